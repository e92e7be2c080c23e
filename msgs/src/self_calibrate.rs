//! The action of the calibrator.

use serde::{Deserialize, Serialize};

use ros2_interfaces::std_msgs::Header;
use ros2_interfaces::{action_part, ros_message};

use crate::Calibration;

/// What is asked of a calibration. Action ~/self_calibrate of the calibrator.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SelfCalibrateGoal {
    /// The scheme that must be running; empty: whatever happens.
    pub scheme: String,
    /// 1 sigma below which the azimuth counts as found; 0 or negative: as the node's parameters say \[rad\].
    pub azimuth_threshold: f64,
    /// The same about East and about North \[rad\].
    pub level_threshold: f64,
    /// The same of each axis' drift \[rad/s\].
    pub gyroscope_drift_threshold: f64,
    /// The same of each axis' bias \[m/s²\].
    pub accelerometer_bias_threshold: f64,
    /// Of sample time, from the first sample after the goal was accepted; 0: none \[s\].
    pub time_limit: f64,
    /// Forget the estimate and begin with coarse alignment.
    pub restart: bool,
}

impl SelfCalibrateGoal {
    /// Type of the action, for servers and clients.
    pub const ACTION: &str = "rotary_sins_msgs/action/SelfCalibrate";
}

/// How it ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SelfCalibrateResult {
    /// One of the constants.
    pub code: u8,
    /// One line for a person.
    pub message: String,
    /// The last good one; `valid` is false where there never was an estimate.
    pub calibration: Calibration,
}

impl SelfCalibrateResult {
    /// Every sigma is below its threshold, and the innovations agree.
    pub const CONVERGED: u8 = 0;
    /// The time limit came first.
    pub const TIME_LIMIT: u8 = 1;
    /// On request; the calibrator goes on.
    pub const CANCELED: u8 = 2;
    /// Another scheme runs than the goal names, or it came to its end without convergence.
    pub const WRONG_SCHEME: u8 = 3;
    /// The node ended.
    pub const SHUTDOWN: u8 = 4;
    /// The samples of the IMU stopped, or never came.
    pub const NO_SAMPLES: u8 = 5;
}

/// How far it has come.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SelfCalibrateFeedback {
    /// Stamp of the sample it stands at; frame_id of the sensor block.
    pub header: Header,
    /// A phase of SelfCalibrationEstimate.
    pub phase: u8,
    /// Its name.
    pub phase_name: String,
    /// Of sample time since the goal began \[s\].
    pub elapsed: f64,
    /// 0 to 1: of coarse alignment while it lasts, then the least of threshold over sigma.
    pub progress: f64,
    /// 1 sigma about East, North, Up; -1 where not known \[rad\].
    pub misalignment_std: [f64; 3],
    /// 1 sigma of x, y, z; -1 where not known \[rad/s\].
    pub gyroscope_drift_std: [f64; 3],
    /// 1 sigma of x, y, z; -1 where not known \[m/s²\].
    pub accelerometer_bias_std: [f64; 3],
    /// As scheme/status tells it; empty where it does not come.
    pub scheme: String,
    /// Counts from 0.
    pub scheme_cycle: u32,
    /// Counts from 0.
    pub scheme_step: u32,
    /// One line for a person.
    pub message: String,
}

const ACTION: &str = include_str!("../action/SelfCalibrate.action");

ros_message!(
    SelfCalibrateGoal,
    "rotary_sins_msgs/action/SelfCalibrate_Goal",
    action_part(ACTION, 0),
    "RIHS01_5d96ac5a6d93aa00dc931893017e796d4a2edd1f9eb20544b149761cffc0a093",
    []
);
ros_message!(
    SelfCalibrateResult,
    "rotary_sins_msgs/action/SelfCalibrate_Result",
    action_part(ACTION, 1),
    "RIHS01_97e88456a786e62e0e1816ac1f37f0a18b08826b1ed19054532e77c6bcb669c3",
    [Calibration]
);
ros_message!(
    SelfCalibrateFeedback,
    "rotary_sins_msgs/action/SelfCalibrate_Feedback",
    action_part(ACTION, 2),
    "RIHS01_b0b31357b861b8fbd65579799daec2098c1d53143e390020f0793341ca801589",
    [Header]
);
