//! The one reader of calibrations: what files and messages carry, in names and numbers, becomes a checked [`Calibration`].

use nalgebra::{DMatrix, Matrix3, Quaternion, UnitQuaternion};

use super::further_errors::put;
use super::{Calibration, Phase};
use crate::earth::Position;
use crate::error::Error;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::estimation::state::{NamedCovariance, StateList};
use crate::sensor::SensorErrors;
use crate::table::TableErrors;
use crate::time::Stamp;

/// How far the length of a quaternion may be from one.
const NORM_TOLERANCE: f64 = 1e-3;
/// Rounding of that length, which is left as it is: a calibration read is the one written, to the last bit.
const NORM_ROUNDING: f64 = 1e-12;

/// What is told of the uncertainty of a calibration.
///
/// Nothing that was measured is known exactly: a variance of zero says that its state was not estimated, and is left out of the
/// calibration as if its name were missing. Of a state that is missing a reader knows what it knew before: its prior.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordedCovariance {
    /// A covariance over named states, in any order: more than a reader knows, or fewer.
    States {
        /// Names of the states.
        names: Vec<String>,
        /// All elements, row by row.
        row_major: Vec<f64>,
    },
    /// One-sigma of the sensor errors, and the covariance of the misalignment. A sigma that is not above zero is not known.
    Sensors {
        /// One-sigma of the gyroscope drift \[rad/s\].
        gyroscope_drift: [f64; 3],
        /// One-sigma of the accelerometer bias \[m/s²\].
        accelerometer_bias: [f64; 3],
        /// Covariance of the misalignment (E, N, U), row by row \[rad²\]; zeros where nothing is known.
        misalignment: [f64; 9],
    },
}

/// A calibration as it is carried; nothing in it has been looked at yet.
///
/// ```
/// use sins::machines::self_calibration::{CalibrationRecord, Phase, RecordedCovariance};
/// use sins::{Stamp, earth::Position};
///
/// let record = CalibrationRecord {
///     stamp: Stamp::from_nanos(1_760_000_000_000_000_000),
///     phase: Phase::Converged,
///     gyroscope_drift_rad_s: [5e-8; 3],
///     accelerometer_bias_m_s2: [1e-3; 3],
///     gyroscope_matrix: [0.0; 9],
///     accelerometer_matrix: [0.0; 9],
///     further: vec![("accelerometer_delay_s".into(), 2e-4)],
///     attitude_xyzw: [0.0, 0.0, 0.0, 1.0],
///     position: Position::from_degrees(45.0, 126.6, 0.0),
///     covariance: RecordedCovariance::States {
///         names: vec!["gyroscope_drift_x_rad_s".into()],
///         row_major: vec![1e-16],
///     },
///     samples: 1_440_000,
///     gaps: 0,
/// };
/// assert!(record.clone().calibration().is_ok());
///
/// let impossible = CalibrationRecord { gyroscope_drift_rad_s: [1e6; 3], ..record };
/// let told = impossible.calibration().unwrap_err().to_string();
/// assert!(told.contains("gyroscope_drift"), "{told}");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationRecord {
    /// Time of the estimate.
    pub stamp: Stamp,
    /// Where self-calibration stood then.
    pub phase: Phase,
    /// Gyroscope drift (x, y, z).
    pub gyroscope_drift_rad_s: [f64; 3],
    /// Accelerometer bias (x, y, z).
    pub accelerometer_bias_m_s2: [f64; 3],
    /// Scale factors and installation angles of the gyroscopes, row by row.
    pub gyroscope_matrix: [f64; 9],
    /// Scale factors and installation angles of the accelerometers, row by row.
    pub accelerometer_matrix: [f64; 9],
    /// Every other error of sensors and table, by the name of its state; one that is missing is zero, and a name that is none of
    /// ours is left aside.
    pub further: Vec<(String, f64)>,
    /// Attitude of the block (b to n) as a quaternion of length one.
    pub attitude_xyzw: [f64; 4],
    /// Position.
    pub position: Position,
    /// How uncertain it is.
    pub covariance: RecordedCovariance,
    /// Samples that went into it.
    pub samples: u64,
    /// Gaps among them.
    pub gaps: u64,
}

