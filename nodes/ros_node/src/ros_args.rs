//! The part of the command line that belongs to ROS: `--ros-args … --`.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::names::{NodeIdentity, RemapRule};
use crate::parameter_file;
use crate::yaml::Yaml;

/// What `--ros-args` said, and what was outside of it.
#[derive(Clone, Debug, Default)]
pub struct RosArgs {
    /// Rules of `-r`, in order.
    pub remaps: Vec<RemapRule>,
    /// Level of `--log-level`, and of `--log-level NAME:=LEVEL`.
    pub log_levels: Vec<LogLevelRule>,
    /// `--disable-rosout-logs` turns this off.
    pub rosout: bool,
    /// `--disable-stdout-logs` turns this off (ours go to standard error).
    pub console: bool,
    /// Everything outside `--ros-args`, for the node.
    pub others: Vec<String>,
    /// `-p` and `--params-file` in order; the later wins.
    parameters: Vec<ParameterSource>,
}

/// A level for one logger, or for all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLevelRule {
    /// Only for the logger of this name.
    pub logger: Option<String>,
    /// The level.
    pub level: tracing::Level,
}

#[derive(Clone, Debug)]
enum ParameterSource {
    File(PathBuf),
    Assignment {
        node: Option<String>,
        name: String,
        value: Yaml,
    },
}

/// A value somebody gave to a parameter.
#[derive(Clone, Debug)]
pub(crate) struct Override {
    pub(crate) name: String,
    pub(crate) value: Yaml,
    /// For messages: the option or the file.
    pub(crate) origin: String,
}

impl RosArgs {
    /// Sorts the arguments (without the name of the program).
    ///
    /// # Errors
    /// [`Error::Argument`] with one line that names the argument.
    pub fn parse<I, S>(arguments: I) -> Result<Self>
    where
        I: IntoIterator<Item = S>,
        S: Into<String>,
    {
        let mut parsed = Self {
            rosout: true,
            console: true,
            ..Self::default()
        };
        let mut arguments = arguments.into_iter().map(Into::into);
        let mut inside = false;
        while let Some(argument) = arguments.next() {
            match (inside, argument.as_str()) {
                (_, "--ros-args") => inside = true,
                (true, "--") => inside = false,
                (true, option) => parsed.option(option, &mut arguments)?,
                (false, _) => parsed.others.push(argument),
            }
        }
        Ok(parsed)
    }

    fn option(&mut self, option: &str, rest: &mut impl Iterator<Item = String>) -> Result<()> {
        let mut value = || {
            rest.next()
                .ok_or_else(|| Error::Argument(format!("--ros-args: {option} needs a value")))
        };
        match option {
            "-r" | "--remap" => self.remaps.push(RemapRule::parse(&value()?)?),
            "-p" | "--param" => self.parameters.push(assignment(&value()?)?),
            "--params-file" => self.parameters.push(ParameterSource::File(value()?.into())),
            "--log-level" => self.log_levels.push(log_level(&value()?)?),
            "--enable-rosout-logs" => self.rosout = true,
            "--disable-rosout-logs" => self.rosout = false,
            "--enable-stdout-logs" => self.console = true,
            "--disable-stdout-logs" => self.console = false,
            // They speak of rcl's external logging library, which we do not have.
            "--enable-external-lib-logs" | "--disable-external-lib-logs" => {}
            // Enclaves are those of DDS security, which is refused where it is switched on.
            "-e" | "--enclave" => {
                value()?;
            }
            "--log-config-file" => {
                return Err(Error::Argument(format!(
                    "--ros-args: {option} is not supported by this node"
                )));
            }
            other => {
                return Err(Error::Argument(format!(
                    "--ros-args: unknown argument '{other}'; known are -r, -p, --params-file, --log-level, --enclave, \
                     --[enable|disable]-[rosout|stdout|external-lib]-logs and -- to end them"
                )));
            }
        }
        Ok(())
    }

    /// The values for this node in the order they were given, files read.
    ///
    /// # Errors
    /// [`Error::ParameterFile`].
    pub(crate) fn overrides(
        &self,
        node: &NodeIdentity,
        original_name: &str,
    ) -> Result<Vec<Override>> {
        let mut overrides = Vec::new();
        for source in &self.parameters {
            match source {
                ParameterSource::File(path) => overrides.extend(from_file(path, node)?),
                ParameterSource::Assignment {
                    node: only,
                    name,
                    value,
                } => {
                    if only
                        .as_deref()
                        .is_none_or(|only| only == node.name || only == original_name)
                    {
                        overrides.push(Override {
                            name: name.clone(),
                            value: value.clone(),
                            origin: "-p".to_owned(),
                        });
                    }
                }
            }
        }
        Ok(overrides)
    }

