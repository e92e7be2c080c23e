//! Motions of joints.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Duration;
use crate::geometry_msgs::{Transform, Twist};
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

/// Where joints of several degrees of freedom are to be, and when. The suite's table has none; the type is a part of others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MultiDOFJointTrajectoryPoint {
    /// Poses of the joints \[m\].
    pub transforms: Vec<Transform>,
    /// Velocities \[m/s, rad/s\].
    pub velocities: Vec<Twist>,
    /// Accelerations \[m/s², rad/s²\].
    pub accelerations: Vec<Twist>,
    /// From the start of the trajectory.
    pub time_from_start: Duration,
}

/// A motion of joints of several degrees of freedom.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MultiDOFJointTrajectory {
    /// When it starts; zero means: on arrival.
    pub header: Header,
    /// Names of the joints.
    pub joint_names: Vec<String>,
    /// The points in order of time.
    pub points: Vec<MultiDOFJointTrajectoryPoint>,
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
ros_message!(
    MultiDOFJointTrajectoryPoint,
    "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
    include_str!("../definitions/trajectory_msgs/MultiDOFJointTrajectoryPoint.msg"),
    "RIHS01_6ada1085b5ee64eaa069b074968e69f0e27c8c5e6f5bb0586dd1c834ef0e32b8",
    [Transform, Twist, Duration]
);
ros_message!(
    MultiDOFJointTrajectory,
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    include_str!("../definitions/trajectory_msgs/MultiDOFJointTrajectory.msg"),
    "RIHS01_3a18fd095292a65cfde8833c72985a30af981f3ec44494655c6267262b443a4a",
    [Header, MultiDOFJointTrajectoryPoint]
);
