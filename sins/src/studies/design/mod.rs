//! Rotation schemes found by search: what to turn, how far and in which order, so that the errors are seen as well or as
//! soon as they can be.

mod catalogue;
mod goal;
mod run;
mod search;
mod sequence;

pub use catalogue::{Catalogue, Turn};
pub use goal::{Criterion, Goal, Measure};
pub use search::{CHAINS, Found, NEIGHBOURS, Progress, Scored, Search, Standing, TOUR};
pub use sequence::{Leg, Rules, Sequence};

#[cfg(test)]
mod tests;
