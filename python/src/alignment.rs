//! Heading, roll and pitch at rest.

use analysis::Aligner;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::machines::self_calibration::Settings;

use crate::calibration::settings_of;
use crate::errors::{Error, Result};
use crate::estimate::Estimate;
use crate::source::Source;

/// Finds heading, roll and pitch on all samples up to the first turn of the table: what ``rotary-sins align`` does.
///
/// source: path of a bag, or a :class:`Record`. Keyword arguments are those of :func:`calibration_settings` with the model ``paper``.
///
/// Gives an :class:`Estimate`, whose ``vehicle`` has the angles. Raises AlignmentError where there is none.
#[pyfunction]
#[pyo3(signature = (source, *, reference=None, **settings))]
pub fn align(
    py: Python<'_>,
    source: Source,
    reference: Option<&str>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Estimate> {
    let settings = settings_of(&Settings::default(), None, reference, None, settings)?;
    Ok(py.detach(|| -> Result<Estimate> {
        let mut aligner = Aligner::new(settings.clone())?;
        source.feed(|sample| aligner.push(sample, |_| {}))?;
        let estimate = aligner.finish().map_err(|error| Error::NoEstimate {
            record: source.name(),
            source: error,
        })?;
        Ok(Estimate::new(estimate, &settings))
    })?)
}
