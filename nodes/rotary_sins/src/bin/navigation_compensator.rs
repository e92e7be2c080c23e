//! The node `navigation_compensator`, see that crate.

#[global_allocator]
static ALLOCATOR: ros_node::BoundedAllocator = ros_node::BoundedAllocator;

fn main() -> std::process::ExitCode {
    navigation_compensator::run()
}
