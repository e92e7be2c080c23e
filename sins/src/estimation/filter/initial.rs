//! What is known of the paper's states before anything is measured.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::estimation::groups::bias::Bias;
use crate::estimation::groups::navigation::Navigation;
use crate::estimation::model::Paper;

/// Initial one-sigma of the paper's states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InitialUncertainty {
    /// Horizontal position, each axis \[m\].
    pub position_m: f64,
    /// Horizontal velocity, each axis \[m/s\].
    pub velocity_m_s: f64,
    /// Misalignment about E, N, U \[rad\].
    pub misalignment_rad: Vector3<f64>,
    /// Accelerometer bias, block axes \[m/s²\].
    pub accelerometer_bias_m_s2: Vector3<f64>,
    /// Gyroscope drift, block axes \[rad/s\].
    pub gyroscope_drift_rad_s: Vector3<f64>,
}

impl InitialUncertainty {
    /// The paper's model with these priors and sensor errors that do not walk.
    pub fn model(&self) -> Paper {
        Paper {
            navigation: Navigation {
                position_m: self.position_m,
                velocity_m_s: self.velocity_m_s,
                misalignment_rad: self.misalignment_rad,
            },
            bias: Bias {
                accelerometer_bias_m_s2: self.accelerometer_bias_m_s2,
                gyroscope_drift_rad_s: self.gyroscope_drift_rad_s,
                accelerometer_walk_m_s2_sqrt_s: 0.0,
                gyroscope_walk_rad_s_sqrt_s: 0.0,
            },
        }
    }
}
