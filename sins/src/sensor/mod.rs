//! What the inertial sensors deliver: samples, their noise, and the one model of their errors with its inverse; and the velocity
//! that another instrument measures.

pub mod compensation;
pub mod errors;
pub mod increment;
pub mod sample;
pub mod velocity;

pub use compensation::{Compensated, Compensation, Compensator};
pub use errors::{BlockMotion, SensorErrors};
pub use increment::Increment;
pub use sample::{ImuSample, NoiseDensity};
pub use velocity::VelocityMeasurement;
