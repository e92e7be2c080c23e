//! Parameters that mean the same in every node that takes samples.

use anyhow::{Context, ensure};
use nalgebra::Vector3;
use ros_node::{Parameter, Parameters, SENSOR_DEPTH};
use sins::sensor::sample::NoiseDensity;
use sins::stream::plausibility::SensorRange;
use sins::table::Turntable;
use sins::units::{DEG_PER_SQRT_HOUR, MICRO_G};

/// A number: name, default, unit, least, greatest, what it is.
pub type Number = (&'static str, f64, &'static str, f64, f64, &'static str);

/// Default of `queue_depth`.
#[allow(clippy::cast_possible_wrap, reason = "a small constant")]
const QUEUE_DEPTH: i64 = SENSOR_DEPTH as i64;

#[rustfmt::skip]
const NUMBERS: [Number; 10] = [
    ("angle_random_walk_deg_per_sqrt_hour", 0.0, "deg/sqrt(h)", 0.0, 10.0,
        "white noise of the gyroscopes; 0: from the covariances of the Imu messages"),
    ("velocity_random_walk_ug_per_sqrt_hz", 0.0, "ug/sqrt(Hz)", 0.0, 1e5,
        "white noise of the accelerometers; 0: from the covariances of the Imu messages"),
    ("moored_sigma_m_s", 0.01, "m/s", 1e-6, 10.0,
        "1 sigma of the moored ship's residual velocity, each axis"),
    ("coarse_alignment_s", 300.0, "s", 10.0, 7200.0,
        "length of coarse alignment"),
    ("restart_gap_s", 5.0, "s", 0.01, 3600.0,
        "a longer hole in the samples starts the alignment anew, unless the joint states tell the turn in it"),
    ("rate_limit_rad_s", 20.0, "rad/s", 1e-3, 1e4,
        "a sample with a greater angular velocity of an axis is refused"),
    ("force_limit_m_s2", 500.0, "m/s^2", 1.0, 1e5,
        "a sample with a greater linear acceleration of an axis is refused"),
    ("rate_step_rad_s", 0.5, "rad/s", 1e-4, 1e4,
        "a single sample that jumps by more, and back again, is refused"),
    ("force_step_m_s2", 20.0, "m/s^2", 1e-2, 1e5,
        "the same for the linear acceleration"),
    ("silence_s", 3.0, "s", 0.1, 3600.0,
        "an input topic that is silent for longer is a fault"),
];

/// The parameters of a table of numbers.
pub fn numbers(table: &[Number]) -> impl Iterator<Item = Parameter> {
    table.iter().map(|(name, default, unit, from, to, text)| {
        Parameter::new(name, *default)
            .unit(unit)
            .range(*from, *to)
            .describe(text)
    })
}

/// The parameters that all these nodes have.
pub fn declarations() -> Vec<Parameter> {
    let axis = |joint: &str, default: &str| {
        Parameter::new(&format!("{joint}_axis"), default)
            .one_of(&["x", "y", "z"])
            .describe(&format!(
                "axis of the block, at zero joint angles, that {joint}_joint turns about"
            ))
    };
    let mut all = vec![
        axis("outer", "x"),
        axis("inner", "y"),
        Parameter::new("queue_depth", QUEUE_DEPTH)
            .range(10.0, 1e6)
            .describe("samples, and joint states, that the middleware keeps until the node takes them; more for accelerated time"),
    ];
    all.extend(numbers(&NUMBERS));
    all
}

/// The table's axes.
///
/// # Errors
/// One line naming the parameters.
pub fn turntable(parameters: &Parameters) -> anyhow::Result<Turntable> {
    let axis = |name: &str| -> anyhow::Result<_> { Ok(parameters.get::<String>(name)?.parse()?) };
    Turntable::new(axis("outer_axis")?, axis("inner_axis")?)
        .context("parameters outer_axis and inner_axis")
}

/// The noise, where it is not to be taken from the messages.
///
/// # Errors
/// One line naming the parameters where only one of them is given.
pub fn noise(parameters: &Parameters) -> anyhow::Result<Option<NoiseDensity>> {
    let gyroscope: f64 = parameters.get("angle_random_walk_deg_per_sqrt_hour")?;
    let accelerometer: f64 = parameters.get("velocity_random_walk_ug_per_sqrt_hz")?;
    ensure!(
        (gyroscope > 0.0) == (accelerometer > 0.0),
        "parameters angle_random_walk_deg_per_sqrt_hour ({gyroscope}) and velocity_random_walk_ug_per_sqrt_hz \
         ({accelerometer}): expected both positive, or both 0 to take the noise from the messages"
    );
    Ok((gyroscope > 0.0).then(|| NoiseDensity {
        gyroscope: Vector3::repeat(gyroscope * DEG_PER_SQRT_HOUR),
        accelerometer: Vector3::repeat(accelerometer * MICRO_G),
    }))
}

/// What the sensors can give.
///
/// # Errors
/// A parameter is not declared.
pub fn range(parameters: &Parameters) -> anyhow::Result<SensorRange> {
    Ok(SensorRange {
        rate_rad_s: parameters.get("rate_limit_rad_s")?,
        force_m_s2: parameters.get("force_limit_m_s2")?,
        rate_step_rad_s: parameters.get("rate_step_rad_s")?,
        force_step_m_s2: parameters.get("force_step_m_s2")?,
    })
}

/// Samples that the middleware keeps until the node takes them.
///
/// # Errors
/// The parameter is not declared.
pub fn queue_depth(parameters: &Parameters) -> anyhow::Result<usize> {
    Ok(usize::try_from(parameters.get::<i64>("queue_depth")?)?)
}
