//! Exceptions of the library's own kinds.

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    rotary_sins,
    RotarySinsError,
    PyException,
    "What is wrong with what this library is given; the base of its exceptions."
);
create_exception!(
    rotary_sins,
    BagError,
    RotarySinsError,
    "A bag cannot be read or written, or lacks what is needed."
);
create_exception!(
    rotary_sins,
    SettingError,
    RotarySinsError,
    "A setting or a number lies outside of what means something, or is not known."
);
create_exception!(
    rotary_sins,
    AlignmentError,
    RotarySinsError,
    "The samples did not lead to an alignment or an estimate."
);
create_exception!(
    rotary_sins,
    SchemeError,
    RotarySinsError,
    "A rotation scheme cannot be understood, or not be run on this table."
);

/// Any error here, on its way to an exception.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Of the mathematics.
    #[error("{0}")]
    Sins(#[from] sins::Error),
    /// The same, of a record whose samples led to nothing.
    #[error("{record}: {source}")]
    NoEstimate {
        /// The record.
        record: String,
        /// Why.
        source: sins::Error,
    },
    /// Of a bag.
    #[error("{0}")]
    Bag(#[from] bags::Error),
    /// Of a study.
    #[error("{0}")]
    Study(#[from] analysis::Error),
    /// Something was given that means nothing.
    #[error("{0}")]
    Setting(String),
    /// A file.
    #[error("{0}")]
    File(String),
}

/// What a function of this library gives.
pub type Result<T> = std::result::Result<T, Error>;

fn of_sins(error: &sins::Error) -> PyErr {
    let text = error.to_string();
    match error {
        sins::Error::Alignment { .. } | sins::Error::Diverged { .. } => {
            AlignmentError::new_err(text)
        }
        sins::Error::Scheme { .. } => SchemeError::new_err(text),
        _ => SettingError::new_err(text),
    }
}

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        let text = error.to_string();
        match error {
            Error::Sins(source) | Error::Study(analysis::Error::Sins(source)) => of_sins(&source),
            Error::NoEstimate { .. } => AlignmentError::new_err(text),
            Error::Bag(_) | Error::Study(analysis::Error::Bag(_)) => BagError::new_err(text),
            Error::Setting(_) => SettingError::new_err(text),
            Error::File(_) | Error::Study(_) => RotarySinsError::new_err(text),
        }
    }
}
