//! The standard states of a managed node and the transitions between them (REP-2005's design, as rcl_lifecycle has it).

use ros2_interfaces::lifecycle_msgs::{State, Transition, TransitionDescription};

/// A state by its number in `lifecycle_msgs/msg/State`.
pub(super) type StateId = u8;

/// All states in the order in which rcl_lifecycle lists them.
pub(super) const STATES: [(StateId, &str); 11] = [
    (State::UNKNOWN, "unknown"),
    (State::UNCONFIGURED, "unconfigured"),
    (State::INACTIVE, "inactive"),
    (State::ACTIVE, "active"),
    (State::FINALIZED, "finalized"),
    (State::CONFIGURING, "configuring"),
    (State::CLEANINGUP, "cleaningup"),
    (State::SHUTTINGDOWN, "shuttingdown"),
    (State::ACTIVATING, "activating"),
    (State::DEACTIVATING, "deactivating"),
    (State::ERRORPROCESSING, "errorprocessing"),
];

const SUCCESS: &str = "transition_success";
const FAILURE: &str = "transition_failure";
const ERROR: &str = "transition_error";

/// All transitions: number, name, where it begins, where it ends.
#[rustfmt::skip]
pub(super) const TRANSITIONS: [(u8, &str, StateId, StateId); 25] = [
    (Transition::CONFIGURE, "configure", State::UNCONFIGURED, State::CONFIGURING),
    (Transition::ON_CONFIGURE_SUCCESS, SUCCESS, State::CONFIGURING, State::INACTIVE),
    (Transition::ON_CONFIGURE_FAILURE, FAILURE, State::CONFIGURING, State::UNCONFIGURED),
    (Transition::ON_CONFIGURE_ERROR, ERROR, State::CONFIGURING, State::ERRORPROCESSING),
    (Transition::CLEANUP, "cleanup", State::INACTIVE, State::CLEANINGUP),
    (Transition::ON_CLEANUP_SUCCESS, SUCCESS, State::CLEANINGUP, State::UNCONFIGURED),
    (Transition::ON_CLEANUP_FAILURE, FAILURE, State::CLEANINGUP, State::INACTIVE),
    (Transition::ON_CLEANUP_ERROR, ERROR, State::CLEANINGUP, State::ERRORPROCESSING),
    (Transition::ACTIVATE, "activate", State::INACTIVE, State::ACTIVATING),
    (Transition::ON_ACTIVATE_SUCCESS, SUCCESS, State::ACTIVATING, State::ACTIVE),
    (Transition::ON_ACTIVATE_FAILURE, FAILURE, State::ACTIVATING, State::INACTIVE),
    (Transition::ON_ACTIVATE_ERROR, ERROR, State::ACTIVATING, State::ERRORPROCESSING),
    (Transition::DEACTIVATE, "deactivate", State::ACTIVE, State::DEACTIVATING),
    (Transition::ON_DEACTIVATE_SUCCESS, SUCCESS, State::DEACTIVATING, State::INACTIVE),
    (Transition::ON_DEACTIVATE_FAILURE, FAILURE, State::DEACTIVATING, State::ACTIVE),
    (Transition::ON_DEACTIVATE_ERROR, ERROR, State::DEACTIVATING, State::ERRORPROCESSING),
    (Transition::UNCONFIGURED_SHUTDOWN, "shutdown", State::UNCONFIGURED, State::SHUTTINGDOWN),
    (Transition::INACTIVE_SHUTDOWN, "shutdown", State::INACTIVE, State::SHUTTINGDOWN),
    (Transition::ACTIVE_SHUTDOWN, "shutdown", State::ACTIVE, State::SHUTTINGDOWN),
    (Transition::ON_SHUTDOWN_SUCCESS, SUCCESS, State::SHUTTINGDOWN, State::FINALIZED),
    (Transition::ON_SHUTDOWN_FAILURE, FAILURE, State::SHUTTINGDOWN, State::FINALIZED),
    (Transition::ON_SHUTDOWN_ERROR, ERROR, State::SHUTTINGDOWN, State::ERRORPROCESSING),
    (Transition::ON_ERROR_SUCCESS, SUCCESS, State::ERRORPROCESSING, State::UNCONFIGURED),
    (Transition::ON_ERROR_FAILURE, FAILURE, State::ERRORPROCESSING, State::FINALIZED),
    (Transition::ON_ERROR_ERROR, ERROR, State::ERRORPROCESSING, State::FINALIZED),
];

/// A state as messages have it.
pub(super) fn state(id: StateId) -> State {
    let label = STATES.iter().find(|(known, _)| *known == id);
    State {
        id,
        label: label.map_or("unknown", |(_, label)| label).to_owned(),
    }
}

/// A transition as messages have it.
pub(super) fn description(
    &(id, label, start, goal): &(u8, &str, StateId, StateId),
) -> TransitionDescription {
    TransitionDescription {
        transition: Transition {
            id,
            label: label.to_owned(),
        },
        start_state: state(start),
        goal_state: state(goal),
    }
}

/// The transition of this number that begins at `from`.
pub(super) fn transition(from: StateId, id: u8) -> Option<TransitionDescription> {
    let of = |t: &&(u8, &str, StateId, StateId)| t.0 == id && t.2 == from;
    TRANSITIONS.iter().find(of).map(description)
}

/// What a request means at `from`: by its number, or by its name where the number is 0, as rclcpp reads it. Outcomes of
/// steps cannot be asked for.
pub(super) fn requested(from: StateId, wanted: &Transition) -> Option<TransitionDescription> {
    const PUBLIC: u8 = 10;
    let of = |t: &&(u8, &str, StateId, StateId)| {
        t.2 == from
            && t.0 < PUBLIC
            && if wanted.id == 0 {
                t.1 == wanted.label
            } else {
                t.0 == wanted.id
            }
    };
    TRANSITIONS.iter().find(of).map(description)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A request goes by number, without one by name, and only from where the transition begins.
    #[test]
    fn requests_are_read_as_rclcpp_reads_them() {
        let wanted = |id, label: &str| Transition {
            id,
            label: label.to_owned(),
        };
        let goal = |from, wanted: &Transition| requested(from, wanted).map(|t| t.goal_state.label);
        assert_eq!(
            goal(State::UNCONFIGURED, &wanted(1, "")).unwrap(),
            "configuring"
        );
        assert_eq!(
            goal(State::ACTIVE, &wanted(0, "shutdown")).unwrap(),
            "shuttingdown"
        );
        assert_eq!(goal(State::ACTIVE, &wanted(1, "configure")), None);
        assert_eq!(goal(State::CONFIGURING, &wanted(10, "")), None);
    }
}
