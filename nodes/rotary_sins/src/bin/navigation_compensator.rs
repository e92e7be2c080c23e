//! The node `navigation_compensator`, see that crate.

fn main() -> std::process::ExitCode {
    navigation_compensator::run()
}
