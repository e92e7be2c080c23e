//! `rotary-sins simulate`: a ship, a turntable and an IMU into a bag.

use std::collections::BTreeMap;
use std::path::PathBuf;

use analysis::{SimulatedBag, write_simulated_bag};
use anyhow::bail;
use bags::{Compression, WriteOptions};
use clap::{Args, ValueEnum};
use ros_node::ParameterSet;
use serde::Serialize;
use sins::{
    machines::self_calibration::named_errors,
    simulation::{
        AidingSettings, EncoderSettings, GRADE_NAMES, ImuErrorSettings, MotionSettings,
        NoiseReading, PlantSettings, SensorGrade, SimulatorSettings,
    },
    table::Turntable,
};

use crate::{
    Outcome, output,
    parameter_options::{Given, Group},
    progress::SecondsBar,
    scheme_options::{self, ShipOptions, TableOptions},
};

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
    /// eight-position, eight-position-yz, static, paper-experiment, designed, or a YAML file
    #[arg(long, default_value = "eight-position", value_name = "NAME|FILE")]
    scheme: String,
    /// Length
    #[arg(long, default_value_t = 4.0)]
    hours: f64,
    #[command(flatten)]
    run: Given<RunGroup>,
    /// Bag to write: FILE.mcap, or the directory of a rosbag2
    #[arg(long, value_name = "BAG")]
    output: PathBuf,
    /// Replace FILE.mcap where it is there already
    #[arg(long)]
    force: bool,
    /// Packing of the bag
    #[arg(long, value_enum, default_value = "zstd")]
    compression: Packing,
    #[command(flatten)]
    ship: ShipOptions,
    #[command(flatten)]
    table: TableOptions,
    #[command(flatten)]
    motion: Given<MotionGroup>,
    /// Kind of sensor, drawn by the seed with its table and encoders; single errors that are given take their place in it
    #[arg(long, value_parser = GRADE_NAMES, default_value = "table-1", value_name = "KIND")]
    sensor: String,
    #[command(flatten)]
    errors: Given<ErrorGroup>,
    #[command(flatten)]
    table_errors: Given<TableErrorGroup>,
    #[command(flatten)]
    encoders: Given<EncoderGroup>,
    #[command(flatten)]
    aiding: Given<AidingGroup>,
    /// White noise [default: D, or by --sensor]
    #[arg(long, value_enum)]
    noise: Option<Noise>,
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
    /// Every error of sensors and table by its name, at the end; left out where drifts and biases are all.
    #[serde(skip_serializing_if = "Option::is_none")]
    states: Option<BTreeMap<&'static str, f64>>,
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

/// A group of the node `imu_simulator` as options.
macro_rules! group {
    ($(#[$doc:meta])* $name:ident, $settings:ty, $heading:literal, $set:ident $(, $constant:ident = $pairs:expr)*) => {
        $(#[$doc])*
        #[derive(Clone, Debug)]
        struct $name;

        impl Group for $name {
            type Settings = $settings;
            const HEADING: &'static str = $heading;
            $(const $constant: &'static [(&'static str, &'static str)] = &$pairs;)*

            fn set() -> ParameterSet<$settings> {
                imu_simulator::parameters::$set()
            }
        }
    };
}

group!(
    /// Rates, seed and start.
    RunGroup, SimulatorSettings, "Simulation", run,
    NAMES = [
        ("imu_rate_hz", "rate"),
        ("joint_state_rate_hz", "joint-state-rate"),
        ("start_time_s", "start-time"),
    ]
);
group!(
    /// Errors of the IMU; its noise is by the paper's readings where it is not given.
    ErrorGroup, ImuErrorSettings, "Sensor errors", imu_errors,
    DECIDED_BY = [
        ("angle_random_walk_deg_per_sqrt_hour", "--noise"),
        ("velocity_random_walk_ug_per_sqrt_hz", "--noise"),
    ]
);
group!(
    /// How the ship moves.
    MotionGroup, MotionSettings, "Ship's motion", motion
);
group!(
    /// Errors of the table.
    TableErrorGroup, PlantSettings, "Table errors", table_errors
);
group!(
    /// Errors of the encoders.
    EncoderGroup, EncoderSettings, "Encoders", encoders
);
group!(
    /// Noise of position and velocity.
    AidingGroup, AidingSettings, "Aiding", aiding
);

impl Options {
    fn settings(&self, turntable: Turntable) -> anyhow::Result<SimulatorSettings> {
        let run = self.run.settings()?;
        let drawn = SensorGrade::named(&self.sensor)?.draw(run.seed);
        let mut imu = drawn.imu;
        if let Some(noise) = self.noise {
            imu.noise = match noise {
                Noise::D => NoiseReading::D.density(),
                Noise::H => NoiseReading::H.density(),
                Noise::None => ImuErrorSettings::perfect().noise,
            };
        }
        self.errors.apply(&mut imu)?;
        let mut encoder = drawn.encoder;
        self.encoders.apply(&mut encoder)?;
        let mut plant = PlantSettings {
            ship: self.ship.settings()?,
            motion: self.motion.settings()?,
            turntable,
            table_errors: drawn.table,
            ..run.plant
        };
        self.table_errors.apply(&mut plant)?;
        Ok(SimulatorSettings {
            plant,
            imu,
            encoder,
            aiding: self.aiding.settings()?,
            ..run
        })
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
    let duration_s = options.hours * 3600.0;
    let write_options = WriteOptions {
        compression: options.compression.into(),
        replaces: options.force,
        ..WriteOptions::default()
    };
    let progress = SecondsBar::new("simulating", duration_s);
    let path = &options.output;
    let SimulatedBag {
        summary,
        run,
        samples,
    } = write_simulated_bag(
        path,
        write_options,
        &scheme,
        settings,
        duration_s,
        &progress,
    )?;
    drop(progress);
    let errors = &run.simulator().sensor_errors();
    let table = &settings.plant.table_errors;
    let ship = settings.plant.ship;
    let report = Report {
        command: command(),
        bag: summary.path,
        scheme: scheme.name,
        seed: settings.seed,
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
        states: (!errors.is_constant() || !table.is_zero())
            .then(|| named_errors(errors, table).into_iter().collect()),
    };
    if options.json {
        output::json(&report)?;
    } else {
        output::text_line(&format!(
            "{}: {duration_s} s of {}, {samples} samples of the IMU",
            report.bag.display(),
            report.scheme
        ))?;
    }
    Ok(Outcome::Reached)
}
