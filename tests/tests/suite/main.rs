//! The whole suite as it is used: bags through the command line and the running nodes, real ROS 2 peers, faults. One executable,
//! because each would link everything once more, and because a runner can only share out what it sees at once.
#![allow(
    clippy::unwrap_used,
    reason = "this is test code: a failed step is a failed test"
)]

mod aboard;
mod actions;
mod aggregator;
mod allan;
mod analysis;
mod colcon;
mod covariances;
mod discovery;
mod disks;
mod endings;
mod faults;
mod foreign_bags;
mod four_nodes;
mod golden;
mod hostile;
mod install;
mod interfaces;
mod kills;
mod launch;
mod layouts;
mod manners;
mod manual;
mod monitor;
mod parameters;
mod real_data;
mod replay;
mod report_page;
mod ros2_peers;
mod rosbags;
mod run_report;
mod samples;
mod shared_bags;
mod soak;
