//! A simulated ship, table and IMU.

use std::path::PathBuf;

use analysis::write_simulated_bag;
use bags::{Bag, Compression, SensorOptions, WriteOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::simulation::{ImuErrorSettings, NoiseReading, SensorGrade, SimulatorSettings};
use sins::time::{NANOS_PER_SECOND, Stamp};

use crate::errors::{Error, Result};
use crate::record::Record;
use crate::scheme::AnyScheme;
use crate::sensor_errors::SensorErrors;
use crate::settings::with;
use crate::values::to_python;

/// Where simulated stamps begin, as those of the command line do \[s since 1970\].
const START_S: i64 = 1_760_000_000;

/// What a kind of sensor, drawn by a seed, and a noise amount to.
fn drawn(sensor: &str, noise: Option<&str>, seed: u64) -> Result<SimulatorSettings> {
    let mut settings = SimulatorSettings {
        seed,
        ..SimulatorSettings::default()
    };
    let drawn = SensorGrade::named(sensor)?.draw(seed);
    settings.imu = drawn.imu;
    settings.encoder = drawn.encoder;
    settings.plant.start = Stamp::from_nanos(START_S * NANOS_PER_SECOND);
    settings.plant.table_errors = drawn.table;
    settings.imu.noise = match noise {
        None => settings.imu.noise,
        Some("D") => NoiseReading::D.density(),
        Some("H") => NoiseReading::H.density(),
        Some("none") => ImuErrorSettings::perfect().noise,
        Some(other) => {
            return Err(Error::Setting(format!(
                "noise is {other}, expected one of D, H, none"
            )));
        }
    };
    Ok(settings)
}

/// The settings of :func:`simulate` with their defaults, as nested mappings; the same names are its keyword arguments.
#[pyfunction]
#[pyo3(signature = (*, sensor="table-1", noise=None, seed=1))]
pub fn simulation_settings<'py>(
    py: Python<'py>,
    sensor: &str,
    noise: Option<&str>,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    to_python(py, &drawn(sensor, noise, seed)?)
}

/// Simulates a ship, a turntable that runs a scheme, and an IMU: what ``rotary-sins simulate`` does, with the same samples.
///
/// scheme: a :class:`Scheme` or the name of a built-in one. hours: length. rate_hz: samples of the IMU a second. seed: decides all
/// noise, and draws the sensor. sensor: ``ideal``, ``table-1``, ``ring-laser``, ``fibre-optic`` or ``mems``. noise: ``D``, ``H`` or
/// ``none`` instead of the sensor's. axes: of the outer and the inner joint, such as ``("x", "y")``. output: also write the bag
/// there, with the truth; a file that is there is refused unless ``force``. Further keyword arguments are those of
/// :func:`simulation_settings`, in SI units, such as ``plant={"ship": {"heading_rad": 0.5}}``.
///
/// Gives a :class:`Record`, and with it the true errors of the sensors at the end: ``record, errors = simulate(...)``. Raises
/// SettingError, SchemeError or BagError.
#[pyfunction]
#[pyo3(signature = (scheme=None, *, hours=4.0, rate_hz=100.0, seed=1, sensor="table-1", noise=None, axes=None, output=None, force=false, **settings))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn simulate(
    py: Python<'_>,
    scheme: Option<AnyScheme>,
    hours: f64,
    rate_hz: f64,
    seed: u64,
    sensor: &str,
    noise: Option<&str>,
    axes: Option<(String, String)>,
    output: Option<PathBuf>,
    force: bool,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<(Record, SensorErrors)> {
    if !(hours > 0.0 && hours <= 10_000.0) {
        let text = format!("hours is {hours}, expected more than 0 and at most 10000");
        return Err(Error::Setting(text).into());
    }
    let scheme = match scheme {
        Some(AnyScheme(scheme)) => scheme,
        None => crate::scheme::Scheme::eight_position(),
    };
    let mut base = drawn(sensor, noise, seed)?;
    base.plant.imu_rate_hz = rate_hz;
    base.plant.turntable = scheme.table(axes)?;
    let settings: SimulatorSettings = with(&base, settings)?;
    Ok(py.detach(|| -> Result<_> {
        let folder = tempfile::tempdir().map_err(|error| Error::File(error.to_string()))?;
        let kept = output.is_some();
        let path = output.unwrap_or_else(|| folder.path().join("simulated.mcap"));
        let options = WriteOptions {
            // What is read back at once need not be small.
            compression: if kept {
                Compression::Zstd
            } else {
                Compression::None
            },
            replaces: force,
            ..WriteOptions::default()
        };
        let made = write_simulated_bag(
            &path,
            options,
            scheme.inner(),
            settings,
            hours * 3600.0,
            &(),
        )?;
        // Through the bag, so that a record in memory is what the bag says to the last bit.
        let record = Record::of_bag(&Bag::open(&made.summary.path)?, &SensorOptions::default())?;
        let record = if kept {
            record
        } else {
            record.named("simulated")
        };
        Ok((
            record,
            SensorErrors::of(&made.run.simulator().sensor_errors()),
        ))
    })?)
}
