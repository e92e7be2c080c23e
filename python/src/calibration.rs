//! Self-calibration: a whole record through the machine, or sample by sample.

use std::ops::ControlFlow;
use std::path::PathBuf;

use analysis::passes::{self, FirstPass, MOST_PASSES, Passed, Passes};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::earth::Position;
use sins::estimation::groups::navigation::{MISALIGNMENT, VELOCITY};
use sins::estimation::groups::vertical::VELOCITY_UP;
use sins::estimation::smoother::Smoothed;
use sins::machines::self_calibration::{
    self, Event, ModelChoice, Reference, SelfCalibration, Settings,
};
use sins::stream::Reading;

use crate::errors::{Error, Result};
use crate::estimate::{self, Estimate};
use crate::sensor_errors::SensorErrors;
use crate::settings::with;
use crate::source::Source;
use crate::values::{rows, to_python};

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

/// The settings of :func:`calibrate`.
fn calibrating(
    model: &str,
    reference: Option<&str>,
    thresholds: Option<&Bound<'_, PyDict>>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Settings> {
    let default = Settings::calibrating();
    settings_of(&default, Some(model), reference, thresholds, given)
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
    to_python(py, &calibrating(model, None, None, None)?)
}

/// Estimates the errors of sensors and table from a record while the table turns: what ``rotary-sins calibrate`` does.
///
/// source: path of a bag, or a :class:`Record`. model: ``whole`` or ``paper`` (the thirteen states). reference: what the velocity is
/// held against, ``auto``, ``moored``, ``position`` or ``measured``. thresholds: one-sigma by state name below which the estimate
/// counts as found, beside the default ones; 0 asks nothing. position: latitude rad, longitude rad, height m where the record
/// has none. passes: so many times over the record, each linear about what the one before found; None: one, or up to four where the
/// azimuth was uncertain by more than a degree at first. Further keyword arguments are those of :func:`calibration_settings`, in
/// SI units.
///
/// Gives an :class:`Estimate`. Raises BagError, SettingError, or AlignmentError where the samples led to no estimate.
#[pyfunction]
#[pyo3(signature = (source, *, model="whole", reference=None, thresholds=None, position=None, passes=None, **settings))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn calibrate(
    py: Python<'_>,
    source: Source,
    model: &str,
    reference: Option<&str>,
    thresholds: Option<&Bound<'_, PyDict>>,
    position: Option<(f64, f64, f64)>,
    passes: Option<u32>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Estimate> {
    let settings = calibrating(model, reference, thresholds, settings)?;
    let work = Work::new(&source, settings, position, passes, false)?;
    let passed = py.detach(|| work.run())?;
    Ok(Estimate::new(passed.estimate.clone(), passed.settings()))
}

/// Calibrates, and smooths: attitude, velocity and position of every second as the whole record says they were, what
/// ``rotary-sins calibrate --smooth`` writes.
///
/// Arguments are those of :func:`calibrate`.
///
/// Gives the :class:`Estimate` and a mapping of n epochs: ``stamp_ns`` (n,), ``attitude_xyzw`` (n, 4) from block to East-North-Up,
/// ``velocity_m_s`` (n, 3) East, North, Up, ``position`` (n, 3) latitude rad, longitude rad, height m, and the one-sigmas
/// ``misalignment_std_rad`` and ``velocity_std_m_s`` (n, 3), NaN where a state is not estimated. Raises what :func:`calibrate` raises.
#[pyfunction]
#[pyo3(signature = (source, *, model="whole", reference=None, thresholds=None, position=None, passes=None, **settings))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn smooth<'py>(
    py: Python<'py>,
    source: Source,
    model: &str,
    reference: Option<&str>,
    thresholds: Option<&Bound<'_, PyDict>>,
    position: Option<(f64, f64, f64)>,
    passes: Option<u32>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<(Estimate, Bound<'py, PyDict>)> {
    let settings = calibrating(model, reference, thresholds, settings)?;
    let work = Work::new(&source, settings, position, passes, true)?;
    let (estimate, epochs) = py.detach(|| -> Result<_> {
        let passed = work.run()?;
        let estimate = Estimate::new(passed.estimate.clone(), passed.settings());
        Ok((estimate, passed.into_epochs(|_, take| work.again(take))?))
    })?;
    Ok((estimate, columns_of(py, &epochs)?))
}

