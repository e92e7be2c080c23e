//! The bags that ship with the project, in `bags/samples`.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use crate::executables::repository;

/// Whole ones, each of which converges.
pub const GOOD_SAMPLES: [&str; 5] = [
    "eight_position",
    "paper_experiment",
    "elsewhere",
    "real_sensor",
    "moored_sea",
];
/// One that was cut off, and one with a damaged chunk.
pub const BAD_SAMPLES: [&str; 2] = ["cut_off", "damaged_chunk"];

/// The folder that they stand in.
pub fn samples() -> PathBuf {
    repository().join("bags/samples")
}

/// One of them.
pub fn sample(name: &str) -> PathBuf {
    samples().join(name)
}

/// What is true of it, in SI units.
pub fn truth_of_sample(name: &str) -> Value {
    let path = samples().join(format!("{name}.truth.json"));
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}
