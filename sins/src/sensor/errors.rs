//! The sensor error model and its inverse.
//!
//! gyroscope ω̃ = (I + K_g) ω + ε, accelerometer f̃ = (I + K_a) f + ∇ (noise apart). K_g holds scale factors on its diagonal
//! and six installation angles off it; K_a scale factors and three installation angles in its lower triangle, because the
//! accelerometers define the block frame.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// Deterministic errors of gyroscopes and accelerometers, measured minus true.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorErrors {
    /// Gyroscope drift ε, block axes \[rad/s\].
    pub gyroscope_drift: Vector3<f64>,
    /// Accelerometer bias ∇, block axes \[m/s²\].
    pub accelerometer_bias: Vector3<f64>,
    /// Gyroscope scale factors and installation angles K_g \[1, rad\].
    pub gyroscope_matrix: Matrix3<f64>,
    /// Accelerometer scale factors and installation angles K_a \[1, rad\].
    pub accelerometer_matrix: Matrix3<f64>,
}

impl Default for SensorErrors {
    fn default() -> Self {
        Self {
            gyroscope_drift: Vector3::zeros(),
            accelerometer_bias: Vector3::zeros(),
            gyroscope_matrix: Matrix3::zeros(),
            accelerometer_matrix: Matrix3::zeros(),
        }
    }
}

impl SensorErrors {
    /// Drift and bias alone.
    pub fn constant(gyroscope_drift: Vector3<f64>, accelerometer_bias: Vector3<f64>) -> Self {
        Self {
            gyroscope_drift,
            accelerometer_bias,
            ..Self::default()
        }
    }

    /// What the sensors report of a true rate \[rad/s\] and a true specific force \[m/s²\].
    pub fn corrupt(
        &self,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        (
            rate + self.gyroscope_matrix * rate + self.gyroscope_drift,
            force + self.accelerometer_matrix * force + self.accelerometer_bias,
        )
    }

    /// The inverse of this model.
    ///
    /// # Errors
    /// [`Error::Setting`] where I + K cannot be inverted or a value is not finite.
    pub fn compensation(&self) -> Result<Compensation, Error> {
        let invert = |name: &str, k: &Matrix3<f64>| {
            (Matrix3::identity() + k)
                .try_inverse()
                .filter(|m| m.iter().all(|v| v.is_finite()))
                .ok_or_else(|| {
                    Error::setting(name, k, "a matrix K for which I + K can be inverted")
                })
        };
        for (name, v) in [
            ("gyroscope_drift_rad_s", &self.gyroscope_drift),
            ("accelerometer_bias_m_s2", &self.accelerometer_bias),
        ] {
            if !v.iter().all(|x| x.is_finite()) {
                return Err(Error::setting(name, v, "finite numbers"));
            }
        }
        let zero = Matrix3::zeros();
        if self.gyroscope_matrix == zero && self.accelerometer_matrix == zero {
            return Ok(Compensation {
                errors: *self,
                gyroscope_inverse: Matrix3::identity(),
                accelerometer_inverse: Matrix3::identity(),
                constant: true,
            });
        }
        Ok(Compensation {
            errors: *self,
            gyroscope_inverse: invert("gyroscope_matrix", &self.gyroscope_matrix)?,
            accelerometer_inverse: invert("accelerometer_matrix", &self.accelerometer_matrix)?,
            constant: false,
        })
    }
}

/// Takes the sensor errors out of samples: ω = (I + K_g)⁻¹ (ω̃ − ε), f = (I + K_a)⁻¹ (f̃ − ∇).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensation {
    errors: SensorErrors,
    gyroscope_inverse: Matrix3<f64>,
    accelerometer_inverse: Matrix3<f64>,
    /// Whether both inverses are identities.
    constant: bool,
}

impl Compensation {
    /// The errors that are taken out.
    pub fn errors(&self) -> &SensorErrors {
        &self.errors
    }

    /// (I + K_g)⁻¹.
    pub fn gyroscope_inverse(&self) -> &Matrix3<f64> {
        &self.gyroscope_inverse
    }

    /// (I + K_a)⁻¹.
    pub fn accelerometer_inverse(&self) -> &Matrix3<f64> {
        &self.accelerometer_inverse
    }

    /// True angle \[rad\] and velocity \[m/s\] gathered over an interval, from measured ones.
    #[inline]
    pub fn apply_increment(
        &self,
        interval_s: f64,
        angle: &Vector3<f64>,
        velocity: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let angle = angle - self.errors.gyroscope_drift * interval_s;
        let velocity = velocity - self.errors.accelerometer_bias * interval_s;
        if self.constant {
            return (angle, velocity);
        }
        (
            self.gyroscope_inverse * angle,
            self.accelerometer_inverse * velocity,
        )
    }

    /// True rate \[rad/s\] and specific force \[m/s²\] from measured ones.
    pub fn apply(&self, rate: &Vector3<f64>, force: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        (
            self.gyroscope_inverse * (rate - self.errors.gyroscope_drift),
            self.accelerometer_inverse * (force - self.errors.accelerometer_bias),
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Compensation undoes the full model, drift, bias, scale factors and installation angles.
    #[test]
    fn compensation_is_the_inverse() {
        let errors = SensorErrors {
            gyroscope_drift: Vector3::new(1e-7, -2e-7, 3e-7),
            accelerometer_bias: Vector3::new(1e-3, 2e-3, -3e-3),
            gyroscope_matrix: Matrix3::new(1e-4, 2e-4, -1e-4, 3e-4, -1e-4, 5e-5, 1e-5, 2e-5, 7e-5),
            accelerometer_matrix: Matrix3::new(1e-4, 0.0, 0.0, 3e-4, -1e-4, 0.0, 1e-5, 2e-5, 7e-5),
        };
        let (w, f) = (Vector3::new(0.1, -0.2, 0.3), Vector3::new(1.0, 2.0, 9.0));
        let (measured_w, measured_f) = errors.corrupt(&w, &f);
        let (back_w, back_f) = errors
            .compensation()
            .unwrap()
            .apply(&measured_w, &measured_f);
        assert!((back_w - w).norm() < 1e-16 && (back_f - f).norm() < 1e-14);
        let (angle, velocity) = errors.compensation().unwrap().apply_increment(
            0.01,
            &(measured_w * 0.01),
            &(measured_f * 0.01),
        );
        assert!((angle - w * 0.01).norm() < 1e-17 && (velocity - f * 0.01).norm() < 1e-15);
    }

    /// A matrix that folds space is refused with its name.
    #[test]
    fn singular_matrix_is_refused() {
        let errors = SensorErrors {
            gyroscope_matrix: -Matrix3::identity(),
            ..SensorErrors::default()
        };
        assert!(
            errors
                .compensation()
                .unwrap_err()
                .to_string()
                .contains("gyroscope_matrix")
        );
    }
}
