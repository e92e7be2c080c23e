//! From the declarations of a node and the command line to a node that can start.

use std::time::Duration;

use ros2_interfaces::Registry;
use tokio::sync::watch;

use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::lifecycle::LIFECYCLE_AUTOSTART;
use crate::names::{NodeIdentity, remap_node};
use crate::node::Node;
use crate::parameters::{self, HARDWARE_ID, NODE, Parameter, Parameters};
use crate::ros_args::RosArgs;
use crate::shutdown::Shutdown;
use crate::supervisor::Limits;

/// Time of a main function from the request to end to its end.
const ENDING: Duration = Duration::from_secs(3);
/// Time of `configure`, where a manager waits for it.
const CONFIGURING: Duration = Duration::from_secs(10);
/// What the process may take, unless it says otherwise \[bytes\]: twenty times what a node of ours needs.
const MEMORY: u64 = 1 << 30;

/// Declares a node: its name, what it is for, its parameters.
#[derive(Clone, Debug)]
pub struct NodeBuilder {
    name: String,
    about: String,
    parameters: Vec<Parameter>,
    arguments_usage: Option<String>,
    workers: usize,
    managed: bool,
    limits: Limits,
    types: Registry,
}

/// Everything that can be wrong before DDS comes in, checked.
#[derive(Debug)]
pub(crate) struct Startup {
    pub(crate) identity: NodeIdentity,
    pub(crate) original_name: String,
    pub(crate) ros_args: RosArgs,
    pub(crate) parameters: Parameters,
    pub(crate) environment: Environment,
    pub(crate) managed: bool,
    pub(crate) limits: Limits,
    pub(crate) types: Registry,
    pub(crate) shutdown: Shutdown,
    /// Whether the start is over.
    pub(crate) ready: watch::Sender<bool>,
}

