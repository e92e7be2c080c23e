//! What can go wrong with a report.

/// Errors of the `report` crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A figure could not be drawn.
    #[error("figure {figure}: {reason}")]
    Chart {
        /// Its id.
        figure: String,
        /// Why.
        reason: String,
    },
}
