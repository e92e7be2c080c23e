//! Requests without data, and switches.

use serde::{Deserialize, Serialize};

use crate::ros_service_part;

/// Name of the type of [`TriggerRequest`] and [`TriggerResponse`].
pub const TRIGGER: &str = "std_srvs/srv/Trigger";

/// Asks a node to do the one thing the service is for.
///
/// CDR has no empty structure: rosidl puts one byte in its place, and so does this type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// Always zero.
    pub structure_needs_at_least_one_member: u8,
}

/// Whether it was done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// It was done.
    pub success: bool,
    /// How, or why not.
    pub message: String,
}

/// Asks a node to switch something on or off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetBoolRequest {
    /// On or off.
    pub data: bool,
}

/// Whether it was switched.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetBoolResponse {
    /// It was switched.
    pub success: bool,
    /// How, or why not.
    pub message: String,
}

ros_service_part!(TriggerRequest);
ros_service_part!(TriggerResponse);
ros_service_part!(SetBoolRequest);
ros_service_part!(SetBoolResponse);
