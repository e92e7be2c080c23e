//! Parameters: declared in the units people use, with their places in the settings of the simulator.

mod motion;
mod sensor;

pub use motion::motion;
pub use sensor::table_errors;

use anyhow::Context;
use node_parameters::units::{
    ARC_SECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_SECOND, DEGREE_PER_SECOND2,
    DEGREE_PER_SQRT_HOUR, MICRO_G, MICRO_G_PER_SQRT_HERTZ, PPM,
};
use ros_node::{ParameterSet, Parameters, Unit};
use sins::simulation::{
    AidingSettings, EncoderSettings, GRADE_NAMES, ImuErrorSettings, SensorGrade, Ship,
    SimulatorSettings, TableSettings, TimeWindow,
};
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

/// Where the ship lies and how.
pub fn ship() -> ParameterSet<Ship> {
    ParameterSet::new("Ship", Ship::default())
        .number(
            "latitude_deg",
            DEGREE,
            -89.9..=89.9,
            |s| &mut s.latitude_rad,
            "Latitude of the ship, WGS-84, north positive",
        )
        .number(
            "longitude_deg",
            DEGREE,
            -180.0..=360.0,
            |s| &mut s.longitude_rad,
            "Longitude of the ship, east positive",
        )
        .number(
            "height_m",
            Unit::METRE,
            -500.0..=20_000.0,
            |s| &mut s.height_m,
            "Height of the ship above the ellipsoid",
        )
        .number(
            "heading_deg",
            DEGREE,
            -360.0..=360.0,
            |s| &mut s.heading_rad,
            "Heading of the y axis, clockwise from true north",
        )
        .number(
            "roll_deg",
            DEGREE,
            -90.0..=90.0,
            |s| &mut s.roll_rad,
            "Roll about the y axis, starboard down positive",
        )
        .number(
            "pitch_deg",
            DEGREE,
            -89.0..=89.0,
            |s| &mut s.pitch_rad,
            "Pitch about the x axis, bow up positive",
        )
}

/// What the drives of the table can do, and where it stands.
fn table() -> ParameterSet<TableSettings> {
    ParameterSet::new("Table", TableSettings::default())
        .numbers(
            "start_angles_deg",
            DEGREE,
            -3600.0..=3600.0,
            |s| &mut s.start,
            "Where the joints stand at first: outer, inner",
        )
        .number(
            "max_rate_deg_per_s",
            DEGREE_PER_SECOND,
            0.001..=3600.0,
            |s| &mut s.max_rate_rad_s,
            "A trajectory that asks for more is refused",
        )
        .number(
            "stop_deceleration_deg_per_s2",
            DEGREE_PER_SECOND2,
            0.001..=3600.0,
            |s| &mut s.stop_deceleration_rad_s2,
            "With this an empty trajectory stops the joints",
        )
        .value(
            "stuck_joint",
            "none".to_owned(),
            "Joint whose drive is blocked, to see what becomes of it: it takes commands and stays where it is",
            |s, name: String| {
                s.stuck = ["outer", "inner"].map(|joint| name == joint || name == "both");
                Ok(())
            },
        )
        .one_of(&["none", "outer", "inner", "both"])
}

