//! Parameters: declared in the units people use, with their places in the settings of the simulator.

mod aiding;
mod imu;
mod motion;
mod sensor;
mod ship;
mod table;

pub use aiding::aiding;
pub use imu::imu_errors;
pub use motion::motion;
pub use sensor::table_errors;
pub use ship::ship;
pub use table::encoders;

use anyhow::Context;
use ros_node::{ParameterSet, Parameters, Unit};
use sins::simulation::{GRADE_NAMES, SensorGrade, SimulatorSettings};
use sins::table::Turntable;
use sins::time::{NANOS_PER_SECOND, Stamp};

/// Everything the node is told.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// For the simulator itself.
    pub simulator: SimulatorSettings,
    /// What kind of sensor is drawn; [`SensorGrade::Table1`] leaves it to the single errors.
    pub sensor: SensorGrade,
    /// Multiple of real time; 0: as fast as the subscribers take it.
    pub speed: f64,
    /// End after this much simulated time \[s\].
    pub duration_s: Option<f64>,
    /// Whether velocities are published.
    pub velocity_aiding: bool,
    /// `topic:count`, for which the first sample waits.
    pub wait_for: Vec<String>,
    /// How long it waits \[s\]; `None`: for ever.
    pub wait_timeout_s: Option<f64>,
    /// How long simulated time stands still for a subscriber that does not acknowledge \[s\].
    pub publish_timeout_s: f64,
}

impl Default for Settings {
    fn default() -> Self {
        let mut simulator = SimulatorSettings::default();
        // A stamp of 0 is one that was never set.
        simulator.plant.start = Stamp::from_nanos(1_760_000_000 * NANOS_PER_SECOND);
        Self {
            simulator,
            sensor: SensorGrade::Table1,
            speed: 1.0,
            duration_s: None,
            velocity_aiding: true,
            wait_for: Vec::new(),
            wait_timeout_s: None,
            publish_timeout_s: 60.0,
        }
    }
}

/// Rates, seed and start.
pub fn run() -> ParameterSet<SimulatorSettings> {
    let base = Settings::default().simulator;
    let start_s = base.plant.start.nanos() / NANOS_PER_SECOND;
    ParameterSet::new("Simulation", base)
        .number(
            "imu_rate_hz",
            Unit::HERTZ,
            1.0..=1000.0,
            |s| &mut s.plant.imu_rate_hz,
            "Samples of the IMU a second",
        )
        .number(
            "joint_state_rate_hz",
            Unit::HERTZ,
            0.1..=1000.0,
            |s| &mut s.joint_state_rate_hz,
            "Joint states a second, at stamps of IMU samples",
        )
        .count(
            "seed",
            0..=9_000_000_000_000_000,
            |s| &mut s.seed,
            "Seed, which decides all noise",
        )
        .value(
            "start_time_s",
            start_s,
            "Simulated time of the start, since 1970",
            |s, seconds: i64| {
                s.plant.start = Stamp::from_nanos(seconds * NANOS_PER_SECOND);
                Ok(())
            },
        )
        .range(0.0..=2_147_483_647.0)
        .unit(Unit::SECOND)
}

/// All parameters of the node.
pub fn declared() -> ParameterSet<Settings> {
    ParameterSet::new("Simulation", Settings::default())
        .include(run(), |s| &mut s.simulator)
        .number(
            "speed",
            Unit::NONE,
            0.0..=1e6,
            |s| &mut s.speed,
            "Multiple of real time; 0: as fast as the subscribers take it",
        )
        .optional(
            "duration_s",
            Unit::SECOND,
            (0.0..=1e9, 0.0),
            |s| &mut s.duration_s,
            "Simulated time after which the node ends; 0: never",
        )
        .texts(
            "wait_for_subscribers",
            |s| &mut s.wait_for,
            "Simulated time starts when each topic has so many other ends, as TOPIC:COUNT",
        )
        .optional(
            "wait_timeout_s",
            Unit::SECOND,
            (0.0..=1e6, 0.0),
            |s| &mut s.wait_timeout_s,
            "Time by which they must be there, else the node ends with an error; 0: wait for ever",
        )
        .number(
            "publish_timeout_s",
            Unit::SECOND,
            0.0..=1e6,
            |s| &mut s.publish_timeout_s,
            "Simulated time stands still so long for a subscriber that does not acknowledge, then samples are dropped",
        )
        .include(ship(), |s| &mut s.simulator.plant.ship)
        .include(motion(), |s| &mut s.simulator.plant.motion)
        .include(node_parameters::axes(), |s| &mut s.simulator.plant.turntable)
        .include(table::drives(), |s| &mut s.simulator.plant.table)
        .include(table_errors(), |s| &mut s.simulator.plant)
        .group("Sensor errors")
        .value(
            "sensor",
            SensorGrade::Table1.name().to_owned(),
            "Kind of sensor, drawn by the seed with its table: table-1 leaves it to what stands below, the others take its place",
            |s, name: String| {
                s.sensor = SensorGrade::named(&name).map_err(|error| error.to_string())?;
                Ok(())
            },
        )
        .one_of(&GRADE_NAMES)
        .include(imu_errors(), |s| &mut s.simulator.imu)
        .include(encoders(), |s| &mut s.simulator.encoder)
        .include(aiding(), |s| &mut s.simulator.aiding)
        .group("Aiding")
        .switch(
            "velocity_aiding",
            |s| &mut s.velocity_aiding,
            "Whether aiding/velocity is published",
        )
}

/// Puts a drawn sensor in the place of the single errors, where a kind is asked for.
fn draw(settings: &mut Settings) {
    if settings.sensor != SensorGrade::Table1 {
        let drawn = settings.sensor.draw(settings.simulator.seed);
        settings.simulator.imu = drawn.imu;
        settings.simulator.plant.table_errors = drawn.table;
        settings.simulator.encoder = drawn.encoder;
    }
}

/// The parameters of a node as settings.
///
/// # Errors
/// A value that means nothing, by its name.
pub fn settings(parameters: &Parameters) -> anyhow::Result<Settings> {
    let mut settings = declared().read(parameters)?;
    draw(&mut settings);
    let Turntable { outer, inner } = settings.simulator.plant.turntable;
    Turntable::new(outer, inner).context("parameters 'outer_axis' and 'inner_axis'")?;
    Ok(settings)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use sins::simulation::ImuErrorSettings;

    use super::*;

    /// The defaults are those of the simulator to the last bit, but for its start.
    #[test]
    fn defaults_are_those_of_the_simulator() {
        let parameters = Parameters::defaults(declared().declarations()).unwrap();
        let read = settings(&parameters).unwrap();
        assert_eq!(read, Settings::default());
        let mut simulator = read.simulator;
        simulator.plant.start = SimulatorSettings::default().plant.start;
        assert_eq!(simulator, SimulatorSettings::default());
    }

    /// A kind of sensor takes the place of the single errors, by the seed; table-1 leaves them.
    #[test]
    fn a_grade_is_drawn() {
        let set = declared();
        let read = |sensor: &str| {
            let mut settings = set.base().clone();
            set.put(&mut settings, "sensor", &sensor.to_owned().into())
                .unwrap();
            draw(&mut settings);
            settings.simulator
        };
        assert_eq!(read("table-1").imu, ImuErrorSettings::default());
        let laser = read("ring-laser");
        assert_eq!(laser.imu, SensorGrade::RingLaser.draw(1).imu);
        assert_eq!(
            laser.plant.table_errors,
            SensorGrade::RingLaser.draw(1).table
        );
    }
}
