//! How a state is called, and estimates as lists of named states.

use std::borrow::Cow;

use nalgebra::{DMatrix, Matrix3, Vector3};

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

/// A covariance over named states \[squares and products of the units that the names end in\].
///
/// What is in it is a covariance: finite, symmetric, no variance below zero, every name once. A reader asks for the states
/// that it knows by their names, so it accepts a list that holds more or fewer of them.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCovariance {
    names: Vec<Cow<'static, str>>,
    matrix: DMatrix<f64>,
}

impl NamedCovariance {
    /// Of these states.
    ///
    /// # Errors
    /// [`Error::Setting`] where the matrix is not square of the number of names, a name stands twice, a number is not
    /// finite, a variance is negative, or the matrix is not symmetric.
    pub fn new(names: Vec<Cow<'static, str>>, matrix: DMatrix<f64>) -> Result<Self, Error> {
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
        Ok(Self { names, matrix })
    }

    /// Of states that do not depend on each other, by name and one-sigma.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn from_sigmas(
        sigmas: impl IntoIterator<Item = (&'static str, f64)>,
    ) -> Result<Self, Error> {
        let (names, sigmas): (Vec<_>, Vec<f64>) = sigmas.into_iter().unzip();
        let variances = nalgebra::DVector::from_iterator(
            sigmas.len(),
            sigmas.iter().map(|sigma| sigma * sigma),
        );
        Self::new(
            names.into_iter().map(Cow::Borrowed).collect(),
            DMatrix::from_diagonal(&variances),
        )
    }

    /// Names of the states, in the order of the matrix.
    pub fn names(&self) -> &[Cow<'static, str>] {
        &self.names
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
        self.names.iter().position(|known| known == name)
    }

    /// Covariance of two states; `None` where either is not among them.
    pub fn covariance(&self, first: &str, second: &str) -> Option<f64> {
        Some(self.matrix[(self.position(first)?, self.position(second)?)])
    }

    /// One-sigma of a state.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        self.covariance(name, name).map(f64::sqrt)
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

    /// Covariance of three states.
    pub fn block3(&self, names: &[&str; 3]) -> Option<Matrix3<f64>> {
        let mut block = Matrix3::zeros();
        for (row, first) in names.iter().enumerate() {
            for (column, second) in names.iter().enumerate() {
                block[(row, column)] = self.covariance(first, second)?;
            }
        }
        Some(block)
    }
}

/// Named states with their values and the covariance of the values' errors.
#[derive(Clone, Debug, PartialEq)]
pub struct StateEstimate {
    values: Vec<f64>,
    covariance: NamedCovariance,
}

impl StateEstimate {
    /// Values for the states of a covariance, in its order.
    ///
    /// # Errors
    /// [`Error::Setting`] where there are not as many values as names, or one is not finite.
    pub fn new(values: Vec<f64>, covariance: NamedCovariance) -> Result<Self, Error> {
        if values.len() != covariance.names.len() {
            let expected = format!("{}, as many as state_names", covariance.names.len());
            return Err(Error::setting("length of state", values.len(), expected));
        }
        if let Some((name, value)) = covariance
            .names
            .iter()
            .zip(&values)
            .find(|(_, value)| !value.is_finite())
        {
            return Err(Error::setting(name.as_ref(), value, "a finite number"));
        }
        Ok(Self { values, covariance })
    }

    /// Values, in the order of the names.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Covariance, with the names.
    pub fn covariance(&self) -> &NamedCovariance {
        &self.covariance
    }

    /// Value of a state.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.covariance
            .position(name)
            .map(|index| self.values[index])
    }

    /// Values of three states.
    pub fn value3(&self, names: &[&str; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = names.map(|name| self.value(name));
        Some(Vector3::new(x?, y?, z?))
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
        let covariance = NamedCovariance::new(vec!["b".into(), "a".into()], matrix).unwrap();
        assert_eq!(covariance.sigma("a"), Some(3.0));
        assert_eq!(covariance.covariance("a", "b"), Some(1.0));
        assert_eq!(covariance.sigma("c"), None);
        let estimate = StateEstimate::new(vec![5.0, 6.0], covariance).unwrap();
        assert_eq!(estimate.value("a"), Some(6.0));
    }

    /// What is no covariance is refused with the state's name: NaN, a negative variance, two values for one pair, a name
    /// twice, a wrong size.
    #[test]
    fn what_is_no_covariance_is_refused() {
        let of = |names: &[&'static str], entries: &[f64]| {
            let matrix = DMatrix::from_row_slice(2, 2, entries);
            let names = names.iter().map(|name| Cow::Borrowed(*name)).collect();
            NamedCovariance::new(names, matrix).unwrap_err().to_string()
        };
        let two = ["a", "b"];
        assert!(of(&two, &[1.0, 0.0, 0.0, f64::NAN]).contains("b is NaN"));
        assert!(of(&two, &[-1.0, 0.0, 0.0, 1.0]).contains("variance of a is -1"));
        assert!(of(&two, &[1.0, 0.5, 0.4, 1.0]).contains("covariance of b and a is 0.4"));
        assert!(of(&["a", "a"], &[1.0, 0.0, 0.0, 1.0]).contains("every name once"));
        assert!(of(&["a"], &[1.0, 0.0, 0.0, 1.0]).contains("2 x 2"));
    }
}
