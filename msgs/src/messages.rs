//! The messages of this package: scheme, estimate, calibration.

use serde::{Deserialize, Serialize};

use ros2_interfaces::cdr;
use ros2_interfaces::geometry_msgs::Quaternion;
use ros2_interfaces::std_msgs::Header;
use ros2_interfaces::{RosMessage, ros_message};

/// Where the rotation scheme stands. Topic scheme/status, reliable, transient local, from the scheme sequencer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SchemeStatus {
    /// Time and frame.
    pub header: Header,
    /// Name of the scheme, e.g. eight-position.
    pub scheme: String,
    /// One of the constants.
    pub state: u8,
    /// Counts from 0.
    pub cycle: u32,
    /// Within the cycle: 0 is the first dwell, k the k-th rotation and the dwell after it.
    pub step: u32,
    /// Rotations of one cycle.
    pub steps_per_cycle: u32,
    /// Letter of the position the block is in or turns to, e.g. A.
    pub position: String,
    /// `outer_joint` or `inner_joint` of the rotation under way or the next one; empty where there is none.
    pub rotation_joint: String,
    /// Axis of the block at zero joint angles that this joint turns about: x, y or z.
    pub rotation_axis: String,
    /// By how much, counter-clockwise positive \[rad\].
    pub rotation_angle_rad: f64,
    /// Since the scheme was started \[s\].
    pub elapsed: f64,
    /// Until it is finished; -1 where not known \[s\].
    pub remaining: f64,
    /// Joint angles (outer, inner) at the end of the step, continuous \[rad\].
    pub target: [f64; 2],
    /// One line for a person.
    pub message: String,
}

impl SchemeStatus {
    /// Nothing was started.
    pub const IDLE: u8 = 0;
    /// The joint states do not arrive, or are not yet at the first position.
    pub const WAITING_FOR_TABLE: u8 = 1;
    /// At rest in a position.
    pub const DWELLING: u8 = 2;
    /// A rotation is under way.
    pub const ROTATING: u8 = 3;
    /// The table stands where it is until resumed.
    pub const PAUSED: u8 = 4;
    /// Ended before its time, on request.
    pub const ABORTED: u8 = 5;
    /// Every cycle is done.
    pub const FINISHED: u8 = 6;
    /// The table did not follow; `message` says how.
    pub const FAULT: u8 = 7;
}

/// What the self-calibration knows now. Topic self_calibration/estimate, reliable, transient local, 1 Hz of ROS time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SelfCalibrationEstimate {
    /// Stamp of the sample the estimate stands at; frame_id of the sensor block.
    pub header: Header,
    /// One of the constants.
    pub phase: u8,
    /// Its name.
    pub phase_name: String,
    /// Names of the states, in order.
    pub state_names: Vec<String>,
    /// The error states, SI units.
    pub state: Vec<f64>,
    /// Row-major, square of the length of state_names.
    pub covariance: Vec<f64>,
    /// Square roots of its diagonal.
    pub std: Vec<f64>,
    /// x, y, z, measured minus true \[rad/s\].
    pub gyroscope_drift: [f64; 3],
    /// Its 1 sigma \[rad/s\].
    pub gyroscope_drift_std: [f64; 3],
    /// x, y, z, measured minus true \[m/s²\].
    pub accelerometer_bias: [f64; 3],
    /// Its 1 sigma \[m/s²\].
    pub accelerometer_bias_std: [f64; 3],
    /// About East, North, Up \[rad\].
    pub misalignment_std: [f64; 3],
    /// Turns vectors of the block into East-North-Up.
    pub attitude: Quaternion,
    /// Of the block's y axis, clockwise from true north, 0 to 2π \[rad\].
    pub heading: f64,
    /// Its 1 sigma \[rad\].
    pub heading_std: f64,
    /// Roll of the block \[rad\].
    pub roll: f64,
    /// Its 1 sigma \[rad\].
    pub roll_std: f64,
    /// Pitch of the block \[rad\].
    pub pitch: f64,
    /// Its 1 sigma \[rad\].
    pub pitch_std: f64,
    /// Normalised innovation squared of the newest update.
    pub nis: f64,
    /// Mean of it over the window.
    pub nis_window_mean: f64,
    /// Chi-square bound that the mean must stay below.
    pub nis_upper_bound: f64,
    /// IMU samples taken.
    pub samples: u64,
    /// Times that the stamps jumped.
    pub gaps: u64,
    /// Samples missing in those gaps.
    pub lost_samples: u64,
    /// From the first sample to the newest \[s\].
    pub duration: f64,
    /// One line for a person.
    pub message: String,
    /// Of the states before anything was measured; empty, or zero where not known.
    pub prior_std: Vec<f64>,
    /// 1 sigma below which the state counts as found; empty, or zero where it is not asked for.
    pub threshold: Vec<f64>,
}

