//! What a scheme can show, what no filter can beat, and how noisy the sensors are.

use std::ops::ControlFlow;

use analysis::allan::{Allan, AllanSettings};
use analysis::observability::{Analysis, report};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::estimation::model;
use sins::simulation::NoiseReading;
use sins::studies::observability::{Setting, bound as covariance_bound};
use sins::table::scheme::Program;

use crate::errors::{Error, Result};
use crate::scheme::{AnyScheme, Scheme};
use crate::settings::with;
use crate::source::Source;
use crate::values::to_python;

/// The program of a scheme, and what degrees and bounds depend on beside it.
fn asked(
    scheme: Option<AnyScheme>,
    hours: f64,
    noise: &str,
    axes: Option<(String, String)>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<(Program, Setting)> {
    if !(hours > 0.0 && hours <= 100.0) {
        let text = format!("hours is {hours}, expected more than 0 and at most 100");
        return Err(Error::Setting(text).into());
    }
    let reading = match noise {
        "D" => NoiseReading::D,
        "H" => NoiseReading::H,
        other => {
            let text = format!("noise is {other}, expected one of D, H");
            return Err(Error::Setting(text).into());
        }
    };
    let scheme = scheme.map_or_else(Scheme::eight_position, |AnyScheme(scheme)| scheme);
    let base = Setting {
        duration_s: hours * 3600.0,
        noise: reading.density(),
        ..Setting::default()
    };
    let program = scheme.inner().program(scheme.table(axes)?);
    Ok((program.map_err(Error::Sins)?, with(&base, settings)?))
}

/// What a scheme can show of the errors, before anything is measured: what ``rotary-sins observability`` says.
///
/// scheme: a :class:`Scheme` or a name. Further keyword arguments: ``ship``, ``initial``, ``noise`` and so on as mappings, in SI
/// units, such as ``ship={"heading_rad": 0.5}``.
///
/// Gives a mapping with the keys of ``rotary-sins observability --json``: ``ranks``, ``degrees``, ``bound_sigma`` (time, state).
/// Raises SettingError or SchemeError.
#[pyfunction]
#[pyo3(signature = (scheme=None, *, hours=4.0, reading="D", axes=None, **settings))]
pub fn observability<'py>(
    py: Python<'py>,
    scheme: Option<AnyScheme>,
    hours: f64,
    reading: &str,
    axes: Option<(String, String)>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (program, setting) = asked(scheme, hours, reading, axes, settings)?;
    let analysis = py.detach(|| -> Result<_> { Ok(Analysis::of(&program, &setting)?) })?;
    to_python(py, &report(&analysis))
}

/// The covariance that no filter with these sensors and measurements can beat, along a scheme.
///
/// Arguments are those of :func:`observability`; every_s: seconds between its points, whole.
///
/// Gives a mapping: ``time_s`` (n,), ``state_names``, ``sigma`` (n, 13) in SI units.
#[pyfunction]
#[pyo3(signature = (scheme=None, *, hours=4.0, every_s=60, reading="D", axes=None, **settings))]
pub fn bound<'py>(
    py: Python<'py>,
    scheme: Option<AnyScheme>,
    hours: f64,
    every_s: u32,
    reading: &str,
    axes: Option<(String, String)>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (program, setting) = asked(scheme, hours, reading, axes, settings)?;
    let points = py
        .detach(|| covariance_bound::bound(&program, &setting, every_s))
        .map_err(Error::Sins)?;
    let names: Vec<String> = points.first().map_or_else(Vec::new, |point| {
        point.sigma.states().iter().map(Into::into).collect()
    });
    let times: Vec<f64> = points.iter().map(|point| point.time_s).collect();
    let sigmas: Vec<f64> = points
        .iter()
        .flat_map(|point| point.sigma.as_slice().iter().copied())
        .collect();
    let mapping = PyDict::new(py);
    let sigma: Bound<'py, PyArray2<f64>> =
        PyArray1::from_vec(py, sigmas).reshape([points.len(), names.len()])?;
    mapping.set_item("time_s", PyArray1::from_vec(py, times))?;
    mapping.set_item("state_names", names)?;
    mapping.set_item("sigma", sigma)?;
    Ok(mapping)
}

/// The noise of the sensors from a record at rest: what ``rotary-sins allan`` says.
///
/// source: path of a bag, or a :class:`Record`. confidence: probability that the true deviation lies within a band.
///
/// Gives a mapping with the keys of ``rotary-sins allan --json``: ``tau_s`` (n,), and in ``axes``, a mapping each, ``deviation``,
/// ``lower`` and ``upper`` (n,) and the fitted noises; SI units. Raises SettingError where there are too few samples at rest.
#[pyfunction]
#[pyo3(signature = (source, *, confidence=0.95))]
pub fn allan(py: Python<'_>, source: Source, confidence: f64) -> PyResult<Bound<'_, PyAny>> {
    let settings = AllanSettings {
        confidence,
        ..AllanSettings::default()
    };
    let report = py.detach(|| -> Result<_> {
        let mut machine = Allan::new(settings)?;
        source.feed(|sample| {
            if let Some(reading) = sample.reading() {
                machine.push(&reading)?;
            }
            while machine.poll_refused().is_some() {}
            Ok(ControlFlow::Continue(()))
        })?;
        let result = machine.finish()?;
        let command = "rotary_sins.allan".to_owned();
        let name = source.name();
        Ok(analysis::allan::report(
            &result,
            &settings,
            name,
            command,
            Vec::new(),
        ))
    })?;
    to_python(py, &report)
}

/// Every state that a model can have, a mapping each: ``name`` (with its SI unit), ``symbol``, ``words``, ``unit`` (field unit) and
/// ``scale`` (one field unit in SI).
#[pyfunction]
pub fn states(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let mapping = |label: &sins::estimation::state::StateLabel| {
        let mapping = PyDict::new(py);
        mapping.set_item("name", label.name)?;
        mapping.set_item("symbol", label.symbol)?;
        mapping.set_item("words", label.words)?;
        mapping.set_item("unit", label.unit)?;
        mapping.set_item("scale", label.scale)?;
        Ok(mapping)
    };
    model::labels().iter().map(mapping).collect()
}
