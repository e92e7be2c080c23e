//! What the whole record says of one epoch in it.

use nalgebra::Vector3;

use crate::error::Error;
use crate::estimation::state::{NamedCovariance, StateLabel, StateList};
use crate::mechanization::strapdown::NavigationState;
use crate::time::Stamp;

/// One epoch, smoothed.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// When.
    pub stamp: Stamp,
    /// Attitude, velocity and position.
    pub navigation: NavigationState,
    labels: &'static [StateLabel],
    values: Box<[f64]>,
    /// The lower triangle, column by column.
    covariance: Box<[f64]>,
}

impl Smoothed {
    /// `values` are those of the first labels, their errors of navigation zero; `covariance` is the lower triangle.
    pub(super) fn new(
        stamp: Stamp,
        navigation: NavigationState,
        labels: &'static [StateLabel],
        values: &[f64],
        covariance: &[f64],
    ) -> Self {
        Self {
            stamp,
            navigation,
            labels: labels.split_at(values.len().min(labels.len())).0,
            values: values.into(),
            covariance: covariance.into(),
        }
    }

    fn position(&self, name: &str) -> Option<usize> {
        self.labels.iter().position(|label| label.name == name)
    }

    fn element(&self, row: usize, column: usize) -> f64 {
        let (row, column) = (row.max(column), row.min(column));
        let before = column * self.values.len() - column * column.saturating_sub(1) / 2;
        self.covariance[before + row - column]
    }

    /// The value of a state: zero of an error of navigation, which has been taken out of [`Self::navigation`]; none of a state that
    /// is not smoothed.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.position(name).map(|at| self.values[at])
    }

    /// The values of three states.
    pub fn value3(&self, names: &[&str; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = names.map(|name| self.value(name));
        Some(Vector3::new(x?, y?, z?))
    }

    /// One-sigma of a state.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        self.position(name)
            .map(|at| self.element(at, at).max(0.0).sqrt())
    }

    /// The covariance of all smoothed states with their names.
    ///
    /// # Errors
    /// As [`NamedCovariance::new`].
    pub fn covariance(&self) -> Result<NamedCovariance, Error> {
        let count = self.values.len();
        NamedCovariance::new(
            StateList::names(self.labels.iter().map(|label| label.name)),
            nalgebra::DMatrix::from_fn(count, count, |row, column| self.element(row, column)),
        )
    }
}
