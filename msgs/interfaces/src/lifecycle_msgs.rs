//! States of a managed node and what leads from one to another.

use serde::{Deserialize, Serialize};

use crate::{ros_message, ros_service_part};

/// A state of a managed node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct State {
    /// One of the constants.
    pub id: u8,
    /// Its name.
    pub label: String,
}

#[rustfmt::skip]
#[allow(missing_docs, reason = "the names are those of the standard and say it")]
impl State {
    pub const UNKNOWN: u8 = 0;
    pub const UNCONFIGURED: u8 = 1;
    pub const INACTIVE: u8 = 2;
    pub const ACTIVE: u8 = 3;
    pub const FINALIZED: u8 = 4;
    pub const CONFIGURING: u8 = 10;
    pub const CLEANINGUP: u8 = 11;
    pub const SHUTTINGDOWN: u8 = 12;
    pub const ACTIVATING: u8 = 13;
    pub const DEACTIVATING: u8 = 14;
    pub const ERRORPROCESSING: u8 = 15;
}

/// What leads from one state to another: asked for from outside (ids below 10), or the outcome of such a step.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Transition {
    /// One of the constants.
    pub id: u8,
    /// Its name; in a request with id 0 it is what counts.
    pub label: String,
}

#[rustfmt::skip]
#[allow(missing_docs, reason = "the names are those of the standard and say it")]
impl Transition {
    pub const CREATE: u8 = 0;
    pub const CONFIGURE: u8 = 1;
    pub const CLEANUP: u8 = 2;
    pub const ACTIVATE: u8 = 3;
    pub const DEACTIVATE: u8 = 4;
    pub const UNCONFIGURED_SHUTDOWN: u8 = 5;
    pub const INACTIVE_SHUTDOWN: u8 = 6;
    pub const ACTIVE_SHUTDOWN: u8 = 7;
    pub const ON_CONFIGURE_SUCCESS: u8 = 10;
    pub const ON_CONFIGURE_FAILURE: u8 = 11;
    pub const ON_CONFIGURE_ERROR: u8 = 12;
    pub const ON_CLEANUP_SUCCESS: u8 = 20;
    pub const ON_CLEANUP_FAILURE: u8 = 21;
    pub const ON_CLEANUP_ERROR: u8 = 22;
    pub const ON_ACTIVATE_SUCCESS: u8 = 30;
    pub const ON_ACTIVATE_FAILURE: u8 = 31;
    pub const ON_ACTIVATE_ERROR: u8 = 32;
    pub const ON_DEACTIVATE_SUCCESS: u8 = 40;
    pub const ON_DEACTIVATE_FAILURE: u8 = 41;
    pub const ON_DEACTIVATE_ERROR: u8 = 42;
    pub const ON_SHUTDOWN_SUCCESS: u8 = 50;
    pub const ON_SHUTDOWN_FAILURE: u8 = 51;
    pub const ON_SHUTDOWN_ERROR: u8 = 52;
    pub const ON_ERROR_SUCCESS: u8 = 60;
    pub const ON_ERROR_FAILURE: u8 = 61;
    pub const ON_ERROR_ERROR: u8 = 62;
}

/// A transition with the states at its ends.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransitionDescription {
    /// The transition.
    pub transition: Transition,
    /// Where it begins.
    pub start_state: State,
    /// Where it ends.
    pub goal_state: State,
}

/// A transition that took place. Topic `~/transition_event`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransitionEvent {
    /// When \[ns\].
    pub timestamp: u64,
    /// Which.
    pub transition: Transition,
    /// Where it began.
    pub start_state: State,
    /// Where it ended.
    pub goal_state: State,
}

/// Request of `lifecycle_msgs/srv/ChangeState`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangeStateRequest {
    /// What is wanted.
    pub transition: Transition,
}

/// Response of `lifecycle_msgs/srv/ChangeState`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangeStateResponse {
    /// The transition took place and succeeded.
    pub success: bool,
}

/// Request of the services that only ask; CDR has no empty structure, so one byte stands in its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EmptyRequest {
    /// Always zero.
    pub structure_needs_at_least_one_member: u8,
}

/// Response of `lifecycle_msgs/srv/GetState`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetStateResponse {
    /// Where the node stands.
    pub current_state: State,
}

/// Response of `lifecycle_msgs/srv/GetAvailableStates`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetAvailableStatesResponse {
    /// All states there are.
    pub available_states: Vec<State>,
}

/// Response of `lifecycle_msgs/srv/GetAvailableTransitions`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetAvailableTransitionsResponse {
    /// Those that start at the current state, or all of them in `~/get_transition_graph`.
    pub available_transitions: Vec<TransitionDescription>,
}

ros_message!(
    State,
    "lifecycle_msgs/msg/State",
    include_str!("../definitions/lifecycle_msgs/State.msg"),
    "RIHS01_dd2d02b82f3ebc858e53c431b1e6e91f3ffc71436fc81d0715214ac6ee2107a0",
    []
);
ros_message!(
    Transition,
    "lifecycle_msgs/msg/Transition",
    include_str!("../definitions/lifecycle_msgs/Transition.msg"),
    "RIHS01_c65d7b31ea134cba4f54fc867b817979be799f7452035cd35fac9b7421fb3424",
    []
);
ros_message!(
    TransitionDescription,
    "lifecycle_msgs/msg/TransitionDescription",
    include_str!("../definitions/lifecycle_msgs/TransitionDescription.msg"),
    "RIHS01_c5f1cd4bb1ad2ba0e3329d4ac7015c52a674a72c1faf7974c37a33f4f6048b28",
    [Transition, State]
);
ros_message!(
    TransitionEvent,
    "lifecycle_msgs/msg/TransitionEvent",
    include_str!("../definitions/lifecycle_msgs/TransitionEvent.msg"),
    "RIHS01_d5f8873a2f0146498f812d7885c7327ce27e463d36811d8792f35ee38c0d6c38",
    [Transition, State]
);
ros_service_part!(ChangeStateRequest);
ros_service_part!(ChangeStateResponse);
ros_service_part!(EmptyRequest);
ros_service_part!(GetStateResponse);
ros_service_part!(GetAvailableStatesResponse);
ros_service_part!(GetAvailableTransitionsResponse);