impl NodeBuilder {
    /// A node of this name in the root namespace.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            about: String::new(),
            parameters: Vec::new(),
            arguments_usage: None,
            workers: 0,
            managed: false,
            limits: Limits {
                ending: Some(ENDING),
                configuring: CONFIGURING,
                memory: MEMORY,
            },
            types: Registry::new(),
        }
    }

    /// What the node is for, one line for `--help`.
    #[must_use]
    pub fn about(mut self, about: &str) -> Self {
        about.clone_into(&mut self.about);
        self
    }

    /// Declares a parameter.
    #[must_use]
    pub fn parameter(mut self, parameter: Parameter) -> Self {
        self.parameters.push(parameter);
        self
    }

    /// Declares several.
    #[must_use]
    pub fn parameters(mut self, parameters: impl IntoIterator<Item = Parameter>) -> Self {
        self.parameters.extend(parameters);
        self
    }

    /// Names the device that the diagnostics speak of, as the default of the parameter `hardware_id`.
    #[must_use]
    pub fn hardware(self, default: &str) -> Self {
        self.parameter(
            Parameter::new(HARDWARE_ID, default).group(NODE).describe(
                "Device that the diagnostics speak of, for instance by its serial number",
            ),
        )
    }

    /// Makes a managed (lifecycle) node of it, see [`crate::LIFECYCLE_AUTOSTART`], which it declares.
    #[must_use]
    pub fn managed(mut self) -> Self {
        self.managed = true;
        self.parameter(
            Parameter::new(LIFECYCLE_AUTOSTART, true)
                .group(NODE)
                .describe("Come up active; false: wait, unconfigured, for a lifecycle manager"),
        )
    }

    /// Types that the node knows besides those of its own publishers and subscriptions, for `~/get_type_description`:
    /// for nodes that carry messages of types that they learn at run time.
    #[must_use]
    pub fn types(mut self, types: Registry) -> Self {
        self.types = types;
        self
    }

    /// Its parameters with their defaults.
    ///
    /// # Errors
    /// None that a test of the node would not show: faulty declarations.
    pub fn declared(&self) -> Result<Parameters> {
        Parameters::defaults(self.parameters.clone())
    }

    /// Its parameters in the order in which they are shown: its own, then those that every node has.
    pub fn declarations(&self) -> Vec<Parameter> {
        let (own, common): (Vec<_>, Vec<_>) = self
            .parameters
            .iter()
            .cloned()
            .chain([parameters::use_sim_time()])
            .partition(|parameter| parameter.group != NODE);
        own.into_iter().chain(common).collect()
    }

    /// Its parameters with their defaults as a parameter file: what `--print-parameters` prints.
    pub fn parameter_file(&self) -> String {
        parameters::file(&self.name, &self.about, &self.declarations())
    }

    /// Its parameters as tables in Markdown, for a manual.
    pub fn parameter_table(&self) -> String {
        parameters::table(&self.declarations())
    }

    /// Lets arguments outside `--ros-args` through to [`Node::arguments`]; without this they are errors.
    #[must_use]
    pub fn accept_arguments(mut self, usage: &str) -> Self {
        self.arguments_usage = Some(usage.to_owned());
        self
    }

    /// Runs the tasks of the node on so many threads beside its main task, instead of all on one: more throughput for
    /// many tasks, at the price of more wake-ups a message.
    #[must_use]
    pub fn worker_threads(mut self, workers: usize) -> Self {
        self.workers = workers;
        self
    }

    /// Gives the main function so long from the request to end to its end, instead of 3 s; `None`: as long as it takes, or
    /// until a second signal.
    #[must_use]
    pub fn end_within(mut self, limit: Option<Duration>) -> Self {
        self.limits.ending = limit;
        self
    }

    /// Ends the node, in order and with status 1, where the process has more memory of its own than this \[bytes\], instead of 1 GiB: whoever is on
    /// the network decides what the middleware takes.
    #[must_use]
    pub fn memory_limit(mut self, limit: u64) -> Self {
        self.limits.memory = limit;
        self
    }

    /// Lets `configure` fail where a manager asks for it and the node is not ready within this, instead of 10 s.
    #[must_use]
    pub fn configure_within(mut self, limit: Duration) -> Self {
        self.limits.configuring = limit;
        self
    }

    pub(crate) fn workers(&self) -> usize {
        self.workers
    }

    /// Its declared name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Starts the node with these arguments (without the name of the program). To be called within a tokio runtime;
    /// executables use [`crate::run`].
    ///
    /// # Errors
    /// Whatever is wrong with arguments, parameters, environment or middleware.
    pub fn start<I, S>(self, arguments: I) -> Result<Node>
    where
        I: IntoIterator<Item = S>,
        S: Into<String>,
    {
        let startup = self.check(RosArgs::parse(arguments)?)?;
        Node::start(startup)
    }

    pub(crate) fn check(self, ros_args: RosArgs) -> Result<Startup> {
        if let (None, Some(unknown)) = (&self.arguments_usage, ros_args.others.first()) {
            return Err(Error::Argument(format!(
                "unknown argument '{unknown}'; parameters are given by --ros-args -p name:=value, --help lists them"
            )));
        }
        let identity = remap_node("/", &self.name, &ros_args.remaps)?;
        let overrides = ros_args.overrides(&identity, &self.name)?;
        let parameters = Parameters::new(self.parameters, &overrides)?;
        let environment = Environment::read()?;
        Ok(Startup {
            identity,
            original_name: self.name,
            ros_args,
            parameters,
            environment,
            managed: self.managed,
            limits: self.limits,
            types: self.types,
            shutdown: Shutdown::default(),
            ready: watch::Sender::new(false),
        })
    }

    /// The text of `--help`.
    pub fn usage(&self) -> String {
        let (name, about) = (&self.name, &self.about);
        let arguments = self.arguments_usage.as_deref().unwrap_or("");
        format!(
            "{name}: {about}\n\n\
             Usage: {name} {arguments}[--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] [--log-level LEVEL]]\n       \
             {name} --print-parameters [--markdown]   (a parameter file with the defaults, or tables)\n\nParameters:\n{}",
            parameters::usage(&self.declarations())
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn builder() -> NodeBuilder {
        NodeBuilder::new("n").about("test").parameter(
            Parameter::new("rate", 100.0)
                .unit("Hz")
                .range(1.0, 400.0)
                .describe("of samples"),
        )
    }

    /// The usage tells name, default, range, unit and description of every parameter, the standard one too.
    #[test]
    fn usage_lists_parameters() {
        let usage = builder().usage();
        for part in [
            "rate (default 100.0): double from 1.0 to 400.0 [Hz]",
            "of samples",
            "use_sim_time (default false)",
        ] {
            assert!(usage.contains(part), "{usage}");
        }
    }

    /// An argument that nobody asked for is an error that names it.
    #[test]
    fn stray_arguments_are_errors() {
        let arguments = || RosArgs::parse(["--frob"]).unwrap();
        assert!(
            builder()
                .check(arguments())
                .unwrap_err()
                .to_string()
                .contains("'--frob'")
        );
        assert_eq!(
            builder()
                .accept_arguments("[FILE] ")
                .check(arguments())
                .unwrap()
                .ros_args
                .others,
            ["--frob"]
        );
    }

    /// Remapped node names decide which parameters of a file are meant.
    #[test]
    fn remapped_name_selects_parameters() {
        let arguments = RosArgs::parse([
            "--ros-args",
            "-r",
            "__node:=m",
            "-p",
            "m:rate:=5",
            "-p",
            "x:rate:=7",
        ])
        .unwrap();
        let startup = builder().check(arguments).unwrap();
        assert_eq!(startup.identity.fully_qualified(), "/m");
        assert_eq!(startup.parameters.get::<f64>("rate").unwrap(), 5.0);
    }
}
