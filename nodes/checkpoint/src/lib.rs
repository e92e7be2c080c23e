//! What a node keeps of its state, so that a crash costs the moment in which it happens and no more.
//!
//! A checkpoint is one file. It is written whole or not at all ([`files::write`]), and read only where every byte is as it was
//! written: magic, kind, version, length and checksum come first ([`envelope`]). [`Keeper`] writes it beside the
//! node's own work, one at a time.

pub mod envelope;
mod found;
mod keeper;

pub use envelope::{Kind, Refusal};
pub use found::{find, put_aside};
pub use keeper::Keeper;
