//! Quadratic coefficients of the accelerometers, K_2: f̃ = … + K_2 f'², so δv̇ = C_b^n (I + K_a)⁻¹ δK_2 f².
//!
//! A unit of it looks like a bias that does not turn its sign with the axis: without a measurement of the vertical velocity
//! it is hardly seen, and with one it must not be left out.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval, Span};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;
use crate::units::MICRO_G_PER_G2;

/// Names of the quadratic coefficients.
pub const ACCELEROMETER_QUADRATIC: [&str; 3] = [
    "accelerometer_quadratic_x_per_m_s2",
    "accelerometer_quadratic_y_per_m_s2",
    "accelerometer_quadratic_z_per_m_s2",
];

/// What is known before of the quadratic coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccelerometerQuadratic {
    /// One-sigma \[1/(m/s²)\].
    pub quadratic_per_m_s2: f64,
}

const fn label(axis: usize, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(
        ACCELEROMETER_QUADRATIC[axis],
        symbol,
        words,
        "ug/g²",
        MICRO_G_PER_G2,
    )
}

impl Group for AccelerometerQuadratic {
    const LABELS: &'static [StateLabel] = &[
        label(0, "K2x", "accelerometer quadratic x"),
        label(1, "K2y", "accelerometer quadratic y"),
        label(2, "K2z", "accelerometer quadratic z"),
    ];

    /// Column i: ∫C_b^n e_i f_i² dt.
    type Gathered = Matrix3<f64>;

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma.fill(self.quadratic_per_m_s2);
    }

    #[inline]
    fn gather(gathered: &mut Matrix3<f64>, span: &Span) {
        let force = span.specific_force();
        for axis in 0..3 {
            let mut sum = gathered.column_mut(axis);
            sum.axpy(force[axis] * force[axis], &span.attitude.column(axis), 1.0);
        }
    }

    fn couple(&self, gathered: &Matrix3<f64>, _interval: &Interval, into: &mut Coupling<'_>) {
        // (I + K_a)⁻¹ is left out: it is one to 1e-3 at worst, and K_2 f² is some micro-g.
        for axis in 0..3 {
            into.drives(axis, Some(gathered.column(axis).into_owned()), None);
        }
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        errors.accelerometer_quadratic += Vector3::from_column_slice(x);
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        x.copy_from_slice(errors.accelerometer_quadratic.as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::column_test::columns_hold;
    use crate::estimation::model::Whole;

    /// Every column.
    #[test]
    fn columns_are_the_derivative_of_the_machine() {
        columns_hold::<Whole, { Whole::M }, { Whole::N }>(AccelerometerQuadratic::LABELS);
    }
}
