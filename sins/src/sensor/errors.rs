//! The sensor error model.
//!
//! - gyroscope: ω̃ = (I + K_g) ω + ε + G_g f
//! - accelerometer: f̃(t) = (I + K_a) f'(t − τ) + ∇ + K_2 f'²(t − τ), f'_i = \[f + ω × (ω × a_i) + ω̇ × a_i\]_i
//!
//! (noise apart). K_g holds scale factors on its diagonal and six installation angles off it; K_a scale factors and three
//! installation angles in its lower triangle, because the accelerometers define the block frame. a_i is the arm of
//! accelerometer i from the table's centre, where the filter's point is: the block's displacement ρ and the accelerometer's
//! place r_i in the block show as their sum only. [`compensation`](super::compensation) is the inverse.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

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
    /// Quadratic coefficients of the accelerometers K_2 \[1/(m/s²)\].
    pub accelerometer_quadratic: Vector3<f64>,
    /// Row i: the arm a_i of accelerometer i from the table's centre, block axes \[m\].
    pub accelerometer_arms: Matrix3<f64>,
    /// g-sensitivity of the gyroscopes G_g \[rad/s per m/s²\].
    pub gyroscope_g_sensitivity: Matrix3<f64>,
    /// How late the accelerometers are against the gyroscopes τ \[s\].
    pub accelerometer_delay_s: f64,
}

impl Default for SensorErrors {
    fn default() -> Self {
        Self {
            gyroscope_drift: Vector3::zeros(),
            accelerometer_bias: Vector3::zeros(),
            gyroscope_matrix: Matrix3::zeros(),
            accelerometer_matrix: Matrix3::zeros(),
            accelerometer_quadratic: Vector3::zeros(),
            accelerometer_arms: Matrix3::zeros(),
            gyroscope_g_sensitivity: Matrix3::zeros(),
            accelerometer_delay_s: 0.0,
        }
    }
}

/// How the block moves at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockMotion {
    /// Angular rate ω against inertial space, block axes \[rad/s\].
    pub rate: Vector3<f64>,
    /// Its derivative ω̇, block axes \[rad/s²\].
    pub rate_derivative: Vector3<f64>,
    /// Specific force f at the table's centre, block axes \[m/s²\].
    pub force: Vector3<f64>,
    /// Its derivative in block axes ḟ \[m/s³\].
    pub force_derivative: Vector3<f64>,
}

impl BlockMotion {
    /// A block of constant rate and specific force.
    pub fn steady(rate: Vector3<f64>, force: Vector3<f64>) -> Self {
        Self {
            rate,
            force,
            ..Self::default()
        }
    }

    /// \[ω×\]² + \[ω̇×\]: what a metre of arm adds to the specific force \[1/s²\].
    pub fn arm_matrix(&self) -> Matrix3<f64> {
        let turning = self.rate.cross_matrix();
        turning * turning + self.rate_derivative.cross_matrix()
    }
}

/// Row i of `matrix` times arm i: what each accelerometer feels by its arm.
pub(super) fn by_arms(matrix: &Matrix3<f64>, arms: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| matrix.row(i).dot(&arms.row(i)))
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

    /// What the sensors report of a motion: rate \[rad/s\] and specific force \[m/s²\]. The delay enters to first order,
    /// f(t − τ) = f − τ ḟ.
    pub fn corrupt(&self, motion: &BlockMotion) -> (Vector3<f64>, Vector3<f64>) {
        let BlockMotion { rate, force, .. } = motion;
        let felt = force + by_arms(&motion.arm_matrix(), &self.accelerometer_arms)
            - self.accelerometer_delay_s * motion.force_derivative;
        (
            rate + self.gyroscope_matrix * rate
                + self.gyroscope_drift
                + self.gyroscope_g_sensitivity * force,
            felt + self.accelerometer_matrix * felt
                + self.accelerometer_bias
                + self
                    .accelerometer_quadratic
                    .component_mul(&felt.component_mul(&felt)),
        )
    }

    /// Whether the model is drift and bias alone.
    pub fn is_constant(&self) -> bool {
        let rest = Self::constant(self.gyroscope_drift, self.accelerometer_bias);
        *self == rest
    }
}
