//! What the tests of the whole suite share: a network of their own, processes that end with the test, the
//! executables, bags made by our own simulator, and Python peers with a real ROS 2.
//!
//! The tests run the release executables as a user runs them, over real DDS. Each test that needs DDS runs in a network
//! and process namespace of its own ([`isolated`]), so that nothing of it is seen outside and nothing outlives it.
//!
//! Environment variables:
//! - `ROTARY_SINS_BIN_DIR`: the executables are taken from this folder and not built.
//! - `CI`: what is missing here (a ROS 2 peer, data, a browser) is a failure, not a skip.
//! - `ROTARY_SINS_SKIPPED`: a file that gets the name of every skipped test, with the reason.
#![allow(
    clippy::unwrap_used,
    reason = "this is test code: a failed step is a failed test"
)]

mod bag_cache;
mod chance;
mod chromium;
mod cli;
mod datagrams;
mod executables;
mod filled;
mod held_file;
mod isolation;
mod listener;
mod peers;
mod process;
mod recorded_run;
mod recording;
mod samples;
mod scene;
mod skipping;
mod tolerance;

pub use bag_cache::{Simulation, copy_bag, mcap_of, scratch};
pub use chance::Chance;
pub use chromium::{chromium, look_at};
pub use cli::{Answer, calibrate, rotary_sins, text};
pub use datagrams::{Intruder, Prefix, fragment_of, gap, heartbeat};
pub use executables::{EXECUTABLES, executable, repository, target_directory};
pub use filled::{assert_filled, filled};
pub use held_file::hold_file;
pub use isolation::{isolated, namespaces_are_permitted};
pub use listener::{GUARD, Heard, Listener};
pub use peers::{Peer, data_file, peer_python};
pub use process::{Program, Running, wait_until};
pub use recorded_run::RecordedRun;
pub use recording::{alter, alter_imu, estimates, messages, within_namespace, without_topic};
pub use samples::{BAD_SAMPLES, GOOD_SAMPLES, sample, samples, truth_of_sample};
pub use scene::Scene;
pub use skipping::skip;
pub use tolerance::{assert_within_sigmas, number, numbers, vector};
