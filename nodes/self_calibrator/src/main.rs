//! self_calibrator
fn main() {}
