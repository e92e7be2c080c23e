//! What the mechanization is fed: integrals over a sampling interval.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// What the sensors gathered over one sampling interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Increment {
    /// Length of the interval \[s\].
    pub interval_s: f64,
    /// Integral of the angular rate, block axes \[rad\].
    pub angle: Vector3<f64>,
    /// Integral of the specific force in the turning block's axes \[m/s\].
    pub velocity: Vector3<f64>,
}

impl Increment {
    /// From averages over the interval.
    #[inline]
    pub fn from_averages(
        interval_s: f64,
        angular_rate: &Vector3<f64>,
        specific_force: &Vector3<f64>,
    ) -> Self {
        Self {
            interval_s,
            angle: angular_rate * interval_s,
            velocity: specific_force * interval_s,
        }
    }

    /// The increment without a constant drift \[rad/s\] and bias \[m/s²\].
    #[must_use]
    pub fn without(
        &self,
        gyroscope_drift: &Vector3<f64>,
        accelerometer_bias: &Vector3<f64>,
    ) -> Self {
        Self {
            interval_s: self.interval_s,
            angle: self.angle - gyroscope_drift * self.interval_s,
            velocity: self.velocity - accelerometer_bias * self.interval_s,
        }
    }
}