impl CalibrationRecord {
    /// The calibration, where its numbers can be those of a sensor and a place. Its phase is not judged here: one may look at a
    /// calibration that is inconsistent, and must not navigate with it ([`Calibration::usable`]).
    ///
    /// # Errors
    /// [`Error::Setting`] that names what is wrong, and what was expected.
    pub fn calibration(self) -> Result<Calibration, Error> {
        let mut errors = SensorErrors {
            gyroscope_drift: self.gyroscope_drift_rad_s.into(),
            accelerometer_bias: self.accelerometer_bias_m_s2.into(),
            gyroscope_matrix: Matrix3::from_row_slice(&self.gyroscope_matrix),
            accelerometer_matrix: Matrix3::from_row_slice(&self.accelerometer_matrix),
            ..SensorErrors::default()
        };
        let mut table = TableErrors::default();
        let named = self
            .further
            .iter()
            .map(|(name, value)| (name.as_str(), *value));
        put(named, &mut errors, &mut table);
        Calibration {
            stamp: self.stamp,
            phase: self.phase,
            errors,
            table,
            attitude: rotation(self.attitude_xyzw)?,
            position: self.position,
            covariance: self.covariance.known()?,
            samples: self.samples,
            gaps: self.gaps,
        }
        .checked()
    }
}

fn rotation([x, y, z, w]: [f64; 4]) -> Result<UnitQuaternion<f64>, Error> {
    let raw = Quaternion::new(w, x, y, z);
    let off = (raw.norm() - 1.0).abs();
    if off.is_nan() || off > NORM_TOLERANCE {
        let expected = "1: a quaternion of length one is a rotation";
        return Err(Error::setting(
            "length of the attitude",
            raw.norm(),
            expected,
        ));
    }
    Ok(if off > NORM_ROUNDING {
        UnitQuaternion::from_quaternion(raw)
    } else {
        UnitQuaternion::new_unchecked(raw)
    })
}

