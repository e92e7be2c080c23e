//! The messages and the action of the rotary SINS suite, as serde structures with their `ros2msg` text and type hash,
//! and what the mathematics makes of messages.
//!
//! [`interfaces`] is the one list of topics, services and actions with their quality of service.
//!
//! The standard messages, the trait of a message and the registry of types are those of [`ros2_interfaces`].
//!
//! Features: `dds` implements `ros2_client::Message` for every type; `sins` adds `convert`, the one place where a
//! message becomes a sample of the mathematics.

#[cfg(feature = "sins")]
pub mod convert;
#[cfg(feature = "sins")]
mod convert_simulation;
pub mod interfaces;
mod known;
mod messages;
mod self_calibrate;

pub use known::{KNOWN_TYPES, known_type, register, registry};
pub use messages::{Calibration, CalibrationOutlook, SchemeStatus, SelfCalibrationEstimate};
pub use self_calibrate::{SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult};

/// For the macros of this crate.
#[doc(hidden)]
pub use ros2_interfaces;
