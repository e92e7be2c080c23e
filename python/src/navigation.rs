//! Free-inertial navigation with a calibration and without it.

use std::ops::ControlFlow;

use analysis::{FreeNavigation, NavigationFigures};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::machines::navigator::NavigatorSettings;

use crate::calibration::Calibration;
use crate::errors::{Error, Result};
use crate::settings::with;
use crate::source::Source;
use crate::values::to_python;

/// The settings of :func:`navigate` with their defaults, as nested mappings.
#[pyfunction]
pub fn navigation_settings(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    to_python(py, &NavigatorSettings::default())
}

/// Aligns on the first part of a record, then navigates freely, with the calibration and without it, held against the record's
/// positions: what ``rotary-sins navigate`` does.
///
/// source: path of a bag, or a :class:`Record`. Keyword arguments are those of :func:`navigation_settings`, in SI units.
///
/// Gives a mapping with the keys of ``rotary-sins navigate --json``: ``max_position_error_nmi`` and so on. Raises AlignmentError
/// where navigation did not begin or there is no position to hold it against.
#[pyfunction]
#[pyo3(signature = (source, calibration, **settings))]
pub fn navigate<'py>(
    py: Python<'py>,
    source: Source,
    calibration: &Bound<'_, Calibration>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let settings: NavigatorSettings = with(&NavigatorSettings::default(), settings)?;
    let calibration = calibration.get().inner().clone();
    let figures = py.detach(|| -> Result<NavigationFigures> {
        let mut navigation = FreeNavigation::new(settings, calibration.usable()?)?;
        source.feed(|sample| {
            navigation.push(sample, |_| {})?;
            Ok(ControlFlow::Continue(()))
        })?;
        let failed = |reason: String| Error::NoEstimate {
            record: source.name(),
            source: sins::Error::Alignment { reason },
        };
        let Some(navigated) = navigation.finish() else {
            let phase = navigation.phase().name();
            return Err(failed(format!(
                "navigation did not begin: it stands at {phase}"
            )));
        };
        if navigated.fixes == 0 {
            return Err(failed(
                "no position to hold the navigation against after its start".to_owned(),
            ));
        }
        Ok(NavigationFigures::from(&navigated))
    })?;
    to_python(py, &figures)
}
