//! Parameters of the node, in the units of the people who set them, and the settings they amount to.

use std::f64::consts::PI;

use imu_input::{Number, noise, numbers, range, turntable};
use nalgebra::Vector3;
use ros_node::{Parameter, Parameters};
use sins::estimation::filter::InitialUncertainty;
use sins::machines::self_calibration::{Reference, SensorWalk, Settings, Thresholds};
use sins::machines::unseen_motion::UnseenMotion;
use sins::units::{ARC_MINUTE, DEG_PER_HOUR, MICRO_G};

/// √3600 s.
const SQRT_HOUR: f64 = 60.0;

/// Numbers that only this node has.
#[rustfmt::skip]
const NUMBERS: [Number; 14] = [
    ("prior_position_m", 10.0, "m", 1e-3, 1e6,
        "initial 1 sigma of the position, each axis"),
    ("prior_velocity_m_s", 0.01, "m/s", 1e-6, 100.0,
        "initial 1 sigma of the velocity, each axis"),
    ("velocity_patience_s", 2.0, "s", 0.01, 3600.0,
        "how much later than its sample, by the stamps, a measured velocity may come"),
    ("update_interval_s", 1.0, "s", 0.01, 60.0,
        "time between covariance steps, and between estimates"),
    ("coarse_alignment_min_s", 60.0, "s", 1.0, 7200.0,
        "shortest coarse alignment, where the samples end early"),
    ("coarse_residual_limit_m_s", 1.0, "m/s", 1e-3, 100.0,
        "velocity that coarse alignment may leave unexplained"),
    ("azimuth_threshold_arcmin", 1.0, "arcmin", 0.0, 1e4,
        "1 sigma below which the azimuth counts as found; 0: not asked for"),
    ("level_threshold_arcmin", 0.0, "arcmin", 0.0, 1e4,
        "1 sigma below which the level counts as found; 0: not asked for"),
    ("innovation_false_alarm", 1e-6, "1", 1e-12, 0.4,
        "probability that the innovation test fails over one window when all is well"),
    ("gyroscope_drift_walk_deg_per_hour_sqrt_hour", 0.001, "deg/h/sqrt(h)", 0.0, 1e3,
        "how the drifts wander from one alignment to the next"),
    ("accelerometer_bias_walk_ug_per_sqrt_hour", 1.0, "ug/sqrt(h)", 0.0, 1e6,
        "how the biases wander from one alignment to the next"),
    ("refused_share", 0.01, "1", 0.0, 1.0,
        "a greater share of refused samples keeps the estimate from converging"),
    ("gap_share", 0.1, "1", 0.0, 1.0,
        "a greater share of holes among the samples keeps the estimate from converging"),
    ("turn_deg", 10.0, "deg", 0.1, 180.0,
        "turn of the block that ends fine alignment and begins calibration"),
];

/// Numbers for the axes x, y, z: name, default, unit, greatest, what it is.
#[rustfmt::skip]
const TRIPLES: [(&str, f64, &str, f64, &str); 4] = [
    ("prior_accelerometer_bias_ug", 100.0, "ug", 1e6, "initial 1 sigma of the biases x, y, z"),
    ("prior_gyroscope_drift_deg_per_hour", 0.01, "deg/h", 1e4, "initial 1 sigma of the drifts x, y, z"),
    ("gyroscope_drift_threshold_deg_per_hour", 0.002, "deg/h", 1e4,
        "1 sigma below which the drifts x, y, z count as found; 0: not asked for"),
    ("accelerometer_bias_threshold_ug", 10.0, "ug", 1e6,
        "1 sigma below which the biases x, y, z count as found; 0: not asked for"),
];

/// Every parameter with unit, range and default. The defaults are those of [`Settings`].
pub fn declarations() -> Vec<Parameter> {
    let mut all = imu_input::declarations();
    all.extend(numbers(&NUMBERS));
    all.extend([
        Parameter::new("velocity_reference", "moored")
            .one_of(&["moored", "measured"])
            .describe("moored: the ship's velocity is zero; measured: it comes on aiding/velocity"),
        Parameter::new("prior_misalignment_deg", vec![1.0, 1.0, 10.0])
            .length(3)
            .unit("deg")
            .range(1e-4, 180.0)
            .describe("initial 1 sigma of the attitude about East, North, Up; wide: the filter itself finds what the coarse alignment is worth"),
        Parameter::new("calibration_file", "").describe(
            "what ~/save writes and ~/load reads; empty: self_calibration.yaml in ROS_HOME, or in .ros at home",
        ),
        Parameter::new("innovation_recovery_windows", 6_i64)
            .range(1.0, 10_000.0)
            .describe("windows that have to agree before a run that failed the innovation test counts as consistent again"),
        Parameter::new("innovation_window_updates", 300_i64)
            .range(10.0, 100_000.0)
            .describe("length of the innovation test in updates"),
    ]);
    all.extend(TRIPLES.map(|(name, default, unit, to, text)| {
        Parameter::new(name, vec![default; 3])
            .length(3)
            .unit(unit)
            .range(0.0, to)
            .describe(text)
    }));
    all
}

