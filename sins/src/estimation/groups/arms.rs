//! Arms of the accelerometers from the table's centre: f'_i = \[f + ω × (ω × a_i) + ω̇ × a_i\]_i.
//!
//! With M = \[ω×\]² + \[ω̇×\] a metre of component j of arm i adds C_b^n e_i M_ij to δv̇. Size effect (where the
//! accelerometers are in the block) and displaced block (where the block is on the table) show as their sum only.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval, Span};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::{BlockMotion, SensorErrors};

/// What is known before of the arms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccelerometerArms {
    /// One-sigma of every component \[m\].
    pub arm_m: f64,
}

const fn label(name: &'static str, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(name, symbol, words, "mm", 1e-3)
}

impl Group for AccelerometerArms {
    /// Accelerometer by accelerometer.
    const LABELS: &'static [StateLabel] = &[
        label("accelerometer_arm_xx_m", "axx", "accelerometer arm xx"),
        label("accelerometer_arm_xy_m", "axy", "accelerometer arm xy"),
        label("accelerometer_arm_xz_m", "axz", "accelerometer arm xz"),
        label("accelerometer_arm_yx_m", "ayx", "accelerometer arm yx"),
        label("accelerometer_arm_yy_m", "ayy", "accelerometer arm yy"),
        label("accelerometer_arm_yz_m", "ayz", "accelerometer arm yz"),
        label("accelerometer_arm_zx_m", "azx", "accelerometer arm zx"),
        label("accelerometer_arm_zy_m", "azy", "accelerometer arm zy"),
        label("accelerometer_arm_zz_m", "azz", "accelerometer arm zz"),
    ];
    const FOLLOWS_CHANGES: bool = true;

    /// Matrix i, column j: ∫C_b^n e_i M_ij dt.
    type Gathered = [Matrix3<f64>; 3];

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma.fill(self.arm_m);
    }

    #[inline]
    fn gather(gathered: &mut [Matrix3<f64>; 3], span: &Span) {
        let motion = BlockMotion {
            rate: span.angular_rate(),
            rate_derivative: span.rate_change / span.increment.interval_s,
            ..BlockMotion::default()
        };
        let by_arm = motion.arm_matrix();
        for (accelerometer, sum) in gathered.iter_mut().enumerate() {
            *sum += span.attitude.column(accelerometer) * by_arm.row(accelerometer);
        }
    }

    fn couple(&self, gathered: &[Matrix3<f64>; 3], _interval: &Interval, into: &mut Coupling<'_>) {
        for (accelerometer, matrix) in gathered.iter().enumerate() {
            for component in 0..3 {
                let push: Vector3<f64> = matrix.column(component).into_owned();
                into.drives(3 * accelerometer + component, Some(push), None);
            }
        }
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        errors.accelerometer_arms += Matrix3::from_row_slice(x);
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        x.copy_from_slice(errors.accelerometer_arms.transpose().as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::column_test::change_columns_hold;
    use crate::estimation::model::Whole;

    /// Every column, for a block whose rate changes.
    #[test]
    fn columns_are_the_derivative_of_the_machine() {
        change_columns_hold::<Whole, { Whole::M }, { Whole::N }>(AccelerometerArms::LABELS);
    }
}
