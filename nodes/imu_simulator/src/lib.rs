//! ROS 2 node: a ship, a two-axis table on it, and the IMU on the table. It drives [`sins::simulation::Simulator`]; here
//! joint trajectories become motions, and samples become messages, at a chosen multiple of real time.

mod follow;
mod node;
mod outputs;
mod pacing;
pub mod parameters;
mod wait_list;

use std::process::ExitCode;

use ros_node::NodeBuilder;

/// The node with its parameters.
pub fn builder() -> NodeBuilder {
    NodeBuilder::new("imu_simulator")
        .about("simulates ship, turntable and IMU, and publishes what a driver would, with the truth beside it")
        .parameters(parameters::declared().declarations())
        .hardware("simulated IMU")
        .managed()
}

/// Runs the node: what its executable does, which stands in the package `rotary_sins`.
pub fn run() -> ExitCode {
    ros_node::run(builder(), node::main)
}
