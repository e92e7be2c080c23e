//! Which reference suits how the ship lies, while the filter goes over the samples of an alignment.

use super::Reference;
use super::running::Running;
use super::ship_motion::ShipMotion;
use crate::error::Error;
use crate::time::Stamp;

/// Variance of the ship's velocity over the mean of the last minutes: waves come in groups.
const WAVE_GROUPS: f64 = 2.0;

/// So many positions in an alignment can tell how the ship moves.
pub(super) const LEAST_POSITIONS: usize = 30;

/// A filter that has gone over the alignment's samples, its last update, and the velocities that were missing.
pub(super) type GoneOver = Result<(Running, Option<Stamp>, u64), Error>;

/// Goes over the samples with the reference that suits how the ship lies. One that is seen to move is gone over once more: with her
/// positions where they may be taken and are enough, else with the motion that the coarse alignment left unexplained.
pub(super) fn by_reference(
    reference: Reference,
    has_positions: bool,
    residual_m_s: f64,
    gone_over: &dyn Fn(Reference, Option<ShipMotion>) -> GoneOver,
) -> GoneOver {
    let (sigma_m_s, patience_s) = match reference {
        Reference::Auto {
            sigma_m_s,
            patience_s,
        } => (sigma_m_s, Some(patience_s).filter(|_| has_positions)),
        Reference::Moored { sigma_m_s } => (sigma_m_s, None),
        Reference::Measured { .. } | Reference::Position { .. } => {
            return gone_over(reference, None);
        }
    };
    let lies = Reference::Moored { sigma_m_s };
    let first = gone_over(lies, None);
    let moves = first.as_ref().map_or(true, |first| first.0.moves());
    if let Some(patience_s) = patience_s.filter(|_| moves) {
        return gone_over(Reference::Position { patience_s }, None);
    }
    let motion =
        |starting_m_s| Some(ShipMotion::new(starting_m_s, sigma_m_s).with_allowance(WAVE_GROUPS));
    let mut first = first?;
    if moves && residual_m_s > sigma_m_s {
        return gone_over(lies, motion(residual_m_s));
    }
    first.0.motion = motion(0.0);
    Ok(first)
}
