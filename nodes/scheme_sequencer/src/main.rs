//! scheme_sequencer
fn main() {}
