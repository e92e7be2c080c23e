//! g-sensitivity of the gyroscopes along their own axes: ω̃ = … + G_g f, so φ̇ = −C_b^n (I + K_g)⁻¹ δG_g f.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval, Span};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;
use crate::units::DEG_PER_HOUR_PER_G;

/// Names of the g-sensitivities, each of a gyroscope to the specific force along its own axis.
pub const GYROSCOPE_G_SENSITIVITY: [&str; 3] = [
    "gyroscope_g_sensitivity_xx_rad_s_per_m_s2",
    "gyroscope_g_sensitivity_yy_rad_s_per_m_s2",
    "gyroscope_g_sensitivity_zz_rad_s_per_m_s2",
];

/// Names of all elements of G_g, row by row: gyroscope, axis of the specific force. Those across the axes are carried, not
/// estimated.
pub const GYROSCOPE_G_SENSITIVITIES: [&str; 9] = [
    GYROSCOPE_G_SENSITIVITY[0],
    "gyroscope_g_sensitivity_xy_rad_s_per_m_s2",
    "gyroscope_g_sensitivity_xz_rad_s_per_m_s2",
    "gyroscope_g_sensitivity_yx_rad_s_per_m_s2",
    GYROSCOPE_G_SENSITIVITY[1],
    "gyroscope_g_sensitivity_yz_rad_s_per_m_s2",
    "gyroscope_g_sensitivity_zx_rad_s_per_m_s2",
    "gyroscope_g_sensitivity_zy_rad_s_per_m_s2",
    GYROSCOPE_G_SENSITIVITY[2],
];

/// What is known before of the g-sensitivities.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GyroscopeGSensitivity {
    /// One-sigma \[rad/s per m/s²\].
    pub g_sensitivity_rad_s_per_m_s2: f64,
}

const fn label(axis: usize, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(
        GYROSCOPE_G_SENSITIVITY[axis],
        symbol,
        words,
        "deg/h/g",
        DEG_PER_HOUR_PER_G,
    )
}

impl Group for GyroscopeGSensitivity {
    const LABELS: &'static [StateLabel] = &[
        label(0, "Gx", "gyroscope g-sensitivity x"),
        label(1, "Gy", "gyroscope g-sensitivity y"),
        label(2, "Gz", "gyroscope g-sensitivity z"),
    ];

    /// Column i: ∫C_b^n e_i f_i dt.
    type Gathered = Matrix3<f64>;

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma.fill(self.g_sensitivity_rad_s_per_m_s2);
    }

    #[inline]
    fn gather(gathered: &mut Matrix3<f64>, span: &Span) {
        let force = span.specific_force();
        for axis in 0..3 {
            let mut sum = gathered.column_mut(axis);
            sum.axpy(force[axis], &span.attitude.column(axis), 1.0);
        }
    }

    fn couple(&self, gathered: &Matrix3<f64>, _interval: &Interval, into: &mut Coupling<'_>) {
        for axis in 0..3 {
            into.drives(axis, None, Some(-gathered.column(axis)));
        }
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        for (axis, value) in x.iter().enumerate() {
            errors.gyroscope_g_sensitivity[(axis, axis)] += value;
        }
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        x.copy_from_slice(errors.gyroscope_g_sensitivity.diagonal().as_slice());
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
        columns_hold::<Whole, { Whole::M }, { Whole::N }>(GyroscopeGSensitivity::LABELS);
    }
}
