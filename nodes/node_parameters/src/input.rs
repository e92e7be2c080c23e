//! How a node takes its samples.

use ros_node::{ParameterSet, SENSOR_DEPTH, Unit};

/// Queues and patience of a node that takes samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputParameters {
    /// Samples, and joint states, that the middleware keeps until the node takes them.
    pub queue_depth: usize,
    /// An input that is silent for longer is a fault \[s\].
    pub silence_s: f64,
}

impl Default for InputParameters {
    fn default() -> Self {
        Self {
            queue_depth: SENSOR_DEPTH,
            silence_s: 3.0,
        }
    }
}

/// Parameters of every node that takes samples.
pub fn input() -> ParameterSet<InputParameters> {
    ParameterSet::new("Input", InputParameters::default())
        .count(
            "queue_depth",
            10..=1_000_000,
            |s| &mut s.queue_depth,
            "Samples, and joint states, that the middleware keeps until the node takes them; more for accelerated time",
        )
        .number(
            "silence_s",
            Unit::SECOND,
            0.1..=3600.0,
            |s| &mut s.silence_s,
            "An input topic that is silent for longer is a fault",
        )
        .changeable()
}
