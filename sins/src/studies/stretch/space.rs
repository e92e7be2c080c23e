//! The states that a search carries: those of a model that anything can be known or learned of, each divided by its prior.
//!
//! Numbers near one keep products of long stretches exact, and states that no measurement and no prior touches cost time.

use crate::estimation::state::StateLabel;

/// Reduced states, those that move first.
#[derive(Clone, Debug)]
pub struct Space {
    /// Their labels.
    pub labels: Vec<&'static StateLabel>,
    /// Their place in the model.
    pub(in crate::studies) positions: Vec<usize>,
    /// How many of them move.
    pub(in crate::studies) moving: usize,
    /// What each is divided by: its prior, SI.
    pub(in crate::studies) scale: Vec<f64>,
    /// Variance before anything is measured, in squares of the scale.
    pub(in crate::studies) initial: Vec<f64>,
    /// Variance gained a second by walking, in squares of the scale; only of those that stand still otherwise.
    pub(in crate::studies) walk: Vec<f64>,
}

impl Space {
    /// How many states.
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// Where a state stands.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.labels.iter().position(|label| label.name == name)
    }

    /// The diagonal covariance before anything is measured, row by row.
    pub(in crate::studies) fn initial_covariance(&self) -> Vec<f64> {
        let n = self.len();
        let mut covariance = vec![0.0; n * n];
        for (state, variance) in self.initial.iter().enumerate() {
            covariance[state * n + state] = *variance;
        }
        covariance
    }

    /// One-sigma of a state, SI.
    pub(in crate::studies) fn sigma(&self, covariance: &[f64], state: usize) -> f64 {
        covariance[state * self.len() + state].max(0.0).sqrt() * self.scale[state]
    }
}
