//! Is a verdict to be believed? Many drawn worlds, inside the model and outside, and how often the judge was wrong in silence.
//!
//! *False assurance*: exit status 0 (converged and consistent) and one of the nine (misalignment, biases, drifts) beyond 4 sigma.
//! *False alarm*: a world inside the model whose sigmas are all reached, and that is not converged and consistent.

mod draw;
mod kind;
mod world;

pub use draw::Draw;
pub use kind::{Inside, KINDS, Kind};
pub use world::{Outcome, World};

use crate::machines::self_calibration::ModelChoice;

/// Beyond so many sigmas an accepted estimate was falsely assured.
pub const FALSE_BEYOND_SIGMA: f64 = 4.0;

/// Whether exit status 0 was a mistake.
pub fn is_false_assurance(outcome: &Outcome) -> bool {
    let worst = outcome.worst().1;
    outcome.is_accepted() && (worst.is_nan() || worst > FALSE_BEYOND_SIGMA)
}

/// Whether a world that the model holds was refused though its sigmas are reached, or called inconsistent.
pub fn is_false_alarm(kind: &Kind, model: ModelChoice, outcome: &Outcome) -> bool {
    let refused = outcome.reached && !outcome.is_accepted();
    kind.inside.holds(model) && (refused || !outcome.verdict.consistent)
}
