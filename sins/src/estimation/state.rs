//! How a state is called, and estimates as lists of named states.

pub(crate) mod serialized;

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3};

use crate::error::Error;

/// The name of a state, how a person calls it, and the field unit in which a person reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateLabel {
    /// The name that files, messages and JSON carry; it ends in the SI unit.
    pub name: &'static str,
    /// The symbol of the conventions, such as `φU` or `∇x`.
    pub symbol: &'static str,
    /// In words, such as `accelerometer bias x`.
    pub words: &'static str,
    /// The field unit.
    pub unit: &'static str,
    /// One field unit in SI.
    pub scale: f64,
}

impl StateLabel {
    /// A label.
    pub const fn new(
        name: &'static str,
        symbol: &'static str,
        words: &'static str,
        unit: &'static str,
        scale: f64,
    ) -> Self {
        Self {
            name,
            symbol,
            words,
            unit,
            scale,
        }
    }
}

/// Asymmetry of a covariance that is rounding, as a share of the two sigmas.
const SYMMETRIC: f64 = 1e-6;

/// A list of states: those of one of our models with their labels, or names that were read.
///
/// Copies share it. Two lists are equal where they hold the same names in the same order.
#[derive(Clone, Debug)]
pub struct StateList(List);

#[derive(Clone, Debug)]
enum List {
    Labels(&'static [StateLabel]),
    Chosen(Arc<[StateLabel]>),
    Names(Arc<[String]>),
}

impl StateList {
    /// Some states of a model, in an order of their own.
    pub fn chosen(states: impl IntoIterator<Item = StateLabel>) -> Self {
        Self(List::Chosen(states.into_iter().collect()))
    }

    /// States of a model.
    pub const fn labels(states: &'static [StateLabel]) -> Self {
        Self(List::Labels(states))
    }

    /// States by any names, such as those of a file.
    pub fn names(names: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self(List::Names(names.into_iter().map(Into::into).collect()))
    }

    /// Number of states.
    pub fn len(&self) -> usize {
        match &self.0 {
            List::Labels(labels) => labels.len(),
            List::Chosen(labels) => labels.len(),
            List::Names(names) => names.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Names, in order.
    pub fn iter(&self) -> impl Iterator<Item = &str> + Clone {
        let (labels, names): (&[StateLabel], &[String]) = match &self.0 {
            List::Labels(labels) => (labels, &[]),
            List::Chosen(labels) => (labels, &[]),
            List::Names(names) => (&[], names),
        };
        let labels = labels.iter().map(|label| label.name);
        labels.chain(names.iter().map(String::as_str))
    }

    /// Where a state stands.
    pub fn position(&self, name: &str) -> Option<usize> {
        match &self.0 {
            List::Labels(labels) => labels.iter().position(|label| label.name == name),
            List::Chosen(labels) => labels.iter().position(|label| label.name == name),
            List::Names(names) => names.iter().position(|known| known == name),
        }
    }

    /// The states at these positions.
    fn select(&self, positions: &[usize]) -> Self {
        if positions.iter().copied().eq(0..self.len()) {
            return self.clone();
        }
        let names: Vec<&str> = self.iter().collect();
        Self::names(positions.iter().map(|position| names[*position]))
    }
}

/// Which states of a filter the outside sees, and in which order.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    states: StateList,
    /// Where they stand in the filter; none where all are seen as they stand.
    positions: Option<Arc<[usize]>>,
}

impl Shown {
    /// The states at these positions of a model.
    pub(super) fn new(states: &'static [StateLabel], positions: &[usize]) -> Self {
        if positions.iter().copied().eq(0..states.len()) {
            return Self {
                states: StateList::labels(states),
                positions: None,
            };
        }
        Self {
            states: StateList::chosen(positions.iter().map(|position| states[*position])),
            positions: Some(positions.into()),
        }
    }

