//! Parameters of the node, in the units of the people who set them, and the settings they amount to.

use node_parameters::units::{DEGREE_PER_HOUR, MICRO_G};
use node_parameters::{FilterParameters, InputParameters, alignment, input};
use ros_node::{ParameterSet, Parameters, Unit};
use sins::machines::navigator::NavigatorSettings;
use sins::machines::self_calibration::Settings;

use crate::instruments::{self, InstrumentSettings};

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
    /// Whether the heading is published as an azimuth too.
    pub azimuth_topics: bool,
    /// An input that is silent for longer is a fault \[s\].
    pub silence_s: f64,
}

impl Default for NodeSettings {
    fn default() -> Self {
        Self {
            // Through a node the joint states may be late; of a bag they are all there.
            navigator: NavigatorSettings {
                joint_patience_s: 0.1,
                ..NavigatorSettings::default()
            },
            output_rate_hz: 0.0,
            imu_output_rate_hz: 0.0,
            odometry_frame_id: "odom".to_owned(),
            base_frame_id: "base_link".to_owned(),
            tf_rate_hz: 20.0,
            nmea_rate_hz: 10.0,
            azimuth_topics: false,
            silence_s: InputParameters::default().silence_s,
        }
    }
}

/// Everything that the parameters say.
#[derive(Clone, Debug, PartialEq)]
pub struct CompensatorParameters {
    node: NodeSettings,
    alignment: Alignment,
    input: InputParameters,
    /// Where the sentences go.
    pub instruments: InstrumentSettings,
}

/// What the node's own alignment assumes.
#[derive(Clone, Debug, PartialEq)]
struct Alignment {
    filter: FilterParameters,
    uncompensated_bias_m_s2: f64,
    uncompensated_drift_rad_s: f64,
}

/// How the navigator aligns and how long it remembers.
pub fn navigator() -> ParameterSet<NavigatorSettings> {
    ParameterSet::new("Navigation", NodeSettings::default().navigator)
        .number(
            "alignment_s",
            Unit::SECOND,
            10.0..=36_000.0,
            |s| &mut s.alignment_s,
            "Length of the navigator's own alignment, where it needs one",
        )
        .number(
            "history_s",
            Unit::SECOND,
            0.0..=3600.0,
            |s| &mut s.history_s,
            "How long samples are kept for a calibration that arrives after them",
        )
        .number(
            "joint_patience_s",
            Unit::SECOND,
            0.0..=60.0,
            |s| &mut s.joint_patience_s,
            "How long, by the samples' stamps, a sample waits for the joint state after it",
        )
        .number(
            "longest_hole_s",
            Unit::SECOND,
            0.0..=36_000.0,
            |s| &mut s.longest_hole_s,
            "A longer hole in the samples begins an alignment; over a shorter one course and speed are kept, less certain",
        )
        .number(
            "moored_speed_m_s",
            Unit::METRE_PER_SECOND,
            0.0..=100.0,
            |s| &mut s.moored_speed_m_s,
            "A ship that is slower than this, by her own solution, lies at her mooring",
        )
        .switch(
            "start_from_calibration",
            |s| &mut s.start_from_calibration,
            "Start from the attitude of the calibration where its samples are still at hand; false: always align anew",
        )
}

fn own_alignment() -> ParameterSet<Alignment> {
    let base = NavigatorSettings::default().alignment;
    let filter = alignment(base.clone());
    let alignment = Alignment {
        filter: filter.base().clone(),
        uncompensated_bias_m_s2: base.prior.accelerometer_bias_m_s2.x,
        uncompensated_drift_rad_s: base.prior.gyroscope_drift_rad_s.x,
    };
    ParameterSet::new("Filter", alignment)
        .include(filter, |s| &mut s.filter)
        .number(
            "uncompensated_accelerometer_bias_ug",
            MICRO_G,
            1e-6..=1e6,
            |s| &mut s.uncompensated_bias_m_s2,
            "1 sigma of the biases where they are not taken out",
        )
        .number(
            "uncompensated_gyroscope_drift_deg_per_hour",
            DEGREE_PER_HOUR,
            1e-9..=1e4,
            |s| &mut s.uncompensated_drift_rad_s,
            "1 sigma of the drifts where they are not taken out",
        )
}

