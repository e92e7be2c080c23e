//! What is known of the sensors: it outlives every hole, jump and restart.

use nalgebra::{SMatrix, Vector3};
use serde::{Deserialize, Serialize};

use super::Calibration;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::groups::antenna::ANTENNA_ARM;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::table::BASE_ATTITUDE;
use crate::estimation::model::{Model, Whole};
use crate::estimation::state::NamedCovariance;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::SensorErrors;
use crate::table::TableErrors;
use crate::time::Stamp;
use crate::units::{DEG_PER_HOUR, MICRO_G};

/// How sensor errors wander while nobody looks: random walks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

/// The sensor errors with their covariance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::machines) struct SensorKnowledge {
    /// When it was learnt.
    pub(super) stamp: Stamp,
    pub(super) errors: SensorErrors,
    pub(super) table: TableErrors,
    pub(super) antenna_arm_m: Vector3<f64>,
    /// Of the states of the sensors, whichever the filter has.
    covariance: NamedCovariance,
    /// The block has turned, so that they have come apart from the attitude.
    pub(super) turned: bool,
}

impl SensorKnowledge {
    /// What a calibration tells, as if it had been made now. Of a state that it does not hold the prior is known.
    pub(in crate::machines) fn of_calibration(calibration: &Calibration, now: Stamp) -> Self {
        Self {
            stamp: now,
            errors: calibration.errors,
            table: calibration.table,
            antenna_arm_m: Vector3::zeros(),
            covariance: calibration.covariance.retain(|name, _| {
                let is_moving = Whole::is_moving(name);
                !is_moving && !BASE_ATTITUDE.contains(&name) && !ANTENNA_ARM.contains(&name)
            }),
            turned: true,
        }
    }

    /// What a filter knows.
    pub(super) fn of(filter: &AnyFilter, stamp: Stamp, turned: bool) -> Self {
        Self {
            stamp,
            errors: filter.sensor_errors(),
            table: filter.believed_installation().table,
            antenna_arm_m: filter.believed_installation().antenna_arm_m,
            covariance: filter
                .named_covariance()
                .retain(|name, _| !filter.is_moving(name) && !BASE_ATTITUDE.contains(&name)),
            turned,
        }
    }

    /// The prior of a filter at a place, with this in place of the prior of the sensors, grown by their walk up to `now`. A clock
    /// that was set back tells no time.
    pub(super) fn prior<G: Model<M, N>, const M: usize, const N: usize>(
        &self,
        model: &G,
        place: &NavigationState,
        now: Stamp,
        walk: &SensorWalk,
    ) -> SMatrix<f64, N, N> {
        let seconds = now.seconds_since(self.stamp).max(0.0);
        let mut covariance = model.covariance_of(&self.covariance, place);
        for (names, density) in [
            (ACCELEROMETER_BIAS, walk.accelerometer_bias_m_s2_sqrt_s),
            (GYROSCOPE_DRIFT, walk.gyroscope_drift_rad_s_sqrt_s),
        ] {
            for name in names {
                if let Some(at) = G::position(name) {
                    covariance[(at, at)] += density.powi(2) * seconds;
                }
            }
        }
        covariance
    }
}
