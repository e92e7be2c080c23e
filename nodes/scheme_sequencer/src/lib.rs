//! ROS 2 node: runs a rotation scheme on a two-axis table. It drives [`sins::table::scheme::Sequencer`]; here joint states become
//! samples, commands become joint trajectories or goals, and service calls become requests.

mod kept;
mod node;
pub mod parameters;
mod stopping;
mod table;

use std::process::ExitCode;

use ros_node::NodeBuilder;

/// The node with its parameters.
pub fn builder() -> NodeBuilder {
    NodeBuilder::new("scheme_sequencer")
        .about("turns the table through a rotation scheme and says where it stands")
        .parameters(parameters::declared().declarations())
        .hardware("turntable")
        .managed()
}

/// Runs the node: what its executable does, which stands in the package `rotary_sins`.
pub fn run() -> ExitCode {
    ros_node::run(builder(), node::main)
}
