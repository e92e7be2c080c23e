//! What self-calibration tells.

use super::{Estimate, Phase};
use crate::stream::counts::Refused;
use crate::stream::order::EpochCause;
use crate::time::Stamp;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A covariance step ended, and this is the estimate.
    Estimate(Box<Estimate>),
    /// Another phase began.
    PhaseChanged {
        /// When.
        stamp: Stamp,
        /// The phase before.
        from: Phase,
        /// The phase now.
        to: Phase,
    },
    /// Attitude and velocity are found anew from this sample on.
    Restarted {
        /// The first sample of the new alignment.
        stamp: Stamp,
        /// Why.
        cause: EpochCause,
        /// What is known of the sensors is kept. False where nothing was known yet.
        sensors_kept: bool,
    },
    /// The filter went over a hole.
    HoleCrossed {
        /// Its end.
        stamp: Stamp,
        /// Its length \[s\].
        seconds: f64,
        /// Added to the misalignment, the greatest one-sigma of an axis \[rad\].
        sigma_rad: f64,
        /// The encoders told the turn, and nothing was integrated.
        held: bool,
    },
    /// Coarse alignment failed, or the filter is of no more use; alignment begins anew.
    AlignmentFailed {
        /// The last sample of it.
        stamp: Stamp,
        /// What was found and what was expected.
        reason: String,
    },
    /// A sample was not used.
    Refused(Refused),
}
