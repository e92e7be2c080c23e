//! What an inertial measurement unit delivers.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::time::Stamp;

/// One sample: averages over the sampling interval that **ends** at `stamp`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImuSample {
    /// End of the sampling interval.
    pub stamp: Stamp,
    /// Angular rate of the block against inertial space, in its own axes, averaged over the interval \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Specific force in the axes of the (rotating) block, averaged over the interval \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// Variance of one sample of `angular_rate` \[rad²/s²\]; zero or negative where it is not known.
    pub angular_rate_variance: Vector3<f64>,
    /// Variance of one sample of `specific_force` \[m²/s⁴\]; zero or negative where it is not known.
    pub specific_force_variance: Vector3<f64>,
}

impl ImuSample {
    /// A sample of a block that lies level and does not turn, of unknown noise: what examples and tests begin with.
    pub fn at_rest(stamp: Stamp, gravity_m_s2: f64) -> Self {
        Self {
            stamp,
            angular_rate: Vector3::zeros(),
            specific_force: Vector3::z() * gravity_m_s2,
            angular_rate_variance: Vector3::zeros(),
            specific_force_variance: Vector3::zeros(),
        }
    }

    /// Whether every measured value is a finite number.
    pub fn is_finite(&self) -> bool {
        self.angular_rate
            .iter()
            .chain(&self.specific_force)
            .all(|v| v.is_finite())
    }
}

/// White noise by density; the variance of one sample over `dt` is density² / dt.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseDensity {
    /// Angular random walk per axis \[rad/√s\].
    pub gyroscope: Vector3<f64>,
    /// Velocity random walk per axis \[m/s/√s\].
    pub accelerometer: Vector3<f64>,
}