/// The settings that the parameters amount to.
///
/// # Errors
/// One line naming the parameter that makes no sense together with the others.
pub fn settings(parameters: &Parameters) -> anyhow::Result<Settings> {
    let double = |name: &str| parameters.get::<f64>(name);
    let triple = |name: &str| -> anyhow::Result<Vector3<f64>> {
        Ok(Vector3::from_vec(parameters.get::<Vec<f64>>(name)?))
    };
    let reference = match parameters.get::<String>("velocity_reference")?.as_str() {
        "measured" => Reference::Measured {
            patience_s: double("velocity_patience_s")?,
        },
        _ => Reference::Moored {
            sigma_m_s: double("moored_sigma_m_s")?,
        },
    };
    let level = double("level_threshold_arcmin")? * ARC_MINUTE;
    let azimuth = double("azimuth_threshold_arcmin")? * ARC_MINUTE;
    let settings = Settings {
        turntable: turntable(parameters)?,
        noise: noise(parameters)?,
        prior: InitialUncertainty {
            position_m: double("prior_position_m")?,
            velocity_m_s: double("prior_velocity_m_s")?,
            misalignment_rad: triple("prior_misalignment_deg")? * PI / 180.0,
            accelerometer_bias_m_s2: triple("prior_accelerometer_bias_ug")? * MICRO_G,
            gyroscope_drift_rad_s: triple("prior_gyroscope_drift_deg_per_hour")? * DEG_PER_HOUR,
        },
        reference,
        step_s: double("update_interval_s")?,
        coarse_alignment_s: double("coarse_alignment_s")?,
        coarse_alignment_min_s: double("coarse_alignment_min_s")?,
        coarse_residual_limit_m_s: double("coarse_residual_limit_m_s")?,
        thresholds: Thresholds::new(
            [level, level, azimuth],
            (triple("accelerometer_bias_threshold_ug")? * MICRO_G).into(),
            (triple("gyroscope_drift_threshold_deg_per_hour")? * DEG_PER_HOUR).into(),
        ),
        window_updates: usize::try_from(parameters.get::<i64>("innovation_window_updates")?)?,
        window_false_alarm: double("innovation_false_alarm")?,
        turn_rad: double("turn_deg")? * PI / 180.0,
        restart_gap_s: double("restart_gap_s")?,
        range: range(parameters)?,
        walk: SensorWalk {
            gyroscope_drift_rad_s_sqrt_s: double("gyroscope_drift_walk_deg_per_hour_sqrt_hour")?
                * DEG_PER_HOUR
                / SQRT_HOUR,
            accelerometer_bias_m_s2_sqrt_s: double("accelerometer_bias_walk_ug_per_sqrt_hour")?
                * MICRO_G
                / SQRT_HOUR,
        },
        unseen: UnseenMotion::default(),
        recovery_windows: usize::try_from(parameters.get::<i64>("innovation_recovery_windows")?)?,
        refused_share: double("refused_share")?,
        gap_share: double("gap_share")?,
    };
    settings.check()?;
    Ok(settings)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The defaults are those of the machine to the last bit, so that node and command line agree.
    #[test]
    fn defaults_are_those_of_the_machine() {
        let parameters = Parameters::defaults(declarations()).unwrap();
        assert_eq!(settings(&parameters).unwrap(), Settings::default());
    }

    /// The parameter file that ships with the project holds every parameter and no other.
    #[test]
    fn the_parameter_file_is_complete() {
        let file = include_str!("../../../launch-scripts/config/self_calibrator.yaml");
        let mut given: Vec<_> = file
            .lines()
            .filter_map(|line| line.strip_prefix("    ")?.split_once(':'))
            .map(|(key, _)| key)
            .filter(|key| !key.starts_with('#'))
            .collect();
        let parameters = crate::builder().declared().unwrap();
        let declarations = parameters.declarations();
        let mut declared: Vec<_> = declarations.iter().map(Parameter::name).collect();
        given.sort_unstable();
        declared.sort_unstable();
        assert_eq!(given, declared);
    }
}
