//! Parameters: declared in the units people use, turned into a program and its settings.

use anyhow::{Context, Result, bail};
use ros_node::{Node, Parameter};
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{BUILTIN_NAMES, Program, Scheme};
use sins::table::{Axis, Turntable};

/// All parameters of the node.
pub fn declarations() -> Vec<Parameter> {
    let mut all = scheme();
    all.extend(sequencer());
    all
}

fn scheme() -> Vec<Parameter> {
    let axes = ["auto", "x", "y", "z"];
    let limits = |name, joint: &str| {
        Parameter::new(name, Vec::<f64>::new())
            .unit("deg")
            .describe(&format!("smallest and largest angle that the cables of the {joint} joint permit; empty: the scheme's"))
    };
    vec![
        Parameter::new("scheme", "eight-position")
            .describe(&format!("{}, or the path of a YAML file", BUILTIN_NAMES.join(", "))),
        Parameter::new("outer_axis", "auto")
            .one_of(&axes)
            .describe("axis of the block about which the outer joint turns; auto: the scheme's own order"),
        Parameter::new("inner_axis", "auto")
            .one_of(&axes)
            .describe("axis of the block about which the inner joint turns; auto: the scheme's own order"),
        Parameter::new("dwell_s", -1.0)
            .unit("s")
            .range(-1.0, 1e7)
            .describe("dwell at the start and after every rotation; -1: the scheme's"),
        Parameter::new("rate_deg_per_s", 0.0)
            .unit("deg/s")
            .range(0.0, 3600.0)
            .describe("cruise rate of rotations; 0: the scheme's"),
        Parameter::new("acceleration_deg_per_s2", 0.0)
            .unit("deg/s^2")
            .range(0.0, 3600.0)
            .describe("acceleration of rotations; 0: the scheme's"),
        Parameter::new("cycles", 0_i64)
            .range(0.0, 4_294_967_295.0)
            .describe("how often the scheme is run; 0: as the scheme says, the built-in ones until stopped"),
        limits("outer_limits_deg", "outer"),
        limits("inner_limits_deg", "inner"),
    ]
}

fn sequencer() -> Vec<Parameter> {
    let default = SequencerSettings::default();
    let number = |name, default: f64, unit, text| {
        Parameter::new(name, default)
            .unit(unit)
            .range(0.0, 1e7)
            .describe(text)
    };
    vec![
        number("position_tolerance_deg", default.position_tolerance_rad.to_degrees(), "deg", "a joint has arrived within this of its target"),
        number("rate_tolerance_deg_per_s", default.rate_tolerance_rad_s.to_degrees(), "deg/s", "a joint rests below this rate"),
        number("settling_s", default.settling_s, "s", "both must hold for so long before the table counts as arrived"),
        number("arrival_timeout_s", default.arrival_timeout_s, "s", "a fault where the table has not arrived so long after the end of a motion"),
        number("command_lead_s", default.command_lead_s, "s", "a rotation is commanded so long before it starts; 0: when it is due"),
        number("joint_state_gap_s", default.joint_state_gap_s, "s", "a longer step between joint states is reported"),
        number("stop_after_s", 0.0, "s", "finished so long after the start of the first dwell; 0: when the scheme is"),
        Parameter::new("restart_when_time_runs_back", true)
            .describe("start the scheme again where the stamps run back (the simulator was started again); else a fault"),
        Parameter::new("table_interface", "topic")
            .one_of(&["topic", "action"])
            .describe("how the table is moved: trajectories on turntable/joint_trajectory, or goals of turntable/follow_joint_trajectory"),
        Parameter::new("autostart", true).describe("start with the first joint state, instead of by ~/start"),
    ]
}

/// The scheme, laid out for its table, and how to run it.
///
/// # Errors
/// A scheme or a value that means nothing, by file, key or name of the parameter.
pub fn program(node: &Node) -> Result<(Program, SequencerSettings)> {
    let mut scheme = named(&node.parameter::<String>("scheme")?)?;
    let dwell_s: f64 = node.parameter("dwell_s")?;
    if dwell_s >= 0.0 {
        scheme.dwell_s = dwell_s;
    }
    let rate: f64 = node.parameter("rate_deg_per_s")?;
    if rate > 0.0 {
        scheme.rate_rad_s = rate.to_radians();
    }
    let acceleration: f64 = node.parameter("acceleration_deg_per_s2")?;
    if acceleration > 0.0 {
        scheme.acceleration_rad_s2 = acceleration.to_radians();
    }
    let cycles = u32::try_from(node.parameter::<i64>("cycles")?).context("parameter 'cycles'")?;
    if cycles > 0 {
        scheme.cycles = Some(cycles);
    }
    if let Some(limits) = limits(node, "outer_limits_deg")? {
        scheme.limits.outer = limits;
    }
    if let Some(limits) = limits(node, "inner_limits_deg")? {
        scheme.limits.inner = limits;
    }
    let own = scheme.default_table();
    let table = Turntable::new(
        axis(node, "outer_axis", own.outer)?,
        axis(node, "inner_axis", own.inner)?,
    )
    .context("parameters 'outer_axis' and 'inner_axis'")?;
    Ok((scheme.program(table)?, settings(node)?))
}

fn named(name: &str) -> Result<Scheme> {
    if let Some(scheme) = Scheme::builtin(name) {
        return Ok(scheme);
    }
    let known = BUILTIN_NAMES.join(", ");
    let text = std::fs::read_to_string(name).with_context(|| {
        format!("parameter 'scheme': '{name}' is none of {known} and cannot be read as a file")
    })?;
    Ok(Scheme::from_yaml(name, &text)?)
}

fn axis(node: &Node, name: &str, own: Axis) -> Result<Axis> {
    let text: String = node.parameter(name)?;
    if text == "auto" {
        return Ok(own);
    }
    text.parse().with_context(|| format!("parameter '{name}'"))
}

fn limits(node: &Node, name: &str) -> Result<Option<(f64, f64)>> {
    match node.parameter::<Vec<f64>>(name)?.as_slice() {
        [] => Ok(None),
        [min, max] => Ok(Some((min.to_radians(), max.to_radians()))),
        other => bail!(
            "parameter '{name}' has {} elements, expected two or none",
            other.len()
        ),
    }
}

fn settings(node: &Node) -> Result<SequencerSettings> {
    let number = |name: &str| node.parameter::<f64>(name);
    let stop_after_s = number("stop_after_s")?;
    let settings = SequencerSettings {
        position_tolerance_rad: number("position_tolerance_deg")?.to_radians(),
        rate_tolerance_rad_s: number("rate_tolerance_deg_per_s")?.to_radians(),
        settling_s: number("settling_s")?,
        arrival_timeout_s: number("arrival_timeout_s")?,
        command_lead_s: number("command_lead_s")?,
        joint_state_gap_s: number("joint_state_gap_s")?,
        stop_after_s: (stop_after_s > 0.0).then_some(stop_after_s),
        restart_when_time_runs_back: node.parameter("restart_when_time_runs_back")?,
    };
    settings.validate()?;
    Ok(settings)
}
