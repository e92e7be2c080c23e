//! Parameters: declared in the units people use, turned into settings in SI units.

use std::time::Duration;

use anyhow::Context;
use nalgebra::{Matrix3, Vector3};
use ros_node::{Node, Parameter};
use sins::sensor::errors::SensorErrors;
use sins::sensor::sample::NoiseDensity;
use sins::simulation::{
    AidingSettings, EncoderSettings, ImuErrorSettings, PlantSettings, Ship, SimulatorSettings,
    TableSettings,
};
use sins::table::{Axis, Turntable};
use sins::time::Stamp;
use sins::units::{ARC_SECOND, DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G, PPM};

/// Everything the node is told.
#[derive(Clone, Debug)]
pub struct Settings {
    /// For the simulator itself.
    pub simulator: SimulatorSettings,
    /// Multiple of real time; 0: as fast as the subscribers take it.
    pub speed: f64,
    /// End after this much simulated time; 0: never \[s\].
    pub duration_s: f64,
    /// Whether velocities are published.
    pub velocity_aiding: bool,
    /// `topic:count`, for which the first sample waits.
    pub wait_for: Vec<String>,
    /// How long it waits; `None`: for ever.
    pub wait_timeout: Option<Duration>,
    /// How long simulated time stands still for a subscriber that does not acknowledge.
    pub publish_timeout: Duration,
}

/// All parameters of the node.
pub fn declarations() -> Vec<Parameter> {
    let mut all = place();
    all.extend(table());
    all.extend(imu());
    all.extend(sensors());
    all.extend(running());
    all
}

fn place() -> Vec<Parameter> {
    let number = |name, default: f64, unit, from, to, text| {
        Parameter::new(name, default)
            .unit(unit)
            .range(from, to)
            .describe(text)
    };
    vec![
        number(
            "latitude_deg",
            45.78,
            "deg",
            -89.9,
            89.9,
            "of the ship, WGS-84, north positive",
        ),
        number(
            "longitude_deg",
            126.67,
            "deg",
            -180.0,
            360.0,
            "of the ship, east positive",
        ),
        number(
            "height_m",
            0.0,
            "m",
            -500.0,
            20_000.0,
            "of the ship above the ellipsoid",
        ),
        number(
            "heading_deg",
            0.0,
            "deg",
            -360.0,
            360.0,
            "of the y axis, clockwise from true north",
        ),
        number(
            "roll_deg",
            0.0,
            "deg",
            -90.0,
            90.0,
            "about the y axis, starboard down positive",
        ),
        number(
            "pitch_deg",
            0.0,
            "deg",
            -89.0,
            89.0,
            "about the x axis, bow up positive",
        ),
    ]
}

fn table() -> Vec<Parameter> {
    vec![
        Parameter::new("outer_axis", "x")
            .one_of(&["x", "y", "z"])
            .describe("axis of the block about which the outer joint turns"),
        Parameter::new("inner_axis", "y")
            .one_of(&["x", "y", "z"])
            .describe("axis of the block about which the inner joint turns"),
        Parameter::new("start_angles_deg", vec![0.0, 0.0])
            .length(2)
            .unit("deg")
            .describe("where the joints stand at first: outer, inner"),
        Parameter::new("max_rate_deg_per_s", 60.0)
            .unit("deg/s")
            .range(0.001, 3600.0)
            .describe("a trajectory that asks for more is refused"),
        Parameter::new("stop_deceleration_deg_per_s2", 2.5)
            .unit("deg/s^2")
            .range(0.001, 3600.0)
            .describe("with this an empty trajectory stops the joints"),
        Parameter::new("stuck_joint", "none")
            .one_of(&["none", "outer", "inner", "both"])
            .describe("whose drive is blocked, to see what becomes of it: it takes commands and stays where it is"),
    ]
}

