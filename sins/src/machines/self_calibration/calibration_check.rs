//! What a calibration must be to be navigated with, wherever it comes from.

use super::{Calibration, Phase};
use crate::error::Error;

/// Greatest drift that is one \[rad/s\]: 2000 deg/h, a gyroscope for toys.
const DRIFT_LIMIT_RAD_S: f64 = 0.01;
/// Greatest bias that is one \[m/s²\]: a tenth of gravity.
const BIAS_LIMIT_M_S2: f64 = 1.0;
/// Greatest scale factor error or installation angle.
const MATRIX_LIMIT: f64 = 0.1;
/// Greatest quadratic coefficient \[1/(m/s²)\]: a tenth of gravity at gravity.
const QUADRATIC_LIMIT_PER_M_S2: f64 = 0.01;
/// Greatest component of an arm \[m\].
const ARM_LIMIT_M: f64 = 10.0;
/// Greatest g-sensitivity \[rad/s per m/s²\]: 2000 deg/h/g.
const G_SENSITIVITY_LIMIT: f64 = 1e-3;
/// Greatest delay of the accelerometers, either way \[s\].
const DELAY_LIMIT_S: f64 = 1.0;
/// Greatest angle by which a table is not what it should be \[rad\].
const TABLE_LIMIT_RAD: f64 = 0.1;
/// Greatest one-sigma of anything, SI units.
const SIGMA_LIMIT: f64 = 1e4;

impl Calibration {
    /// This calibration where its numbers can be those of a sensor.
    ///
    /// # Errors
    /// [`Error::Setting`] that names the number, and what was expected.
    pub fn checked(self) -> Result<Self, Error> {
        let (errors, table) = (&self.errors, &self.table);
        let eccentricities = [
            table.encoder_eccentricity_outer_rad,
            table.encoder_eccentricity_inner_rad,
        ];
        for (name, values, limit) in [
            (
                "gyroscope_drift in rad/s",
                errors.gyroscope_drift.as_slice(),
                DRIFT_LIMIT_RAD_S,
            ),
            (
                "accelerometer_bias in m/s²",
                errors.accelerometer_bias.as_slice(),
                BIAS_LIMIT_M_S2,
            ),
            (
                "gyroscope_matrix",
                errors.gyroscope_matrix.as_slice(),
                MATRIX_LIMIT,
            ),
            (
                "accelerometer_matrix",
                errors.accelerometer_matrix.as_slice(),
                MATRIX_LIMIT,
            ),
            (
                "accelerometer_quadratic in 1/(m/s²)",
                errors.accelerometer_quadratic.as_slice(),
                QUADRATIC_LIMIT_PER_M_S2,
            ),
            (
                "accelerometer_arm in m",
                errors.accelerometer_arms.as_slice(),
                ARM_LIMIT_M,
            ),
            (
                "gyroscope_g_sensitivity in rad/s per m/s²",
                errors.gyroscope_g_sensitivity.as_slice(),
                G_SENSITIVITY_LIMIT,
            ),
            (
                "accelerometer_delay in s",
                &[errors.accelerometer_delay_s],
                DELAY_LIMIT_S,
            ),
            (
                "table_nonorthogonality in rad",
                &[table.nonorthogonality_rad],
                TABLE_LIMIT_RAD,
            ),
            (
                "inner_axis_tilt in rad",
                &table.inner_axis_tilt_rad,
                TABLE_LIMIT_RAD,
            ),
            (
                "encoder_zero_inner in rad",
                &[table.encoder_zero_inner_rad],
                TABLE_LIMIT_RAD,
            ),
            (
                "encoder_eccentricity in rad",
                eccentricities.as_flattened(),
                TABLE_LIMIT_RAD,
            ),
        ] {
            // Not a number is not within anything.
            if let Some(value) = values
                .iter()
                .find(|value| value.is_nan() || value.abs() > limit)
            {
                return Err(Error::setting(name, value, format!("-{limit} to {limit}")));
            }
        }
        let norm = self.attitude.norm();
        if norm.is_nan() || (norm - 1.0).abs() >= 1e-3 {
            return Err(Error::setting("norm of the attitude", norm, "1"));
        }
        self.position.checked()?;
        let variances = self.covariance.matrix().diagonal();
        let limit = SIGMA_LIMIT * SIGMA_LIMIT;
        let mut names = self.covariance.states().iter().zip(&variances);
        if let Some((name, variance)) = names.find(|(_, variance)| **variance > limit) {
            let expected = format!("0 to {limit:e}");
            return Err(Error::setting(
                format!("variance of {name}"),
                variance,
                expected,
            ));
        }
        drop(names);
        Ok(self)
    }

