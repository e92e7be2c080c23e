//! ROS 2 node: runs a rotation scheme on a two-axis table. It drives [`sins::scheme::Sequencer`]; here joint states become
//! samples, commands become joint trajectories or goals, and service calls become requests.

mod node;
mod parameters;
mod table;

use std::process::ExitCode;

use ros_node::NodeBuilder;

fn main() -> ExitCode {
    let builder = NodeBuilder::new("scheme_sequencer")
        .about("turns the table through a rotation scheme and says where it stands")
        .parameters(parameters::declarations());
    ros_node::run(builder, node::main)
}
