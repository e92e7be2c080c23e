//! How a node keeps its state.

use std::path::PathBuf;
use std::time::Duration;

use ros_node::{ParameterSet, Unit};

/// Where a node keeps its state, how often, and how old it may be.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckpointParameters {
    /// The file; empty: nothing is kept.
    pub file: String,
    /// Time between two of them \[s\].
    pub period_s: f64,
    /// An older one is not gone on with \[s\], by the stamps of the inputs.
    pub oldest_s: f64,
}

impl Default for CheckpointParameters {
    fn default() -> Self {
        Self {
            file: String::new(),
            period_s: 10.0,
            oldest_s: 3600.0,
        }
    }
}

impl CheckpointParameters {
    /// The file, where there is one.
    pub fn path(&self) -> Option<PathBuf> {
        (!self.file.is_empty()).then(|| PathBuf::from(&self.file))
    }

    /// Time between two.
    pub fn period(&self) -> Duration {
        Duration::from_secs_f64(self.period_s)
    }
}

/// Parameters of every node that keeps its state.
pub fn checkpoint() -> ParameterSet<CheckpointParameters> {
    ParameterSet::new("Checkpoint", CheckpointParameters::default())
        .text(
            "checkpoint_file",
            |s| &mut s.file,
            "File that the node keeps its state in, and goes on from after a crash; empty: off. A file a node",
        )
        .number(
            "checkpoint_period_s",
            Unit::SECOND,
            0.1..=3600.0,
            |s| &mut s.period_s,
            "Time between two checkpoints, on the clock of the computer",
        )
        .number(
            "checkpoint_oldest_s",
            Unit::SECOND,
            1.0..=1e7,
            |s| &mut s.oldest_s,
            "An older checkpoint, by the stamps of the inputs, is not gone on with",
        )
}
