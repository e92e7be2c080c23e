//! Self-calibration: a whole record through the machine, or sample by sample.

use std::ops::ControlFlow;
use std::path::PathBuf;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::earth::Position;
use sins::machines::self_calibration::{
    self, Event, ModelChoice, Reference, SelfCalibration, Settings,
};

use crate::errors::{Error, Result};
use crate::estimate::{self, Estimate};
use crate::sensor_errors::SensorErrors;
use crate::settings::with;
use crate::source::Source;
use crate::values::to_python;

/// The settings of a calibration from keyword arguments.
///
/// # Errors
/// Where one of them means nothing.
pub fn settings_of(
    default: &Settings,
    model: Option<&str>,
    reference: Option<&str>,
    thresholds: Option<&Bound<'_, PyDict>>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Settings> {
    let mut settings: Settings = with(default, given)?;
    settings.thresholds = default.thresholds.clone();
    if let Some(model) = model {
        settings.model = model.parse::<ModelChoice>().map_err(Error::Sins)?;
    }
    if let Some(name) = reference {
        settings.reference = reference_of(name)?;
    }
    for (name, sigma) in thresholds.into_iter().flatten() {
        let (name, sigma): (String, f64) = (name.extract()?, sigma.extract()?);
        settings.thresholds.ask(&name, sigma).map_err(Error::Sins)?;
    }
    Ok(settings)
}

/// A reference by its name, with the sigma and the patience of the default.
fn reference_of(name: &str) -> Result<Reference> {
    let Reference::Auto {
        sigma_m_s,
        patience_s,
    } = Settings::calibrating().reference
    else {
        return Err(Error::Setting(
            "the default reference is not auto".to_owned(),
        ));
    };
    match name {
        "moored" => Ok(Reference::Moored { sigma_m_s }),
        "measured" => Ok(Reference::Measured { patience_s }),
        "position" => Ok(Reference::Position { patience_s }),
        "auto" => Ok(Reference::Auto {
            sigma_m_s,
            patience_s,
        }),
        other => Err(Error::Setting(format!(
            "reference is {other}, expected one of moored, measured, position, auto"
        ))),
    }
}

/// The settings of :func:`calibrate` with their defaults, as nested mappings; the same names are its keyword arguments.
#[pyfunction]
#[pyo3(signature = (model="whole"))]
pub fn calibration_settings<'py>(py: Python<'py>, model: &str) -> PyResult<Bound<'py, PyAny>> {
    to_python(
        py,
        &settings_of(&Settings::calibrating(), Some(model), None, None, None)?,
    )
}

/// Estimates the errors of sensors and table from a record while the table turns: what ``rotary-sins calibrate`` does.
///
/// source: path of a bag, or a :class:`Record`. model: ``whole`` or ``paper`` (the thirteen states). reference: what the velocity is
/// held against, ``auto``, ``moored``, ``position`` or ``measured``. thresholds: one-sigma by state name below which the estimate
/// counts as found, beside the default ones; 0 asks nothing. position: latitude rad, longitude rad, height m where the record
/// has none. Further keyword arguments are those of :func:`calibration_settings`, in SI units.
///
/// Gives an :class:`Estimate`. Raises BagError, SettingError, or AlignmentError where the samples led to no estimate.
#[pyfunction]
#[pyo3(signature = (source, *, model="whole", reference=None, thresholds=None, position=None, **settings))]
pub fn calibrate(
    py: Python<'_>,
    source: Source,
    model: &str,
    reference: Option<&str>,
    thresholds: Option<&Bound<'_, PyDict>>,
    position: Option<(f64, f64, f64)>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Estimate> {
    let settings = settings_of(
        &Settings::calibrating(),
        Some(model),
        reference,
        thresholds,
        settings,
    )?;
    Ok(py.detach(|| -> Result<Estimate> {
        let mut machine = SelfCalibration::new(settings)?;
        let given = position.map(position_of);
        if let Some(position) = given {
            machine.push_position(position)?;
        }
        source.feed(|sample| {
            let is_fix = matches!(sample, bags::Sample::Fix(_));
            if let Some(reading) = sample.reading().filter(|_| !(is_fix && given.is_some())) {
                machine.push(&reading)?;
            }
            while machine.poll().is_some() {}
            Ok(ControlFlow::Continue(()))
        })?;
        let estimate = machine.finish().map_err(|error| Error::NoEstimate {
            record: source.name(),
            source: error,
        })?;
        Ok(Estimate::new(estimate, machine.settings()))
    })?)
}

/// Latitude, longitude and height as a position.
pub fn position_of((latitude_rad, longitude_rad, height_m): (f64, f64, f64)) -> Position {
    Position {
        latitude_rad,
        longitude_rad,
        height_m,
    }
}

/// Self-calibration sample by sample: records are pushed as they come, and events come out.
///
/// Keyword arguments are those of :func:`calibrate`.
#[pyclass(module = "rotary_sins")]
pub struct Calibrator {
    machine: SelfCalibration,
}

#[pymethods]
impl Calibrator {
    #[new]
    #[pyo3(signature = (*, model="whole", reference=None, thresholds=None, **settings))]
    fn new(
        model: &str,
        reference: Option<&str>,
        thresholds: Option<&Bound<'_, PyDict>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let settings = settings_of(
            &Settings::calibrating(),
            Some(model),
            reference,
            thresholds,
            settings,
        )?;
        Ok(Self {
            machine: SelfCalibration::new(settings).map_err(Error::Sins)?,
        })
    }

    /// Takes the samples of a record, of any length, that follow those before.
    ///
    /// Gives what happened, a mapping each: ``event`` is ``phase_changed`` (with ``from``, ``to``), ``restarted``,
    /// ``hole_crossed``, ``alignment_failed`` (with ``reason``) or ``refused`` (with ``reason``), and ``stamp_ns``.
    fn push<'py>(&mut self, py: Python<'py>, record: Source) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let mut events = Vec::new();
        let machine = &mut self.machine;
        py.detach(|| {
            record.feed(|sample| {
                if let Some(reading) = sample.reading() {
                    machine.push(&reading)?;
                }
                while let Some(event) = machine.poll() {
                    if !matches!(event, Event::Estimate(_)) {
                        events.push(event);
                    }
                }
                Ok(ControlFlow::Continue(()))
            })
        })?;
        events.iter().map(|event| mapping_of(py, event)).collect()
    }

    /// The last estimate; None before there is one.
    #[getter]
    fn estimate(&self) -> Option<Estimate> {
        let estimate = self.machine.last()?;
        Some(Estimate::new(estimate.clone(), self.machine.settings()))
    }

    /// Where it stands.
    #[getter]
    fn phase(&self) -> &'static str {
        self.machine.phase().name()
    }

    /// No more will come: the last estimate. Raises AlignmentError where there is none.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Estimate> {
        let machine = &mut self.machine;
        let estimate = py.detach(|| machine.finish()).map_err(|source| {
            let record = "record".to_owned();
            Error::NoEstimate { record, source }
        })?;
        Ok(Estimate::new(estimate, self.machine.settings()))
    }
}

