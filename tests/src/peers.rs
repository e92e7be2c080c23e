//! Real ROS 2 peers in Python, and data that this project did not make.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::cli::Answer;
use crate::executables::repository;
use crate::process::Program;

/// What cannot be skipped where this is set.
const REQUIRED: &str = "ROTARY_SINS_REQUIRE_PEERS";

/// Says in one line that a test is skipped; fails instead where `ROTARY_SINS_REQUIRE_PEERS` is set.
pub fn skip(reason: &str) {
    assert!(
        std::env::var_os(REQUIRED).is_none(),
        "{REQUIRED} is set, but {reason}"
    );
    say(&format!("skipped: {reason}"));
}

/// Past the test harness, which shows what a passing test prints to nobody.
fn say(line: &str) {
    writeln!(std::io::stderr(), "{line}").ok();
}

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

/// Pythons of the newest distribution and the long-term one, as far as `setup.sh` has set them up.
pub fn distributions() -> Vec<PathBuf> {
    ["kilted", "jazzy"]
        .into_iter()
        .filter_map(peer_python)
        .collect()
}

/// A file that stands beside the project, in `../shared/data`; `None`, with a line, where it is absent.
pub fn data_file(name: &str) -> Option<PathBuf> {
    let path = repository().join("../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    // Data is no duty of a user's machine, so its absence is never a failure.
    say(&format!("skipped: {} is not there", path.display()));
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