impl SelfCalibrationEstimate {
    /// Reads a payload of a bag; in one of the time before `prior_std` or `threshold` were there, they are empty.
    ///
    /// # Errors
    /// Why it is no estimate.
    pub fn from_cdr(payload: &[u8]) -> Result<Self, cdr::Error> {
        of_bag(payload)
    }

    /// What `message` says behind phase and time: in an inconsistent run the judge's first reason stands there.
    pub fn words(&self) -> &str {
        let behind = self.message.split_once(" s: ");
        behind.map_or(self.message.as_str(), |(_, words)| words)
    }

    /// No latitude and longitude yet.
    pub const WAITING_FOR_POSITION: u8 = 0;
    /// Attitude from gravity and earth rate in the inertial frame.
    pub const COARSE_ALIGNMENT: u8 = 1;
    /// The filter runs in the first dwell.
    pub const FINE_ALIGNMENT: u8 = 2;
    /// The filter runs through rotations.
    pub const CALIBRATING: u8 = 3;
    /// Every state the scheme can show is below its threshold, and the innovations agree.
    pub const CONVERGED: u8 = 4;
    /// A test of the judge failed: the filter does not describe its samples.
    pub const INCONSISTENT: u8 = 5;
}

/// What the scheme under way will still bring, and which rotation would bring more. Topic self_calibration/outlook, reliable,
/// transient local.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CalibrationOutlook {
    /// Stamp of the estimate that it begins at; frame_id of the sensor block.
    pub header: Header,
    /// False: `message` says why nothing is foreseen; arrays are then empty and times -1.
    pub foreseen: bool,
    /// Name of the scheme.
    pub scheme: String,
    /// In which the scheme stands, from 0.
    pub cycle: u32,
    /// Of the cycle; 0 is the first dwell.
    pub step: u32,
    /// Names of the states, in order.
    pub state_names: Vec<String>,
    /// 1 sigma below which the state counts as found, SI; zero where it is not asked for.
    pub threshold: Vec<f64>,
    /// 1 sigma now, SI.
    pub std: Vec<f64>,
    /// 1 sigma at the end, SI.
    pub std_at_end: Vec<f64>,
    /// End of the scheme, or of its present cycle, from the stamp \[s\].
    pub end_in: f64,
    /// Its cycle.
    pub end_cycle: u32,
    /// Its step.
    pub end_step: u32,
    /// It is the end of the scheme.
    pub end_is_of_scheme: bool,
    /// When every threshold will be met, from the stamp; 0: now; -1: not by that end and one more cycle \[s\].
    pub met_in: f64,
    /// In this cycle.
    pub met_cycle: u32,
    /// In this step.
    pub met_step: u32,
    /// States that do not get below their threshold in that time.
    pub out_of_reach: Vec<String>,
    /// `outer_joint` or `inner_joint` of the rotation that brings most; empty where rest does, or every threshold is met.
    pub best_joint: String,
    /// Axis of the block at zero joint angles that this joint turns about: x, y or z.
    pub best_axis: String,
    /// By how much, counter-clockwise positive; 0: rest \[rad\].
    pub best_angle_rad: f64,
    /// The dwell after it \[s\].
    pub best_dwell: f64,
    /// Of the thresholds now: sum of ln(std / threshold) over the states above theirs.
    pub distance: f64,
    /// The same after that rotation and dwell.
    pub best_distance: f64,
    /// One line for a person.
    pub message: String,
}

/// Reads a payload that may be from before the last array of its type was there.
fn of_bag<M: RosMessage>(payload: &[u8]) -> Result<M, cdr::Error> {
    cdr::decode(payload).or_else(|error| {
        // The lengths of empty arrays, behind as many bytes as bring them to their place.
        let with_empty = |arrays: usize| {
            let mut longer = payload.to_vec();
            longer.resize(payload.len().next_multiple_of(4) + 4 * arrays, 0);
            cdr::decode(&longer).ok()
        };
        (1..=2).find_map(with_empty).ok_or(error)
    })
}

