//! Velocity over ground from outside the inertial system.

/// A measured velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityMeasurement {
    /// East and north \[m/s\].
    pub east_north: [f64; 2],
    /// One-sigma of each \[m/s\].
    pub sigma: [f64; 2],
}
