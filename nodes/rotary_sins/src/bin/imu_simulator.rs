//! The node `imu_simulator`, see that crate.

fn main() -> std::process::ExitCode {
    imu_simulator::run()
}