    /// Whether a filter of `count` states has all of them.
    pub(super) fn is_within(&self, count: usize) -> bool {
        self.positions
            .as_ref()
            .map_or(self.states.len() == count, |positions| {
                positions.iter().all(|position| *position < count)
            })
    }
}

impl PartialEq for StateList {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

/// Where states stand in a list; a name that is not there does not compile where this is a constant.
///
/// # Panics
/// Where a name is not in the list: at compile time, for constants.
pub const fn positions<const K: usize>(states: &[StateLabel], names: [&str; K]) -> [usize; K] {
    let mut positions = [usize::MAX; K];
    let mut wanted = 0;
    while wanted < K {
        let mut state = 0;
        while state < states.len() {
            if same(states[state].name.as_bytes(), names[wanted].as_bytes()) {
                positions[wanted] = state;
            }
            state += 1;
        }
        assert!(positions[wanted] != usize::MAX, "no such state");
        wanted += 1;
    }
    positions
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

/// Numbers by state, such as errors or one-sigmas \[the units that the names end in\].
#[derive(Clone, Debug, PartialEq)]
pub struct StateValues {
    states: StateList,
    values: Arc<[f64]>,
}

impl StateValues {
    /// One number for every state of a list.
    ///
    /// # Errors
    /// [`Error::Setting`] where there are not as many.
    pub fn new(states: StateList, values: &[f64]) -> Result<Self, Error> {
        if values.len() != states.len() {
            let expected = format!("{}, as many as state_names", states.len());
            return Err(Error::setting("length of state", values.len(), expected));
        }
        let values = values.into();
        Ok(Self { states, values })
    }

    /// Of a model, whose labels and numbers are equally many by their types.
    pub fn of<const N: usize>(states: &'static [StateLabel; N], values: &SVector<f64, N>) -> Self {
        Self {
            states: StateList::labels(states),
            values: values.as_slice().into(),
        }
    }

    /// The states.
    pub fn states(&self) -> &StateList {
        &self.states
    }

    /// All numbers, in the order of the states.
    pub fn as_slice(&self) -> &[f64] {
        &self.values
    }

    /// Names with their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.states.iter().zip(self.values.iter().copied())
    }

    /// Number of a state.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.states
            .position(name)
            .and_then(|at| self.values.get(at).copied())
    }

    /// Numbers of three states.
    pub fn value3(&self, names: &[&str; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = names.map(|name| self.value(name));
        Some(Vector3::new(x?, y?, z?))
    }
}

/// A covariance over named states \[squares and products of the units that the names end in\].
///
/// What is in it is a covariance: finite, symmetric, no variance below zero, every name once. A reader asks for the states
/// that it knows by their names, so it accepts a list that holds more or fewer of them. Copies share the numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCovariance {
    states: StateList,
    matrix: Arc<DMatrix<f64>>,
}

impl NamedCovariance {
    /// Of these states.
    ///
    /// # Errors
    /// [`Error::Setting`] where the matrix is not square of the number of names, a name stands twice, a number is not
    /// finite, a variance is negative, or the matrix is not symmetric.
    pub fn new(states: StateList, matrix: DMatrix<f64>) -> Result<Self, Error> {
        let names: Vec<&str> = states.iter().collect();
        let count = names.len();
        if matrix.shape() != (count, count) {
            let (rows, columns) = matrix.shape();
            return Err(Error::setting(
                "covariance",
                format!("{rows} x {columns}"),
                format!("{count} x {count}, as many as state_names"),
            ));
        }
        if let Some((_, twice)) = names
            .iter()
            .enumerate()
            .find(|(i, n)| names[..*i].contains(n))
        {
            return Err(Error::setting("state_names", twice, "every name once"));
        }
        for (row, name) in names.iter().enumerate() {
            for column in 0..=row {
                let (value, mirrored) = (matrix[(row, column)], matrix[(column, row)]);
                let of = || format!("covariance of {name} and {}", names[column]);
                if !(value.is_finite() && mirrored.is_finite()) {
                    return Err(Error::setting(of(), value + mirrored, "finite numbers"));
                }
                if row == column && value < 0.0 {
                    return Err(Error::setting(
                        format!("variance of {name}"),
                        value,
                        "a number that is not negative",
                    ));
                }
                let size = (matrix[(row, row)].abs() * matrix[(column, column)].abs()).sqrt();
                if (value - mirrored).abs() > SYMMETRIC * size.max(f64::MIN_POSITIVE) {
                    let expected = format!("{mirrored}, as on the other side of the diagonal");
                    return Err(Error::setting(of(), value, expected));
                }
            }
        }
        let matrix = Arc::new(matrix);
        Ok(Self { states, matrix })
    }

