//! Velocity over ground from outside the inertial system.

use serde::{Deserialize, Serialize};

/// A measured velocity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VelocityMeasurement {
    /// East and north \[m/s\].
    pub east_north: [f64; 2],
    /// One-sigma of each \[m/s\].
    pub sigma: [f64; 2],
}
