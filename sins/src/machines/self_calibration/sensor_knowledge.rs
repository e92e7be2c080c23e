//! What is known of the sensors: it outlives every hole, jump and restart.

use nalgebra::SMatrix;

use crate::estimation::error_state::{BIAS, DRIFT, StateMatrix};
use crate::estimation::model::PaperFilter;
use crate::sensor::SensorErrors;
use crate::time::Stamp;
use crate::units::{DEG_PER_HOUR, MICRO_G};

/// How sensor errors wander while nobody looks: random walks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorWalk {
    /// Of the gyroscope drifts \[rad/s/√s\].
    pub gyroscope_drift_rad_s_sqrt_s: f64,
    /// Of the accelerometer biases \[m/s²/√s\].
    pub accelerometer_bias_m_s2_sqrt_s: f64,
}

impl Default for SensorWalk {
    /// 0.001 deg/h and 1 ug in an hour: what laser gyroscopes and good accelerometers keep.
    fn default() -> Self {
        let sqrt_hour = 60.0;
        Self {
            gyroscope_drift_rad_s_sqrt_s: 0.001 * DEG_PER_HOUR / sqrt_hour,
            accelerometer_bias_m_s2_sqrt_s: MICRO_G / sqrt_hour,
        }
    }
}

/// Drifts and biases with their covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SensorKnowledge {
    /// When it was learnt.
    pub(super) stamp: Stamp,
    pub(super) errors: SensorErrors,
    /// In the order of the state vector.
    covariance: SMatrix<f64, 6, 6>,
    /// The block has turned, so that they have come apart from the attitude.
    pub(super) turned: bool,
}

impl SensorKnowledge {
    /// What a filter knows.
    pub(super) fn of(filter: &PaperFilter, stamp: Stamp, turned: bool) -> Self {
        Self {
            stamp,
            errors: filter.sensor_errors(),
            covariance: filter.covariance().fixed_view::<6, 6>(BIAS, BIAS).into(),
            turned,
        }
    }

    /// Puts it in place of the prior of the sensors, grown by their walk up to `now`. A clock that was set back tells no time.
    pub(super) fn put_into(&self, prior: &mut StateMatrix, now: Stamp, walk: &SensorWalk) {
        let seconds = now.seconds_since(self.stamp).max(0.0);
        let mut covariance = self.covariance;
        for axis in 0..3 {
            let bias = walk.accelerometer_bias_m_s2_sqrt_s.powi(2) * seconds;
            let drift = walk.gyroscope_drift_rad_s_sqrt_s.powi(2) * seconds;
            covariance[(axis, axis)] += bias;
            covariance[(DRIFT - BIAS + axis, DRIFT - BIAS + axis)] += drift;
        }
        prior
            .fixed_view_mut::<6, 6>(BIAS, BIAS)
            .copy_from(&covariance);
    }
}
