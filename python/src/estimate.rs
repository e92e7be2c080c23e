//! What self-calibration hands back.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::estimation::state::NamedCovariance;
use sins::machines::self_calibration::{self, Settings};

use crate::calibration::Calibration;
use crate::sensor_errors::SensorErrors;
use crate::values::to_python;

/// An estimate of self-calibration: attitude, sensor errors, and every state by name with its covariance. SI units.
#[pyclass(module = "rotary_sins", frozen)]
pub struct Estimate {
    estimate: self_calibration::Estimate,
    settings: Settings,
}

impl Estimate {
    /// An estimate and what it was made with, of which the verdict asks the thresholds.
    pub fn new(estimate: self_calibration::Estimate, settings: &Settings) -> Self {
        Self {
            estimate,
            settings: settings.clone(),
        }
    }
}

/// A covariance, shape (n, n).
pub fn covariance<'py>(
    py: Python<'py>,
    covariance: &NamedCovariance,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = covariance.states().len();
    PyArray1::from_vec(py, covariance.row_major()).reshape([count, count])
}

fn vector(py: Python<'_>, vector: nalgebra::Vector3<f64>) -> Bound<'_, PyArray1<f64>> {
    PyArray1::from_slice(py, vector.as_slice())
}

#[pymethods]
impl Estimate {
    /// Time of the estimate [ns since 1970].
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.estimate.stamp.nanos()
    }

    /// Where self-calibration stands: ``converged``, ``calibrating`` and so on.
    #[getter]
    fn phase(&self) -> &'static str {
        self.estimate.phase.name()
    }

    /// Gyroscope drift, block axes, shape (3,) [rad/s].
    #[getter]
    fn gyroscope_drift<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.estimate.gyroscope_drift())
    }

    /// Its one-sigma, shape (3,) [rad/s].
    #[getter]
    fn gyroscope_drift_std<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.estimate.gyroscope_drift_sigma())
    }

    /// Accelerometer bias, block axes, shape (3,) [m/s²].
    #[getter]
    fn accelerometer_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.estimate.accelerometer_bias())
    }

    /// Its one-sigma, shape (3,) [m/s²].
    #[getter]
    fn accelerometer_bias_std<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.estimate.accelerometer_bias_sigma())
    }

    /// One-sigma of the misalignment about east, north, up, shape (3,) [rad].
    #[getter]
    fn misalignment_std<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.estimate.misalignment_sigma())
    }

    /// Attitude of the block, b to n (east-north-up), as a quaternion x, y, z, w, shape (4,).
    #[getter]
    fn attitude_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let q = self.estimate.navigation.attitude;
        PyArray1::from_slice(py, &[q.i, q.j, q.k, q.w])
    }

    /// Heading, pitch and roll of the ship [rad], as a mapping; heading clockwise from true north.
    #[getter]
    fn vehicle<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (vehicle, sigma) = (self.estimate.vehicle, self.estimate.vehicle_sigma());
        let mapping = PyDict::new(py);
        for (name, value, sigma) in [
            ("heading", vehicle.heading, sigma.heading),
            ("roll", vehicle.roll, sigma.roll),
            ("pitch", vehicle.pitch, sigma.pitch),
        ] {
            mapping.set_item(format!("{name}_rad"), value)?;
            mapping.set_item(format!("{name}_std_rad"), sigma)?;
        }
        Ok(mapping)
    }

    /// Latitude [rad], longitude [rad], height [m].
    #[getter]
    fn position(&self) -> (f64, f64, f64) {
        let position = self.estimate.navigation.position;
        (
            position.latitude_rad,
            position.longitude_rad,
            position.height_m,
        )
    }

    /// Names of the states, in the order of ``state`` and ``covariance``; each ends in its SI unit.
    #[getter]
    fn state_names(&self) -> Vec<String> {
        let states = self.estimate.states.states();
        states.iter().map(Into::into).collect()
    }

    /// Values of the states, shape (n,).
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.estimate.states.values())
    }

    /// Covariance of the states, shape (n, n).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        covariance(py, self.estimate.covariance())
    }

    /// One state by its name; None where this model does not have it.
    fn value(&self, name: &str) -> Option<f64> {
        self.estimate.states.value(name)
    }

    /// One-sigma of a state by its name; None where this model does not have it.
    fn std(&self, name: &str) -> Option<f64> {
        self.estimate.states.sigma(name)
    }

    /// The share by which a state's one-sigma has shrunk, 0 to 1; None where nothing was said of it before.
    fn learned(&self, name: &str) -> Option<f64> {
        self.estimate.learned(name)
    }

    /// States that kept their prior: what neither record nor scheme shows.
    #[getter]
    fn unobservable(&self) -> Vec<String> {
        let names = self.estimate.unobservable();
        names.into_iter().map(Into::into).collect()
    }

    /// What the judge says: ``converged``, ``consistent``, ``reasons``, and one entry a test.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.estimate.verdict(&self.settings))
    }

    /// Whether it converged and stayed consistent: exit status 0 of the command line.
    #[getter]
    fn is_good(&self) -> bool {
        let verdict = self.estimate.verdict(&self.settings);
        verdict.converged && verdict.consistent
    }

    /// Time from the first sample of this alignment [s].
    #[getter]
    fn duration_s(&self) -> f64 {
        self.estimate.duration_s
    }

    /// Samples that were used.
    #[getter]
    fn samples(&self) -> u64 {
        self.estimate.samples.counts.samples
    }

    /// Holes in the samples.
    #[getter]
    fn gaps(&self) -> u64 {
        self.estimate.samples.counts.gaps
    }

    /// The sensor errors that were found.
    #[getter]
    fn errors(&self) -> SensorErrors {
        SensorErrors::of(&self.estimate.errors)
    }

    /// The calibration, to be written or to navigate with.
    #[getter]
    fn calibration(&self) -> Calibration {
        Calibration::of(self.estimate.calibration())
    }

    fn __repr__(&self) -> String {
        format!(
            "<Estimate {} after {:.1} s, {} states>",
            self.estimate.phase.name(),
            self.estimate.duration_s,
            self.estimate.states.states().len()
        )
    }
}
