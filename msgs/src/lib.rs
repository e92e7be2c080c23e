//! ROS 2 messages of the rotary SINS suite, as serde structures in the order of their fields, so that CDR reads and
//! writes them as ROS 2 does; with the `ros2msg` text and the type hash of each.
//!
//! One module per package. SI units: rad, rad/s, m, m/s, m/s², s; latitude and longitude in degrees, as
//! `sensor_msgs/NavSatFix` has them. Covariances are row-major.
//!
//! Features: `dds` implements `ros2_client::Message` for every type; `sins` adds `convert`, the one place where a
//! message becomes a sample of the mathematics.

pub mod builtin_interfaces;
pub mod control_msgs;
#[cfg(feature = "sins")]
pub mod convert;
#[cfg(feature = "sins")]
mod convert_simulation;
pub mod diagnostic_msgs;
pub mod geometry_msgs;
mod interfaces;
mod known;
pub mod lifecycle_msgs;
mod message;
pub mod nav_msgs;
pub mod rcl_interfaces;
pub mod rosgraph_msgs;
mod self_calibrate;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod std_srvs;
pub mod tf2_msgs;
pub mod trajectory_msgs;
mod type_description;
pub mod type_description_interfaces;

pub use interfaces::{Calibration, SchemeStatus, SelfCalibrationEstimate};
pub use known::{ACTION_PARTS, KNOWN_TYPES, KnownType, known_type};
pub use message::RosMessage;
pub(crate) use message::{action_part, ros_message, ros_service_part};
pub use self_calibrate::{SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult};
pub use type_description::{type_description, type_sources};
