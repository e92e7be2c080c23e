//! What a calibration holds beyond drifts, biases and the two matrices, by name: files and messages carry it so.
//!
//! Whoever reads a name that it does not know leaves it aside, and of a name that is missing the error is zero.

use nalgebra::{Matrix3, Vector3};

use crate::estimation::group::Group;
use crate::estimation::groups::arms::AccelerometerArms;
use crate::estimation::groups::bias::Bias;
use crate::estimation::groups::delay::ACCELEROMETER_DELAY;
use crate::estimation::groups::g_sensitivity::GYROSCOPE_G_SENSITIVITIES;
use crate::estimation::groups::quadratic::ACCELEROMETER_QUADRATIC;
use crate::estimation::groups::scale::{AccelerometerMatrix, GyroscopeMatrix};
use crate::estimation::groups::table::Table;
use crate::sensor::SensorErrors;
use crate::table::TableErrors;

/// Quadratic coefficients, arms, g-sensitivities, delay, table.
const COUNT: usize = 3 + 9 + 9 + 1 + 8;

/// The names, in the order of the conventions; each ends in its unit.
fn names() -> impl Iterator<Item = &'static str> {
    let of = |group: &'static [crate::estimation::state::StateLabel]| {
        group.iter().map(|label| label.name)
    };
    ACCELEROMETER_QUADRATIC
        .into_iter()
        .chain(of(AccelerometerArms::LABELS))
        .chain(GYROSCOPE_G_SENSITIVITIES)
        .chain([ACCELEROMETER_DELAY])
        .chain(of(Table::LABELS))
}

/// The errors, in the order of their names.
fn values(errors: &SensorErrors, table: &TableErrors) -> [f64; COUNT] {
    let by_rows = |m: &Matrix3<f64>| m.transpose();
    let (arms, sensitivities) = (
        by_rows(&errors.accelerometer_arms),
        by_rows(&errors.gyroscope_g_sensitivity),
    );
    let mut values = [0.0; COUNT];
    let parts = [
        errors.accelerometer_quadratic.as_slice(),
        arms.as_slice(),
        sensitivities.as_slice(),
        &[errors.accelerometer_delay_s, table.nonorthogonality_rad],
        &table.inner_axis_tilt_rad,
        &[table.encoder_zero_inner_rad],
        &table.encoder_eccentricity_outer_rad,
        &table.encoder_eccentricity_inner_rad,
    ];
    for (value, part) in values.iter_mut().zip(parts.into_iter().flatten()) {
        *value = *part;
    }
    values
}

/// The errors with their names.
pub fn further_errors(errors: &SensorErrors, table: &TableErrors) -> Vec<(&'static str, f64)> {
    names().zip(values(errors, table)).collect()
}

/// Every error of sensors and table with its name: drifts and biases, the two matrices, and the further ones.
pub fn named_errors(errors: &SensorErrors, table: &TableErrors) -> Vec<(&'static str, f64)> {
    fn of<G: Group>(errors: &SensorErrors) -> Vec<(&'static str, f64)> {
        let mut values = vec![0.0; G::SIZE];
        G::found(errors, &mut values);
        G::LABELS.iter().map(|l| l.name).zip(values).collect()
    }
    let mut all = of::<Bias>(errors);
    all.extend(of::<GyroscopeMatrix>(errors));
    all.extend(of::<AccelerometerMatrix>(errors));
    all.extend(further_errors(errors, table));
    all
}

/// Puts errors in their places by name. A name that is none of these is left aside.
pub(super) fn put<'a>(
    named: impl IntoIterator<Item = (&'a str, f64)>,
    errors: &mut SensorErrors,
    table: &mut TableErrors,
) {
    let mut values = values(errors, table);
    for (name, value) in named {
        if let Some(at) = names().position(|known| known == name) {
            values[at] = value;
        }
    }
    let v = &values;
    errors.accelerometer_quadratic = Vector3::from_column_slice(&v[0..3]);
    errors.accelerometer_arms = Matrix3::from_row_slice(&v[3..12]);
    errors.gyroscope_g_sensitivity = Matrix3::from_row_slice(&v[12..21]);
    errors.accelerometer_delay_s = v[21];
    table.nonorthogonality_rad = v[22];
    table.inner_axis_tilt_rad = [v[23], v[24]];
    table.encoder_zero_inner_rad = v[25];
    table.encoder_eccentricity_outer_rad = [v[26], v[27]];
    table.encoder_eccentricity_inner_rad = [v[28], v[29]];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::model::{Model, Whole};
    use crate::simulation::SensorGrade;

    /// Every number comes back to the last bit, and stands under the name that the whole model has for it.
    #[test]
    fn there_and_back_by_the_names_of_the_model() {
        let numbers: Vec<(&str, f64)> = names()
            .enumerate()
            .map(|(at, name)| (name, 1e-7 / (at + 3) as f64))
            .collect();
        assert_eq!(numbers.len(), COUNT);
        let (mut errors, mut table) = (SensorErrors::default(), TableErrors::default());
        let unknown = [("colour", 1.0)];
        put(
            numbers.iter().copied().chain(unknown),
            &mut errors,
            &mut table,
        );
        assert_eq!(further_errors(&errors, &table), numbers);

        // Drifts, biases and matrices besides.
        let all = named_errors(&errors, &table);
        assert_eq!(all.len(), COUNT + 3 + 3 + 9 + 6);
        for number in &numbers {
            assert!(all.contains(number), "{number:?}");
        }
    }

    /// Every parameter of sensors and table that the whole model has is among the errors of a drawn sensor, by its name; the
    /// base's attitude, the antenna's arm and what moves are not.
    #[test]
    fn every_state_of_the_whole_model_is_named() {
        let drawn = SensorGrade::RingLaser.draw(1);
        let errors = named_errors(&drawn.imu.errors, &drawn.table);
        let others = ["_error_", "misalignment_", "base_attitude_", "antenna_arm_"];
        for state in Whole::STATES.map(|state| state.name) {
            let is_other = others.iter().any(|part| state.contains(part));
            assert!(
                is_other != errors.iter().any(|(name, _)| *name == state),
                "{state}"
            );
        }
        let of = |wanted: &str| errors.iter().find(|(name, _)| *name == wanted);
        let arm = drawn.imu.errors.accelerometer_arms[(1, 2)];
        let cosine = drawn.table.encoder_eccentricity_inner_rad[1];
        assert_eq!(
            of("accelerometer_arm_yz_m"),
            Some(&("accelerometer_arm_yz_m", arm))
        );
        let name = "encoder_eccentricity_inner_cosine_rad";
        assert_eq!(of(name), Some(&(name, cosine)));
    }
}
