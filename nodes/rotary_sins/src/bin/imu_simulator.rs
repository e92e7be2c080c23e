//! The node `imu_simulator`, see that crate.

#[global_allocator]
static ALLOCATOR: ros_node::BoundedAllocator = ros_node::BoundedAllocator;

fn main() -> std::process::ExitCode {
    imu_simulator::run()
}
