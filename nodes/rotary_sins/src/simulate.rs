//! `rotary-sins simulate`: a ship, a turntable and an IMU into a bag.

use std::path::PathBuf;

use anyhow::bail;
use bags::{BagWriter, Compression, NewTopic, Qos, TopicId, WriteOptions};
use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use ros2_interfaces::{
    RosMessage,
    geometry_msgs::TwistWithCovarianceStamped,
    sensor_msgs::{Imu, JointState, NavSatFix},
};
use rotary_sins_msgs::convert::{ToMessage, imu_from_sample};
use rotary_sins_msgs::{Calibration, SchemeStatus};
use serde::Serialize;
use sins::{
    sensor::sample::NoiseDensity,
    simulation::{
        ImuErrorSettings, NoiseReading, PlantSettings, Run, Simulator, SimulatorSettings,
    },
    table::Turntable,
    table::scheme::{Sequencer, sequencer::SequencerSettings},
    time::Stamp,
    units::{DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G, PPM},
};

use crate::{
    Outcome, output,
    progress::SecondsBar,
    scheme_options::{self, ShipOptions, TableOptions},
};

/// Frame of the sensor block.
const IMU_LINK: &str = "imu_link";

/// Noise of the sensors.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Noise {
    /// 0.001 deg/√h and 10 ug/√Hz
    #[value(name = "D")]
    D,
    /// 0.001 deg/h/√Hz and 10 ug/√Hz
    #[value(name = "H")]
    H,
    /// None at all
    #[value(name = "none")]
    None,
}

/// Packing of the bag.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Packing {
    /// Small
    Zstd,
    /// Fast
    Lz4,
    /// Fastest to read
    None,
}

impl From<Packing> for Compression {
    fn from(packing: Packing) -> Self {
        match packing {
            Packing::Zstd => Self::Zstd,
            Packing::Lz4 => Self::Lz4,
            Packing::None => Self::None,
        }
    }
}

