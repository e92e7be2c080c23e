//! What can go wrong with a report.

/// Errors of the `report` crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A figure has nothing to draw.
    #[error("figure {figure}: it has no panels")]
    NoPanels {
        /// Its id.
        figure: String,
    },
    /// The data of a figure could not be written.
    #[error("data of a figure: {0}")]
    Csv(#[from] csv::Error),
    /// The rows could not be gathered.
    #[error("data of a figure: {0}")]
    Io(#[from] std::io::Error),
}
