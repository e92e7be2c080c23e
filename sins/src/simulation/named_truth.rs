//! What is true of a simulated block and its table, by the names of states.

use crate::sensor::SensorErrors;
use crate::table::TableErrors;

const AXES: [char; 3] = ['x', 'y', 'z'];

/// Every error of sensors and table with the name that a filter's state of it has, in SI units: drifts, biases, scale factors,
/// installation angles, squares, arms, g-sensitivity, delay, and the table's. What has no state (the outer encoder's zero, which
/// is the base's attitude) is left out.
pub fn named_truth(sensor: &SensorErrors, table: &TableErrors) -> Vec<(String, f64)> {
    let mut named = Vec::new();
    let mut add = |name: String, value: f64| named.push((name, value));
    for (axis, name) in AXES.iter().enumerate() {
        add(
            format!("accelerometer_bias_{name}_m_s2"),
            sensor.accelerometer_bias[axis],
        );
    }
    for (axis, name) in AXES.iter().enumerate() {
        add(
            format!("gyroscope_drift_{name}_rad_s"),
            sensor.gyroscope_drift[axis],
        );
    }
    for (kind, matrix) in [
        ("gyroscope", &sensor.gyroscope_matrix),
        ("accelerometer", &sensor.accelerometer_matrix),
    ] {
        for (axis, name) in AXES.iter().enumerate() {
            add(format!("{kind}_scale_factor_{name}"), matrix[(axis, axis)]);
        }
        for (row, first) in AXES.iter().enumerate() {
            for (column, second) in AXES.iter().enumerate() {
                // The accelerometers define the block: nothing stands above their diagonal.
                if row > column || (row < column && kind == "gyroscope") {
                    add(
                        format!("{kind}_installation_{first}{second}_rad"),
                        matrix[(row, column)],
                    );
                }
            }
        }
    }
    for (axis, name) in AXES.iter().enumerate() {
        let value = sensor.accelerometer_quadratic[axis];
        add(format!("accelerometer_quadratic_{name}_per_m_s2"), value);
    }
    for (row, first) in AXES.iter().enumerate() {
        for (column, second) in AXES.iter().enumerate() {
            let value = sensor.accelerometer_arms[(row, column)];
            add(format!("accelerometer_arm_{first}{second}_m"), value);
        }
    }
    for (row, first) in AXES.iter().enumerate() {
        for (column, second) in AXES.iter().enumerate() {
            let value = sensor.gyroscope_g_sensitivity[(row, column)];
            add(
                format!("gyroscope_g_sensitivity_{first}{second}_rad_s_per_m_s2"),
                value,
            );
        }
    }
    add(
        "accelerometer_delay_s".to_owned(),
        sensor.accelerometer_delay_s,
    );
    add(
        "table_nonorthogonality_rad".to_owned(),
        table.nonorthogonality_rad,
    );
    for (number, tilt) in (1..).zip(table.inner_axis_tilt_rad) {
        add(format!("inner_axis_tilt_{number}_rad"), tilt);
    }
    add(
        "encoder_zero_inner_rad".to_owned(),
        table.encoder_zero_inner_rad,
    );
    for (joint, [sine, cosine]) in [
        ("outer", table.encoder_eccentricity_outer_rad),
        ("inner", table.encoder_eccentricity_inner_rad),
    ] {
        add(format!("encoder_eccentricity_{joint}_sine_rad"), sine);
        add(format!("encoder_eccentricity_{joint}_cosine_rad"), cosine);
    }
    named
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::estimation::model::{Model, Whole};
    use crate::simulation::SensorGrade;

    /// Every parameter of sensors and table that a filter of the whole model has is in the truth, by its name; the base's attitude, the
    /// antenna's arm and what moves are not.
    #[test]
    fn every_state_of_the_whole_model_has_its_truth() {
        let drawn = SensorGrade::RingLaser.draw(1);
        let truth = named_truth(&drawn.imu.errors, &drawn.table);
        for state in Whole::STATES {
            let others = ["_error_", "misalignment_", "base_attitude_", "antenna_arm_"];
            if others.iter().any(|part| state.name.contains(part)) {
                continue;
            }
            assert!(
                truth.iter().any(|(name, _)| name == state.name),
                "{}",
                state.name
            );
        }
        let value = |wanted: &str| truth.iter().find(|(name, _)| name == wanted).unwrap().1;
        assert_eq!(
            value("accelerometer_arm_yz_m"),
            drawn.imu.errors.accelerometer_arms[(1, 2)]
        );
        assert_eq!(
            value("encoder_eccentricity_inner_cosine_rad"),
            drawn.table.encoder_eccentricity_inner_rad[1]
        );
    }
}
