//! Types by name, for nodes and tools that learn the type of a topic at run time.

use std::collections::BTreeMap;

use crate::RosMessage;

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
    /// What is known of a message that is a structure here.
    pub const fn of<M: RosMessage>() -> Self {
        Self {
            name: M::TYPE_NAME,
            hash: M::TYPE_HASH,
            definition: M::DEFINITION,
            schema: M::schema,
        }
    }

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

/// The types that a program knows by name. A program fills it with those that it uses; no crate has a closed list.
#[derive(Clone, Debug, Default)]
pub struct Registry {
    types: BTreeMap<&'static str, KnownType>,
}

/// Why a type cannot be registered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RegistryError {
    /// Another type of this name is there.
    #[error("{name} is registered with the hash {there}, and cannot be registered with {new} too")]
    Conflict {
        /// Full name.
        name: &'static str,
        /// Hash of the one that is there.
        there: &'static str,
        /// Hash of the new one.
        new: &'static str,
    },
    /// The hash of a type is not the one of its definition.
    #[error("{name} says that its hash is {declared}, but its definition has {computed}")]
    Hash {
        /// Full name.
        name: &'static str,
        /// What it says.
        declared: &'static str,
        /// By REP-2011.
        computed: String,
    },
}

impl Registry {
    /// Knows nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Knows every message of this crate that topics carry, and the parts of its actions.
    pub fn standard() -> Self {
        let mut registry = Self::new();
        for known in STANDARD_TYPES {
            registry.types.insert(known.name, *known);
        }
        registry
    }

    /// Adds a type and all it is made of. One that is there already is left as it is.
    ///
    /// # Errors
    /// [`RegistryError`]: another type of this name, or a hash that is not the definition's. Nothing is added then.
    pub fn register<M: RosMessage>(&mut self) -> Result<(), RegistryError> {
        let mut new = vec![KnownType::of::<M>()];
        M::collect_parts(&mut new);
        for known in &new {
            if let Some(there) = self.get(known.name)
                && there.hash != known.hash
            {
                return Err(RegistryError::Conflict {
                    name: known.name,
                    there: there.hash,
                    new: known.hash,
                });
            }
        }
        let before = self.types.clone();
        self.types
            .extend(new.iter().map(|known| (known.name, *known)));
        for known in new {
            let computed = self.description(known.name).map(|d| crate::type_hash(&d));
            if let Some(computed) = computed.filter(|computed| computed != known.hash) {
                self.types = before;
                return Err(RegistryError::Hash {
                    name: known.name,
                    declared: known.hash,
                    computed,
                });
            }
        }
        Ok(())
    }

    /// The type of this full name (`package/msg/Type`).
    pub fn get(&self, name: &str) -> Option<&KnownType> {
        self.types.get(name)
    }

    /// All of them, by name.
    pub fn iter(&self) -> impl Iterator<Item = &KnownType> {
        self.types.values()
    }
}

/// Hands every message type of this crate that topics carry to a macro: `with_standard_types!(name)` becomes
/// `name!(Type, Type, ...)`, and `with_standard_types!(name, value; More, ...)` becomes `name!(value, Type, Type, ...,
/// More, ...)`. The list stands here and nowhere else.
#[macro_export]
macro_rules! with_standard_types {
    ($macro:ident $(, $first:ident)? $(; $($more:ty),* $(,)?)?) => {
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
            $crate::compass_interfaces::Azimuth,
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
            $($($more,)*)?
        ]
    };
}

macro_rules! list {
    ($($type:ty),* $(,)?) => { &[
        $(KnownType::of::<$type>(),)*
        KnownType::of::<crate::control_msgs::FollowJointTrajectoryGoal>(),
        KnownType::of::<crate::control_msgs::FollowJointTrajectoryResult>(),
        KnownType::of::<crate::control_msgs::FollowJointTrajectoryFeedback>(),
    ] };
}

const STANDARD_TYPES: &[KnownType] = with_standard_types!(list);
