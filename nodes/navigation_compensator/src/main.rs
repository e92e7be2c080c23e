//! navigation_compensator
fn main() {}