/// All parameters of the node. The defaults are those of [`NavigatorSettings`].
pub fn declared() -> ParameterSet<CompensatorParameters> {
    let base = CompensatorParameters {
        node: NodeSettings::default(),
        alignment: own_alignment().base().clone(),
        input: *input().base(),
        instruments: instruments::declared().base().clone(),
    };
    ParameterSet::new("Output", base)
        .include(navigator(), |s| &mut s.node.navigator)
        .include(own_alignment(), |s| &mut s.alignment)
        .include(input(), |s| &mut s.input)
        .group("Output")
        .number(
            "output_rate_hz",
            Unit::HERTZ,
            0.0..=10_000.0,
            |s| &mut s.node.output_rate_hz,
            "How often odometry, fix_ins and velocity are published, by sample time; 0: with every sample",
        )
        .changeable()
        .number(
            "imu_output_rate_hz",
            Unit::HERTZ,
            0.0..=10_000.0,
            |s| &mut s.node.imu_output_rate_hz,
            "How often imu/data is published, by sample time; 0: with every sample",
        )
        .changeable()
        .number(
            "tf_rate_hz",
            Unit::HERTZ,
            0.0..=1000.0,
            |s| &mut s.node.tf_rate_hz,
            "How often transforms of table and ship go to /tf, by sample time; 0: never, for a robot_state_publisher has them",
        )
        .changeable()
        .switch(
            "azimuth_topics",
            |s| &mut s.node.azimuth_topics,
            "Publish the heading with odometry as compass_interfaces/Azimuth too, by ENU and by NED",
        )
        .text(
            "odometry_frame_id",
            |s| &mut s.node.odometry_frame_id,
            "Frame of the pose: East-North-Up, origin at the first position",
        )
        .text(
            "base_frame_id",
            |s| &mut s.node.base_frame_id,
            "Frame of the ship: forward-left-up",
        )
        .include(instruments::declared(), |s| &mut s.instruments)
        .group("NMEA 0183")
        .number(
            "nmea_rate_hz",
            Unit::HERTZ,
            0.1..=100.0,
            |s| &mut s.node.nmea_rate_hz,
            "How often every sentence is sent, by the time of the samples",
        )
        .changeable()
}

/// What the parameters say.
///
/// # Errors
/// One line naming the parameter that means nothing.
pub fn settings(parameters: &Parameters) -> anyhow::Result<CompensatorParameters> {
    Ok(declared().read(parameters)?)
}

impl CompensatorParameters {
    /// The settings that they amount to.
    ///
    /// # Errors
    /// One line naming the parameter that makes no sense together with the others.
    pub fn node(&self) -> anyhow::Result<NodeSettings> {
        let mut node = self.node.clone();
        let mut alignment: Settings = self.alignment.filter.clone().settings()?;
        let prior = &mut alignment.prior;
        prior
            .accelerometer_bias_m_s2
            .fill(self.alignment.uncompensated_bias_m_s2);
        prior
            .gyroscope_drift_rad_s
            .fill(self.alignment.uncompensated_drift_rad_s);
        node.navigator.alignment = alignment;
        node.silence_s = self.input.silence_s;
        Ok(node)
    }

    /// Messages of an input that the middleware keeps.
    pub fn queue_depth(&self) -> usize {
        self.input.queue_depth
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The defaults are those of the machine to the last bit, so that node and command line agree.
    #[test]
    fn defaults_are_those_of_the_machine() {
        let parameters = Parameters::defaults(declared().declarations()).unwrap();
        let node = settings(&parameters).unwrap().node().unwrap();
        assert_eq!(node, NodeSettings::default());
    }

    /// What is not taken out is what the alignment expects to be there.
    #[test]
    fn errors_that_are_not_taken_out_are_expected() {
        let mut given = declared().base().clone();
        let bias = "uncompensated_accelerometer_bias_ug";
        declared().put(&mut given, bias, &50.0.into()).unwrap();
        let prior = given.node().unwrap().navigator.alignment.prior;
        assert_eq!(
            prior.accelerometer_bias_m_s2,
            nalgebra::Vector3::repeat(MICRO_G.to_si(50.0))
        );
    }
}
