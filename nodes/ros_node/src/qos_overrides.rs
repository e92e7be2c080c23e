//! Quality of service by parameter: `qos_overrides.<topic>.<publisher|subscription>.<policy>`, as rclcpp has it.

use crate::error::Result;
use crate::parameters::{Parameter, Parameters, QOS_OVERRIDES};
use crate::qos::Qos;

/// Which end of a topic a quality of service belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Publisher,
    Subscription,
}

impl End {
    const fn name(self) -> &'static str {
        match self {
            Self::Publisher => "publisher",
            Self::Subscription => "subscription",
        }
    }
}

/// Whether parameters may change the quality of service of an endpoint. Only those of endpoints that opted in are declared, as
/// rclcpp has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overrides {
    Allowed,
    None,
}

impl From<bool> for Overrides {
    fn from(allowed: bool) -> Self {
        if allowed { Self::Allowed } else { Self::None }
    }
}

/// Declares the parameters of an endpoint, read-only, and gives the quality of service they amount to; `topic` is the
/// absolute name after remapping.
///
/// # Errors
/// [`crate::Error::ParameterValue`] for a policy that makes no sense.
pub(crate) fn overridden(parameters: &Parameters, topic: &str, end: End, qos: Qos) -> Result<Qos> {
    let name = |policy: &str| format!("{QOS_OVERRIDES}{topic}.{}.{policy}", end.name());
    let choice = |policy: &str, choices: [&str; 2], first: bool| -> Result<bool> {
        let name = name(policy);
        let default = if first { choices[0] } else { choices[1] };
        parameters.declare(
            Parameter::new(&name, default)
                .one_of(&choices)
                .describe(&format!("{policy} of the {} of {topic}", end.name())),
        )?;
        Ok(parameters.get::<String>(&name)? == choices[0])
    };
    let reliable = choice("reliability", ["reliable", "best_effort"], qos.reliable)?;
    let transient_local = choice(
        "durability",
        ["transient_local", "volatile"],
        qos.transient_local,
    )?;
    let history = name("history");
    parameters.declare(Parameter::new(&history, "keep_last").one_of(&["keep_last"]).describe(
        "history; keep_all is not offered: a subscriber that hangs would stop the publisher",
    ))?;
    let depth = name("depth");
    parameters.declare(
        Parameter::new(&depth, i64::try_from(qos.depth).unwrap_or(i64::MAX))
            .range(1.0, 1e6)
            .unit("messages")
            .describe("how many are kept for who does not keep up"),
    )?;
    Ok(Qos {
        reliable,
        transient_local,
        depth: usize::try_from(parameters.get::<i64>(&depth)?).unwrap_or(qos.depth),
        ..qos
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::names::NodeIdentity;
    use crate::ros_args::RosArgs;

    fn with(arguments: &[&str]) -> Parameters {
        let node = NodeIdentity::new("/", "n").unwrap();
        let arguments = RosArgs::parse(arguments.iter().copied()).unwrap();
        Parameters::new(Vec::new(), &arguments.overrides(&node, "n").unwrap()).unwrap()
    }

    /// What is given counts, the rest stays, and the other end of the topic is not meant.
    #[test]
    fn policies_are_overridden_one_by_one() {
        let parameters = with(&[
            "--ros-args",
            "-p",
            "qos_overrides./a/b.publisher.reliability:=best_effort",
            "-p",
            "qos_overrides./a/b.publisher.depth:=7",
        ]);
        let of = |end| overridden(&parameters, "/a/b", end, Qos::latched(3)).unwrap();
        let expected = Qos {
            reliable: false,
            depth: 7,
            ..Qos::latched(3)
        };
        assert_eq!(of(End::Publisher), expected);
        assert_eq!(of(End::Subscription), Qos::latched(3));
        assert!(parameters.undeclared().is_empty());
    }

    /// A policy without meaning names the parameter and what it may be.
    #[test]
    fn nonsense_is_an_error() {
        let parameters = with(&[
            "--ros-args",
            "-p",
            "qos_overrides./a.publisher.history:=keep_all",
        ]);
        let error = overridden(&parameters, "/a", End::Publisher, Qos::reliable(1)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "-p: parameter 'qos_overrides./a.publisher.history' is 'keep_all', expected string, one of keep_last"
        );
    }
}
