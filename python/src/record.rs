//! A record in memory: the samples of the sensors in the order in which they came, and their columns.

use std::path::PathBuf;
use std::sync::Arc;

use bags::{Bag, BagWriter, Fix, NewTopic, Sample, SensorOptions, SensorStream, WriteOptions};
use nalgebra::Vector3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::sensor_msgs::{JointState, NavSatFix};
use rotary_sins_msgs::convert::{ToMessage, imu_from_sample};
use rotary_sins_msgs::interfaces::topics;
use sins::earth::Position;
use sins::sensor::{ImuSample, VelocityMeasurement};
use sins::simulation::{PositionFix, VelocityFix};
use sins::table::JointSample;
use sins::time::Stamp;

use crate::columns::Columns;
use crate::errors::{Error, Result};
use crate::values::rows;

/// Frame of the sensor block.
const IMU_LINK: &str = "imu_link";
/// Columns by sensor, for tables of other libraries: name with unit, and how many numbers a row.
const IMU_COLUMNS: [&str; 4] = [
    "angular_rate",
    "specific_force",
    "angular_rate_variance",
    "specific_force_variance",
];

/// Samples of the sensors, in memory.
///
/// Made by :func:`read`, by :func:`simulate`, or from arrays::
///
///     Record(imu={"stamp_ns": t, "angular_rate": w, "specific_force": f}, fix={...})
///
/// imu: ``stamp_ns`` (n,) int64, ``angular_rate`` (n, 3) rad/s and ``specific_force`` (n, 3) m/s², both averaged over the interval
/// that ends at the stamp; optional ``angular_rate_variance`` and ``specific_force_variance`` (n, 3), of one sample.
/// joints: ``position`` (n, 2) rad, outer and inner; optional ``velocity`` (n, 2) rad/s.
/// fix: ``position`` (n, 3), latitude rad, longitude rad, height m; optional ``sigma`` (n, 3) m, east, north, up.
/// velocity: ``velocity`` (n, 2) m/s, east and north; ``sigma`` (n, 2) m/s.
///
/// Raises SettingError where a column is missing, unknown or of another shape.
#[pyclass(module = "rotary_sins", frozen)]
pub struct Record {
    name: String,
    samples: Arc<Vec<Sample>>,
    warnings: Vec<String>,
}

impl Record {
    /// What stands in front of an error about it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same by another name.
    pub fn named(mut self, name: &str) -> Self {
        name.clone_into(&mut self.name);
        self
    }

    /// Its samples.
    pub fn samples(&self) -> Arc<Vec<Sample>> {
        Arc::clone(&self.samples)
    }

    /// A bag in memory. What cannot be decoded is left out, and said in a warning.
    pub fn of_bag(bag: &Bag, options: &SensorOptions) -> Result<Self> {
        let mut stream = SensorStream::new(bag, options)?;
        let mut warnings: Vec<String> = bag.warnings().iter().map(ToString::to_string).collect();
        let (mut samples, mut undecodable) = (Vec::new(), 0_u64);
        loop {
            match stream.next() {
                Ok(Some(sample)) => samples.push(sample),
                Ok(None) => break,
                Err(error) => {
                    undecodable += 1;
                    if undecodable == 1 {
                        warnings.push(error.to_string());
                    }
                }
            }
        }
        if undecodable > 1 {
            warnings.push(format!("{undecodable} messages could not be read in all"));
        }
        warnings.extend(stream.warnings().iter().map(ToString::to_string));
        Ok(Self {
            name: bag.path().display().to_string(),
            samples: Arc::new(samples),
            warnings,
        })
    }

    fn imu_samples(&self) -> impl Iterator<Item = &ImuSample> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::Imu(imu) => Some(imu),
            _ => None,
        })
    }

    fn joint_samples(&self) -> impl Iterator<Item = &JointSample> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::Joints(joints) => Some(joints),
            _ => None,
        })
    }

    /// Those that have a position.
    fn fixes(&self) -> impl Iterator<Item = (Stamp, Position, Vector3<f64>)> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::Fix(fix) => Some((fix.stamp, fix.position?, fix.sigma_m)),
            _ => None,
        })
    }

    fn velocities(&self) -> impl Iterator<Item = (Stamp, &VelocityMeasurement)> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::Velocity(stamp, velocity) => Some((*stamp, velocity)),
            _ => None,
        })
    }

    fn write_to(&self, path: PathBuf, options: WriteOptions) -> Result<()> {
        let mut bag = BagWriter::create(path, options)?;
        let imu = bag.add_topic(NewTopic::on(&topics::IMU_DATA_RAW.with_depth(1000)))?;
        let joints = bag.add_topic(NewTopic::on(&topics::JOINT_STATES.with_depth(1000)))?;
        let fix = bag.add_topic(NewTopic::on(&topics::FIX.with_depth(10)))?;
        let velocity = bag.add_topic(NewTopic::on(&topics::AIDING_VELOCITY.with_depth(10)))?;
        for sample in &*self.samples {
            match sample {
                Sample::Imu(sample) => {
                    let time = sample.stamp.nanos().unsigned_abs();
                    bag.write(imu, time, &imu_from_sample(sample, IMU_LINK))?;
                }
                Sample::Joints(sample) => {
                    let time = sample.stamp.nanos().unsigned_abs();
                    let message: JointState = sample.to_message();
                    bag.write(joints, time, &message)?;
                }
                Sample::Fix(sample) => {
                    let time = sample.stamp.nanos().unsigned_abs();
                    if let Some(message) = message_of_fix(sample) {
                        bag.write(fix, time, &message)?;
                    }
                }
                Sample::Velocity(stamp, measurement) => {
                    let message = message_of_velocity(*stamp, measurement);
                    bag.write(velocity, stamp.nanos().unsigned_abs(), &message)?;
                }
            }
        }
        bag.finish()?;
        Ok(())
    }
}

