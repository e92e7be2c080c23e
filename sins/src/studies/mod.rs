//! Studies over everything below: many runs at once, and what a scheme can show.

pub mod allan;
pub mod assurance;
pub mod design;
pub mod monte_carlo;
pub mod observability;
pub mod outlook;
pub mod paper;
pub mod stretch;
