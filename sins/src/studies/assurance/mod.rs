//! Is a verdict to be believed? Many drawn worlds, inside the model and outside, and how often the judge was wrong in silence.
//!
//! *False assurance*: exit status 0 (converged and consistent) and one of the nine (misalignment, biases, drifts) beyond 4 sigma, or
//! any other state that was learned beyond 5 (the worst of some thirty is farther out by chance than that of nine).
//! *False alarm*: a world inside the model whose sigmas are all reached, and that is not converged and consistent; or that ends
//! without any estimate.

mod draw;
mod kind;
mod world;

pub use draw::Draw;
pub use kind::{Inside, KINDS, Kind};
pub use world::{Outcome, World};

use crate::machines::self_calibration::ModelChoice;

/// Beyond so many sigmas an accepted estimate was falsely assured.
pub const FALSE_BEYOND_SIGMA: f64 = 4.0;

/// The same of the worst of more than nine states.
pub const OTHERS_FALSE_BEYOND_SIGMA: f64 = 5.0;

/// Whether exit status 0 was a mistake.
pub fn is_false_assurance(outcome: &Outcome) -> bool {
    let beyond = |worst: f64, limit: f64| worst.is_nan() || worst > limit;
    let other = outcome.worst_other();
    outcome.is_accepted()
        && (beyond(outcome.worst().1, FALSE_BEYOND_SIGMA)
            || other.is_some_and(|(_, z)| beyond(z, OTHERS_FALSE_BEYOND_SIGMA)))
}

/// Whether a world that the model holds was refused though its sigmas are reached, was called inconsistent, or ended without an
/// estimate.
pub fn is_false_alarm(
    kind: &Kind,
    model: ModelChoice,
    outcome: Result<&Outcome, &crate::error::Error>,
) -> bool {
    kind.inside.holds(model)
        && outcome.map_or(true, |outcome| {
            (outcome.reached && !outcome.is_accepted()) || !outcome.verdict.consistent
        })
}

#[cfg(test)]
mod tests;
