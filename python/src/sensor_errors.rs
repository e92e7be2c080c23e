//! The sensor error model and its inverse.

use nalgebra::Vector3;
use numpy::{AllowTypeChange, PyArray2, PyArrayLike2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::machines::self_calibration::named_errors;
use sins::sensor::{self, BlockMotion};
use sins::table::TableErrors;

use crate::errors::{Error, Result};
use crate::settings::with;
use crate::values::{matrix, rows, to_python};

/// Rate and force, a row a sample.
type Pair<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Deterministic errors of gyroscopes and accelerometers, measured minus true::
///
///     gyroscope:      w~ = (I + K_g) w + drift + G_g f
///     accelerometer:  f~ = (I + K_a) f' + bias + K_2 f'^2,   f' = f + arms - delay * df/dt
///
/// Keyword arguments, zero where not given: ``gyroscope_drift`` (3,) rad/s, ``accelerometer_bias`` (3,) m/s²,
/// ``gyroscope_matrix`` (3, 3) K_g, ``accelerometer_matrix`` (3, 3) K_a, ``accelerometer_quadratic`` (3,) 1/(m/s²),
/// ``accelerometer_arms`` (3, 3) m, row i of accelerometer i, ``gyroscope_g_sensitivity`` (3, 3) rad/s per m/s²,
/// ``accelerometer_delay_s``. Raises SettingError.
#[pyclass(module = "rotary_sins", frozen, eq)]
#[derive(Clone, Debug, PartialEq)]
pub struct SensorErrors {
    errors: sensor::SensorErrors,
}

impl SensorErrors {
    /// Of the mathematics.
    pub fn of(errors: &sensor::SensorErrors) -> Self {
        Self { errors: *errors }
    }
}

/// Rows of numbers, shape (n, 3).
fn samples(what: &str, array: &Bound<'_, PyAny>) -> PyResult<Vec<Vector3<f64>>> {
    let expected = || Error::Setting(format!("{what}: expected float64, shape (n, 3)"));
    let array: PyArrayLike2<'_, f64, AllowTypeChange> = array.extract().map_err(|_| expected())?;
    let array = array.as_array();
    if array.ncols() != 3 {
        return Err(expected().into());
    }
    let rows = array.rows().into_iter();
    Ok(rows
        .map(|row| Vector3::new(row[0], row[1], row[2]))
        .collect())
}

/// As many of one as of the other.
fn pairs(
    rate: &Bound<'_, PyAny>,
    force: &Bound<'_, PyAny>,
) -> PyResult<Vec<(Vector3<f64>, Vector3<f64>)>> {
    let (rate, force) = (samples("rate", rate)?, samples("force", force)?);
    if rate.len() != force.len() {
        let text = format!("force has {} rows, expected {}", force.len(), rate.len());
        return Err(Error::Setting(text).into());
    }
    Ok(rate.into_iter().zip(force).collect())
}

fn given_back<'py>(py: Python<'py>, done: &[(Vector3<f64>, Vector3<f64>)]) -> PyResult<Pair<'py>> {
    Ok((
        rows(py, done.iter().map(|(rate, _)| (*rate).into()))?,
        rows(py, done.iter().map(|(_, force)| (*force).into()))?,
    ))
}

#[pymethods]
impl SensorErrors {
    #[new]
    #[pyo3(signature = (**errors))]
    fn new(errors: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let errors: sensor::SensorErrors = with(&sensor::SensorErrors::default(), errors)?;
        // What cannot be taken out again is none.
        errors.compensation().map_err(Error::Sins)?;
        Ok(Self { errors })
    }

