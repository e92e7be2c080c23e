//! Parameters: declared in the units people use, with their places in what makes the program.

use std::path::Path;

use anyhow::{Context, Result};
use node_parameters::units::{DEGREE, DEGREE_PER_SECOND, DEGREE_PER_SECOND2};
use node_parameters::{CheckpointParameters, checkpoint};
use ros_node::{ParameterSet, Parameters, Unit};
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{BUILTIN_NAMES, Program, Scheme};
use sins::table::{Axis, Turntable};

/// A scheme of ten thousand rotations is shorter \[bytes\].
const LONGEST_SCHEME: u64 = 4 << 20;

/// Everything the node is told.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Name or file of the scheme.
    scheme: String,
    /// What is not as the scheme has it.
    instead: Instead,
    /// How the scheme is run.
    pub sequencer: SequencerSettings,
    /// Whether motions are goals of an action, and not messages of a topic.
    pub uses_action: bool,
    /// Whether the first joint state starts the scheme.
    pub autostart: bool,
    /// How the state is kept.
    pub checkpoint: CheckpointParameters,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            scheme: "eight-position".to_owned(),
            instead: Instead::default(),
            sequencer: SequencerSettings {
                // A node outlives the simulator that it turns.
                restart_when_time_runs_back: true,
                ..SequencerSettings::default()
            },
            uses_action: false,
            autostart: false,
            checkpoint: CheckpointParameters::default(),
        }
    }
}

/// Values instead of the scheme's own, SI; joints are outer, inner.
#[derive(Clone, Debug, Default, PartialEq)]
struct Instead {
    axes: [Option<Axis>; 2],
    dwell_s: Option<f64>,
    rate_rad_s: Option<f64>,
    acceleration_rad_s2: Option<f64>,
    cycles: Option<u32>,
    limits_rad: [Option<(f64, f64)>; 2],
}

/// All parameters of the node.
pub fn declared() -> ParameterSet<Settings> {
    let set = ParameterSet::new("Scheme", Settings::default()).text(
        "scheme",
        |s| &mut s.scheme,
        &format!(
            "Name of a scheme ({}), or path of a YAML file",
            BUILTIN_NAMES.join(", ")
        ),
    );
    let set = axis(axis(set, 0, "outer"), 1, "inner")
        .optional(
            "dwell_s",
            Unit::SECOND,
            (-1.0..=1e7, -1.0),
            |s| &mut s.instead.dwell_s,
            "Dwell at the start and after every rotation; -1: the scheme's",
        )
        .optional(
            "rate_deg_per_s",
            DEGREE_PER_SECOND,
            (0.0..=3600.0, 0.0),
            |s| &mut s.instead.rate_rad_s,
            "Cruise rate of rotations; 0: the scheme's",
        )
        .optional(
            "acceleration_deg_per_s2",
            DEGREE_PER_SECOND2,
            (0.0..=3600.0, 0.0),
            |s| &mut s.instead.acceleration_rad_s2,
            "Acceleration of rotations; 0: the scheme's",
        )
        .value(
            "cycles",
            0_i64,
            "How often the scheme is run; 0: as the scheme says, the built-in ones until stopped",
            |s, cycles: i64| {
                let cycles = u32::try_from(cycles).map_err(|error| error.to_string())?;
                s.instead.cycles = Some(cycles).filter(|cycles| *cycles > 0);
                Ok(())
            },
        )
        .range(0.0..=4_294_967_295.0);
    limits(limits(set, 0, "outer"), 1, "inner")
        .include(sequencer(), |s| &mut s.sequencer)
        .group("Running")
        .value(
            "table_interface",
            "topic".to_owned(),
            "How the table is moved: trajectories on turntable/joint_trajectory, or goals of turntable/follow_joint_trajectory",
            |s, name: String| {
                s.uses_action = name == "action";
                Ok(())
            },
        )
        .one_of(&["topic", "action"])
        .switch(
            "autostart",
            |s| &mut s.autostart,
            "Start with the first joint state, without a call of ~/start: for simulated tables",
        )
        .include(checkpoint(), |s| &mut s.checkpoint)
}

fn axis(set: ParameterSet<Settings>, index: usize, joint: &str) -> ParameterSet<Settings> {
    set.value(
        &format!("{joint}_axis"),
        "auto".to_owned(),
        &format!("Axis of the block, at zero joint angles, that the {joint} joint turns about; auto: the scheme's"),
        move |s, name: String| {
            s.instead.axes[index] = match name.as_str() {
                "auto" => None,
                name => Some(name.parse().map_err(|error: sins::Error| error.to_string())?),
            };
            Ok(())
        },
    )
    .one_of(&["auto", "x", "y", "z"])
}

fn limits(set: ParameterSet<Settings>, index: usize, joint: &str) -> ParameterSet<Settings> {
    set.value(
        &format!("{joint}_limits_deg"),
        Vec::<f64>::new(),
        &format!("Smallest and largest angle that the cables of the {joint} joint permit; empty: the scheme's"),
        move |s, values: Vec<f64>| {
            s.instead.limits_rad[index] = match values.as_slice() {
                [] => None,
                [min, max] => Some((DEGREE.to_si(*min), DEGREE.to_si(*max))),
                other => return Err(format!("{} elements, expected two or none", other.len())),
            };
            Ok(())
        },
    )
    .range(-1e6..=1e6)
    .unit(DEGREE)
}

