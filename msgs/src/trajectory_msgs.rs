//! Motions of joints.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Duration;
use crate::ros_message;
use crate::std_msgs::Header;

/// Where the joints are to be, and when; in the order of the trajectory's names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointTrajectoryPoint {
    /// Angles \[rad\].
    pub positions: Vec<f64>,
    /// Rates \[rad/s\].
    pub velocities: Vec<f64>,
    /// Angular accelerations \[rad/s²\].
    pub accelerations: Vec<f64>,
    /// Torques \[N m\].
    pub effort: Vec<f64>,
    /// From the start of the trajectory.
    pub time_from_start: Duration,
}

/// A motion of joints, point by point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointTrajectory {
    /// When it starts; zero means: on arrival.
    pub header: Header,
    /// Names of the joints.
    pub joint_names: Vec<String>,
    /// The points in order of time.
    pub points: Vec<JointTrajectoryPoint>,
}

ros_message!(
    JointTrajectoryPoint,
    "trajectory_msgs/msg/JointTrajectoryPoint",
    include_str!("../definitions/trajectory_msgs/JointTrajectoryPoint.msg"),
    "RIHS01_de8907036d8bd45aac6f30cc9044a3d4a329c42cbf719aff7d95a584cfa532d7",
    [Duration]
);
ros_message!(
    JointTrajectory,
    "trajectory_msgs/msg/JointTrajectory",
    include_str!("../definitions/trajectory_msgs/JointTrajectory.msg"),
    "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
    [Header, JointTrajectoryPoint]
);
