//! The node `scheme_sequencer`, see that crate.

#[global_allocator]
static ALLOCATOR: ros_node::BoundedAllocator = ros_node::BoundedAllocator;

fn main() -> std::process::ExitCode {
    scheme_sequencer::run()
}