/// Errors of the IMU and its noise.
pub fn imu_errors() -> ParameterSet<ImuErrorSettings> {
    let set = ParameterSet::new("Sensor errors", ImuErrorSettings::default())
        .numbers(
            "gyroscope_drift_deg_per_hour",
            DEGREE_PER_HOUR,
            -1e6..=1e6,
            |s| s.errors.gyroscope_drift.as_mut_slice(),
            "Gyroscope drifts x, y, z, measured minus true",
        )
        .numbers(
            "accelerometer_bias_ug",
            MICRO_G,
            -1e7..=1e7,
            |s| s.errors.accelerometer_bias.as_mut_slice(),
            "Accelerometer biases x, y, z, measured minus true",
        )
        .array::<3>(
            "gyroscope_scale_factor_ppm",
            PPM,
            -5e5..=5e5,
            (
                |s| s.errors.gyroscope_matrix.diagonal().into(),
                |s, scale| s.errors.gyroscope_matrix.set_diagonal(&scale.into()),
            ),
            "Scale factor errors of the gyroscopes x, y, z",
        )
        .array::<3>(
            "accelerometer_scale_factor_ppm",
            PPM,
            -5e5..=5e5,
            (
                |s| s.errors.accelerometer_matrix.diagonal().into(),
                |s, scale| s.errors.accelerometer_matrix.set_diagonal(&scale.into()),
            ),
            "Scale factor errors of the accelerometers x, y, z",
        )
        .array::<6>(
            "gyroscope_installation_arcsec",
            ARC_SECOND,
            -36_000.0..=36_000.0,
            (
                |s| {
                    let k = &s.errors.gyroscope_matrix;
                    [k.m12, k.m13, k.m21, k.m23, k.m31, k.m32]
                },
                |s, angles| {
                    let k = &mut s.errors.gyroscope_matrix;
                    [k.m12, k.m13, k.m21, k.m23, k.m31, k.m32] = angles;
                },
            ),
            "Installation angles of the gyroscopes, the elements of K_g off its diagonal: xy, xz, yx, yz, zx, zy",
        )
        .array::<3>(
            "accelerometer_installation_arcsec",
            ARC_SECOND,
            -36_000.0..=36_000.0,
            (
                |s| {
                    let k = &s.errors.accelerometer_matrix;
                    [k.m21, k.m31, k.m32]
                },
                |s, angles| {
                    let k = &mut s.errors.accelerometer_matrix;
                    [k.m21, k.m31, k.m32] = angles;
                },
            ),
            "Installation angles of the accelerometers, the elements of K_a below its diagonal: yx, zx, zy",
        )
        .uniform(
            "angle_random_walk_deg_per_sqrt_hour",
            DEGREE_PER_SQRT_HOUR,
            0.0..=1000.0,
            |s| s.noise.gyroscope.as_mut_slice(),
            "White noise of the gyroscopes",
        )
        .uniform(
            "velocity_random_walk_ug_per_sqrt_hz",
            MICRO_G_PER_SQRT_HERTZ,
            0.0..=1e6,
            |s| s.noise.accelerometer.as_mut_slice(),
            "White noise of the accelerometers",
        );
    sensor::beyond_table_1(set)
}

/// Errors of the encoders.
pub fn encoders() -> ParameterSet<EncoderSettings> {
    ParameterSet::new("Encoders", EncoderSettings::default())
        .number(
            "encoder_resolution_arcsec",
            ARC_SECOND,
            0.0..=1e6,
            |s| &mut s.resolution_rad,
            "Smallest step of a joint angle; 0: none",
        )
        .number(
            "encoder_noise_arcsec",
            ARC_SECOND,
            0.0..=1e6,
            |s| &mut s.position_std_rad,
            "1 sigma of a joint angle",
        )
        .number(
            "encoder_rate_noise_deg_per_s",
            DEGREE_PER_SECOND,
            0.0..=1e6,
            |s| &mut s.rate_std_rad_s,
            "1 sigma of a joint rate",
        )
}

/// Noise of what the ship says of herself.
pub fn aiding() -> ParameterSet<AidingSettings> {
    let set = ParameterSet::new("Aiding", AidingSettings::default())
        .number(
            "velocity_noise_m_per_s",
            Unit::METRE_PER_SECOND,
            0.0..=1e6,
            |s| &mut s.velocity_std_m_s,
            "1 sigma of aiding/velocity, every axis",
        )
        .number(
            "position_noise_m",
            Unit::METRE,
            0.0..=1e6,
            |s| &mut s.horizontal_std_m,
            "1 sigma of fix, East and North",
        )
        .number(
            "height_noise_m",
            Unit::METRE,
            0.0..=1e6,
            |s| &mut s.vertical_std_m,
            "1 sigma of the height of fix",
        )
        .number(
            "position_rate_hz",
            Unit::HERTZ,
            0.001..=100.0,
            |s| &mut s.position_rate_hz,
            "Positions a second",
        )
        .number(
            "velocity_rate_hz",
            Unit::HERTZ,
            0.001..=100.0,
            |s| &mut s.velocity_rate_hz,
            "Velocities a second",
        )
        .numbers(
            "antenna_arm_m",
            Unit::METRE,
            -500.0..=500.0,
            |s| s.antenna_arm_m.as_mut_slice(),
            "Where both are measured, from the table's centre: starboard, forward, up",
        );
    aiding_faults(set)
}

