//! Covariance arithmetic: propagation of a partitioned system and scalar measurement updates in Joseph form.
//!
//! The first M states move, the rest stand still or walk: x = \[m | s\], Φ = \[Φ_mm Φ_ms; 0 D\] with D diagonal. Only M rows are
//! ever multiplied: with T = \[Φ_mm Φ_ms\] P, the new covariance has P_mm = T \[Φ_mm Φ_ms\]ᵀ, P_ms = T_s D and P_ss = D P_ss D.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::measurement::{Innovation, Measurement, Outcome};
use super::smoother::Tape;
use crate::error::Error;

/// A variance that falls below zero by less than this share of what it was is rounding.
const ROUNDING: f64 = 1e-10;

/// A = ∫F dt of a partitioned system over one step.
#[derive(Clone, Copy, Debug)]
pub struct Dynamics<const M: usize, const N: usize> {
    /// Rows of the moving states, each as a column: \[A_mm A_ms\]ᵀ.
    pub rows: SMatrix<f64, N, M>,
    /// Diagonal of A_ss: −T/τ of a state that forgets with the time constant τ, zero of one that does not. The first M
    /// elements mean nothing.
    pub decay: SVector<f64, N>,
}

impl<const M: usize, const N: usize> Dynamics<M, N> {
    /// Nothing moves.
    pub fn zeros() -> Self {
        Self {
            rows: SMatrix::zeros(),
            decay: SVector::zeros(),
        }
    }

    /// Φ = I + A + A²/2 in the moving rows, D = exp A_ss.
    pub fn transition(&self) -> Transition<M, N> {
        let mut rows = self.rows;
        for row in 0..M {
            for through in 0..M {
                let half = 0.5 * self.rows[(through, row)];
                if half != 0.0 {
                    for state in 0..N {
                        rows[(state, row)] += half * self.rows[(state, through)];
                    }
                }
            }
            rows[(row, row)] += 1.0;
        }
        let decays = self.decay.iter().skip(M).any(|a| *a != 0.0);
        let mut decay = SVector::repeat(1.0);
        if decays {
            for state in M..N {
                decay[state] = self.decay[state].exp();
                for row in 0..M {
                    rows[(state, row)] += 0.5 * self.rows[(state, row)] * self.decay[state];
                }
            }
        }
        Transition {
            rows,
            decay,
            decays,
        }
    }

    /// A as one matrix.
    pub fn dense(&self) -> SMatrix<f64, N, N> {
        dense(&self.rows, |state| self.decay[state])
    }
}

/// Φ of a partitioned system.
#[derive(Clone, Copy, Debug)]
pub struct Transition<const M: usize, const N: usize> {
    /// \[Φ_mm Φ_ms\]ᵀ.
    rows: SMatrix<f64, N, M>,
    /// Diagonal of D.
    decay: SVector<f64, N>,
    decays: bool,
}

impl<const M: usize, const N: usize> Transition<M, N> {
    /// Φ as one matrix.
    pub fn dense(&self) -> SMatrix<f64, N, N> {
        dense(&self.rows, |state| self.decay[state])
    }
}

fn dense<const M: usize, const N: usize>(
    rows: &SMatrix<f64, N, M>,
    diagonal: impl Fn(usize) -> f64,
) -> SMatrix<f64, N, N> {
    SMatrix::from_fn(|row, column| {
        if row < M {
            rows[(column, row)]
        } else if row == column {
            diagonal(row)
        } else {
            0.0
        }
    })
}

/// Noise of one step: Q is full over the moving states and diagonal over the others.
#[derive(Clone, Copy, Debug)]
pub struct ProcessNoise<const M: usize, const N: usize> {
    /// Over the moving states.
    pub moving: SMatrix<f64, M, M>,
    /// Variance that the states walk; the first M elements mean nothing.
    pub walk: SVector<f64, N>,
}

impl<const M: usize, const N: usize> ProcessNoise<M, N> {
    /// None.
    pub fn zeros() -> Self {
        Self {
            moving: SMatrix::zeros(),
            walk: SVector::zeros(),
        }
    }

    /// Q as one matrix.
    pub fn dense(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|row, column| match (row < M, column < M) {
            (true, true) => self.moving[(row, column)],
            (false, false) if row == column => self.walk[row],
            _ => 0.0,
        })
    }
}

/// Refuses a covariance that is none.
fn check<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Result<(), Error> {
    for state in 0..N {
        let variance = covariance[(state, state)];
        let all_finite = covariance
            .column(state)
            .iter()
            .all(|value| value.is_finite());
        if !(all_finite && variance >= 0.0) {
            return Err(Error::Variance {
                state,
                value: if all_finite { variance } else { f64::NAN },
            });
        }
    }
    Ok(())
}

/// Estimate and covariance of `N` error states. The covariance is finite and symmetric, and no variance is negative.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Kalman<const N: usize> {
    state: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
    /// What is done to it, where it is to be smoothed afterwards.
    #[serde(skip)]
    tape: Option<Box<Tape>>,
}

