//! What can be wrong with what this crate is given.

use crate::time::Stamp;

/// Errors of the `sins` crate. Each carries the value a person needs to find the cause.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A setting lies outside the range in which it means something.
    #[error("{name} is {value}, expected {expected}")]
    Setting {
        /// Name of the setting with its unit.
        name: String,
        /// The value that was given.
        value: String,
        /// What would have been accepted.
        expected: String,
    },
    /// A sample holds a number that is not finite.
    #[error("{what} at {} ns is not finite", stamp.nanos())]
    NotFinite {
        /// Which quantity.
        what: &'static str,
        /// Stamp of the sample.
        stamp: Stamp,
    },
    /// A variance is none: it is negative or not a finite number.
    #[error(
        "the variance of state {state} is {value}, expected a finite number that is not negative"
    )]
    Variance {
        /// Number of the state in its filter.
        state: usize,
        /// The variance; NaN where it or a covariance beside it is not finite.
        value: f64,
    },
    /// The filter's numbers are no longer numbers.
    #[error("the filter has diverged: the variance of {state} would be {variance}")]
    Diverged {
        /// Name of the first state that shows it.
        state: &'static str,
        /// What its variance would have become.
        variance: f64,
    },
    /// The samples do not look like gravity and earth rate on a ship at its mooring.
    #[error("coarse alignment: {reason}")]
    Alignment {
        /// What was found and what was expected.
        reason: String,
    },
    /// What was kept of a machine cannot be gone on with.
    #[error("{reason}")]
    Snapshot {
        /// What is wrong with it.
        reason: String,
    },
    /// A scheme file cannot be understood or cannot be run on this table.
    #[error("scheme {name}: {reason}")]
    Scheme {
        /// Name of the scheme or of its file.
        name: String,
        /// What is wrong, and where.
        reason: String,
    },
}

impl Error {
    /// A [`Error::Setting`] from anything printable.
    pub fn setting(
        name: impl Into<String>,
        value: impl std::fmt::Display,
        expected: impl Into<String>,
    ) -> Self {
        Self::Setting {
            name: name.into(),
            value: value.to_string(),
            expected: expected.into(),
        }
    }
}