fn columns_of<'py>(py: Python<'py>, epochs: &[Smoothed]) -> PyResult<Bound<'py, PyDict>> {
    let sigmas = |names: [&str; 3]| {
        let of = move |epoch: &Smoothed| names.map(|name| epoch.sigma(name).unwrap_or(f64::NAN));
        rows(py, epochs.iter().map(of))
    };
    let mapping = PyDict::new(py);
    let stamps = epochs.iter().map(|epoch| epoch.stamp.nanos());
    mapping.set_item("stamp_ns", PyArray1::from_iter(py, stamps))?;
    let attitudes = epochs.iter().map(|epoch| {
        let q = epoch.navigation.attitude.coords;
        [q.x, q.y, q.z, q.w]
    });
    mapping.set_item("attitude_xyzw", rows(py, attitudes)?)?;
    let velocities = epochs.iter().map(|epoch| epoch.navigation.velocity.into());
    mapping.set_item("velocity_m_s", rows::<3>(py, velocities)?)?;
    let positions = epochs.iter().map(|epoch| {
        let place = epoch.navigation.position;
        [place.latitude_rad, place.longitude_rad, place.height_m]
    });
    mapping.set_item("position", rows(py, positions)?)?;
    mapping.set_item("misalignment_std_rad", sigmas(MISALIGNMENT)?)?;
    let [east, north] = VELOCITY;
    mapping.set_item("velocity_std_m_s", sigmas([east, north, VELOCITY_UP])?)?;
    Ok(mapping)
}

/// A record that is calibrated by: which samples, and how.
struct Work<'s> {
    source: &'s Source,
    settings: Settings,
    position: Option<Position>,
    passes: Passes,
}

impl<'s> Work<'s> {
    fn new(
        source: &'s Source,
        settings: Settings,
        position: Option<(f64, f64, f64)>,
        passes: Option<u32>,
        smooths: bool,
    ) -> Result<Self> {
        if let Some(passes) = passes
            && !(1..=MOST_PASSES).contains(&passes)
        {
            return Err(Error::Setting(format!(
                "passes is {passes}, expected 1 to {MOST_PASSES}"
            )));
        }
        Ok(Self {
            source,
            settings,
            position: position.map(position_of),
            passes: Passes {
                asked: passes,
                smooths,
            },
        })
    }

    /// Hands every reading to `take`, a position that was given in place of the record's.
    fn feed(
        &self,
        mut take: impl FnMut(&Reading) -> std::result::Result<ControlFlow<()>, sins::Error>,
    ) -> Result<()> {
        let given = self.position;
        if let Some(position) = given
            && take(&Reading::Position(position))?.is_break()
        {
            return Ok(());
        }
        self.source.feed(|sample| {
            let is_fix = matches!(sample, bags::Sample::Fix(_));
            match sample.reading().filter(|_| !(is_fix && given.is_some())) {
                Some(reading) => take(&reading),
                None => Ok(ControlFlow::Continue(())),
            }
        })
    }

    fn again(&self, take: &mut dyn FnMut(&Reading) -> ControlFlow<()>) -> Result<()> {
        self.feed(|reading| Ok(take(reading)))
    }

    fn run(&self) -> Result<Passed> {
        let machine = SelfCalibration::new(self.settings.clone())?;
        let mut first = FirstPass::new(self.passes, machine);
        self.feed(|reading| {
            let taken = first.smoothing().push(reading);
            while first.poll().is_some() {}
            taken.map(|()| ControlFlow::Continue(()))
        })?;
        let finished = first.smoothing().finish();
        let estimate = finished.map_err(|error| Error::NoEstimate {
            record: self.source.name(),
            source: error,
        })?;
        passes::go_over(first, estimate, self.passes, &self.settings, |_, take| {
            self.again(take)
        })
    }
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
        let settings = calibrating(model, reference, thresholds, settings)?;
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