fn sequencer() -> ParameterSet<SequencerSettings> {
    ParameterSet::new("Running", Settings::default().sequencer)
        .number(
            "position_tolerance_deg",
            DEGREE,
            0.0..=180.0,
            |s| &mut s.position_tolerance_rad,
            "A joint has arrived within this of its target",
        )
        .number(
            "rate_tolerance_deg_per_s",
            DEGREE_PER_SECOND,
            0.0..=3600.0,
            |s| &mut s.rate_tolerance_rad_s,
            "A joint rests below this rate",
        )
        .number(
            "settling_s",
            Unit::SECOND,
            0.0..=1e7,
            |s| &mut s.settling_s,
            "Both must hold for so long before the table counts as arrived",
        )
        .number(
            "arrival_timeout_s",
            Unit::SECOND,
            0.0..=1e7,
            |s| &mut s.arrival_timeout_s,
            "A fault where the table has not arrived so long after the end of a motion",
        )
        .number(
            "command_lead_s",
            Unit::SECOND,
            0.0..=1e7,
            |s| &mut s.command_lead_s,
            "A rotation is commanded so long before it starts; 0: when it is due",
        )
        .number(
            "joint_state_gap_s",
            Unit::SECOND,
            0.0..=1e7,
            |s| &mut s.joint_state_gap_s,
            "A longer step between joint states is reported",
        )
        .optional(
            "stop_after_s",
            Unit::SECOND,
            (0.0..=1e7, 0.0),
            |s| &mut s.stop_after_s,
            "Finished so long after the start of the first dwell; 0: when the scheme is",
        )
        .switch(
            "restart_when_time_runs_back",
            |s| &mut s.restart_when_time_runs_back,
            "Start the scheme again where the stamps run back (the simulator was started again); else a fault",
        )
}

/// What the parameters amount to.
///
/// # Errors
/// A value that means nothing, by the name of the parameter.
pub fn settings(parameters: &Parameters) -> Result<Settings> {
    let settings = declared().read(parameters)?;
    settings.sequencer.validate()?;
    Ok(settings)
}

impl Settings {
    /// The scheme as it is to run, and laid out for its table.
    ///
    /// # Errors
    /// A scheme that cannot be read or run, by file and key.
    pub fn scheme_and_program(&self) -> Result<(Scheme, Program)> {
        let mut scheme = named(&self.scheme)?;
        let instead = &self.instead;
        scheme.dwell_s = instead.dwell_s.unwrap_or(scheme.dwell_s);
        scheme.rate_rad_s = instead.rate_rad_s.unwrap_or(scheme.rate_rad_s);
        let acceleration = instead.acceleration_rad_s2;
        scheme.acceleration_rad_s2 = acceleration.unwrap_or(scheme.acceleration_rad_s2);
        scheme.cycles = instead.cycles.or(scheme.cycles);
        let [outer, inner] = instead.limits_rad;
        scheme.limits.outer = outer.unwrap_or(scheme.limits.outer);
        scheme.limits.inner = inner.unwrap_or(scheme.limits.inner);
        let own = scheme.default_table();
        let [outer, inner] = instead.axes;
        let table = Turntable::new(outer.unwrap_or(own.outer), inner.unwrap_or(own.inner))
            .context("parameters 'outer_axis' and 'inner_axis'")?;
        let program = scheme.program(table)?;
        Ok((scheme, program))
    }
}

fn named(name: &str) -> Result<Scheme> {
    if let Some(scheme) = Scheme::builtin(name) {
        return Ok(scheme);
    }
    let known = BUILTIN_NAMES.join(", ");
    let text = files::read_text(Path::new(name), LONGEST_SCHEME).with_context(|| {
        format!("parameter 'scheme': '{name}' is none of {known} and cannot be read as a file")
    })?;
    Ok(Scheme::from_yaml(name, &text)?)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use ros_node::Value;

    use super::*;

    fn with(given: &[(&str, Value)]) -> Result<Settings> {
        let mut settings = Settings::default();
        for (name, value) in given {
            declared().put(&mut settings, name, value)?;
        }
        Ok(settings)
    }

    /// By default everything is the scheme's own, and the settings are those of the sequencer but for one.
    #[test]
    fn by_default_the_scheme_decides() {
        let parameters = Parameters::defaults(declared().declarations()).unwrap();
        let read = settings(&parameters).unwrap();
        assert_eq!(read, Settings::default());
        let scheme = Scheme::builtin("eight-position").unwrap();
        let own = scheme.program(scheme.default_table()).unwrap();
        assert_eq!(read.scheme_and_program().unwrap().1, own);
        // A table moves because somebody asked for it, never because a process came up.
        assert!(!read.autostart);
        let machine = SequencerSettings {
            restart_when_time_runs_back: false,
            ..read.sequencer
        };
        assert_eq!(machine, SequencerSettings::default());
    }

    /// What is given goes before the scheme's, 0 s of dwell too.
    #[test]
    fn what_is_given_goes_before_the_scheme() {
        let settings = with(&[
            ("dwell_s", 0.0.into()),
            ("rate_deg_per_s", 9.0.into()),
            ("cycles", 2_i64.into()),
            ("outer_axis", "y".into()),
            ("inner_axis", "x".into()),
            ("inner_limits_deg", vec![-400.0, 400.0].into()),
        ])
        .unwrap();
        let instead = &settings.instead;
        assert_eq!((instead.dwell_s, instead.cycles), (Some(0.0), Some(2)));
        assert_eq!(instead.limits_rad[0], None);
        let (scheme, program) = settings.scheme_and_program().unwrap();
        // What is told of it says the same.
        let told = Scheme::from_yaml("told", &scheme.to_yaml()).unwrap();
        assert_eq!(told.program(program.table).unwrap(), program);
        assert_eq!(
            (program.table.outer, program.table.inner),
            (Axis::Y, Axis::X)
        );
        let error = with(&[("outer_limits_deg", vec![1.0].into())]).unwrap_err();
        assert!(
            error.to_string().contains("'outer_limits_deg': 1 elements"),
            "{error}"
        );
    }
}
