//! The node `self_calibrator`, see that crate.

#[global_allocator]
static ALLOCATOR: ros_node::BoundedAllocator = ros_node::BoundedAllocator;

fn main() -> std::process::ExitCode {
    self_calibrator::run()
}
