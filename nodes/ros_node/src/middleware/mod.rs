//! What keeps RustDDS at work, and what notices that it is not.
//!
//! RustDDS works on two threads of a participant. Where one of them ends the node is deaf and mute, and nobody is told. So waits are
//! made good where they are interrupted ([`waits`]), what it takes is bounded ([`memory`]), and somebody looks after its threads
//! ([`watchdog`]).

mod memory;
mod threads;
mod waits;
mod watchdog;

pub use memory::BoundedAllocator;
pub(crate) use threads::is_of_middleware;
pub(crate) use watchdog::Watchdog;