    /// What a filter holds, which has looked after it itself.
    pub(super) fn of_filter<const N: usize>(
        shown: &Shown,
        covariance: &SMatrix<f64, N, N>,
    ) -> Self {
        let matrix = match &shown.positions {
            None => DMatrix::from_column_slice(N, N, covariance.as_slice()),
            Some(positions) => DMatrix::from_iterator(
                positions.len(),
                positions.len(),
                positions.iter().flat_map(|column| {
                    let column = covariance.column(*column);
                    positions.iter().map(move |row| column[*row])
                }),
            ),
        };
        Self {
            states: shown.states.clone(),
            matrix: Arc::new(matrix),
        }
    }

    /// Of states that do not depend on each other, by name and one-sigma.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn from_sigmas(
        sigmas: impl IntoIterator<Item = (&'static str, f64)>,
    ) -> Result<Self, Error> {
        let (names, sigmas): (Vec<_>, Vec<f64>) = sigmas.into_iter().unzip();
        let variances =
            DVector::from_iterator(sigmas.len(), sigmas.iter().map(|sigma| sigma * sigma));
        Self::new(StateList::names(names), DMatrix::from_diagonal(&variances))
    }

    /// The states, in the order of the matrix.
    pub fn states(&self) -> &StateList {
        &self.states
    }

    /// The matrix.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// All elements, row by row.
    pub fn row_major(&self) -> Vec<f64> {
        self.matrix.transpose().as_slice().to_vec()
    }

    /// Where a state stands in the matrix.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.states.position(name)
    }

    /// Covariance of two states; `None` where either is not among them.
    pub fn covariance(&self, first: &str, second: &str) -> Option<f64> {
        Some(self.matrix[(self.position(first)?, self.position(second)?)])
    }

    /// One-sigma of a state.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        let at = self.position(name)?;
        Some(self.matrix[(at, at)].sqrt())
    }

    /// One-sigma of all states, in their order.
    pub fn sigmas(&self) -> Vec<f64> {
        self.matrix.diagonal().iter().map(|v| v.sqrt()).collect()
    }

    /// One-sigma of three states.
    pub fn sigma3(&self, names: &[&str; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = names.map(|name| self.sigma(name));
        Some(Vector3::new(x?, y?, z?))
    }

    /// Covariance of some states; `None` where one is not among them.
    pub fn block<const K: usize>(&self, names: &[&str; K]) -> Option<SMatrix<f64, K, K>> {
        let mut positions = [0; K];
        for (position, name) in positions.iter_mut().zip(names) {
            *position = self.position(name)?;
        }
        Some(SMatrix::from_fn(|row, column| {
            self.matrix[(positions[row], positions[column])]
        }))
    }

    /// Covariance of some states; one that is not among them has the variance `unknown`, and nothing tells of it.
    pub fn block_or<const K: usize>(&self, names: &[&str; K], unknown: f64) -> SMatrix<f64, K, K> {
        let positions = names.map(|name| self.position(name));
        SMatrix::from_fn(|row, column| match (positions[row], positions[column]) {
            (Some(i), Some(j)) => self.matrix[(i, j)],
            _ if row == column => unknown,
            _ => 0.0,
        })
    }

    /// Only the states that `keeps` says yes to, by name and variance.
    #[must_use]
    pub fn retain(&self, keeps: impl Fn(&str, f64) -> bool) -> Self {
        let positions: Vec<usize> = self
            .states
            .iter()
            .enumerate()
            .filter(|(at, name)| keeps(name, self.matrix[(*at, *at)]))
            .map(|(at, _)| at)
            .collect();
        let count = positions.len();
        let matrix = DMatrix::from_fn(count, count, |row, column| {
            self.matrix[(positions[row], positions[column])]
        });
        Self {
            states: self.states.select(&positions),
            matrix: Arc::new(matrix),
        }
    }
}

/// Named states with their values and the covariance of the values' errors.
#[derive(Clone, Debug, PartialEq)]
pub struct StateEstimate {
    values: StateValues,
    covariance: NamedCovariance,
}

impl StateEstimate {
    /// Values for the states of a covariance, in its order.
    ///
    /// # Errors
    /// [`Error::Setting`] where there are not as many values as names, or one is not finite.
    pub fn new(values: &[f64], covariance: NamedCovariance) -> Result<Self, Error> {
        let values = StateValues::new(covariance.states.clone(), values)?;
        if let Some((name, value)) = values.iter().find(|(_, value)| !value.is_finite()) {
            return Err(Error::setting(name, value, "a finite number"));
        }
        Ok(Self { values, covariance })
    }

