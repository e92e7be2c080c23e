//! What can go wrong in a node, each with the values a person needs to find the cause.

use std::path::PathBuf;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line cannot be understood.
    #[error("{0}")]
    Argument(String),
    /// A parameter file cannot be read or does not have the layout rcl reads.
    #[error("parameter file {}: {reason}", path.display())]
    ParameterFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A key that this node has not declared.
    #[error("{origin}: unknown parameter '{name}'; {hint}")]
    UnknownParameter {
        /// The key.
        name: String,
        /// Where it was given.
        origin: String,
        /// Near matches, or everything that is known.
        hint: String,
    },
    /// A value of the wrong type, out of range, or not among those allowed.
    #[error("{origin}: parameter '{name}' is {value}, expected {expected}")]
    ParameterValue {
        /// The key.
        name: String,
        /// Where it was given.
        origin: String,
        /// The value.
        value: String,
        /// What would have been accepted.
        expected: String,
    },
    /// A value that is in range and still means nothing.
    #[error("parameter '{name}': {reason}")]
    ParameterMeaning {
        /// The key.
        name: String,
        /// What is wrong with it, and what was expected.
        reason: String,
    },
    /// A fault of the program: two declarations of one key.
    #[error("parameter '{0}' is declared twice")]
    DeclaredTwice(String),
    /// The node asks for a parameter that it has not declared, or as another type.
    #[error("parameter '{name}' is not declared as {expected}")]
    NotDeclared {
        /// The key.
        name: String,
        /// The type that was asked for.
        expected: &'static str,
    },
    /// A message type that cannot be registered.
    #[error(transparent)]
    Type(#[from] ros2_interfaces::RegistryError),
    /// A node, topic or service name breaks the rules of ROS 2.
    #[error("'{name}' is no valid {kind}: {reason}")]
    Name {
        /// The name.
        name: String,
        /// What it should name.
        kind: &'static str,
        /// Which rule it breaks.
        reason: String,
    },
    /// An environment variable has no usable value.
    #[error("environment variable {name} is '{value}', expected {expected}")]
    Environment {
        /// The variable.
        name: &'static str,
        /// Its value.
        value: String,
        /// What would have been accepted.
        expected: &'static str,
    },
    /// The middleware refused to create something.
    #[error("cannot create {what}: {reason}")]
    Create {
        /// What.
        what: String,
        /// The middleware's words.
        reason: String,
    },
    /// A message could not be handed to the middleware.
    #[error("{topic}: {reason}")]
    Publish {
        /// The topic.
        topic: String,
        /// Why.
        reason: String,
    },
    /// A service did not answer.
    #[error("service {service}: {reason}")]
    Service {
        /// The service.
        service: String,
        /// Why.
        reason: String,
    },
    /// The operating system refused something (signals, threads).
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: &'static str,
        /// The system's words.
        source: std::io::Error,
    },
}

/// Results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
