//! What the inertial sensors deliver: samples, their noise, and the one model of their errors with its inverse.

pub mod errors;
pub mod increment;
pub mod sample;

pub use errors::{Compensation, SensorErrors};
pub use increment::Increment;
pub use sample::{ImuSample, NoiseDensity};