    /// This calibration where one may navigate with it: its numbers can be those of a sensor, and its filter agreed with its
    /// samples.
    ///
    /// # Errors
    /// [`Error::Setting`] that names what speaks against it.
    pub fn usable(self) -> Result<Self, Error> {
        if self.phase == Phase::Inconsistent {
            return Err(Error::setting(
                "phase",
                self.phase.name(),
                "a calibration whose filter agreed with its samples",
            ));
        }
        self.checked()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::earth::Position;
    use crate::estimation::groups::navigation::VELOCITY;
    use crate::estimation::state::NamedCovariance;
    use crate::sensor::SensorErrors;
    use crate::table::TableErrors;
    use crate::time::Stamp;

    fn good() -> Calibration {
        Calibration {
            stamp: Stamp::default(),
            phase: Phase::Converged,
            errors: SensorErrors::constant(Vector3::repeat(1e-7), Vector3::repeat(1e-3)),
            table: TableErrors::default(),
            attitude: UnitQuaternion::identity(),
            position: Position::from_degrees(45.0, 126.0, 0.0),
            covariance: NamedCovariance::from_sigmas([(VELOCITY[0], 1e-6)]).unwrap(),
            samples: 1,
            gaps: 0,
        }
    }

    /// What no sensor and no place can be is refused by its name, and so is a filter that did not agree with its samples.
    #[test]
    fn what_cannot_be_is_refused() {
        assert!(good().usable().is_ok());
        let change = |change: &dyn Fn(&mut Calibration)| {
            let mut calibration = good();
            change(&mut calibration);
            calibration.usable().unwrap_err().to_string()
        };
        for (change, word) in [
            (
                change(&|c| c.errors.gyroscope_drift.x = 1e6),
                "gyroscope_drift",
            ),
            (
                change(&|c| c.errors.accelerometer_bias.y = 1e9),
                "accelerometer_bias",
            ),
            (
                change(&|c| c.errors.gyroscope_matrix[(0, 1)] = f64::NAN),
                "gyroscope_matrix",
            ),
            (
                change(&|c| c.position.latitude_rad = 95f64.to_radians()),
                "latitude",
            ),
            (change(&|c| c.position.height_m = 1e300), "height"),
            (
                change(&|c| c.errors.accelerometer_quadratic.z = 0.1),
                "accelerometer_quadratic",
            ),
            (
                change(&|c| c.errors.accelerometer_arms[(2, 0)] = f64::INFINITY),
                "accelerometer_arm",
            ),
            (
                change(&|c| c.errors.gyroscope_g_sensitivity[(0, 1)] = 1.0),
                "gyroscope_g_sensitivity",
            ),
            (
                change(&|c| c.errors.accelerometer_delay_s = -2.0),
                "accelerometer_delay",
            ),
            (
                change(&|c| c.table.nonorthogonality_rad = f64::NAN),
                "table_nonorthogonality",
            ),
            (
                change(&|c| c.table.inner_axis_tilt_rad[1] = 1.0),
                "inner_axis_tilt",
            ),
            (
                change(&|c| c.table.encoder_zero_inner_rad = 1.0),
                "encoder_zero_inner",
            ),
            (
                change(&|c| c.table.encoder_eccentricity_inner_rad[0] = -1.0),
                "encoder_eccentricity",
            ),
            (
                change(&|c| {
                    c.covariance = NamedCovariance::from_sigmas([(VELOCITY[1], 1e5)]).unwrap();
                }),
                VELOCITY[1],
            ),
            (change(&|c| c.phase = Phase::Inconsistent), "inconsistent"),
        ] {
            assert!(change.contains(word), "{change}");
        }
    }
}
