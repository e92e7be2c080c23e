//! What the inertial sensors deliver: samples, their noise, and the one model of their errors with its inverse; and position and
//! velocity that other instruments measure.

pub mod compensation;
pub mod errors;
pub mod increment;
pub mod position;
pub mod sample;
pub mod velocity;

pub use compensation::{Compensated, Compensation, Compensator};
pub use errors::{BlockMotion, SensorErrors};
pub use increment::Increment;
pub use position::PositionMeasurement;
pub use sample::{ImuSample, NoiseDensity};
pub use velocity::VelocityMeasurement;
