//! Every message type of this crate, by name, for tools that learn the type of a topic at run time.

use crate::{
    RosMessage, SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult, builtin_interfaces,
    control_msgs, diagnostic_msgs, geometry_msgs, interfaces, lifecycle_msgs, nav_msgs,
    rcl_interfaces, rosgraph_msgs, sensor_msgs, std_msgs, tf2_msgs, trajectory_msgs,
};

/// A message type as a tool sees it that has only its name.
#[derive(Clone, Copy, Debug)]
pub struct KnownType {
    /// Full name, e.g. `sensor_msgs/msg/Imu`.
    pub name: &'static str,
    /// REP-2011 hash.
    pub hash: &'static str,
    /// Text of its `.msg` file.
    pub definition: &'static str,
    /// Makes the `ros2msg` text with everything it is made of.
    pub schema: fn() -> String,
}

impl KnownType {
    /// Whether the first eight bytes of a message, behind the encapsulation, are its stamp.
    pub fn begins_with_stamp(&self) -> bool {
        let first = self
            .definition
            .lines()
            .find(|line| !line.is_empty() && !line.starts_with('#') && !line.contains('='));
        first.is_some_and(|field| {
            field.starts_with("std_msgs/Header ") || field.starts_with("builtin_interfaces/Time ")
        })
    }
}

const fn known<M: RosMessage>() -> KnownType {
    KnownType {
        name: M::TYPE_NAME,
        hash: M::TYPE_HASH,
        definition: M::DEFINITION,
        schema: M::schema,
    }
}

/// All message types of this crate that topics carry.
pub const KNOWN_TYPES: &[KnownType] = &[
    known::<builtin_interfaces::Time>(),
    known::<builtin_interfaces::Duration>(),
    known::<std_msgs::Header>(),
    known::<std_msgs::String>(),
    known::<geometry_msgs::Vector3>(),
    known::<geometry_msgs::Vector3Stamped>(),
    known::<geometry_msgs::Point>(),
    known::<geometry_msgs::Quaternion>(),
    known::<geometry_msgs::QuaternionStamped>(),
    known::<geometry_msgs::Pose>(),
    known::<geometry_msgs::PoseStamped>(),
    known::<geometry_msgs::PoseWithCovariance>(),
    known::<geometry_msgs::PoseWithCovarianceStamped>(),
    known::<geometry_msgs::Twist>(),
    known::<geometry_msgs::TwistStamped>(),
    known::<geometry_msgs::TwistWithCovariance>(),
    known::<geometry_msgs::TwistWithCovarianceStamped>(),
    known::<geometry_msgs::Transform>(),
    known::<geometry_msgs::TransformStamped>(),
    known::<sensor_msgs::Imu>(),
    known::<sensor_msgs::JointState>(),
    known::<sensor_msgs::NavSatStatus>(),
    known::<sensor_msgs::NavSatFix>(),
    known::<nav_msgs::Odometry>(),
    known::<trajectory_msgs::JointTrajectoryPoint>(),
    known::<trajectory_msgs::JointTrajectory>(),
    known::<trajectory_msgs::MultiDOFJointTrajectoryPoint>(),
    known::<trajectory_msgs::MultiDOFJointTrajectory>(),
    known::<control_msgs::JointTolerance>(),
    known::<control_msgs::JointComponentTolerance>(),
    known::<tf2_msgs::TFMessage>(),
    known::<rosgraph_msgs::Clock>(),
    known::<diagnostic_msgs::KeyValue>(),
    known::<diagnostic_msgs::DiagnosticStatus>(),
    known::<diagnostic_msgs::DiagnosticArray>(),
    known::<rcl_interfaces::Log>(),
    known::<rcl_interfaces::ParameterValue>(),
    known::<rcl_interfaces::Parameter>(),
    known::<rcl_interfaces::ParameterEvent>(),
    known::<lifecycle_msgs::State>(),
    known::<lifecycle_msgs::Transition>(),
    known::<lifecycle_msgs::TransitionDescription>(),
    known::<lifecycle_msgs::TransitionEvent>(),
    known::<interfaces::SchemeStatus>(),
    known::<interfaces::SelfCalibrationEstimate>(),
    known::<interfaces::Calibration>(),
];

/// Goal, result and feedback of the actions of this crate. They go through an action's own services and topics.
pub const ACTION_PARTS: &[KnownType] = &[
    known::<SelfCalibrateGoal>(),
    known::<SelfCalibrateResult>(),
    known::<SelfCalibrateFeedback>(),
    known::<control_msgs::FollowJointTrajectoryGoal>(),
    known::<control_msgs::FollowJointTrajectoryResult>(),
    known::<control_msgs::FollowJointTrajectoryFeedback>(),
];

/// The type of this full name (`package/msg/Type`), where this crate has it.
pub fn known_type(name: &str) -> Option<&'static KnownType> {
    KNOWN_TYPES.iter().find(|known| known.name == name)
}
