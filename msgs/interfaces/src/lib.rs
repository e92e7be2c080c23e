//! Standard ROS 2 messages, services and actions as serde structures in the order of their fields, so that CDR reads
//! and writes them as ROS 2 does; with the `ros2msg` text, the type hash and the description of each.
//!
//! One module per package. SI units: rad, rad/s, m, m/s, m/s², s; latitude and longitude in degrees, as
//! `sensor_msgs/NavSatFix` has them. Covariances are row-major.
//!
//! Features: `dds` implements `ros2_client::Message` for every type; `nalgebra` adds conversions of vectors and
//! quaternions.

pub mod builtin_interfaces;
pub mod cdr;
pub mod compass_interfaces;
pub mod control_msgs;
pub mod diagnostic_msgs;
pub mod geometry_msgs;
mod interface;
mod known;
pub mod lifecycle_msgs;
mod message;
pub mod nav_msgs;
mod qos;
pub mod rcl_interfaces;
pub mod rosgraph_msgs;
pub mod sensor_msgs;
pub mod standard_topics;
pub mod std_msgs;
pub mod std_srvs;
pub mod tf2_msgs;
pub mod trajectory_msgs;
mod type_description;
pub mod type_description_interfaces;
#[cfg(feature = "nalgebra")]
mod vectors;

pub use interface::{Action, Interface, InterfaceKind, Service, Topic};
pub use known::{KnownType, Registry, RegistryError};
pub use message::{RosMessage, action_part};
pub use qos::{Qos, SENSOR_DEPTH};
pub use type_description::type_hash;

/// For the macros of this crate.
#[cfg(feature = "dds")]
#[doc(hidden)]
pub use ros2_client;

/// The examples of the page are tried.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