    /// What the sensors report of true rates [rad/s] and specific forces [m/s²] of a block that moves steadily: two arrays (n, 3).
    fn corrupt<'py>(
        &self,
        py: Python<'py>,
        rate: &Bound<'py, PyAny>,
        force: &Bound<'py, PyAny>,
    ) -> PyResult<Pair<'py>> {
        let given = pairs(rate, force)?;
        let done: Vec<_> = py.detach(|| {
            let steady = given
                .into_iter()
                .map(|(rate, force)| BlockMotion::steady(rate, force));
            steady.map(|motion| self.errors.corrupt(&motion)).collect()
        });
        given_back(py, &done)
    }

    /// The inverse: true rates and forces from reported ones, each sample by itself: two arrays (n, 3).
    fn correct<'py>(
        &self,
        py: Python<'py>,
        rate: &Bound<'py, PyAny>,
        force: &Bound<'py, PyAny>,
    ) -> PyResult<Pair<'py>> {
        let given = pairs(rate, force)?;
        let compensation = self.errors.compensation().map_err(Error::Sins)?;
        let done: Vec<_> = py.detach(|| {
            let each = given.iter();
            each.map(|(rate, force)| compensation.apply(rate, force))
                .collect()
        });
        given_back(py, &done)
    }

    /// The inverse that follows a stream of samples, as arms and delay need it.
    fn compensator(&self) -> PyResult<Compensator> {
        let compensation = self.errors.compensation().map_err(Error::Sins)?;
        Ok(Compensator {
            compensator: sensor::Compensator::new(compensation),
        })
    }

    /// Every error by the name of its state, each with its SI unit.
    #[getter]
    fn named<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mapping = PyDict::new(py);
        for (name, value) in named_errors(&self.errors, &TableErrors::default()) {
            mapping.set_item(name, value)?;
        }
        Ok(mapping)
    }

    /// Gyroscope drift, shape (3,) [rad/s].
    #[getter]
    fn gyroscope_drift<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.errors.gyroscope_drift)
    }

    /// Accelerometer bias, shape (3,) [m/s²].
    #[getter]
    fn accelerometer_bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.errors.accelerometer_bias)
    }

    /// Scale factors and installation angles of the gyroscopes K_g, shape (3, 3).
    #[getter]
    fn gyroscope_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.errors.gyroscope_matrix)
    }

    /// Scale factors and installation angles of the accelerometers K_a, shape (3, 3).
    #[getter]
    fn accelerometer_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.errors.accelerometer_matrix)
    }

    /// Quadratic coefficients of the accelerometers K_2, shape (3,) [1/(m/s²)].
    #[getter]
    fn accelerometer_quadratic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.errors.accelerometer_quadratic)
    }

    /// Arms of the accelerometers from the table's centre, row i of accelerometer i, shape (3, 3) [m].
    #[getter]
    fn accelerometer_arms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.errors.accelerometer_arms)
    }

    /// g-sensitivity of the gyroscopes G_g, shape (3, 3) [rad/s per m/s²].
    #[getter]
    fn gyroscope_g_sensitivity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.errors.gyroscope_g_sensitivity)
    }

    /// How late the accelerometers are against the gyroscopes [s].
    #[getter]
    fn accelerometer_delay_s(&self) -> f64 {
        self.errors.accelerometer_delay_s
    }

    fn __repr__(&self) -> String {
        format!(
            "<SensorErrors drift {:?} rad/s, bias {:?} m/s²>",
            self.errors.gyroscope_drift.as_slice(),
            self.errors.accelerometer_bias.as_slice()
        )
    }
}

/// Takes sensor errors out of a stream of samples, with what arms and delay need of the sample before.
#[pyclass(module = "rotary_sins")]
pub struct Compensator {
    compensator: sensor::Compensator,
}

#[pymethods]
impl Compensator {
    /// The next samples without their errors: averages over intervals of ``interval_s``, two arrays (n, 3). Samples follow those
    /// of the call before.
    fn apply<'py>(
        &mut self,
        py: Python<'py>,
        interval_s: f64,
        rate: &Bound<'py, PyAny>,
        force: &Bound<'py, PyAny>,
    ) -> PyResult<Pair<'py>> {
        interval(interval_s)?;
        let given = pairs(rate, force)?;
        let compensator = &mut self.compensator;
        let done: Vec<_> = py.detach(|| {
            let each = given.iter();
            each.map(|(rate, force)| compensator.averages(interval_s, rate, force))
                .collect()
        });
        given_back(py, &done)
    }

    /// The next sample does not follow the last one.
    fn forget(&mut self) {
        self.compensator.forget();
    }
}

fn interval(interval_s: f64) -> Result<()> {
    if interval_s.is_finite() && interval_s > 0.0 {
        return Ok(());
    }
    Err(Error::Setting(format!(
        "interval_s is {interval_s}, expected a positive number"
    )))
}
