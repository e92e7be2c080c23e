//! The action of a ros2_control `joint_trajectory_controller`.
//!
//! The fields are those of control_msgs 3.0 to 6.2 (Humble, Jazzy, Kilted at its release). 6.3 puts indices of the point
//! under way into the feedback, behind `error`; what stands before is the same in all of them, and
//! [`FollowJointTrajectoryProgress`] is just that.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Duration;
use crate::std_msgs::Header;
use crate::trajectory_msgs::{
    JointTrajectory, JointTrajectoryPoint, MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint,
};
use crate::{action_part, ros_message, ros_service_part};

/// Type of the action, for servers and clients.
pub const FOLLOW_JOINT_TRAJECTORY: &str = "control_msgs/action/FollowJointTrajectory";

/// How far a joint may be from where it should be. 0: the controller's own tolerance; negative: no tolerance at all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointTolerance {
    /// The joint.
    pub name: String,
    /// Of the angle \[rad\].
    pub position: f64,
    /// Of the rate \[rad/s\].
    pub velocity: f64,
    /// Of the angular acceleration \[rad/s²\].
    pub acceleration: f64,
}

/// The same for one component of a joint of several degrees of freedom.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointComponentTolerance {
    /// The joint.
    pub joint_name: String,
    /// One of the constants.
    pub component: u16,
    /// Of the position \[m or rad\].
    pub position: f64,
    /// Of the velocity \[m/s or rad/s\].
    pub velocity: f64,
    /// Of the acceleration \[m/s² or rad/s²\].
    pub acceleration: f64,
}

impl JointComponentTolerance {
    /// Along x.
    pub const X_AXIS: u16 = 1;
    /// Along y.
    pub const Y_AXIS: u16 = 2;
    /// Along z.
    pub const Z_AXIS: u16 = 3;
    /// The distance.
    pub const TRANSLATION: u16 = 4;
    /// The angle of rotation.
    pub const ROTATION: u16 = 5;
}

/// A motion, and how closely it is to be followed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FollowJointTrajectoryGoal {
    /// The motion.
    pub trajectory: JointTrajectory,
    /// Of joints of several degrees of freedom; the suite's table has none.
    pub multi_dof_trajectory: MultiDOFJointTrajectory,
    /// On the way.
    pub path_tolerance: Vec<JointTolerance>,
    /// On the way, by component.
    pub component_path_tolerance: Vec<JointComponentTolerance>,
    /// At the end.
    pub goal_tolerance: Vec<JointTolerance>,
    /// At the end, by component.
    pub component_goal_tolerance: Vec<JointComponentTolerance>,
    /// How long after the end of the motion the goal may still be reached; 0: as the controller is set.
    pub goal_time_tolerance: Duration,
}

/// How it ended.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FollowJointTrajectoryResult {
    /// One of the constants.
    pub error_code: i32,
    /// One line for a person.
    pub error_string: String,
}

impl FollowJointTrajectoryResult {
    /// The joints are where they should be.
    pub const SUCCESSFUL: i32 = 0;
    /// The trajectory means nothing, or was stopped.
    pub const INVALID_GOAL: i32 = -1;
    /// The joints are others.
    pub const INVALID_JOINTS: i32 = -2;
    /// The motion would be over already.
    pub const OLD_HEADER_TIMESTAMP: i32 = -3;
    /// A joint left its path.
    pub const PATH_TOLERANCE_VIOLATED: i32 = -4;
    /// A joint did not arrive.
    pub const GOAL_TOLERANCE_VIOLATED: i32 = -5;

    /// What the error code is called, for a person.
    pub fn error_name(&self) -> &'static str {
        match self.error_code {
            Self::SUCCESSFUL => "successful",
            Self::INVALID_GOAL => "invalid goal",
            Self::INVALID_JOINTS => "invalid joints",
            Self::OLD_HEADER_TIMESTAMP => "old header timestamp",
            Self::PATH_TOLERANCE_VIOLATED => "path tolerance violated",
            Self::GOAL_TOLERANCE_VIOLATED => "goal tolerance violated",
            _ => "unknown error",
        }
    }
}

/// Where the joints are on their way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FollowJointTrajectoryFeedback {
    /// Time of the reading.
    pub header: Header,
    /// The joints, in the order of what follows.
    pub joint_names: Vec<String>,
    /// Where they should be.
    pub desired: JointTrajectoryPoint,
    /// Where they are.
    pub actual: JointTrajectoryPoint,
    /// Desired minus actual.
    pub error: JointTrajectoryPoint,
    /// Joints of several degrees of freedom, in the order of what follows.
    pub multi_dof_joint_names: Vec<String>,
    /// Where they should be.
    pub multi_dof_desired: MultiDOFJointTrajectoryPoint,
    /// Where they are.
    pub multi_dof_actual: MultiDOFJointTrajectoryPoint,
    /// Desired minus actual.
    pub multi_dof_error: MultiDOFJointTrajectoryPoint,
}

/// The head of a [`FollowJointTrajectoryFeedback`], which is the same in every version of control_msgs. A client that
/// reads no more than this understands all of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FollowJointTrajectoryProgress {
    /// Time of the reading.
    pub header: Header,
    /// The joints, in the order of what follows.
    pub joint_names: Vec<String>,
    /// Where they should be.
    pub desired: JointTrajectoryPoint,
    /// Where they are.
    pub actual: JointTrajectoryPoint,
    /// Desired minus actual.
    pub error: JointTrajectoryPoint,
}

ros_service_part!(FollowJointTrajectoryProgress);

ros_message!(
    JointTolerance,
    "control_msgs/msg/JointTolerance",
    include_str!("../definitions/control_msgs/JointTolerance.msg"),
    "RIHS01_c254f9cece0f3b733017b6990fd46d1326e25242d6b8844398c97d9a88e7d648",
    []
);
ros_message!(
    JointComponentTolerance,
    "control_msgs/msg/JointComponentTolerance",
    include_str!("../definitions/control_msgs/JointComponentTolerance.msg"),
    "RIHS01_739ea7566931944d33830fa10f1bf5e7a7fbdc3172bce7a7eaac642bd6e3ffa4",
    []
);

const ACTION: &str = include_str!("../definitions/control_msgs/FollowJointTrajectory.action");

ros_message!(
    FollowJointTrajectoryGoal,
    "control_msgs/action/FollowJointTrajectory_Goal",
    action_part(ACTION, 0),
    "RIHS01_8a9060704b269608f5a340934cc26e66869dd14bdac29e2e7fd9ec8b9882d205",
    [
        JointTrajectory,
        MultiDOFJointTrajectory,
        JointTolerance,
        JointComponentTolerance,
        Duration
    ]
);
ros_message!(
    FollowJointTrajectoryResult,
    "control_msgs/action/FollowJointTrajectory_Result",
    action_part(ACTION, 1),
    "RIHS01_8002e99ed2c14c6faa522f2a93c26d744c5982f254f9e98ff9c6f19789bdb220",
    []
);
ros_message!(
    FollowJointTrajectoryFeedback,
    "control_msgs/action/FollowJointTrajectory_Feedback",
    action_part(ACTION, 2),
    "RIHS01_3fd0aaecf71725121ae1ff7f01098a5e0da581e672be18a6b2c286cb43d96b49",
    [Header, JointTrajectoryPoint, MultiDOFJointTrajectoryPoint]
);