fn mapping_of<'py>(py: Python<'py>, event: &Event) -> PyResult<Bound<'py, PyDict>> {
    let mapping = PyDict::new(py);
    let (name, stamp) = match event {
        Event::Estimate(estimate) => ("estimate", estimate.stamp),
        Event::PhaseChanged { stamp, from, to } => {
            mapping.set_item("from", from.name())?;
            mapping.set_item("to", to.name())?;
            ("phase_changed", *stamp)
        }
        Event::Restarted { stamp, cause, .. } => {
            mapping.set_item("reason", cause.to_string())?;
            ("restarted", *stamp)
        }
        Event::HoleCrossed { stamp, seconds, .. } => {
            mapping.set_item("seconds", *seconds)?;
            ("hole_crossed", *stamp)
        }
        Event::AlignmentFailed { stamp, reason } => {
            mapping.set_item("reason", reason)?;
            ("alignment_failed", *stamp)
        }
        Event::Refused(refused) => {
            mapping.set_item("reason", refused.why.to_string())?;
            ("refused", refused.stamp)
        }
    };
    mapping.set_item("event", name)?;
    mapping.set_item("stamp_ns", stamp.nanos())?;
    Ok(mapping)
}

/// A calibration: what a navigator takes out of every sample, and where it starts from.
#[pyclass(module = "rotary_sins", frozen)]
pub struct Calibration {
    calibration: self_calibration::Calibration,
}

impl Calibration {
    /// Of the machine.
    pub fn of(calibration: self_calibration::Calibration) -> Self {
        Self { calibration }
    }

    /// As the machine has it.
    pub fn inner(&self) -> &self_calibration::Calibration {
        &self.calibration
    }
}

#[pymethods]
impl Calibration {
    /// Reads the file that ``rotary-sins calibrate --output`` writes. Raises RotarySinsError.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let file = |error: &dyn std::fmt::Display| Error::File(format!("{error:#}"));
        let calibration = calibration_file::read(&path).map_err(|error| file(&error))?;
        Ok(Self { calibration })
    }

    /// Writes it as a file that people and the suite read. Raises RotarySinsError.
    #[pyo3(signature = (path, *, source="python"))]
    fn write(&self, path: PathBuf, source: &str) -> PyResult<()> {
        let written = calibration_file::write(&path, &self.calibration, source);
        Ok(written.map_err(|error| Error::File(format!("{error:#}")))?)
    }

    /// The sensor errors.
    #[getter]
    fn errors(&self) -> SensorErrors {
        SensorErrors::of(&self.calibration.errors)
    }

    /// Where self-calibration stood.
    #[getter]
    fn phase(&self) -> &'static str {
        self.calibration.phase.name()
    }

    /// Time of the estimate [ns since 1970].
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.calibration.stamp.nanos()
    }

    /// Attitude of the block, b to n, x, y, z, w, shape (4,).
    #[getter]
    fn attitude_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let q = self.calibration.attitude;
        PyArray1::from_slice(py, &[q.i, q.j, q.k, q.w])
    }

    /// Names of the states of which something is known.
    #[getter]
    fn state_names(&self) -> Vec<String> {
        let states = self.calibration.covariance.states();
        states.iter().map(Into::into).collect()
    }

    /// Their covariance, shape (n, n).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        estimate::covariance(py, &self.calibration.covariance)
    }
}
