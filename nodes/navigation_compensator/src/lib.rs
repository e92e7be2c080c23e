//! ROS 2 node: takes the calibrated sensor errors out of the samples and navigates on them, with the uncompensated
//! solution beside it. It drives [`sins::machines::navigator::Navigator`]; here messages become samples and results become messages.

mod compensator;
mod instruments;
mod node;
pub mod parameters;
mod transforms;
mod translation;

use std::process::ExitCode;

use ros_node::NodeBuilder;

/// The node with its parameters.
pub fn builder() -> NodeBuilder {
    NodeBuilder::new("navigation_compensator")
        .about("compensates the IMU by the calibration and navigates free-inertially, with and without it")
        .parameters(parameters::declared().declarations())
        .hardware("IMU")
        .managed()
}

/// Runs the node: what its executable does, which stands in the package `rotary_sins`.
pub fn run() -> ExitCode {
    ros_node::run(builder(), node::main)
}
