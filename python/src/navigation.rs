//! Free-inertial navigation with a calibration and without it.

use std::ops::ControlFlow;

use analysis::FreeNavigation;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use sins::machines::navigator::NavigatorSettings;

use crate::calibration::Calibration;
use crate::errors::{Error, Result};
use crate::settings::with;
use crate::source::Source;
use crate::values::to_python;

#[derive(Serialize)]
struct Report {
    max_position_error_nmi: f64,
    max_position_error_uncompensated_nmi: f64,
    final_position_error_nmi: f64,
    final_position_error_uncompensated_nmi: f64,
    position_std_nmi: f64,
    alignment_s: f64,
    navigation_s: f64,
    fixes: u64,
    samples: u64,
    gaps: u64,
    lost_samples: u64,
    refused_samples: u64,
    restarts: u64,
}

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
    let report = py.detach(|| -> Result<Report> {
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
        let counts = navigated.counts;
        Ok(Report {
            max_position_error_nmi: navigated.with.largest,
            max_position_error_uncompensated_nmi: navigated.without.largest,
            final_position_error_nmi: navigated.with.last,
            final_position_error_uncompensated_nmi: navigated.without.last,
            position_std_nmi: navigated.position_std_nmi(),
            alignment_s: navigated.alignment_s(),
            navigation_s: navigated.navigation_s(),
            fixes: navigated.fixes,
            samples: counts.samples,
            gaps: counts.gaps,
            lost_samples: counts.lost,
            refused_samples: counts.refused(),
            restarts: counts.restarts,
        })
    })?;
    to_python(py, &report)
}
