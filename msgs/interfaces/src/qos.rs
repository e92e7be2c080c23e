//! Quality of service of a topic's end, as far as this project sets it.

use std::time::Duration;

/// Samples that writer and reader of a sensor topic keep. A reader that is not scheduled for a while loses nothing
/// as long as fewer arrive in that time: 0.4 s at 10 000 samples/s, 20 s at 200.
pub const SENSOR_DEPTH: usize = 4000;

/// Reliability, durability and depth of a topic's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Lost samples are sent again, else best effort.
    pub reliable: bool,
    /// Late subscribers get the last samples, else volatile.
    pub transient_local: bool,
    /// Samples kept; in what a bag says of its publishers, 0 means all.
    pub depth: usize,
    /// Samples older than this are not delivered any more.
    pub lifespan: Option<Duration>,
}

impl Qos {
    /// Sensor samples that must not be lost: reliable, deep. Readers made with it also take from best-effort writers.
    pub const fn sensor() -> Self {
        Self::reliable(SENSOR_DEPTH)
    }

    /// Reliable, volatile.
    pub const fn reliable(depth: usize) -> Self {
        Self {
            reliable: true,
            transient_local: false,
            depth,
            lifespan: None,
        }
    }

    /// Reliable, transient local: who comes late gets the last `depth`.
    pub const fn latched(depth: usize) -> Self {
        Self {
            reliable: true,
            transient_local: true,
            depth,
            lifespan: None,
        }
    }

    /// Best effort, volatile.
    pub const fn best_effort(depth: usize) -> Self {
        Self {
            reliable: false,
            transient_local: false,
            depth,
            lifespan: None,
        }
    }

    /// The same with another depth.
    #[must_use]
    pub const fn with_depth(self, depth: usize) -> Self {
        Self { depth, ..self }
    }

    /// The same with a lifespan.
    #[must_use]
    pub const fn with_lifespan(self, lifespan: Duration) -> Self {
        Self {
            lifespan: Some(lifespan),
            ..self
        }
    }
}
