//! Constant errors of the sensors: accelerometer bias ∇ and gyroscope drift ε, block axes. They may walk.
//!
//! δv̇ = C_b^n (I + K_a)⁻¹ ∇, φ̇ = −C_b^n (I + K_g)⁻¹ ε.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval, Span};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;
use crate::units::{DEG_PER_HOUR, MICRO_G};

/// Names of the accelerometer biases.
pub const ACCELEROMETER_BIAS: [&str; 3] = [
    "accelerometer_bias_x_m_s2",
    "accelerometer_bias_y_m_s2",
    "accelerometer_bias_z_m_s2",
];
/// Names of the gyroscope drifts.
pub const GYROSCOPE_DRIFT: [&str; 3] = [
    "gyroscope_drift_x_rad_s",
    "gyroscope_drift_y_rad_s",
    "gyroscope_drift_z_rad_s",
];

/// What is known of biases and drifts before, and how they walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bias {
    /// One-sigma of the accelerometer bias \[m/s²\].
    pub accelerometer_bias_m_s2: Vector3<f64>,
    /// One-sigma of the gyroscope drift \[rad/s\].
    pub gyroscope_drift_rad_s: Vector3<f64>,
    /// Walk of the accelerometer bias, density \[m/s²/√s\]; zero: constant.
    pub accelerometer_walk_m_s2_sqrt_s: f64,
    /// Walk of the gyroscope drift, density \[rad/s/√s\]; zero: constant.
    pub gyroscope_walk_rad_s_sqrt_s: f64,
}

impl Group for Bias {
    const LABELS: &'static [StateLabel] = &[
        StateLabel::new(
            ACCELEROMETER_BIAS[0],
            "∇x",
            "accelerometer bias x",
            "ug",
            MICRO_G,
        ),
        StateLabel::new(
            ACCELEROMETER_BIAS[1],
            "∇y",
            "accelerometer bias y",
            "ug",
            MICRO_G,
        ),
        StateLabel::new(
            ACCELEROMETER_BIAS[2],
            "∇z",
            "accelerometer bias z",
            "ug",
            MICRO_G,
        ),
        StateLabel::new(
            GYROSCOPE_DRIFT[0],
            "εx",
            "gyroscope drift x",
            "deg/h",
            DEG_PER_HOUR,
        ),
        StateLabel::new(
            GYROSCOPE_DRIFT[1],
            "εy",
            "gyroscope drift y",
            "deg/h",
            DEG_PER_HOUR,
        ),
        StateLabel::new(
            GYROSCOPE_DRIFT[2],
            "εz",
            "gyroscope drift z",
            "deg/h",
            DEG_PER_HOUR,
        ),
    ];

    /// ∫C_b^n dt \[s\].
    type Gathered = Matrix3<f64>;

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma[..3].copy_from_slice(self.accelerometer_bias_m_s2.as_slice());
        sigma[3..].copy_from_slice(self.gyroscope_drift_rad_s.as_slice());
    }

    fn walk(&self, rate: &mut [f64]) {
        rate[..3].fill(self.accelerometer_walk_m_s2_sqrt_s.powi(2));
        rate[3..].fill(self.gyroscope_walk_rad_s_sqrt_s.powi(2));
    }

    #[inline]
    fn gather(gathered: &mut Matrix3<f64>, span: &Span) {
        *gathered += span.attitude;
    }

    fn couple(&self, gathered: &Matrix3<f64>, interval: &Interval, into: &mut Coupling<'_>) {
        let [gyroscope, accelerometer] = interval.inverses.map(|inverse| gathered * inverse);
        for axis in 0..3 {
            into.drives(axis, Some(accelerometer.column(axis).into_owned()), None);
            into.drives(3 + axis, None, Some(-gyroscope.column(axis)));
        }
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        errors.accelerometer_bias += Vector3::from_column_slice(&x[..3]);
        errors.gyroscope_drift += Vector3::from_column_slice(&x[3..6]);
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        x[..3].copy_from_slice(errors.accelerometer_bias.as_slice());
        x[3..].copy_from_slice(errors.gyroscope_drift.as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::column_test::columns_hold;
    use crate::estimation::model::{Matrices, Paper};

    /// Every column of biases and drifts, with and without matrices before them.
    #[test]
    fn columns_are_the_derivative_of_the_machine() {
        columns_hold::<Paper, { Paper::M }, { Paper::N }>(Bias::LABELS);
        columns_hold::<Matrices, { Matrices::M }, { Matrices::N }>(Bias::LABELS);
    }
}