impl RecordedCovariance {
    /// The states of which something is known.
    fn known(self) -> Result<NamedCovariance, Error> {
        let (states, matrix) = match self {
            Self::States { names, row_major } => {
                let count = names.len();
                if row_major.len() != count * count {
                    return Err(Error::setting(
                        "number of elements of the covariance",
                        row_major.len(),
                        format!("{}, of {count} states", count * count),
                    ));
                }
                let matrix = DMatrix::from_row_slice(count, count, &row_major);
                (StateList::names(names), matrix)
            }
            Self::Sensors {
                gyroscope_drift,
                accelerometer_bias,
                misalignment,
            } => {
                let mut matrix = DMatrix::zeros(9, 9);
                let attitude = Matrix3::from_row_slice(&misalignment);
                matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&attitude);
                for (start, sigmas) in [(3, accelerometer_bias), (6, gyroscope_drift)] {
                    for (axis, sigma) in sigmas.into_iter().enumerate() {
                        let known = if sigma < 0.0 { 0.0 } else { sigma };
                        matrix[(start + axis, start + axis)] = known * known;
                    }
                }
                let names = [MISALIGNMENT, ACCELEROMETER_BIAS, GYROSCOPE_DRIFT];
                (StateList::names(names.concat()), matrix)
            }
        };
        Ok(NamedCovariance::new(states, matrix)?.retain(|_, variance| variance > 0.0))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn good() -> CalibrationRecord {
        CalibrationRecord {
            stamp: Stamp::default(),
            phase: Phase::Converged,
            gyroscope_drift_rad_s: [1e-7, 2e-7, 3e-7],
            accelerometer_bias_m_s2: [1e-3; 3],
            gyroscope_matrix: [0.0, 1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            accelerometer_matrix: [0.0; 9],
            further: vec![
                ("accelerometer_delay_s".into(), 2e-4),
                ("colour".into(), 7.0),
            ],
            attitude_xyzw: [0.6, 0.0, 0.0, 0.8],
            position: Position::from_degrees(45.0, 126.0, 0.0),
            covariance: RecordedCovariance::Sensors {
                gyroscope_drift: [1e-8; 3],
                accelerometer_bias: [-1.0; 3],
                misalignment: [0.0; 9],
            },
            samples: 1,
            gaps: 0,
        }
    }

    fn refusal(change: impl Fn(&mut CalibrationRecord)) -> String {
        let mut record = good();
        change(&mut record);
        record.calibration().unwrap_err().to_string()
    }

    /// Names and numbers become a calibration; matrices are read by rows, and a sigma below zero says that nothing is known.
    #[test]
    fn numbers_take_their_places() {
        let calibration = good().calibration().unwrap();
        assert_eq!(calibration.errors.gyroscope_matrix[(0, 1)], 1e-4);
        assert_eq!(calibration.errors.gyroscope_drift.z, 3e-7);
        assert_eq!(calibration.errors.accelerometer_delay_s, 2e-4);
        assert_eq!(calibration.table, TableErrors::default());
        let named = &calibration.covariance;
        assert!((named.sigma(GYROSCOPE_DRIFT[1]).unwrap() - 1e-8).abs() < 1e-22);
        assert_eq!(named.sigma(ACCELEROMETER_BIAS[1]), None);
        assert_eq!(named.states(), &StateList::names(GYROSCOPE_DRIFT));
        let mut short = good();
        short.attitude_xyzw = [0.6, 0.0, 0.0, 0.8004];
        let attitude = short.calibration().unwrap().attitude;
        assert!((attitude.norm() - 1.0).abs() < 1e-15);
    }

    /// States of models that are not ours are kept with their numbers, and one whose variance is zero was not estimated.
    #[test]
    fn any_states_are_kept_but_those_not_estimated() {
        let mut other = good();
        other.covariance = RecordedCovariance::States {
            names: ["colour", GYROSCOPE_DRIFT[2], ACCELEROMETER_BIAS[0]]
                .map(Into::into)
                .into(),
            row_major: vec![4.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 9.0],
        };
        let covariance = other.calibration().unwrap().covariance;
        let expected = StateList::names(["colour", ACCELEROMETER_BIAS[0]]);
        assert_eq!(covariance.states(), &expected);
        assert_eq!(covariance.row_major(), [4.0, 1.0, 1.0, 9.0]);
    }

    /// What cannot be is refused in one line that names it.
    #[test]
    fn what_cannot_be_is_named() {
        for (told, word) in [
            (
                refusal(|r| r.gyroscope_drift_rad_s[0] = 1e6),
                "gyroscope_drift",
            ),
            (
                refusal(|r| r.accelerometer_bias_m_s2[2] = 1e9),
                "accelerometer_bias",
            ),
            (
                refusal(|r| r.position.latitude_rad = 95f64.to_radians()),
                "latitude",
            ),
            (refusal(|r| r.position.height_m = 1e300), "height"),
            (
                refusal(|r| r.further[0].1 = f64::NAN),
                "accelerometer_delay",
            ),
            (
                refusal(|r| r.position.longitude_rad = f64::NAN),
                "longitude",
            ),
            (refusal(|r| r.attitude_xyzw = [0.0; 4]), "attitude"),
            (refusal(|r| r.attitude_xyzw[1] = f64::NAN), "attitude"),
            (
                refusal(|r| {
                    r.covariance = RecordedCovariance::States {
                        names: vec!["x".into()],
                        row_major: vec![],
                    };
                }),
                "covariance is 0",
            ),
            (
                refusal(|r| {
                    r.covariance = RecordedCovariance::Sensors {
                        gyroscope_drift: [f64::NAN; 3],
                        accelerometer_bias: [0.0; 3],
                        misalignment: [0.0; 9],
                    };
                }),
                GYROSCOPE_DRIFT[0],
            ),
        ] {
            assert!(told.contains(word) && !told.contains('\n'), "{told}");
        }
    }
}
