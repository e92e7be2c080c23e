//! What can be wrong with a study or a report.

use std::path::PathBuf;

/// An error of this crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The mathematics refuses a setting or a scheme.
    #[error(transparent)]
    Sins(#[from] sins::Error),
    /// A figure that cannot be drawn.
    #[error(transparent)]
    Figure(#[from] report::Error),
    /// A bag that cannot be read.
    #[error(transparent)]
    Bag(#[from] bags::Error),
    /// The position that the samples were to begin with means nothing.
    #[error("position")]
    Position(#[source] sins::Error),
    /// The samples did not lead to an estimate.
    #[error("{}", path.display())]
    NoEstimate {
        /// The bag.
        path: PathBuf,
        /// Why.
        source: sins::Error,
    },
    /// No estimate could be read, and there is nothing to make one from.
    #[error(
        "{}: no message of type {type_name} could be read of {topic:?}, and there are no samples of an IMU to make estimates from",
        path.display()
    )]
    NothingToReport {
        /// The bag.
        path: PathBuf,
        /// Type of the estimates.
        type_name: &'static str,
        /// Their topic.
        topic: String,
    },
}
