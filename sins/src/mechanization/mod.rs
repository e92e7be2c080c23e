//! From increments to attitude, velocity and position, and what a solution is on the map.

pub mod coarse_alignment;
pub mod strapdown;