/// What goes wrong with it on a real ship.
fn aiding_faults(set: ParameterSet<AidingSettings>) -> ParameterSet<AidingSettings> {
    set.number(
        "position_latency_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.position_latency_s,
        "How old a position is at its stamp",
    )
    .number(
        "velocity_latency_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.velocity_latency_s,
        "How old a velocity is at its stamp",
    )
    .number(
        "outlier_probability",
        Unit::NONE,
        0.0..=1.0,
        |s| &mut s.outlier_probability,
        "Part of the positions that are outliers",
    )
    .number(
        "outlier_m",
        Unit::METRE,
        0.0..=1e6,
        |s| &mut s.outlier_std_m,
        "1 sigma of an outlier",
    )
    .numbers(
        "position_lie_m",
        Unit::METRE,
        -1e6..=1e6,
        |s| s.position_lie_m.as_mut_slice(),
        "What is added to positions while they lie: East, North, Up",
    )
    .array::<3>(
        "position_lie_window_s",
        Unit::SECOND,
        0.0..=1e9,
        (
            |s| window(&s.position_lies),
            |s, w| s.position_lies = window_of(w),
        ),
        "When positions lie: start, length (0: never), period (0: once)",
    )
    .numbers(
        "velocity_lie_m_per_s",
        Unit::METRE_PER_SECOND,
        -1e3..=1e3,
        |s| s.velocity_lie_m_s.as_mut_slice(),
        "What is added to velocities while they lie: East, North, Up",
    )
    .array::<3>(
        "velocity_lie_window_s",
        Unit::SECOND,
        0.0..=1e9,
        (
            |s| window(&s.velocity_lies),
            |s, w| s.velocity_lies = window_of(w),
        ),
        "When velocities lie: start, length (0: never), period (0: once)",
    )
    .array::<3>(
        "dropout_window_s",
        Unit::SECOND,
        0.0..=1e9,
        (|s| window(&s.dropouts), |s, w| s.dropouts = window_of(w)),
        "When neither position nor velocity comes: start, length (0: never), period (0: once)",
    )
    .number(
        "fix_variance_ratio",
        Unit::NONE,
        0.0..=1e6,
        |s| &mut s.stated_variance_ratio,
        "Variance that a position states over that of its noise; 0: it states none",
    )
}

fn window(window: &TimeWindow) -> [f64; 3] {
    [window.start_s, window.duration_s, window.period_s]
}

fn window_of([start_s, duration_s, period_s]: [f64; 3]) -> TimeWindow {
    TimeWindow {
        start_s,
        duration_s,
        period_s,
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
        .include(table(), |s| &mut s.simulator.plant.table)
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
    use nalgebra::{Matrix3, Vector3};

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

    /// Installation angles and scale factors land where their names say.
    #[test]
    fn matrices_are_filled_by_name() {
        let set = imu_errors();
        let mut settings = *set.base();
        for (name, values) in [
            (
                "gyroscope_installation_arcsec",
                vec![12.0, 13.0, 21.0, 23.0, 31.0, 32.0],
            ),
            ("gyroscope_scale_factor_ppm", vec![1.0, 2.0, 3.0]),
            ("accelerometer_installation_arcsec", vec![21.0, 31.0, 32.0]),
            ("accelerometer_scale_factor_ppm", vec![4.0, 5.0, 6.0]),
        ] {
            set.put(&mut settings, name, &values.into()).unwrap();
        }
        let (angle, ppm) = (ARC_SECOND.to_si(1.0), PPM.to_si(1.0));
        let scaled = |angles: Matrix3<f64>, scale: Vector3<f64>| {
            angles * angle + Matrix3::from_diagonal(&(scale * ppm))
        };
        let k = Matrix3::new(0.0, 12.0, 13.0, 21.0, 0.0, 23.0, 31.0, 32.0, 0.0);
        let errors = &settings.errors;
        assert_eq!(
            errors.gyroscope_matrix,
            scaled(k, Vector3::new(1.0, 2.0, 3.0))
        );
        let k = Matrix3::new(0.0, 0.0, 0.0, 21.0, 0.0, 0.0, 31.0, 32.0, 0.0);
        assert_eq!(
            errors.accelerometer_matrix,
            scaled(k, Vector3::new(4.0, 5.0, 6.0))
        );
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

    /// Arms are given accelerometer by accelerometer, windows as start, length and period.
    #[test]
    fn rows_and_windows_are_filled_in_order() {
        let set = imu_errors();
        let mut settings = *set.base();
        let arms: Vec<f64> = (1..=9).map(f64::from).collect();
        set.put(&mut settings, "accelerometer_arms_mm", &arms.into())
            .unwrap();
        assert_eq!(settings.errors.accelerometer_arms[(1, 2)], 6e-3);
        let set = aiding();
        let mut settings = *set.base();
        set.put(
            &mut settings,
            "dropout_window_s",
            &vec![7.0, 5.0, 100.0].into(),
        )
        .unwrap();
        assert!(settings.dropouts.contains(108.0) && !settings.dropouts.contains(6.0));
    }
}
