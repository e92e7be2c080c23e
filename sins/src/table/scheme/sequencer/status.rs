//! What a sequencer says: commands, states, refusals.

use crate::table::{Axis, Joint, Trajectory};
use crate::time::Stamp;

/// A motion for the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// When the motion starts; `None`: at once.
    pub start: Option<Stamp>,
    /// The motion; without points: stop where you are.
    pub trajectory: Trajectory,
}

impl Command {
    pub(super) fn hold() -> Self {
        Self {
            start: None,
            trajectory: Trajectory::default(),
        }
    }
}

/// What the sequencer is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing was started.
    Idle,
    /// No joint states yet, or the table is on its way to where the scheme starts or goes on.
    WaitingForTable,
    /// At rest in a position.
    Dwelling,
    /// A rotation is under way.
    Rotating,
    /// The table stands where it is until resumed.
    Paused,
    /// Ended before its time, on request.
    Aborted,
    /// Every cycle is done, or the time given is over.
    Finished,
    /// The table did not follow.
    Fault,
}

impl State {
    /// Whether the scheme neither runs nor can be resumed.
    pub fn is_over(self) -> bool {
        matches!(self, Self::Aborted | Self::Finished | Self::Fault)
    }

    /// Name for a person.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::WaitingForTable => "waiting for the table",
            Self::Dwelling => "dwelling",
            Self::Rotating => "rotating",
            Self::Paused => "paused",
            Self::Aborted => "aborted",
            Self::Finished => "finished",
            Self::Fault => "fault",
        }
    }
}

/// A request that the present state does not permit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cannot {request}: the scheme is {}", state.name())]
pub struct Refused {
    /// What was asked for.
    pub request: &'static str,
    /// The state that forbids it.
    pub state: State,
}

/// A rotation, for a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationStatus {
    /// The joint that turns.
    pub joint: Joint,
    /// Axis of the block, at zero joint angles, about which it turns.
    pub axis: Axis,
    /// Angle, counter-clockwise positive \[rad\].
    pub angle_rad: f64,
}

/// Where the scheme stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// Stamp of the last joint state; zero before the first.
    pub stamp: Stamp,
    /// Name of the scheme.
    pub scheme: String,
    /// What the sequencer is doing.
    pub state: State,
    /// Which cycle, from 0.
    pub cycle: u32,
    /// 0: the first dwell; k: the k-th rotation of the cycle and the dwell after it.
    pub step: u32,
    /// Rotations of one cycle.
    pub steps_per_cycle: u32,
    /// Name of the position the block is in or turns to.
    pub position: String,
    /// The rotation under way, or the next one where the table dwells.
    pub rotation: Option<RotationStatus>,
    /// Since the beginning of the first dwell \[s\].
    pub elapsed_s: f64,
    /// Until it is finished; `None`: until stopped \[s\].
    pub remaining_s: Option<f64>,
    /// Joint angles (outer, inner) at the end of the step \[rad\].
    pub target: [f64; 2],
    /// What happened last, for a person.
    pub message: String,
}