    /// The level for the logger of the node.
    pub fn log_level(&self, logger: &str) -> tracing::Level {
        let of = |name: Option<&str>| {
            self.log_levels
                .iter()
                .rev()
                .find(|rule| rule.logger.as_deref() == name)
                .map(|rule| rule.level)
        };
        of(Some(logger))
            .or_else(|| of(None))
            .unwrap_or(tracing::Level::INFO)
    }
}

fn from_file(path: &Path, node: &NodeIdentity) -> Result<Vec<Override>> {
    let origin = path.display().to_string();
    let values = parameter_file::read(path, &node.fully_qualified())?;
    Ok(values
        .into_iter()
        .map(|(name, value)| Override {
            name,
            value,
            origin: origin.clone(),
        })
        .collect())
}

fn assignment(text: &str) -> Result<ParameterSource> {
    let bad = |reason: &str| Error::Argument(format!("-p '{text}': {reason}"));
    let (name, value) = text
        .split_once(":=")
        .ok_or_else(|| bad("expected [node:]name:=value"))?;
    let (node, name) = match name.split_once(':') {
        Some((node, name)) => (Some(node.to_owned()), name),
        None => (None, name),
    };
    if name.is_empty() {
        return Err(bad("the name is missing"));
    }
    let value = Yaml::parse(value).map_err(|reason| bad(&reason))?;
    Ok(ParameterSource::Assignment {
        node,
        name: name.to_owned(),
        value,
    })
}

fn log_level(text: &str) -> Result<LogLevelRule> {
    let (logger, level) = match text.split_once(":=") {
        Some((logger, level)) => (Some(logger.to_owned()), level),
        None => (None, text),
    };
    let level = match level.to_ascii_lowercase().as_str() {
        "debug" => tracing::Level::DEBUG,
        "info" => tracing::Level::INFO,
        "warn" => tracing::Level::WARN,
        // tracing has no level above ERROR; a node's FATAL line is always written.
        "error" | "fatal" => tracing::Level::ERROR,
        _ => {
            return Err(Error::Argument(format!(
                "--log-level '{text}': expected [logger:=]debug, info, warn, error or fatal"
            )));
        }
    };
    Ok(LogLevelRule { logger, level })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn values(arguments: &[&str]) -> Vec<(String, Yaml)> {
        let node = NodeIdentity::new("/", "n").unwrap();
        let parsed = RosArgs::parse(arguments.iter().copied()).unwrap();
        parsed
            .overrides(&node, "n")
            .unwrap()
            .into_iter()
            .map(|o| (o.name, o.value))
            .collect()
    }

    /// `--` ends the ROS part; several parts are allowed; the rest goes to the node.
    #[test]
    fn others_are_kept_for_the_node() {
        let parsed = RosArgs::parse([
            "a",
            "--ros-args",
            "-r",
            "x:=y",
            "--",
            "b",
            "--ros-args",
            "-p",
            "k:=1",
        ])
        .unwrap();
        assert_eq!(parsed.others, ["a", "b"]);
        assert_eq!(parsed.remaps.len(), 1);
        assert_eq!(parsed.parameters.len(), 1);
    }

    /// What is unknown or incomplete is an error that names it.
    #[test]
    fn unknown_ros_arguments_are_errors() {
        for (arguments, named) in [
            (vec!["--ros-args", "--frobnicate"], "--frobnicate"),
            (vec!["--ros-args", "-p"], "-p"),
            (vec!["--ros-args", "-p", "rate=3"], "rate=3"),
            (vec!["--ros-args", "--log-level", "loud"], "loud"),
        ] {
            let error = RosArgs::parse(arguments).unwrap_err().to_string();
            assert!(error.contains(named) && !error.contains('\n'), "{error}");
        }
    }

    /// `-p` takes YAML, and a rule for another node is not ours.
    #[test]
    fn assignments_are_yaml_and_may_name_the_node() {
        assert_eq!(
            values(&[
                "--ros-args",
                "-p",
                "a.b:=[1, 2]",
                "-p",
                "other:c:=3",
                "-p",
                "n:d:='x'"
            ]),
            [
                (
                    "a.b".to_owned(),
                    Yaml::Sequence(vec![Yaml::Int(1), Yaml::Int(2)])
                ),
                ("d".to_owned(), Yaml::String("x".to_owned())),
            ]
        );
    }

    /// The logger's own level goes before the common one, whatever the order.
    #[test]
    fn log_level_of_the_node_wins() {
        let parsed = RosArgs::parse([
            "--ros-args",
            "--log-level",
            "n:=debug",
            "--log-level",
            "warn",
        ])
        .unwrap();
        assert_eq!(parsed.log_level("n"), tracing::Level::DEBUG);
        assert_eq!(parsed.log_level("m"), tracing::Level::WARN);
    }
}
