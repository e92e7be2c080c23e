//! The node `scheme_sequencer`, see that crate.

fn main() -> std::process::ExitCode {
    scheme_sequencer::run()
}