fn imu() -> Vec<Parameter> {
    let vector = |name, default: f64, unit, text| {
        Parameter::new(name, vec![default; 3])
            .length(3)
            .unit(unit)
            .describe(text)
    };
    vec![
        Parameter::new("imu_rate_hz", 100.0)
            .unit("Hz")
            .range(1.0, 1000.0)
            .describe("samples of the IMU"),
        vector(
            "gyroscope_drift_deg_per_hour",
            0.01,
            "deg/h",
            "x, y, z, measured minus true",
        ),
        vector(
            "accelerometer_bias_ug",
            100.0,
            "ug",
            "x, y, z, measured minus true",
        ),
        vector("gyroscope_scale_factor_ppm", 0.0, "ppm", "x, y, z"),
        vector("accelerometer_scale_factor_ppm", 0.0, "ppm", "x, y, z"),
        Parameter::new("gyroscope_installation_arcsec", vec![0.0; 6])
            .length(6)
            .unit("arcsec")
            .describe("off-diagonal elements of K_g: xy, xz, yx, yz, zx, zy"),
        vector(
            "accelerometer_installation_arcsec",
            0.0,
            "arcsec",
            "elements of K_a below its diagonal: yx, zx, zy",
        ),
        Parameter::new("angle_random_walk_deg_per_sqrt_hour", 0.001)
            .unit("deg/sqrt(h)")
            .range(0.0, 1000.0)
            .describe("white noise of the gyroscopes"),
        Parameter::new("velocity_random_walk_ug_per_sqrt_hz", 10.0)
            .unit("ug/sqrt(Hz)")
            .range(0.0, 1e6)
            .describe("white noise of the accelerometers"),
    ]
}

fn sensors() -> Vec<Parameter> {
    let noise = |name, default: f64, unit, text| {
        Parameter::new(name, default)
            .unit(unit)
            .range(0.0, 1e6)
            .describe(text)
    };
    vec![
        Parameter::new("joint_state_rate_hz", 20.0)
            .unit("Hz")
            .range(0.1, 1000.0)
            .describe("joint states, at stamps of IMU samples"),
        noise(
            "encoder_resolution_arcsec",
            0.0,
            "arcsec",
            "smallest step of a joint angle; 0: none",
        ),
        noise(
            "encoder_noise_arcsec",
            0.0,
            "arcsec",
            "1 sigma of a joint angle",
        ),
        noise(
            "encoder_rate_noise_deg_per_s",
            0.0,
            "deg/s",
            "1 sigma of a joint rate",
        ),
        Parameter::new("velocity_aiding", true).describe("whether aiding/velocity is published"),
        noise(
            "velocity_noise_m_per_s",
            0.01,
            "m/s",
            "1 sigma of aiding/velocity, every axis",
        ),
        noise(
            "position_noise_m",
            1.0,
            "m",
            "1 sigma of fix, East and North",
        ),
        noise("height_noise_m", 2.0, "m", "1 sigma of the height of fix"),
    ]
}

fn running() -> Vec<Parameter> {
    vec![
        Parameter::new("seed", 1_i64).range(0.0, 9e15).describe("decides all noise"),
        Parameter::new("speed", 1.0)
            .range(0.0, 1e6)
            .describe("multiple of real time; 0: as fast as the subscribers take it"),
        Parameter::new("start_time_s", 1_760_000_000_i64)
            .unit("s")
            .range(0.0, 2_147_483_647.0)
            .describe("simulated time of the start, since 1970"),
        Parameter::new("duration_s", 0.0)
            .unit("s")
            .range(0.0, 1e9)
            .describe("simulated time after which the node ends; 0: never"),
        Parameter::new("wait_for_subscribers", Vec::<String>::new())
            .describe("topic:count; simulated time starts when each topic has so many other ends"),
        Parameter::new("wait_timeout_s", 0.0)
            .unit("s")
            .range(0.0, 1e6)
            .describe("time by which they must be there, else the node ends with an error; 0: wait for ever"),
        Parameter::new("publish_timeout_s", 60.0)
            .unit("s")
            .range(0.0, 1e6)
            .describe("simulated time stands still so long for a subscriber that does not acknowledge, then samples are dropped"),
    ]
}

