//! ROS 2 node: self-calibration of a rotary strapdown IMU, from its samples and the ship's position to the drifts and
//! biases of its sensors. It drives [`sins::self_calibration::SelfCalibration`]; here messages become samples and
//! results become messages.

mod action;
mod calibrator;
mod node;
mod parameters;
mod phase;
mod translation;

use std::process::ExitCode;

use ros_node::NodeBuilder;

fn main() -> ExitCode {
    let builder = NodeBuilder::new("self_calibrator")
        .about("estimates gyroscope drift and accelerometer bias while the turntable turns the IMU")
        .parameters(parameters::declarations());
    ros_node::run(builder, node::main)
}