fn message_of_fix(fix: &Fix) -> Option<NavSatFix> {
    let position = fix.position?;
    Some(
        PositionFix {
            stamp: fix.stamp,
            latitude_rad: position.latitude_rad,
            longitude_rad: position.longitude_rad,
            height_m: position.height_m,
            variance_m2: fix.sigma_m.component_mul(&fix.sigma_m),
        }
        .to_message(),
    )
}

fn message_of_velocity(
    stamp: Stamp,
    measurement: &VelocityMeasurement,
) -> TwistWithCovarianceStamped {
    let [east, north] = measurement.east_north;
    let [sigma_east, sigma_north] = measurement.sigma;
    VelocityFix {
        stamp,
        velocity: Vector3::new(east, north, 0.0),
        variance: Vector3::new(sigma_east * sigma_east, sigma_north * sigma_north, 0.0),
    }
    .to_message()
}

/// A table of one sensor from its columns.
fn table<'py>(
    py: Python<'py>,
    stamps: Vec<i64>,
    columns: &[(&str, Bound<'py, PyAny>)],
) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    table.set_item("stamp_ns", PyArray1::from_vec(py, stamps))?;
    for (name, column) in columns {
        table.set_item(name, column)?;
    }
    Ok(table)
}

#[pymethods]
impl Record {
    #[new]
    #[pyo3(signature = (*, imu, joints=None, fix=None, velocity=None))]
    fn new(
        imu: &Bound<'_, PyDict>,
        joints: Option<&Bound<'_, PyDict>>,
        fix: Option<&Bound<'_, PyDict>>,
        velocity: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut samples: Vec<(Stamp, Sample)> = Vec::new();
        let columns = Columns::new("imu", imu, &IMU_COLUMNS)?;
        let stamps = columns.stamps()?;
        let count = stamps.len();
        let rate = columns.needed::<3>(IMU_COLUMNS[0], count)?;
        let force = columns.needed::<3>(IMU_COLUMNS[1], count)?;
        let rate_variance = columns.rows::<3>(IMU_COLUMNS[2], count)?;
        let force_variance = columns.rows::<3>(IMU_COLUMNS[3], count)?;
        let row = |rows: &Option<Vec<[f64; 3]>>, k: usize| {
            rows.as_ref()
                .map_or_else(Vector3::zeros, |rows| rows[k].into())
        };
        samples.extend(stamps.into_iter().enumerate().map(|(k, stamp)| {
            let sample = ImuSample {
                stamp,
                angular_rate: rate[k].into(),
                specific_force: force[k].into(),
                angular_rate_variance: row(&rate_variance, k),
                specific_force_variance: row(&force_variance, k),
            };
            (stamp, Sample::Imu(sample))
        }));
        if let Some(joints) = joints {
            let columns = Columns::new("joints", joints, &["position", "velocity"])?;
            let stamps = columns.stamps()?;
            let position = columns.needed::<2>("position", stamps.len())?;
            let velocity = columns.rows::<2>("velocity", stamps.len())?;
            samples.extend(stamps.into_iter().enumerate().map(|(k, stamp)| {
                let sample = JointSample {
                    stamp,
                    position: position[k],
                    velocity: velocity.as_ref().map_or([0.0; 2], |rows| rows[k]),
                };
                (stamp, Sample::Joints(sample))
            }));
        }
        if let Some(fix) = fix {
            let columns = Columns::new("fix", fix, &["position", "sigma"])?;
            let stamps = columns.stamps()?;
            let position = columns.needed::<3>("position", stamps.len())?;
            let sigma = columns.rows::<3>("sigma", stamps.len())?;
            for (k, stamp) in stamps.into_iter().enumerate() {
                let [latitude_rad, longitude_rad, height_m] = position[k];
                let position = Position {
                    latitude_rad,
                    longitude_rad,
                    height_m,
                };
                let sample = Fix {
                    stamp,
                    position: Some(position.checked().map_err(Error::Sins)?),
                    sigma_m: row(&sigma, k),
                };
                samples.push((stamp, Sample::Fix(sample)));
            }
        }
        if let Some(velocity) = velocity {
            let columns = Columns::new("velocity", velocity, &["velocity", "sigma"])?;
            let stamps = columns.stamps()?;
            let value = columns.needed::<2>("velocity", stamps.len())?;
            let sigma = columns.needed::<2>("sigma", stamps.len())?;
            samples.extend(stamps.into_iter().enumerate().map(|(k, stamp)| {
                let measurement = VelocityMeasurement {
                    east_north: value[k],
                    sigma: sigma[k],
                };
                (stamp, Sample::Velocity(stamp, measurement))
            }));
        }
        // A stable sort: of one time, the IMU comes first, as a bag of the simulator has it.
        samples.sort_by_key(|(stamp, _)| *stamp);
        Ok(Self {
            name: "record".to_owned(),
            samples: Arc::new(samples.into_iter().map(|(_, sample)| sample).collect()),
            warnings: Vec::new(),
        })
    }