/// Options of `simulate`.
#[derive(Args)]
pub struct Options {
    /// eight-position, eight-position-yz, static, paper-experiment, or a YAML file
    #[arg(long, default_value = "eight-position", value_name = "NAME|FILE")]
    scheme: String,
    /// Length
    #[arg(long, default_value_t = 4.0)]
    hours: f64,
    /// Samples of the IMU a second
    #[arg(long, default_value_t = 100.0, value_name = "HZ")]
    rate: f64,
    /// Decides all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Bag to write: FILE.mcap, or the directory of a rosbag2
    #[arg(long, value_name = "BAG")]
    output: PathBuf,
    /// Packing of the bag
    #[arg(long, value_enum, default_value = "zstd")]
    compression: Packing,
    #[command(flatten)]
    ship: ShipOptions,
    #[command(flatten)]
    table: TableOptions,
    /// Joint states a second
    #[arg(long, default_value_t = 20.0, value_name = "HZ")]
    joint_state_rate: f64,
    /// Gyroscope drift x,y,z
    #[arg(long, value_delimiter = ',', num_args = 1..=3, default_values_t = [0.01; 3], value_name = "DEG/h", allow_negative_numbers = true)]
    gyroscope_drift_deg_per_hour: Vec<f64>,
    /// Accelerometer bias x,y,z
    #[arg(long, value_delimiter = ',', num_args = 1..=3, default_values_t = [100.0; 3], value_name = "ug", allow_negative_numbers = true)]
    accelerometer_bias_ug: Vec<f64>,
    /// Gyroscope scale factor errors x,y,z
    #[arg(long, value_delimiter = ',', num_args = 1..=3, default_values_t = [0.0; 3], value_name = "ppm", allow_negative_numbers = true)]
    gyroscope_scale_factor_ppm: Vec<f64>,
    /// Accelerometer scale factor errors x,y,z
    #[arg(long, value_delimiter = ',', num_args = 1..=3, default_values_t = [0.0; 3], value_name = "ppm", allow_negative_numbers = true)]
    accelerometer_scale_factor_ppm: Vec<f64>,
    /// White noise
    #[arg(long, value_enum, default_value = "D")]
    noise: Noise,
    /// White noise of the gyroscopes, instead of --noise
    #[arg(long, value_name = "DEG/√h")]
    angle_random_walk_deg_per_sqrt_hour: Option<f64>,
    /// White noise of the accelerometers, instead of --noise
    #[arg(long, value_name = "ug/√Hz")]
    velocity_random_walk_ug_per_sqrt_hz: Option<f64>,
    /// Time of the start, seconds since 1970
    #[arg(long, default_value_t = 1_760_000_000, value_name = "SECONDS")]
    start_time: u32,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

/// What was made, and what is true of it.
#[derive(Serialize)]
struct Report {
    /// Makes the same again.
    command: String,
    bag: PathBuf,
    scheme: String,
    seed: u64,
    duration_s: f64,
    messages: Vec<(String, u64)>,
    latitude_rad: f64,
    longitude_rad: f64,
    height_m: f64,
    heading_rad: f64,
    roll_rad: f64,
    pitch_rad: f64,
    gyroscope_drift_rad_s: [f64; 3],
    accelerometer_bias_m_s2: [f64; 3],
    /// From the block to East-North-Up, at the end.
    attitude_xyzw: [f64; 4],
}

/// The command line of this run.
fn command() -> String {
    let arguments = std::env::args().skip(1).map(|argument| {
        if argument.contains(char::is_whitespace) {
            format!("'{argument}'")
        } else {
            argument
        }
    });
    std::iter::once("rotary-sins".to_owned())
        .chain(arguments)
        .collect::<Vec<_>>()
        .join(" ")
}

/// One value for all axes, or one for each.
fn triple(name: &str, values: &[f64]) -> anyhow::Result<Vector3<f64>> {
    match *values {
        [all] => Ok(Vector3::repeat(all)),
        [x, y, z] => Ok(Vector3::new(x, y, z)),
        _ => bail!("{name} has {} values, expected 1 or 3", values.len()),
    }
}

impl Options {
    fn errors(&self) -> anyhow::Result<ImuErrorSettings> {
        let mut settings = ImuErrorSettings::perfect();
        let errors = &mut settings.errors;
        errors.gyroscope_drift = triple(
            "--gyroscope-drift-deg-per-hour",
            &self.gyroscope_drift_deg_per_hour,
        )? * DEG_PER_HOUR;
        errors.accelerometer_bias =
            triple("--accelerometer-bias-ug", &self.accelerometer_bias_ug)? * MICRO_G;
        let scale = triple(
            "--gyroscope-scale-factor-ppm",
            &self.gyroscope_scale_factor_ppm,
        )? * PPM;
        errors.gyroscope_matrix.set_diagonal(&scale);
        let scale = triple(
            "--accelerometer-scale-factor-ppm",
            &self.accelerometer_scale_factor_ppm,
        )? * PPM;
        errors.accelerometer_matrix.set_diagonal(&scale);
        settings.noise = match self.noise {
            Noise::D => NoiseReading::D.density(),
            Noise::H => NoiseReading::H.density(),
            Noise::None => NoiseDensity {
                gyroscope: Vector3::zeros(),
                accelerometer: Vector3::zeros(),
            },
        };
        if let Some(density) = self.angle_random_walk_deg_per_sqrt_hour {
            settings.noise.gyroscope = Vector3::repeat(density * DEG_PER_SQRT_HOUR);
        }
        if let Some(density) = self.velocity_random_walk_ug_per_sqrt_hz {
            settings.noise.accelerometer = Vector3::repeat(density * MICRO_G);
        }
        Ok(settings)
    }

    fn settings(&self, turntable: Turntable) -> anyhow::Result<SimulatorSettings> {
        Ok(SimulatorSettings {
            plant: PlantSettings {
                ship: self.ship.ship(),
                turntable,
                imu_rate_hz: self.rate,
                start: Stamp::from_nanos(i64::from(self.start_time) * 1_000_000_000),
                ..PlantSettings::default()
            },
            imu: self.errors()?,
            joint_state_rate_hz: self.joint_state_rate,
            seed: self.seed,
            ..SimulatorSettings::default()
        })
    }
}

/// The bag with its topics.
struct Output {
    bag: BagWriter,
    imu: TopicId,
    joints: TopicId,
    fix: TopicId,
    velocity: TopicId,
    status: TopicId,
    truth: TopicId,
    last_status: Option<SchemeStatus>,
}

impl Output {
    fn new(options: &Options) -> Result<Self, bags::Error> {
        let write_options = WriteOptions {
            compression: options.compression.into(),
            ..WriteOptions::default()
        };
        let mut bag = BagWriter::create(&options.output, write_options)?;
        let samples = Qos::reliable(1000);
        Ok(Self {
            imu: bag.add_topic(NewTopic::of::<Imu>("/imu/data_raw", samples))?,
            joints: bag.add_topic(NewTopic::of::<JointState>(
                "/turntable/joint_states",
                samples,
            ))?,
            fix: bag.add_topic(NewTopic::of::<NavSatFix>("/fix", Qos::reliable(10)))?,
            velocity: bag.add_topic(NewTopic::of::<TwistWithCovarianceStamped>(
                "/aiding/velocity",
                Qos::reliable(10),
            ))?,
            status: bag.add_topic(NewTopic::of::<SchemeStatus>(
                "/scheme/status",
                Qos::latched(1),
            ))?,
            truth: bag.add_topic(NewTopic::of::<Calibration>(
                "/ground_truth/calibration",
                Qos::latched(1),
            ))?,
            bag,
            last_status: None,
        })
    }