    /// What a filter holds, which has looked after it itself.
    pub(super) fn of_filter<const N: usize>(
        shown: &Shown,
        values: &SVector<f64, N>,
        covariance: &SMatrix<f64, N, N>,
    ) -> Self {
        let values = match &shown.positions {
            None => values.as_slice().into(),
            Some(positions) => positions.iter().map(|position| values[*position]).collect(),
        };
        Self {
            values: StateValues {
                states: shown.states.clone(),
                values,
            },
            covariance: NamedCovariance::of_filter(shown, covariance),
        }
    }

    /// The states.
    pub fn states(&self) -> &StateList {
        &self.covariance.states
    }

    /// Values, in the order of the states.
    pub fn values(&self) -> &[f64] {
        self.values.as_slice()
    }

    /// Covariance, with the names.
    pub fn covariance(&self) -> &NamedCovariance {
        &self.covariance
    }

    /// Value of a state.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values.value(name)
    }

    /// Values of three states.
    pub fn value3(&self, names: &[&str; 3]) -> Option<Vector3<f64>> {
        self.values.value3(names)
    }

    /// One-sigma of a state.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        self.covariance.sigma(name)
    }

    /// One-sigma of three states.
    pub fn sigma3(&self, names: &[&str; 3]) -> Option<Vector3<f64>> {
        self.covariance.sigma3(names)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// States are found by name wherever they stand, and one that is not there is not made up.
    #[test]
    fn states_are_found_by_name() {
        let matrix = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 9.0]);
        let covariance = NamedCovariance::new(StateList::names(["b", "a"]), matrix).unwrap();
        assert_eq!(covariance.sigma("a"), Some(3.0));
        assert_eq!(covariance.covariance("a", "b"), Some(1.0));
        assert_eq!(covariance.sigma("c"), None);
        let estimate = StateEstimate::new(&[5.0, 6.0], covariance).unwrap();
        assert_eq!(estimate.value("a"), Some(6.0));
    }

    /// What is no covariance is refused with the state's name: NaN, a negative variance, two values for one pair, a name
    /// twice, a wrong size.
    #[test]
    fn what_is_no_covariance_is_refused() {
        let of = |names: &[&'static str], entries: &[f64]| {
            let matrix = DMatrix::from_row_slice(2, 2, entries);
            let states = StateList::names(names.iter().copied());
            NamedCovariance::new(states, matrix)
                .unwrap_err()
                .to_string()
        };
        let two = ["a", "b"];
        assert!(of(&two, &[1.0, 0.0, 0.0, f64::NAN]).contains("b is NaN"));
        assert!(of(&two, &[-1.0, 0.0, 0.0, 1.0]).contains("variance of a is -1"));
        assert!(of(&two, &[1.0, 0.5, 0.4, 1.0]).contains("covariance of b and a is 0.4"));
        assert!(of(&["a", "a"], &[1.0, 0.0, 0.0, 1.0]).contains("every name once"));
        assert!(of(&["a"], &[1.0, 0.0, 0.0, 1.0]).contains("2 x 2"));
    }

    /// A part of a covariance keeps the numbers of its states; what is missing is unknown, and nothing tells of it.
    #[test]
    fn parts_keep_their_numbers() {
        let matrix = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 9.0]);
        let whole = NamedCovariance::new(StateList::names(["b", "a"]), matrix).unwrap();
        let part = whole.retain(|name, variance| name == "a" && variance > 5.0);
        assert_eq!(part.states(), &StateList::names(["a"]));
        assert_eq!(part.sigma("a"), Some(3.0));
        assert_eq!(whole.retain(|_, _| true), whole);
        let block = whole.block_or(&["a", "c", "b"], 7.0);
        assert_eq!(
            (block[(0, 2)], block[(1, 1)], block[(0, 1)]),
            (1.0, 7.0, 0.0)
        );
        assert_eq!(whole.block(&["a", "c"]), None);
    }

    /// A list that was read is the list of the model where the names are the same, and positions are found by them.
    #[test]
    fn lists_are_compared_by_name() {
        const LABELS: &[StateLabel] = &[
            StateLabel::new("a", "a", "a", "m", 1.0),
            StateLabel::new("b", "b", "b", "m", 1.0),
        ];
        const AT: [usize; 2] = positions(LABELS, ["b", "a"]);
        assert_eq!(AT, [1, 0]);
        assert_eq!(StateList::labels(LABELS), StateList::names(["a", "b"]));
        assert_ne!(StateList::labels(LABELS), StateList::names(["b", "a"]));
    }
}
