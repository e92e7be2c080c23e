//! A measurement as a row: z = h x + noise of variance r, and what became of it.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// The row h of a scalar measurement; only coefficients that are not zero are kept.
#[derive(Clone, Copy, Debug)]
pub struct Row<const N: usize> {
    states: [usize; N],
    coefficients: [f64; N],
    count: usize,
}

impl<const N: usize> Row<N> {
    /// One state, measured directly; a row of zeros where there is no such state.
    pub fn unit(state: usize) -> Self {
        Self::new([(state, 1.0)])
    }

    /// From states and their coefficients; those of a state that is named more than once add up.
    pub fn new(entries: impl IntoIterator<Item = (usize, f64)>) -> Self {
        let mut dense = SVector::<f64, N>::zeros();
        for (state, coefficient) in entries {
            if let Some(sum) = dense.get_mut(state) {
                *sum += coefficient;
            }
        }
        Self::dense(&dense)
    }

    /// From all coefficients.
    pub fn dense(coefficients: &SVector<f64, N>) -> Self {
        let mut row = Self {
            states: [0; N],
            coefficients: [0.0; N],
            count: 0,
        };
        for (state, coefficient) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            row.states[row.count] = state;
            row.coefficients[row.count] = *coefficient;
            row.count += 1;
        }
        row
    }

    /// States with their coefficients, in the order of the states.
    pub fn entries(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let coefficients = &self.coefficients[..self.count];
        self.states[..self.count]
            .iter()
            .copied()
            .zip(coefficients.iter().copied())
    }

    /// h x.
    pub fn product(&self, x: &SVector<f64, N>) -> f64 {
        self.entries()
            .map(|(state, coefficient)| coefficient * x[state])
            .sum()
    }
}

/// A scalar measurement of the states.
#[derive(Clone, Copy, Debug)]
pub struct Measurement<const N: usize> {
    /// h.
    pub row: Row<N>,
    /// z, in the measurement's own unit.
    pub value: f64,
    /// r, in the square of that unit.
    pub variance: f64,
    /// Normalized innovation squared above which the measurement is left out; `None` takes every one.
    pub gate: Option<f64>,
}

impl<const N: usize> Measurement<N> {
    /// A measurement that is taken however far off it is.
    pub fn new(row: Row<N>, value: f64, variance: f64) -> Self {
        Self {
            row,
            value,
            variance,
            gate: None,
        }
    }

    /// The same behind a gate.
    #[must_use]
    pub fn gated(self, gate: Option<f64>) -> Self {
        Self { gate, ..self }
    }
}

/// Innovation of a scalar measurement and its variance before the update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Measurement minus prediction.
    pub value: f64,
    /// h P hᵀ + r.
    pub variance: f64,
}

impl Innovation {
    /// Normalized innovation squared of this scalar.
    pub fn normalized_squared(&self) -> f64 {
        self.value * self.value / self.variance
    }
}

/// What became of a measurement. Where it was not accepted, state and covariance are as they were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// It was taken.
    Accepted(Innovation),
    /// Its innovation lies beyond its gate.
    Gated(Innovation),
    /// h P hᵀ + r is not above zero: neither state nor measurement leaves anything to learn, or the covariance is none.
    Singular {
        /// h P hᵀ + r.
        variance: f64,
    },
    /// A value, a variance, a coefficient or what they would make of the state is not finite, or r is negative.
    Refused,
}

impl Outcome {
    /// The innovation, where there is one.
    pub fn innovation(&self) -> Option<Innovation> {
        match self {
            Self::Accepted(innovation) | Self::Gated(innovation) => Some(*innovation),
            Self::Singular { .. } | Self::Refused => None,
        }
    }

    /// Whether it was taken.
    pub fn is_accepted(&self) -> bool {
        matches!(self, Self::Accepted(_))
    }
}

/// How many scalar measurements came to which end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UpdateCounts {
    /// Taken.
    pub accepted: u64,
    /// Left out by their gate.
    pub gated: u64,
    /// Left out because the innovation had no variance.
    pub singular: u64,
    /// Left out because a number was not finite.
    pub refused: u64,
}

impl UpdateCounts {
    /// Counts one.
    pub fn count(&mut self, outcome: &Outcome) {
        match outcome {
            Outcome::Accepted(_) => self.accepted += 1,
            Outcome::Gated(_) => self.gated += 1,
            Outcome::Singular { .. } => self.singular += 1,
            Outcome::Refused => self.refused += 1,
        }
    }
}

impl std::ops::Add for UpdateCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            accepted: self.accepted + other.accepted,
            gated: self.gated + other.gated,
            singular: self.singular + other.singular,
            refused: self.refused + other.refused,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector4;

    /// Only what is not zero is kept, what stands twice adds up, and a state that does not exist measures nothing.
    #[test]
    fn rows_are_sparse() {
        let row = Row::<4>::new([(3, 2.0), (1, 0.5), (1, 0.5), (0, 0.0), (7, 1.0)]);
        assert_eq!(row.entries().collect::<Vec<_>>(), [(1, 1.0), (3, 2.0)]);
        assert_eq!(row.product(&Vector4::new(9.0, 5.0, 9.0, 1.0)), 7.0);
    }
}
