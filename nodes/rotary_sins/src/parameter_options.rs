//! Options of a command that are parameters of a node: the same key, default, unit, range and words.

use std::{fmt::Write, marker::PhantomData};

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, parser::ValueSource};
use ros_node::{Parameter, ParameterSet, Value};

/// Parameters that a command takes as options.
pub trait Group: 'static {
    /// What they make up.
    type Settings: Clone + 'static;
    /// Heading in `--help`.
    const HEADING: &'static str;
    /// Options that are not called like their parameter.
    const NAMES: &'static [(&'static str, &'static str)] = &[];
    /// Parameters that another option decides where they are not given.
    const DECIDED_BY: &'static [(&'static str, &'static str)] = &[];

    /// The parameters.
    fn set() -> ParameterSet<Self::Settings>;

    /// Name of the option, without dashes.
    fn option(key: &str) -> String {
        let named = Self::NAMES.iter().find(|(name, _)| *name == key);
        named.map_or_else(|| key.replace('_', "-"), |(_, name)| (*name).to_owned())
    }
}

/// The parameters of a group that were given.
#[derive(Clone, Debug)]
pub struct Given<G> {
    values: Vec<(String, Value)>,
    group: PhantomData<G>,
}

impl<G: Group> Given<G> {
    /// The settings, defaults where nothing was given.
    pub fn settings(&self) -> anyhow::Result<G::Settings> {
        let mut settings = G::set().base().clone();
        self.apply(&mut settings)?;
        Ok(settings)
    }

    /// Puts what was given into settings that come from elsewhere.
    pub fn apply(&self, settings: &mut G::Settings) -> anyhow::Result<()> {
        let set = G::set();
        for (key, value) in &self.values {
            set.put(settings, key, value)?;
        }
        Ok(())
    }

    /// The options, to be given again.
    pub fn arguments(&self) -> String {
        let mut text = String::new();
        for (key, value) in &self.values {
            write!(text, " --{} {}", G::option(key), written(value)).ok();
        }
        text
    }
}

impl<G: Group> Args for Given<G> {
    fn augment_args(command: Command) -> Command {
        let options = G::set().declarations().into_iter().map(|p| option::<G>(p));
        options.fold(command, Command::arg)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<G: Group> FromArgMatches for Given<G> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut values = Vec::new();
        for parameter in G::set().declarations() {
            let key = parameter.name();
            if matches.value_source(key) == Some(ValueSource::CommandLine)
                && let Some(value) = matches.get_one::<Value>(key)
            {
                values.push((key.to_owned(), value.clone()));
            }
        }
        Ok(Self {
            values,
            group: PhantomData,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn option<G: Group>(parameter: Parameter) -> Arg {
    let key = parameter.name().to_owned();
    let decided_by = G::DECIDED_BY.iter().find(|(name, _)| *name == key);
    let mut help = parameter.description().to_owned();
    if let Some((from, to)) = parameter.bounds() {
        write!(help, " [{from} .. {to}]").ok();
    }
    if !parameter.choices().is_empty() {
        write!(help, " [{}]", parameter.choices().join(", ")).ok();
    }
    if let Some((_, other)) = decided_by {
        write!(help, " [default: by {other}]").ok();
    }
    let unit = match parameter.unit_symbol() {
        "" => parameter.kind().name(),
        unit => unit,
    };
    let mut option = Arg::new(key.clone())
        .long(G::option(&key))
        .help(help)
        .help_heading(G::HEADING)
        .value_name(unit.to_owned())
        // A list that begins with a minus is no number to clap.
        .allow_hyphen_values(true);
    if decided_by.is_none() {
        option = option.default_value(written(parameter.default()));
    }
    option.value_parser(move |text: &str| {
        let expected = |expected| format!("expected {expected}");
        parameter.parse(text).map_err(expected)
    })
}

/// A value as a command line takes it; one for all where all are the same.
fn written(value: &Value) -> String {
    match value {
        Value::Double(value) => value.to_string(),
        Value::String(value) => value.clone(),
        Value::DoubleArray(values) => match values.as_slice() {
            [first, rest @ ..] if rest.iter().all(|value| value == first) => first.to_string(),
            values => {
                let all: Vec<_> = values.iter().map(ToString::to_string).collect();
                all.join(",")
            }
        },
        Value::StringArray(values) => values.join(","),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use ros_node::Unit;

    const MILLI: Unit = Unit::new("mm", 1e-3);

    #[derive(Debug)]
    struct Test;

    impl Group for Test {
        type Settings = [f64; 3];
        const HEADING: &'static str = "Test";
        const NAMES: &'static [(&'static str, &'static str)] = &[("first_mm", "first")];
        const DECIDED_BY: &'static [(&'static str, &'static str)] = &[("last", "--model")];

        fn set() -> ParameterSet<[f64; 3]> {
            ParameterSet::new("", [1e-3, 2.0, 3.0])
                .number("first_mm", MILLI, -5.0..=5.0, |s| &mut s[0], "The first")
                .numbers(
                    "rest",
                    Unit::NONE,
                    -9.0..=9.0,
                    |s| &mut s[1..],
                    "The others",
                )
                .number("last", Unit::NONE, 0.0..=9.0, |s| &mut s[2], "The last")
        }
    }

    fn parse(arguments: &str) -> Result<Given<Test>, clap::Error> {
        let command = Given::<Test>::augment_args(Command::new("test").no_binary_name(true));
        let matches = command.try_get_matches_from(arguments.split_whitespace())?;
        Given::from_arg_matches(&matches)
    }

    /// Only what was given is put where it belongs, and can be given again.
    #[test]
    fn what_is_given_is_applied() {
        assert_eq!(parse("").unwrap().settings().unwrap(), [1e-3, 2.0, 3.0]);
        let given = parse("--first -4 --rest -1,2").unwrap();
        let mut settings = [0.0; 3];
        given.apply(&mut settings).unwrap();
        assert_eq!(settings, [-4e-3, -1.0, 2.0]);
        assert_eq!(given.arguments(), " --first -4 --rest -1,2");
        assert_eq!(
            parse("--rest 7").unwrap().settings().unwrap(),
            [1e-3, 7.0, 7.0]
        );
    }

    /// Help has words, range, unit and default; a value out of range is refused by what was expected.
    #[test]
    fn options_are_as_the_parameters() {
        let mut command = Given::<Test>::augment_args(Command::new("test"));
        let help = command.render_help().to_string();
        for words in [
            "Test:",
            "--first <mm>",
            "The first [-5 .. 5] [default: 1]",
            "[default: 2,3]",
            "The last [0 .. 9] [default: by --model]",
        ] {
            assert!(help.contains(words), "{words}\n{help}");
        }
        let error = parse("--first 6").unwrap_err().to_string();
        assert!(
            error.contains("expected double from -5.0 to 5.0 [mm]"),
            "{error}"
        );
    }
}
