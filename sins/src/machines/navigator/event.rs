//! What the navigator says.

use super::NavigatorPhase;
use super::solution::NavigatorOutput;
use crate::sensor::ImuSample;
use crate::stream::counts::Refused;
use crate::stream::order::EpochCause;
use crate::table::JointSample;
use crate::time::Stamp;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum NavigatorEvent {
    /// A sample was used; both solutions at its time while navigating.
    Sample {
        /// The sample.
        sample: ImuSample,
        /// The joints at its time.
        joints: JointSample,
        /// Both solutions.
        output: Option<Box<NavigatorOutput>>,
    },
    /// Another phase began.
    PhaseChanged {
        /// The phase before.
        from: NavigatorPhase,
        /// The phase now.
        to: NavigatorPhase,
    },
    /// A calibration is used from now on.
    CalibrationTaken {
        /// Its time.
        stamp: Stamp,
        /// The solutions start anew: what ran stood on a calibration that had not converged.
        restarted: bool,
    },
    /// A calibration that had waited for its samples is not used.
    CalibrationRefused {
        /// Its time.
        stamp: Stamp,
        /// What speaks against it.
        reason: String,
    },
    /// The clock was broken: navigation cannot go on, and an alignment begins from the newest position.
    Restarted {
        /// The first sample of the new time.
        stamp: Stamp,
        /// Why.
        cause: EpochCause,
    },
    /// The solutions went over a hole in the samples.
    HoleCrossed {
        /// Its end.
        stamp: Stamp,
        /// Its length \[s\].
        seconds: f64,
        /// Nothing was integrated: course and speed were kept.
        held: bool,
    },
    /// The alignment failed and begins anew.
    AlignmentFailed {
        /// When.
        stamp: Stamp,
        /// What was found and what was expected.
        reason: String,
    },
    /// A sample was not used.
    Refused(Refused),
}
