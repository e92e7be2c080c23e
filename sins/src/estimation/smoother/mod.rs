//! Fixed-interval smoothing: what the whole record says of every epoch in it.
//!
//! The modified Bryson-Frazier smoother (Bierman 1973; Gibbs 2013, "Advanced Kalman Filtering", section 8.2). Forwards the filter
//! leaves a [`Tape`]: Φ of every covariance step, gain, innovation ν and its variance s of every scalar update. [`Backward`] goes
//! over it from its end with an adjoint vector λ and an adjoint matrix Λ, both zero at the end of the record:
//!
//! - over an update, with C = I − k h: λ ← Cᵀ λ − hᵀ ν / s, Λ ← Cᵀ Λ C + hᵀ h / s;
//! - over a covariance step: λ ← Φᵀ λ, Λ ← Φᵀ Λ Φ;
//! - the smoothed state is x − P λ, its covariance P − P Λ P, with x and P of the filter at that epoch.
//!
//! Nothing is inverted, so a state that is known exactly does no harm. λ hangs on the innovations alone and not on x: what a
//! closed loop takes out of the state and puts into the mechanization is a known shift of both, and changes no innovation. So
//! resets cost the smoother nothing: it corrects the mechanization as it stood after them.
//!
//! A state that is forgotten in the middle (a base that was moved, a new epoch) is a new one after it: its part of λ and Λ is
//! zero before. Noise that is added from outside is process noise, of which the recursion needs to know nothing.

mod backward;
mod smoothed;
mod tape;

pub use backward::Backward;
pub use smoothed::Smoothed;
pub(in crate::estimation) use tape::Shape;
pub use tape::Tape;

#[cfg(test)]
#[path = "smoother_tests.rs"]
mod tests;
