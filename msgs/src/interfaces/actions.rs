//! Actions.

use ros2_interfaces::control_msgs::{
    FOLLOW_JOINT_TRAJECTORY as FOLLOW_JOINT_TRAJECTORY_TYPE, FollowJointTrajectoryFeedback,
    FollowJointTrajectoryGoal, FollowJointTrajectoryResult,
};
use ros2_interfaces::{Action, Interface};

use crate::{SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult};

/// The table's action. The sequencer reads only the head of the feedback, which every version of control_msgs has.
pub const FOLLOW_JOINT_TRAJECTORY: Action<
    FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult,
    FollowJointTrajectoryFeedback,
> = Action::new(
    "turntable/follow_joint_trajectory",
    FOLLOW_JOINT_TRAJECTORY_TYPE,
    "`scheme_sequencer` with `table_interface: action`",
    "table driver or `imu_simulator`",
    "One rotation, with its result",
);

/// The calibrator's action.
pub const SELF_CALIBRATE: Action<SelfCalibrateGoal, SelfCalibrateResult, SelfCalibrateFeedback> =
    Action::new(
        "~/self_calibrate",
        SelfCalibrateGoal::ACTION,
        "whoever waits for a calibration",
        "`self_calibrator`",
        "Calibrates until the sigmas that the goal asks for are reached",
    );

/// The rows of all actions.
pub const ALL: &[Interface] = &[FOLLOW_JOINT_TRAJECTORY.row(), SELF_CALIBRATE.row()];
