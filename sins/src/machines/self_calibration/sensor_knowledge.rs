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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::earth::Position;
    use crate::estimation::groups::bias::Bias;
    use crate::estimation::groups::navigation::MISALIGNMENT;
    use crate::estimation::groups::navigation::Navigation;
    use crate::estimation::model::Paper;

    const WALK: SensorWalk = SensorWalk {
        gyroscope_drift_rad_s_sqrt_s: 3e-10,
        accelerometer_bias_m_s2_sqrt_s: 2e-6,
    };

    fn knowledge() -> SensorKnowledge {
        let states = [
            (ACCELEROMETER_BIAS[0], 1e-4),
            (GYROSCOPE_DRIFT[0], 1e-8),
            (GYROSCOPE_DRIFT[1], 2e-8),
            (MISALIGNMENT[0], 1e-6),
        ];
        SensorKnowledge {
            stamp: Stamp::from_nanos(0),
            errors: SensorErrors::default(),
            table: TableErrors::default(),
            antenna_arm_m: Vector3::zeros(),
            covariance: NamedCovariance::from_sigmas(states).unwrap(),
            turned: true,
        }
    }

    fn prior_after(seconds: f64) -> (SMatrix<f64, 13, 13>, SMatrix<f64, 13, 13>) {
        let place = NavigationState {
            attitude: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            position: Position::from_degrees(45.0, 126.6, 0.0),
        };
        let model = Paper {
            navigation: Navigation {
                position_m: 10.0,
                velocity_m_s: 0.01,
                misalignment_rad: Vector3::repeat(1e-3),
            },
            bias: Bias {
                accelerometer_bias_m_s2: Vector3::repeat(1e-3),
                gyroscope_drift_rad_s: Vector3::repeat(1e-7),
                accelerometer_walk_m_s2_sqrt_s: 0.0,
                gyroscope_walk_rad_s_sqrt_s: 0.0,
            },
        };
        let now = Stamp::from_nanos(0).plus_seconds(seconds);
        let knowledge = knowledge();
        let known = model.covariance_of(&knowledge.covariance, &place);
        (knowledge.prior(&model, &place, now, &WALK), known)
    }

    /// After T seconds a prior is P + q²T in every bias and drift, and P everywhere else.
    #[test]
    fn knowledge_fades_by_its_walk() {
        let seconds = 7200.0;
        let (grown, known) = prior_after(seconds);
        let mut expected = known;
        for axis in 0..3 {
            let bias = Paper::position(ACCELEROMETER_BIAS[axis]).unwrap();
            let drift = Paper::position(GYROSCOPE_DRIFT[axis]).unwrap();
            expected[(bias, bias)] += 4e-12 * seconds;
            expected[(drift, drift)] += 9e-20 * seconds;
        }
        let drift = Paper::position(GYROSCOPE_DRIFT[0]).unwrap();
        // By hand: (1e-8)² + 9e-20 · 7200 = 7.48e-16.
        assert!((grown[(drift, drift)] / 7.48e-16 - 1.0).abs() < 1e-12);
        for (grown, expected) in grown.iter().zip(expected.iter()) {
            assert!((grown - expected).abs() <= 1e-12 * expected.abs());
        }
    }

    /// A clock that was set back makes nothing surer, and nothing less sure.
    #[test]
    fn a_clock_set_back_tells_no_time() {
        let (prior, known) = prior_after(-7200.0);
        assert_eq!(prior, known);
    }
}