/// A calibration of the sensor block. Topic self_calibration/calibration, reliable, transient local.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Stamp of the sample it was taken at; frame_id of the sensor block.
    pub header: Header,
    /// The values may be used.
    pub valid: bool,
    /// Every estimated state was below its threshold and consistent.
    pub converged: bool,
    /// x, y, z, measured minus true \[rad/s\].
    pub gyroscope_drift: [f64; 3],
    /// Its 1 sigma; -1 where not known \[rad/s\].
    pub gyroscope_drift_std: [f64; 3],
    /// x, y, z, measured minus true \[m/s²\].
    pub accelerometer_bias: [f64; 3],
    /// Its 1 sigma; -1 where not known \[m/s²\].
    pub accelerometer_bias_std: [f64; 3],
    /// K_g, row-major: scale factors on the diagonal, installation angles (rad) off it.
    pub gyroscope_matrix: [f64; 9],
    /// Its 1 sigma, row-major; -1 where not known.
    pub gyroscope_matrix_std: [f64; 9],
    /// K_a, row-major, lower triangle.
    pub accelerometer_matrix: [f64; 9],
    /// Its 1 sigma, row-major; -1 where not known.
    pub accelerometer_matrix_std: [f64; 9],
    /// Turns vectors of the block into East-North-Up.
    pub attitude: Quaternion,
    /// Of the misalignment about East, North, Up, row-major \[rad²\].
    pub attitude_covariance: [f64; 9],
    /// WGS-84, north positive \[deg\].
    pub latitude_deg: f64,
    /// WGS-84, east positive \[deg\].
    pub longitude_deg: f64,
    /// Above the ellipsoid \[m\].
    pub height_m: f64,
    /// Names of the states, in order.
    pub state_names: Vec<String>,
    /// Row-major, square of the length of state_names, or empty; a variance of 0 stands for what was not estimated.
    pub covariance: Vec<f64>,
    /// A phase of SelfCalibrationEstimate.
    pub phase: u8,
    /// Mean normalised innovation squared over the last window; -1 where not known.
    pub nis_mean: f64,
    /// IMU samples it rests on.
    pub samples: u64,
    /// Times that their stamps jumped.
    pub gaps: u64,
    /// From the first sample to the newest \[s\].
    pub duration: f64,
    /// What made it: a node, a file, ground truth.
    pub source: String,
    /// As many as state_names: errors of sensors and table, zero where fed back; empty stands for zeros.
    pub state: Vec<f64>,
}

impl Calibration {
    /// Reads a payload of a bag; in one of the time before `state` was there, it is empty.
    ///
    /// # Errors
    /// Why it is no calibration.
    pub fn from_cdr(payload: &[u8]) -> Result<Self, cdr::Error> {
        of_bag(payload)
    }

    /// Errors by the names of their states.
    pub fn named_states(&self) -> impl Iterator<Item = (&str, f64)> {
        let names = self.state_names.iter().map(String::as_str);
        names.zip(self.state.iter().copied())
    }
}

ros_message!(
    SchemeStatus,
    "rotary_sins_msgs/msg/SchemeStatus",
    include_str!("../msg/SchemeStatus.msg"),
    "RIHS01_d6f2b7a256d5fa06a8d7d1e18bf905a3072bae3034904ab3b5f1cbf44c3a5fa2",
    [Header]
);
ros_message!(
    SelfCalibrationEstimate,
    "rotary_sins_msgs/msg/SelfCalibrationEstimate",
    include_str!("../msg/SelfCalibrationEstimate.msg"),
    "RIHS01_3aa579601c117b1d06e882d8cd638d8731c836f0d7e062335868f254c16c5089",
    [Header, Quaternion]
);
ros_message!(
    CalibrationOutlook,
    "rotary_sins_msgs/msg/CalibrationOutlook",
    include_str!("../msg/CalibrationOutlook.msg"),
    "RIHS01_4d88042d161325c6b64b02c2a4289e56ae9e6acc6a875dc77e760eb639303177",
    [Header]
);
ros_message!(
    Calibration,
    "rotary_sins_msgs/msg/Calibration",
    include_str!("../msg/Calibration.msg"),
    "RIHS01_62f6061a680bc303bf5679fbeaf219143cb789b3f3290a5a5e5e3a43c06b5fb6",
    [Header, Quaternion]
);

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A payload from before the last array was there is read with that array empty, whatever the length of the text before it;
    /// one that ends earlier is refused.
    #[test]
    fn older_records_are_read() {
        for source in ["", "a", "ab", "abc", "abcd"] {
            let calibration = Calibration {
                source: source.to_owned(),
                samples: 7,
                ..Calibration::default()
            };
            let mut payload = Vec::new();
            cdr::encode(&calibration, &mut payload).unwrap();
            assert_eq!(Calibration::from_cdr(&payload).unwrap(), calibration);
            // Behind the text, its end and what brings the length to its place.
            let older = payload.len() - 4 - (4 - (source.len() + 1) % 4) % 4;
            assert_eq!(
                Calibration::from_cdr(&payload[..older]).unwrap(),
                calibration
            );
            let cut_off = &payload[..older - source.len() - 9];
            assert!(Calibration::from_cdr(cut_off).is_err());
        }
    }
}