/// The parameters of a node as settings.
///
/// # Errors
/// A value that means nothing, by its name.
pub fn settings(node: &Node) -> anyhow::Result<Settings> {
    let number = |name: &str| node.parameter::<f64>(name);
    let angle = |name: &str| number(name).map(f64::to_radians);
    let axis = |name: &str| -> anyhow::Result<Axis> {
        node.parameter::<String>(name)?
            .parse()
            .with_context(|| format!("parameter '{name}'"))
    };
    let vector = |name: &str, unit: f64| -> anyhow::Result<Vector3<f64>> {
        Ok(Vector3::from(array::<3>(node, name)?) * unit)
    };
    let ship = Ship {
        latitude_rad: angle("latitude_deg")?,
        longitude_rad: angle("longitude_deg")?,
        height_m: number("height_m")?,
        heading_rad: angle("heading_deg")?,
        roll_rad: angle("roll_deg")?,
        pitch_rad: angle("pitch_deg")?,
    };
    let turntable = Turntable::new(axis("outer_axis")?, axis("inner_axis")?)
        .context("parameters 'outer_axis' and 'inner_axis'")?;
    let stuck = node.parameter::<String>("stuck_joint")?;
    let table = TableSettings {
        stuck: ["outer", "inner"].map(|joint| stuck == joint || stuck == "both"),
        max_rate_rad_s: angle("max_rate_deg_per_s")?,
        stop_deceleration_rad_s2: angle("stop_deceleration_deg_per_s2")?,
        start: array::<2>(node, "start_angles_deg")?.map(f64::to_radians),
        ..TableSettings::default()
    };
    let errors = SensorErrors {
        gyroscope_drift: vector("gyroscope_drift_deg_per_hour", DEG_PER_HOUR)?,
        accelerometer_bias: vector("accelerometer_bias_ug", MICRO_G)?,
        gyroscope_matrix: gyroscope_matrix(
            vector("gyroscope_scale_factor_ppm", PPM)?,
            array::<6>(node, "gyroscope_installation_arcsec")?.map(|angle| angle * ARC_SECOND),
        ),
        accelerometer_matrix: accelerometer_matrix(
            vector("accelerometer_scale_factor_ppm", PPM)?,
            vector("accelerometer_installation_arcsec", ARC_SECOND)?,
        ),
    };
    let noise = NoiseDensity {
        gyroscope: Vector3::repeat(
            number("angle_random_walk_deg_per_sqrt_hour")? * DEG_PER_SQRT_HOUR,
        ),
        accelerometer: Vector3::repeat(number("velocity_random_walk_ug_per_sqrt_hz")? * MICRO_G),
    };
    let simulator = SimulatorSettings {
        plant: PlantSettings {
            ship,
            turntable,
            table,
            imu_rate_hz: number("imu_rate_hz")?,
            start: Stamp::from_nanos(
                node.parameter::<i64>("start_time_s")? * sins::time::NANOS_PER_SECOND,
            ),
        },
        imu: ImuErrorSettings { errors, noise },
        encoder: EncoderSettings {
            resolution_rad: number("encoder_resolution_arcsec")? * ARC_SECOND,
            position_std_rad: number("encoder_noise_arcsec")? * ARC_SECOND,
            rate_std_rad_s: angle("encoder_rate_noise_deg_per_s")?,
        },
        joint_state_rate_hz: number("joint_state_rate_hz")?,
        aiding: AidingSettings {
            velocity_std_m_s: number("velocity_noise_m_per_s")?,
            horizontal_std_m: number("position_noise_m")?,
            vertical_std_m: number("height_noise_m")?,
            ..AidingSettings::default()
        },
        seed: node.parameter::<i64>("seed")?.unsigned_abs(),
    };
    let wait_timeout_s = number("wait_timeout_s")?;
    Ok(Settings {
        simulator,
        speed: number("speed")?,
        duration_s: number("duration_s")?,
        velocity_aiding: node.parameter("velocity_aiding")?,
        wait_for: node.parameter("wait_for_subscribers")?,
        wait_timeout: (wait_timeout_s > 0.0).then(|| Duration::from_secs_f64(wait_timeout_s)),
        publish_timeout: Duration::from_secs_f64(number("publish_timeout_s")?),
    })
}

fn array<const N: usize>(node: &Node, name: &str) -> anyhow::Result<[f64; N]> {
    let values = node.parameter::<Vec<f64>>(name)?;
    let length = values.len();
    values
        .try_into()
        .map_err(|_| anyhow::anyhow!("parameter '{name}' has {length} elements, expected {N}"))
}

fn gyroscope_matrix(scale: Vector3<f64>, [xy, xz, yx, yz, zx, zy]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(scale.x, xy, xz, yx, scale.y, yz, zx, zy, scale.z)
}

fn accelerometer_matrix(scale: Vector3<f64>, below: Vector3<f64>) -> Matrix3<f64> {
    let [[yx, zx, zy]] = below.data.0;
    Matrix3::new(scale.x, 0.0, 0.0, yx, scale.y, 0.0, zx, zy, scale.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Installation angles land where their names say.
    #[test]
    fn matrices_are_filled_by_name() {
        let k = gyroscope_matrix(
            Vector3::new(1.0, 2.0, 3.0),
            [12.0, 13.0, 21.0, 23.0, 31.0, 32.0],
        );
        assert_eq!(
            (k.m11, k.m12, k.m13, k.m21, k.m23, k.m32),
            (1.0, 12.0, 13.0, 21.0, 23.0, 32.0)
        );
        let k = accelerometer_matrix(Vector3::new(1.0, 2.0, 3.0), Vector3::new(21.0, 31.0, 32.0));
        assert_eq!((k.m21, k.m31, k.m32, k.m12), (21.0, 31.0, 32.0, 0.0));
    }
}
