//! Real ROS 2 peers in Python, and data that this project did not make.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::cli::Answer;
use crate::executables::repository;
use crate::process::Program;
use crate::skipping::skip;

/// Python of the environment that `tests/ros2_peers/setup.sh` made for a ROS 2 distribution; `None`, with a line,
/// where it was not made.
pub fn peer_python(distribution: &str) -> Option<PathBuf> {
    let base = std::env::var_os("ROTARY_SINS_PEERS")
        .map_or_else(|| repository().join("target/ros2-peers"), PathBuf::from);
    let prefix = base.join(distribution);
    if prefix.join(".messages").exists() {
        return Some(prefix.join("bin/python"));
    }
    skip(&format!(
        "there is no ROS 2 {distribution}: run tests/ros2_peers/setup.sh {distribution}"
    ));
    None
}

/// Makes two tests of each function that takes the path of a Python: one a ROS 2 distribution, the newest and the long-term one,
/// each in a network of its own. Where `setup.sh` has not set one up, its test is skipped.
#[macro_export]
macro_rules! each_distribution {
    ($($test:ident),* $(,)?) => {$(
        mod $test {
            #[test]
            fn kilted() {
                if let Some(python) = $crate::peer_python("kilted") {
                    $crate::isolated(|| super::$test(&python));
                }
            }

            #[test]
            fn jazzy() {
                if let Some(python) = $crate::peer_python("jazzy") {
                    $crate::isolated(|| super::$test(&python));
                }
            }
        }
    )*};
}

/// A file that stands beside the project, in `../shared/data`; `None`, with a line, where it is absent.
pub fn data_file(name: &str) -> Option<PathBuf> {
    let path = repository().join("../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("there is no {}", path.display()));
    None
}

/// A script of `tests/ros2_peers`, run with a real ROS 2 beneath it.
#[derive(Clone, Debug)]
pub struct Peer {
    program: Program,
}

impl Peer {
    /// A script by name.
    pub fn new(python: &Path, script: &str) -> Self {
        let path = repository().join("tests/ros2_peers").join(script);
        Self {
            program: Program::at(script, python.to_owned())
                .arg(path)
                // Shared memory is not divided by network namespaces.
                .environment("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
                .environment("PYTHONUNBUFFERED", "1"),
        }
    }

    /// An argument.
    #[must_use]
    pub fn arg(mut self, argument: impl AsRef<Path>) -> Self {
        self.program = self.program.arg(argument);
        self
    }

    /// The program, to be started beside others.
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// Runs it to its end; what it prints is JSON.
    pub fn ask(&self) -> Value {
        Answer::from(self.program.command().output().unwrap())
            .expect_status(0)
            .json()
    }
}