    fn write<M: RosMessage>(
        &mut self,
        topic: TopicId,
        stamp: Stamp,
        message: &M,
    ) -> Result<(), bags::Error> {
        self.bag.write(topic, stamp.nanos().unsigned_abs(), message)
    }

    /// Writes the status where step or state are new.
    fn write_status(&mut self, stamp: Stamp, status: SchemeStatus) -> Result<(), bags::Error> {
        let place = |s: &SchemeStatus| (s.state, s.cycle, s.step);
        if self.last_status.as_ref().map(place) == Some(place(&status)) {
            return Ok(());
        }
        let result = self.write(self.status, stamp, &status);
        self.last_status = Some(status);
        result
    }
}

/// Simulates and writes.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    if !(options.hours > 0.0 && options.hours <= 10_000.0) {
        bail!(
            "--hours is {}, expected more than 0 and at most 10000",
            options.hours
        );
    }
    let scheme = scheme_options::scheme(&options.scheme)?;
    let turntable = options.table.table(&scheme)?;
    let settings = options.settings(turntable)?;
    let simulator = Simulator::new(settings)?;
    let sequencer = Sequencer::new(scheme.program(turntable)?, SequencerSettings::default())?;
    let start = settings.plant.start;
    let duration_s = options.hours * 3600.0;
    let mut output = Output::new(options)?;
    let progress = SecondsBar::new("simulating", duration_s);
    let plant = simulator.plant();
    let truth =
        Calibration::ground_truth(start, &settings.imu.errors, plant.attitude(), plant.ship());
    output.write(output.truth, start, &truth)?;
    output.write(
        output.joints,
        start,
        &ToMessage::<JointState>::to_message(&simulator.first_joints()),
    )?;
    let mut run = Run::new(simulator, sequencer, duration_s);
    let mut count = 0_u64;
    while let Some(tick) = run.next() {
        let tick = tick?;
        let stamp = tick.imu.stamp;
        output.write(output.imu, stamp, &imu_from_sample(&tick.imu, IMU_LINK))?;
        if let Some(joints) = &tick.joints {
            output.write(
                output.joints,
                stamp,
                &ToMessage::<JointState>::to_message(joints),
            )?;
        }
        if let Some(position) = &tick.position {
            output.write(
                output.fix,
                stamp,
                &ToMessage::<NavSatFix>::to_message(position),
            )?;
        }
        if let Some(velocity) = &tick.velocity {
            output.write(
                output.velocity,
                stamp,
                &ToMessage::<TwistWithCovarianceStamped>::to_message(velocity),
            )?;
        }
        if tick.joints.is_some() {
            output.write_status(stamp, run.sequencer().status().to_message())?;
        }
        count += 1;
        if count.is_multiple_of(10_000) {
            progress.set(stamp.seconds_since(start));
        }
    }
    drop(progress);
    let summary = output.bag.finish()?;
    let errors = &settings.imu.errors;
    let ship = settings.plant.ship;
    let report = Report {
        command: command(),
        bag: summary.path,
        scheme: scheme.name,
        seed: options.seed,
        duration_s,
        messages: summary.counts,
        latitude_rad: ship.latitude_rad,
        longitude_rad: ship.longitude_rad,
        height_m: ship.height_m,
        heading_rad: ship.heading_rad,
        roll_rad: ship.roll_rad,
        pitch_rad: ship.pitch_rad,
        attitude_xyzw: run.simulator().plant().attitude().coords.into(),
        gyroscope_drift_rad_s: errors.gyroscope_drift.into(),
        accelerometer_bias_m_s2: errors.accelerometer_bias.into(),
    };
    if options.json {
        output::json(&report)?;
    } else {
        output::text_line(&format!(
            "{}: {duration_s} s of {}, {count} samples of the IMU",
            report.bag.display(),
            report.scheme
        ))?;
    }
    Ok(Outcome::Reached)
}
