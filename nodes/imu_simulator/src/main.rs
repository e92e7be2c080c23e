//! imu_simulator
fn main() {}
