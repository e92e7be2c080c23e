//! What is wrong with sensors and table beyond the paper's errors.

use nalgebra::Matrix3;
use node_parameters::units::{
    ARC_SECOND, DEGREE_PER_HOUR, DEGREE_PER_HOUR_PER_G, DEGREE_PER_HOUR_SQRT_HOUR, MICRO_G,
    MICRO_G_PER_G2, MICRO_G_PER_SQRT_HOUR, MILLIMETRE, MILLISECOND, PPM,
};
use ros_node::{ParameterSet, Unit};
use sins::simulation::{ImuErrorSettings, PlantSettings};
use sins::units;

use super::Settings;

const DEGREE_PER_HOUR2: Unit = Unit::new("deg/h^2", units::DEG_PER_HOUR / 3600.0);
const MICRO_G_PER_HOUR: Unit = Unit::new("ug/h", units::MICRO_G / 3600.0);
const ARC_SECOND_PER_G: Unit = Unit::new("arcsec/g", units::ARC_SECOND);
const MILLIMETRE_PER_SECOND: Unit = Unit::new("mm/s", 1e-3);

fn row_major(matrix: &Matrix3<f64>) -> [f64; 9] {
    let mut values = [0.0; 9];
    values.copy_from_slice(matrix.transpose().as_slice());
    values
}

/// Errors that need more than the paper's model, to be appended to its own.
pub fn beyond_table_1(set: ParameterSet<ImuErrorSettings>) -> ParameterSet<ImuErrorSettings> {
    let set = set
        .group("Further sensor errors")
        .numbers(
            "accelerometer_quadratic_ug_per_g2",
            MICRO_G_PER_G2,
            -1e6..=1e6,
            |s| s.errors.accelerometer_quadratic.as_mut_slice(),
            "Quadratic errors K_2 of the accelerometers x, y, z",
        )
        .array::<9>(
            "accelerometer_arms_mm",
            MILLIMETRE,
            -1e4..=1e4,
            (
                |s| row_major(&s.errors.accelerometer_arms),
                |s, arms| s.errors.accelerometer_arms = Matrix3::from_row_slice(&arms),
            ),
            "Where each accelerometer stands, from the table's centre: x's place x, y, z, then y's, then z's",
        )
        .array::<9>(
            "gyroscope_g_sensitivity_deg_per_hour_per_g",
            DEGREE_PER_HOUR_PER_G,
            -1e4..=1e4,
            (
                |s| row_major(&s.errors.gyroscope_g_sensitivity),
                |s, values| s.errors.gyroscope_g_sensitivity = Matrix3::from_row_slice(&values),
            ),
            "What specific force adds to the gyroscopes: xx, xy, xz, yx ... zz",
        )
        .number(
            "accelerometer_delay_ms",
            MILLISECOND,
            0.0..=100.0,
            |s| &mut s.errors.accelerometer_delay_s,
            "How late the accelerometers are against the gyroscopes",
        )
        .numbers(
            "gyroscope_asymmetry_ppm",
            PPM,
            -5e5..=5e5,
            |s| s.gyroscope_asymmetry.as_mut_slice(),
            "Half the difference of the scale factors for positive and negative rates x, y, z",
        );
    wandering(set)
        .number(
            "angle_count_arcsec",
            ARC_SECOND,
            0.0..=3600.0,
            |s| &mut s.output.angle_count_rad,
            "Angle of a count of the gyroscopes; 0: they do not count",
        )
        .number(
            "velocity_count_mm_per_s",
            MILLIMETRE_PER_SECOND,
            0.0..=1e4,
            |s| &mut s.output.velocity_count_m_s,
            "Velocity of a count of the accelerometers; 0: they do not count",
        )
        .number(
            "stamp_jitter_ms",
            MILLISECOND,
            0.0..=1000.0,
            |s| &mut s.output.stamp_jitter_s,
            "1 sigma by which the stamp of a sample is off",
        )
        .number(
            "stated_variance_ratio",
            Unit::NONE,
            0.0..=1e6,
            |s| &mut s.output.stated_variance_ratio,
            "Variance that a sample states over its true one; 0: it states none",
        )
}

