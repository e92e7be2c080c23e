//! Errors of the IMU and its noise.

use node_parameters::units::{
    ARC_SECOND, DEGREE_PER_HOUR, DEGREE_PER_SQRT_HOUR, MICRO_G, MICRO_G_PER_SQRT_HERTZ, PPM,
};
use ros_node::ParameterSet;
use sins::simulation::ImuErrorSettings;

use super::sensor;

/// Errors of the IMU and its noise.
pub fn imu_errors() -> ParameterSet<ImuErrorSettings> {
    let set = ParameterSet::new("Sensor errors", ImuErrorSettings::default())
        .numbers(
            "gyroscope_drift_deg_per_hour",
            DEGREE_PER_HOUR,
            -1e6..=1e6,
            |s| s.errors.gyroscope_drift.as_mut_slice(),
            "Gyroscope drifts x, y, z, measured minus true",
        )
        .numbers(
            "accelerometer_bias_ug",
            MICRO_G,
            -1e7..=1e7,
            |s| s.errors.accelerometer_bias.as_mut_slice(),
            "Accelerometer biases x, y, z, measured minus true",
        )
        .array::<3>(
            "gyroscope_scale_factor_ppm",
            PPM,
            -5e5..=5e5,
            (
                |s| s.errors.gyroscope_matrix.diagonal().into(),
                |s, scale| s.errors.gyroscope_matrix.set_diagonal(&scale.into()),
            ),
            "Scale factor errors of the gyroscopes x, y, z",
        )
        .array::<3>(
            "accelerometer_scale_factor_ppm",
            PPM,
            -5e5..=5e5,
            (
                |s| s.errors.accelerometer_matrix.diagonal().into(),
                |s, scale| s.errors.accelerometer_matrix.set_diagonal(&scale.into()),
            ),
            "Scale factor errors of the accelerometers x, y, z",
        )
        .array::<6>(
            "gyroscope_installation_arcsec",
            ARC_SECOND,
            -36_000.0..=36_000.0,
            (
                |s| {
                    let k = &s.errors.gyroscope_matrix;
                    [k.m12, k.m13, k.m21, k.m23, k.m31, k.m32]
                },
                |s, angles| {
                    let k = &mut s.errors.gyroscope_matrix;
                    [k.m12, k.m13, k.m21, k.m23, k.m31, k.m32] = angles;
                },
            ),
            "Installation angles of the gyroscopes, the elements of K_g off its diagonal: xy, xz, yx, yz, zx, zy",
        )
        .array::<3>(
            "accelerometer_installation_arcsec",
            ARC_SECOND,
            -36_000.0..=36_000.0,
            (
                |s| {
                    let k = &s.errors.accelerometer_matrix;
                    [k.m21, k.m31, k.m32]
                },
                |s, angles| {
                    let k = &mut s.errors.accelerometer_matrix;
                    [k.m21, k.m31, k.m32] = angles;
                },
            ),
            "Installation angles of the accelerometers, the elements of K_a below its diagonal: yx, zx, zy",
        )
        .uniform(
            "angle_random_walk_deg_per_sqrt_hour",
            DEGREE_PER_SQRT_HOUR,
            0.0..=1000.0,
            |s| s.noise.gyroscope.as_mut_slice(),
            "White noise of the gyroscopes",
        )
        .uniform(
            "velocity_random_walk_ug_per_sqrt_hz",
            MICRO_G_PER_SQRT_HERTZ,
            0.0..=1e6,
            |s| s.noise.accelerometer.as_mut_slice(),
            "White noise of the accelerometers",
        );
    sensor::beyond_table_1(set)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    /// Installation angles and scale factors land where their names say.
    #[test]
    fn matrices_are_filled_by_name() {
        let set = imu_errors();
        let mut settings = *set.base();
        for (name, values) in [
            (
                "gyroscope_installation_arcsec",
                vec![12.0, 13.0, 21.0, 23.0, 31.0, 32.0],
            ),
            ("gyroscope_scale_factor_ppm", vec![1.0, 2.0, 3.0]),
            ("accelerometer_installation_arcsec", vec![21.0, 31.0, 32.0]),
            ("accelerometer_scale_factor_ppm", vec![4.0, 5.0, 6.0]),
        ] {
            set.put(&mut settings, name, &values.into()).unwrap();
        }
        let (angle, ppm) = (ARC_SECOND.to_si(1.0), PPM.to_si(1.0));
        let scaled = |angles: Matrix3<f64>, scale: Vector3<f64>| {
            angles * angle + Matrix3::from_diagonal(&(scale * ppm))
        };
        let k = Matrix3::new(0.0, 12.0, 13.0, 21.0, 0.0, 23.0, 31.0, 32.0, 0.0);
        let errors = &settings.errors;
        assert_eq!(
            errors.gyroscope_matrix,
            scaled(k, Vector3::new(1.0, 2.0, 3.0))
        );
        let k = Matrix3::new(0.0, 0.0, 0.0, 21.0, 0.0, 0.0, 31.0, 32.0, 0.0);
        assert_eq!(
            errors.accelerometer_matrix,
            scaled(k, Vector3::new(4.0, 5.0, 6.0))
        );
    }

    /// Arms are given accelerometer by accelerometer.
    #[test]
    fn rows_are_filled_in_order() {
        let set = imu_errors();
        let mut settings = *set.base();
        let arms: Vec<f64> = (1..=9).map(f64::from).collect();
        set.put(&mut settings, "accelerometer_arms_mm", &arms.into())
            .unwrap();
        assert_eq!(settings.errors.accelerometer_arms[(1, 2)], 6e-3);
    }
}