    /// Samples of the inertial measurement unit: columns as the constructor takes them.
    #[getter]
    fn imu<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let column = |of: fn(&ImuSample) -> &Vector3<f64>| -> PyResult<Bound<'py, PyAny>> {
            let values = self.imu_samples().map(|sample| (*of(sample)).into());
            Ok(rows::<3>(py, values)?.into_any())
        };
        let stamps = self.imu_samples().map(|s| s.stamp.nanos()).collect();
        table(
            py,
            stamps,
            &[
                (IMU_COLUMNS[0], column(|s| &s.angular_rate)?),
                (IMU_COLUMNS[1], column(|s| &s.specific_force)?),
                (IMU_COLUMNS[2], column(|s| &s.angular_rate_variance)?),
                (IMU_COLUMNS[3], column(|s| &s.specific_force_variance)?),
            ],
        )
    }

    /// Readings of the joints: columns as the constructor takes them.
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let stamps = self.joint_samples().map(|s| s.stamp.nanos()).collect();
        let position = rows(py, self.joint_samples().map(|s| s.position))?.into_any();
        let velocity = rows(py, self.joint_samples().map(|s| s.velocity))?.into_any();
        table(
            py,
            stamps,
            &[("position", position), ("velocity", velocity)],
        )
    }

    /// Positions of the satellite receiver: columns as the constructor takes them.
    #[getter]
    fn fix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let stamps = self.fixes().map(|(stamp, ..)| stamp.nanos()).collect();
        let places = self
            .fixes()
            .map(|(_, p, _)| [p.latitude_rad, p.longitude_rad, p.height_m]);
        let position = rows(py, places)?.into_any();
        let sigma = rows(py, self.fixes().map(|(.., sigma)| sigma.into()))?.into_any();
        table(py, stamps, &[("position", position), ("sigma", sigma)])
    }

    /// Velocities over ground: columns as the constructor takes them.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let stamps = self.velocities().map(|(stamp, _)| stamp.nanos()).collect();
        let value = rows(py, self.velocities().map(|(_, v)| v.east_north))?.into_any();
        let sigma = rows(py, self.velocities().map(|(_, v)| v.sigma))?.into_any();
        table(py, stamps, &[("velocity", value), ("sigma", sigma)])
    }

    /// What of the bag could not be read, a line each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Length, from the first sample of the IMU to the last [s].
    #[getter]
    fn duration_s(&self) -> f64 {
        let stamps = || self.imu_samples().map(|sample| sample.stamp);
        match (stamps().next(), stamps().last()) {
            (Some(first), Some(last)) => last.seconds_since(first),
            _ => 0.0,
        }
    }

    /// Writes a rosbag2-style MCAP bag: FILE.mcap, or the directory of a rosbag2.
    ///
    /// A file that is there is refused unless ``force``. Raises BagError.
    #[pyo3(signature = (path, *, force=false))]
    fn write(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let options = WriteOptions {
            replaces: force,
            ..WriteOptions::default()
        };
        Ok(py.detach(|| self.write_to(path, options))?)
    }

    fn __len__(&self) -> usize {
        self.imu_samples().count()
    }

    fn __repr__(&self) -> String {
        format!(
            "<Record {}: {} samples of the IMU, {:.1} s>",
            self.name,
            self.imu_samples().count(),
            self.duration_s()
        )
    }
}

/// Reads the sensors of a bag into memory.
///
/// path: MCAP file or rosbag2 directory. Topics are found by their usual names, or are the only ones of their type.
/// start_offset, duration: the part of it [s]. Raises BagError; what could not be decoded is in ``Record.warnings``.
#[pyfunction]
#[pyo3(signature = (path, *, start_offset=None, duration=None, imu_topic=None, joints_topic=None, fix_topic=None, velocity_topic=None))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    start_offset: Option<f64>,
    duration: Option<f64>,
    imu_topic: Option<String>,
    joints_topic: Option<String>,
    fix_topic: Option<String>,
    velocity_topic: Option<String>,
) -> PyResult<Record> {
    let options = SensorOptions {
        imu_topic,
        joints_topic,
        fix_topic,
        velocity_topic,
        start_offset,
        duration,
    };
    Ok(py.detach(|| -> Result<Record> { Record::of_bag(&Bag::open(path)?, &options) })?)
}