fn wandering(set: ParameterSet<ImuErrorSettings>) -> ParameterSet<ImuErrorSettings> {
    set.uniform(
        "gyroscope_walk_deg_per_hour_per_sqrt_hour",
        DEGREE_PER_HOUR_SQRT_HOUR,
        0.0..=1e4,
        |s| s.wandering.gyroscope_walk.as_mut_slice(),
        "Random walk of the drifts",
    )
    .uniform(
        "accelerometer_walk_ug_per_sqrt_hour",
        MICRO_G_PER_SQRT_HOUR,
        0.0..=1e6,
        |s| s.wandering.accelerometer_walk.as_mut_slice(),
        "Random walk of the biases",
    )
    .uniform(
        "gyroscope_markov_deg_per_hour",
        DEGREE_PER_HOUR,
        0.0..=1e4,
        |s| s.wandering.gyroscope_markov_std.as_mut_slice(),
        "1 sigma of a Gauss-Markov part of the drifts",
    )
    .uniform(
        "accelerometer_markov_ug",
        MICRO_G,
        0.0..=1e6,
        |s| s.wandering.accelerometer_markov_std.as_mut_slice(),
        "1 sigma of a Gauss-Markov part of the biases",
    )
    .number(
        "markov_time_s",
        Unit::SECOND,
        0.0..=1e9,
        |s| &mut s.wandering.markov_time_s,
        "Correlation time of the Gauss-Markov parts; 0: there are none",
    )
    .numbers(
        "gyroscope_trend_deg_per_hour2",
        DEGREE_PER_HOUR2,
        -1e4..=1e4,
        |s| s.wandering.gyroscope_trend.as_mut_slice(),
        "Steady growth of the drifts x, y, z",
    )
    .numbers(
        "accelerometer_trend_ug_per_hour",
        MICRO_G_PER_HOUR,
        -1e6..=1e6,
        |s| s.wandering.accelerometer_trend.as_mut_slice(),
        "Steady growth of the biases x, y, z",
    )
    .number(
        "warm_up_time_s",
        Unit::SECOND,
        0.0..=1e9,
        |s| &mut s.wandering.warm_up_s,
        "Time constant of the warming up, which begins with the first sample; 0: there is none",
    )
    .numbers(
        "gyroscope_warm_up_deg_per_hour",
        DEGREE_PER_HOUR,
        -1e6..=1e6,
        |s| s.wandering.gyroscope_warm_up.as_mut_slice(),
        "What the warming up adds to the drifts x, y, z at first",
    )
    .numbers(
        "accelerometer_warm_up_ug",
        MICRO_G,
        -1e7..=1e7,
        |s| s.wandering.accelerometer_warm_up.as_mut_slice(),
        "What the warming up adds to the biases x, y, z at first",
    )
    .numbers(
        "gyroscope_scale_warm_up_ppm",
        PPM,
        -5e5..=5e5,
        |s| s.wandering.gyroscope_scale_warm_up.as_mut_slice(),
        "What the warming up adds to the gyroscopes' scale factors x, y, z at first",
    )
    .numbers(
        "accelerometer_scale_warm_up_ppm",
        PPM,
        -5e5..=5e5,
        |s| s.wandering.accelerometer_scale_warm_up.as_mut_slice(),
        "What the warming up adds to the accelerometers' scale factors x, y, z at first",
    )
}

/// What is wrong with the table.
pub fn table_errors() -> ParameterSet<PlantSettings> {
    // A set that is included brings its defaults along: of the whole plant, those are the node's, its start among them.
    ParameterSet::new("Table errors", Settings::default().simulator.plant)
        .number(
            "table_nonorthogonality_arcsec",
            ARC_SECOND,
            -2e4..=2e4,
            |s| &mut s.table_errors.nonorthogonality_rad,
            "Angle between the joints' axes beyond 90 deg",
        )
        .numbers(
            "inner_axis_tilt_arcsec",
            ARC_SECOND,
            -2e4..=2e4,
            |s| &mut s.table_errors.inner_axis_tilt_rad,
            "Tilts of the inner axis in the block, about the two axes that follow it in the order x, y, z, x",
        )
        .array::<2>(
            "encoder_zero_arcsec",
            ARC_SECOND,
            -2e4..=2e4,
            (
                |s| {
                    let errors = &s.table_errors;
                    [errors.encoder_zero_outer_rad, errors.encoder_zero_inner_rad]
                },
                |s, [outer, inner]| {
                    s.table_errors.encoder_zero_outer_rad = outer;
                    s.table_errors.encoder_zero_inner_rad = inner;
                },
            ),
            "Zeros of the encoders: outer, inner",
        )
        .numbers(
            "encoder_eccentricity_outer_arcsec",
            ARC_SECOND,
            -2e4..=2e4,
            |s| &mut s.table_errors.encoder_eccentricity_outer_rad,
            "Error of the outer encoder once a turn: sine, cosine",
        )
        .numbers(
            "encoder_eccentricity_inner_arcsec",
            ARC_SECOND,
            -2e4..=2e4,
            |s| &mut s.table_errors.encoder_eccentricity_inner_rad,
            "Error of the inner encoder once a turn: sine, cosine",
        )
        .numbers(
            "flexing_arcsec_per_g",
            ARC_SECOND_PER_G,
            -2e4..=2e4,
            |s| s.flexing_rad_per_g.as_mut_slice(),
            "How the structure bends: the block turns by d × u, u upwards in the block; d: x, y, z",
        )
}