impl<const N: usize> Kalman<N> {
    /// Errors assumed zero, with their uncertainty.
    ///
    /// # Errors
    /// [`Error::Variance`] where a number is not finite or a variance is negative.
    pub fn new(covariance: SMatrix<f64, N, N>) -> Result<Self, Error> {
        check(&covariance)?;
        Ok(Self {
            state: SVector::zeros(),
            covariance: (covariance + covariance.transpose()) * 0.5,
            tape: None,
        })
    }

    /// Refuses numbers that no filter holds, such as those of a damaged file.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn check(&self) -> Result<(), Error> {
        for (state, value) in self.state.iter().enumerate() {
            if !value.is_finite() {
                return Err(Error::Variance {
                    state,
                    value: f64::NAN,
                });
            }
        }
        check(&self.covariance)
    }

    /// The estimate.
    pub fn state(&self) -> &SVector<f64, N> {
        &self.state
    }

    /// Takes the estimate out, which is zero from here on: it has been fed back.
    pub fn take_state(&mut self) -> SVector<f64, N> {
        std::mem::replace(&mut self.state, SVector::zeros())
    }

    /// Believes this of the errors instead of zero; the covariance is about it.
    pub(super) fn believe(&mut self, state: SVector<f64, N>) {
        self.state = state;
    }

    /// Writes everything that is done to it down from here on. `None` writes nothing any more.
    pub(super) fn record(&mut self, tape: Option<Box<Tape>>) {
        self.tape = tape;
    }

    /// What it writes down.
    pub(super) fn tape(&self) -> Option<&Tape> {
        self.tape.as_deref()
    }

    /// What it writes down.
    pub(super) fn tape_mut(&mut self) -> Option<&mut Tape> {
        self.tape.as_deref_mut()
    }

    /// Covariance of the estimate's error.
    pub fn covariance(&self) -> &SMatrix<f64, N, N> {
        &self.covariance
    }

    /// One-sigma of every state.
    pub fn sigma(&self) -> SVector<f64, N> {
        self.covariance.diagonal().map(f64::sqrt)
    }

    /// Makes a state more uncertain. A variance that is no number above zero adds nothing.
    pub fn add_variance(&mut self, state: usize, variance: f64) {
        if variance.is_finite() && variance > 0.0 && state < N {
            self.covariance[(state, state)] += variance;
        }
    }

    /// Knows of a state nothing but that it is zero, give or take `variance`: no other state tells anything about it.
    pub fn forget(&mut self, state: usize, variance: f64) {
        if variance.is_finite() && variance >= 0.0 && state < N {
            self.covariance.row_mut(state).fill(0.0);
            self.covariance.column_mut(state).fill(0.0);
            self.covariance[(state, state)] = variance;
            self.state[state] = 0.0;
            if let Some(tape) = &mut self.tape {
                tape.forgotten(state);
            }
        }
    }

    /// x ← Φ x, P ← Φ (P + Q/2) Φᵀ + Q/2: the noise of a step enters by the trapezoid.
    ///
    /// # Errors
    /// [`Error::Variance`] where the step would leave a number that is not finite or a variance below zero. Nothing has
    /// changed then.
    pub fn propagate<const M: usize>(
        &mut self,
        transition: &Transition<M, N>,
        noise: &ProcessNoise<M, N>,
    ) -> Result<(), Error> {
        let phi = &transition.rows;
        let half = noise.moving * 0.5;
        // T: column i is row i of [Φ_mm Φ_ms] (P + Q/2). P is symmetric, so that its rows are its columns.
        let mut product = SMatrix::<f64, N, M>::zeros();
        let mut moving = SMatrix::<f64, M, M>::zeros();
        let diagonal: [f64; N] = std::array::from_fn(|state| self.covariance[(state, state)]);
        let corner = self.covariance.fixed_view::<M, M>(0, 0).into_owned();
        {
            let mut view = self.covariance.fixed_view_mut::<M, M>(0, 0);
            view += half;
        }
        for state in M..N {
            self.covariance[(state, state)] += 0.5 * noise.walk[state];
        }
        for row in 0..M {
            let mut sum = SVector::<f64, N>::zeros();
            for through in 0..N {
                let coefficient = phi[(through, row)];
                if coefficient != 0.0 {
                    for state in 0..N {
                        sum[state] += coefficient * self.covariance[(state, through)];
                    }
                }
            }
            product.set_column(row, &sum);
        }
        for row in 0..M {
            for column in 0..=row {
                let value = phi.column(row).dot(&product.column(column)) + half[(row, column)];
                moving[(row, column)] = value;
                moving[(column, row)] = value;
            }
        }
        let state = if self.state.iter().all(|x| *x == 0.0) {
            self.state
        } else {
            SVector::from_fn(|state, _| {
                if state < M {
                    phi.column(state).dot(&self.state)
                } else {
                    transition.decay[state] * self.state[state]
                }
            })
        };
        let broken = broken_variance(&moving, &product, &noise.walk).or_else(|| {
            state
                .iter()
                .position(|x| !x.is_finite())
                .map(|i| (i, f64::NAN))
        });
        if let Some((state, value)) = broken {
            self.covariance
                .fixed_view_mut::<M, M>(0, 0)
                .copy_from(&corner);
            for (state, variance) in diagonal.into_iter().enumerate().skip(M) {
                self.covariance[(state, state)] = variance;
            }
            return Err(Error::Variance { state, value });
        }
        self.state = state;
        if transition.decays {
            for row in M..N {
                for column in M..N {
                    self.covariance[(row, column)] *=
                        transition.decay[row] * transition.decay[column];
                }
            }
        }
        self.covariance
            .fixed_view_mut::<M, M>(0, 0)
            .copy_from(&moving);
        for state in M..N {
            self.covariance[(state, state)] += 0.5 * noise.walk[state];
            let decay = transition.decay[state];
            for row in 0..M {
                let value = product[(state, row)] * decay;
                self.covariance[(state, row)] = value;
                self.covariance[(row, state)] = value;
            }
        }
        if let Some(tape) = &mut self.tape {
            tape.step(phi, transition.decays.then_some(&transition.decay));
        }
        Ok(())
    }

    /// What a scalar measurement would bring; `None` where its numbers are none.
    pub fn innovation(&self, measurement: &Measurement<N>) -> Option<Innovation> {
        let mut variance = measurement.variance;
        for (state, coefficient) in measurement.row.entries() {
            for (other, factor) in measurement.row.entries() {
                variance += coefficient * factor * self.covariance[(other, state)];
            }
        }
        let value = measurement.value - measurement.row.product(&self.state);
        let innovation = Innovation { value, variance };
        (value.is_finite() && variance.is_finite() && variance >= f64::MIN_POSITIVE)
            .then_some(innovation)
    }

    /// Updates with a scalar measurement.
    ///
    /// Joseph form, P ← (I − K h) P (I − K h)ᵀ + K r Kᵀ with K = P hᵀ / (h P hᵀ + r), as three products of rank one.
    pub fn update(&mut self, measurement: &Measurement<N>) -> Outcome {
        let r = measurement.variance;
        let mut projected = SVector::<f64, N>::zeros();
        for (state, coefficient) in measurement.row.entries() {
            for other in 0..N {
                projected[other] += coefficient * self.covariance[(other, state)];
            }
        }
        let own = measurement.row.product(&projected);
        let variance = own + r;
        let value = measurement.value - measurement.row.product(&self.state);
        if !(value.is_finite() && variance.is_finite() && r >= 0.0) {
            return Outcome::Refused;
        }
        if variance < f64::MIN_POSITIVE {
            return Outcome::Singular { variance };
        }
        let innovation = Innovation { value, variance };
        if measurement
            .gate
            .is_some_and(|gate| innovation.normalized_squared() > gate)
        {
            return Outcome::Gated(innovation);
        }
        let gain = projected / variance;
        let state = self.state + gain * value;
        // (I − K h) P hᵀ.
        let left = projected - gain * own;
        let variances = SVector::<f64, N>::from_fn(|i, _| {
            let (k, before) = (gain[i], self.covariance[(i, i)]);
            let after = before - k * projected[i] - left[i] * k + k * (r * k);
            // Rounding may take a variance that is known exactly below zero by a hair.
            if after < 0.0 && after >= -ROUNDING * before {
                0.0
            } else {
                after
            }
        });
        if !(state.iter().all(|x| x.is_finite()) && variances.iter().all(|v| *v >= 0.0)) {
            return Outcome::Refused;
        }
        self.state = state;
        for column in 0..N {
            let (k, b, rk) = (gain[column], projected[column], r * gain[column]);
            for row in column + 1..N {
                let value =
                    self.covariance[(row, column)] - gain[row] * b - left[row] * k + gain[row] * rk;
                self.covariance[(row, column)] = value;
                self.covariance[(column, row)] = value;
            }
            self.covariance[(column, column)] = variances[column];
        }
        if let Some(tape) = &mut self.tape {
            tape.update(&measurement.row, &gain, value, variance);
        }
        Outcome::Accepted(innovation)
    }
}

/// The first variance that would be none, with its state.
fn broken_variance<const M: usize, const N: usize>(
    moving: &SMatrix<f64, M, M>,
    product: &SMatrix<f64, N, M>,
    walk: &SVector<f64, N>,
) -> Option<(usize, f64)> {
    let bad = |value: f64| !(value.is_finite() && value >= 0.0);
    (0..M)
        .map(|state| (state, moving[(state, state)]))
        .chain((M..N).map(|state| (state, walk[state])))
        .find(|(_, value)| bad(*value))
        .or_else(|| {
            let column = (0..M).find(|row| !product.column(*row).iter().all(|v| v.is_finite()))?;
            Some((column, f64::NAN))
        })
}

#[cfg(test)]
#[path = "kalman_tests.rs"]
mod tests;
