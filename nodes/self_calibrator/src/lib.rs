//! ROS 2 node: self-calibration of a rotary strapdown IMU, from its samples and the ship's position to the drifts and
//! biases of its sensors. It drives [`sins::machines::self_calibration::SelfCalibration`]; here messages become samples and
//! results become messages.

mod action;
mod calibrator;
mod kept;
mod node;
mod outlook;
pub mod parameters;
mod phase;
mod storage;
mod translation;

use std::process::ExitCode;

use ros_node::NodeBuilder;

/// The node with its parameters.
pub fn builder() -> NodeBuilder {
    NodeBuilder::new("self_calibrator")
        .about("estimates gyroscope drift and accelerometer bias while the turntable turns the IMU")
        .parameters(parameters::declared().declarations())
        .hardware("IMU")
        .managed()
}

/// Runs the node: what its executable does, which stands in the package `rotary_sins`.
pub fn run() -> ExitCode {
    ros_node::run(builder(), node::main)
}
