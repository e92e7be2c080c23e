//! Nodes and programs in a network namespace of their own.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use ros_node::{Node, NodeBuilder, Parameter};

/// Longest time that anything is waited for: it only ends what would never end.
pub const LONG: Duration = Duration::from_secs(600);

/// Runs a program where no other participant can be heard.
pub fn isolated(program: &PathBuf, arguments: &[&str]) -> Command {
    let script = "ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo; exec \"$@\"";
    let permitted = Command::new("unshare")
        .args(["-n", "true"])
        .status()
        .is_ok_and(|status| status.success());
    let mut command = if permitted {
        let mut command = Command::new("unshare");
        command
            .args(["-n", "bash", "-c", script, "bash"])
            .arg(program);
        command
    } else {
        eprintln!("unshare -n is not permitted: localhost and a domain of its own instead");
        let mut command = Command::new(program);
        command
            .env("ROS_DOMAIN_ID", (1 + std::process::id() % 200).to_string())
            .env("ROS_LOCALHOST_ONLY", "1");
        command
    };
    command.args(arguments);
    command
}

/// Runs one of the tests below, which are ignored otherwise, by itself.
pub fn run_inner(test: &str) {
    let me = std::env::current_exe().unwrap();
    let status = isolated(&me, &["--ignored", "--exact", test, "--nocapture"])
        .status()
        .unwrap();
    assert!(status.success(), "{test}: {status}");
}

/// A node with two parameters.
pub fn start(name: &str, arguments: &[&str]) -> Node {
    let gain = Parameter::new("gain", 1.0)
        .range(0.0, 2.0)
        .unit("1")
        .changeable();
    let builder = NodeBuilder::new(name)
        .parameter(gain)
        .parameter(Parameter::new("rate", 10.0));
    builder.start(arguments.iter().copied()).unwrap()
}

/// The example that stands for a node's executable.
pub fn minimal() -> PathBuf {
    let mut path = std::env::current_exe().unwrap();
    path.pop();
    path.pop();
    path.join("examples/minimal")
}
