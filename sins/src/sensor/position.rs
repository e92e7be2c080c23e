//! Position from outside the inertial system.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::earth::Position;
use crate::time::Stamp;

/// A measured position, such as a satellite receiver's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositionMeasurement {
    /// When the antenna was there.
    pub stamp: Stamp,
    /// Where it was.
    pub position: Position,
    /// One-sigma east, north, up \[m\]; zero or less where it is not known.
    pub sigma_m: Vector3<f64>,
}

impl PositionMeasurement {
    /// Whether it says how well it knows the horizontal position.
    pub fn is_measured(&self) -> bool {
        self.sigma_m.x > 0.0 && self.sigma_m.y > 0.0 && self.sigma_m.iter().all(|s| s.is_finite())
    }
}
