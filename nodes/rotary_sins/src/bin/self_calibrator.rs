//! The node `self_calibrator`, see that crate.

fn main() -> std::process::ExitCode {
    self_calibrator::run()
}
