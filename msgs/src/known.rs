//! Every message type of this crate, by name, for tools that learn the type of a topic at run time.

use crate::{
    RosMessage, SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult, control_msgs,
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

/// Hands every message type that topics carry to a macro: `with_known_types!(name)` becomes `name!(Type, Type, ...)`, and
/// `with_known_types!(name, value)` becomes `name!(value, Type, Type, ...)`. The list stands here and nowhere else.
#[macro_export]
macro_rules! with_known_types {
    ($macro:ident $(, $first:ident)?) => {
        $macro![
            $($first,)?
            $crate::builtin_interfaces::Time,
            $crate::builtin_interfaces::Duration,
            $crate::std_msgs::Header,
            $crate::std_msgs::String,
            $crate::geometry_msgs::Vector3,
            $crate::geometry_msgs::Vector3Stamped,
            $crate::geometry_msgs::Point,
            $crate::geometry_msgs::Quaternion,
            $crate::geometry_msgs::QuaternionStamped,
            $crate::geometry_msgs::Pose,
            $crate::geometry_msgs::PoseStamped,
            $crate::geometry_msgs::PoseWithCovariance,
            $crate::geometry_msgs::PoseWithCovarianceStamped,
            $crate::geometry_msgs::Twist,
            $crate::geometry_msgs::TwistStamped,
            $crate::geometry_msgs::TwistWithCovariance,
            $crate::geometry_msgs::TwistWithCovarianceStamped,
            $crate::geometry_msgs::Transform,
            $crate::geometry_msgs::TransformStamped,
            $crate::sensor_msgs::Imu,
            $crate::sensor_msgs::JointState,
            $crate::sensor_msgs::NavSatStatus,
            $crate::sensor_msgs::NavSatFix,
            $crate::nav_msgs::Odometry,
            $crate::trajectory_msgs::JointTrajectoryPoint,
            $crate::trajectory_msgs::JointTrajectory,
            $crate::trajectory_msgs::MultiDOFJointTrajectoryPoint,
            $crate::trajectory_msgs::MultiDOFJointTrajectory,
            $crate::control_msgs::JointTolerance,
            $crate::control_msgs::JointComponentTolerance,
            $crate::tf2_msgs::TFMessage,
            $crate::rosgraph_msgs::Clock,
            $crate::diagnostic_msgs::KeyValue,
            $crate::diagnostic_msgs::DiagnosticStatus,
            $crate::diagnostic_msgs::DiagnosticArray,
            $crate::rcl_interfaces::Log,
            $crate::rcl_interfaces::ParameterValue,
            $crate::rcl_interfaces::Parameter,
            $crate::rcl_interfaces::ParameterEvent,
            $crate::lifecycle_msgs::State,
            $crate::lifecycle_msgs::Transition,
            $crate::lifecycle_msgs::TransitionDescription,
            $crate::lifecycle_msgs::TransitionEvent,
            $crate::SchemeStatus,
            $crate::SelfCalibrationEstimate,
            $crate::Calibration,
        ]
    };
}

macro_rules! list {
    ($($type:ty),* $(,)?) => { &[$(known::<$type>()),*] };
}

/// All message types of this crate that topics carry.
pub const KNOWN_TYPES: &[KnownType] = with_known_types!(list);

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
