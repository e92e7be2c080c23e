//! Parameters of the node, in the units of the people who set them, and the settings they amount to.

use imu_input::{Number, noise, numbers, range, turntable};
use nalgebra::Vector3;
use ros_node::{Parameter, Parameters};
use sins::machines::navigator::NavigatorSettings;
use sins::machines::self_calibration::{Reference, Settings};
use sins::units::{DEG_PER_HOUR, MICRO_G};

use crate::instruments;

/// What the node itself needs to know.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeSettings {
    /// Settings of the navigator.
    pub navigator: NavigatorSettings,
    /// Odometry, position and velocity a second of sample time; 0: with every sample \[Hz\].
    pub output_rate_hz: f64,
    /// Compensated samples a second of sample time; 0: every one \[Hz\].
    pub imu_output_rate_hz: f64,
    /// Frame of the pose.
    pub odometry_frame_id: String,
    /// Frame of the ship.
    pub base_frame_id: String,
    /// Transforms a second of sample time; 0: none \[Hz\].
    pub tf_rate_hz: f64,
    /// NMEA 0183 sentences a second of sample time, where they go anywhere \[Hz\].
    pub nmea_rate_hz: f64,
    /// An input that is silent for longer is a fault \[s\].
    pub silence_s: f64,
}

/// Numbers that only this node has.
#[rustfmt::skip]
const NUMBERS: [Number; 11] = [
    ("alignment_s", 900.0, "s", 10.0, 36_000.0,
        "length of the node's own alignment, where it needs one"),
    ("history_s", 60.0, "s", 0.0, 3600.0,
        "how long samples are kept for a calibration that arrives after them"),
    ("joint_patience_s", 0.1, "s", 0.0, 60.0,
        "how long, by the samples' stamps, a sample waits for the joint state after it"),
    ("longest_hole_s", 300.0, "s", 0.0, 36_000.0,
        "a longer hole in the samples begins an alignment; over a shorter one course and speed are kept, less certain"),
    ("moored_speed_m_s", 0.5, "m/s", 0.0, 100.0,
        "a ship that is slower than this, by her own solution, lies at her mooring"),
    ("velocity_patience_s", 2.0, "s", 0.01, 3600.0,
        "how much later than its sample, by the stamps, a measured velocity may come"),
    ("uncompensated_accelerometer_bias_ug", 100.0, "ug", 1e-6, 1e6,
        "1 sigma of the biases where they are not taken out"),
    ("uncompensated_gyroscope_drift_deg_per_hour", 0.01, "deg/h", 1e-9, 1e4,
        "1 sigma of the drifts where they are not taken out"),
    ("output_rate_hz", 0.0, "Hz", 0.0, 10_000.0,
        "odometry, fix_ins and velocity a second of sample time; 0: with every sample"),
    ("imu_output_rate_hz", 0.0, "Hz", 0.0, 10_000.0,
        "imu/data a second of sample time; 0: with every sample"),
    ("tf_rate_hz", 20.0, "Hz", 0.0, 1000.0,
        "transforms of table and ship a second of sample time, to /tf; 0: none, for a robot_state_publisher has them"),
];

/// Every parameter with unit, range and default. The defaults are those of [`NavigatorSettings`].
pub fn declarations() -> Vec<Parameter> {
    let mut all = imu_input::declarations();
    all.extend(numbers(&NUMBERS));
    all.extend(instruments::declarations());
    all.extend([
        Parameter::new("start_from_calibration", true)
            .describe("start from the attitude of the calibration where its samples are still at hand; false: always align anew"),
        Parameter::new("velocity_reference", "moored")
            .one_of(&["moored", "measured"])
            .describe("during alignment, moored: the ship's velocity is zero; measured: it comes on aiding/velocity"),
        Parameter::new("odometry_frame_id", "odom")
            .describe("frame of the pose: East-North-Up, origin at the first position"),
        Parameter::new("base_frame_id", "base_link").describe("frame of the ship: forward-left-up"),
    ]);
    all
}

/// The settings that the parameters amount to.
///
/// # Errors
/// One line naming the parameter that makes no sense together with the others.
pub fn settings(parameters: &Parameters) -> anyhow::Result<NodeSettings> {
    let double = |name: &str| parameters.get::<f64>(name);
    let mut alignment = Settings {
        turntable: turntable(parameters)?,
        noise: noise(parameters)?,
        reference: match parameters.get::<String>("velocity_reference")?.as_str() {
            "measured" => Reference::Measured {
                patience_s: double("velocity_patience_s")?,
            },
            _ => Reference::Moored {
                sigma_m_s: double("moored_sigma_m_s")?,
            },
        },
        range: range(parameters)?,
        coarse_alignment_s: double("coarse_alignment_s")?,
        restart_gap_s: double("restart_gap_s")?,
        ..Settings::default()
    };
    alignment.prior.accelerometer_bias_m_s2 =
        Vector3::repeat(double("uncompensated_accelerometer_bias_ug")? * MICRO_G);
    alignment.prior.gyroscope_drift_rad_s =
        Vector3::repeat(double("uncompensated_gyroscope_drift_deg_per_hour")? * DEG_PER_HOUR);
    Ok(NodeSettings {
        navigator: NavigatorSettings {
            alignment,
            alignment_s: double("alignment_s")?,
            history_s: double("history_s")?,
            start_from_calibration: parameters.get("start_from_calibration")?,
            joint_patience_s: double("joint_patience_s")?,
            longest_hole_s: double("longest_hole_s")?,
            moored_speed_m_s: double("moored_speed_m_s")?,
        },
        output_rate_hz: double("output_rate_hz")?,
        imu_output_rate_hz: double("imu_output_rate_hz")?,
        odometry_frame_id: parameters.get("odometry_frame_id")?,
        base_frame_id: parameters.get("base_frame_id")?,
        tf_rate_hz: double("tf_rate_hz")?,
        nmea_rate_hz: double("nmea_rate_hz")?,
        silence_s: double("silence_s")?,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The defaults are those of the machine to the last bit, so that node and command line agree; only the node's joint states may be
    /// late.
    #[test]
    fn defaults_are_those_of_the_machine() {
        let parameters = Parameters::defaults(declarations()).unwrap();
        assert_eq!(
            settings(&parameters).unwrap().navigator,
            NavigatorSettings {
                joint_patience_s: 0.1,
                ..NavigatorSettings::default()
            }
        );
    }

    /// The parameter file that ships with the project holds every parameter and no other.
    #[test]
    fn the_parameter_file_is_complete() {
        let file = include_str!("../../../launch-scripts/config/navigation_compensator.yaml");
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
