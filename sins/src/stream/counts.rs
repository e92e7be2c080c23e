//! What became of everything that was put into a stream.

use serde::{Deserialize, Serialize};

use crate::time::Stamp;

/// A quantity of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Angular rate \[rad/s\].
    AngularVelocity,
    /// Specific force \[m/s²\].
    LinearAcceleration,
}

impl std::fmt::Display for Quantity {
    /// As the message calls it, with its unit.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::AngularVelocity => "angular velocity [rad/s]",
            Self::LinearAcceleration => "linear acceleration [m/s²]",
        })
    }
}

/// Why a sample is not used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// Its stamp is that of a sample before it.
    Repeated,
    /// It came too late to be put in its place.
    OutOfOrder,
    /// No other stamp agrees with its own.
    Alone,
    /// It holds a number that is not finite.
    NotFinite,
    /// It lies beyond what the sensor can give.
    BeyondRange {
        /// Which quantity.
        what: Quantity,
        /// Its greatest component.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// It jumps away from the sample before it, and the one after it jumps back.
    Spike {
        /// Which quantity.
        what: Quantity,
        /// The jump.
        value: f64,
        /// The limit.
        limit: f64,
    },
}

impl Refusal {
    /// A name by which refusals are counted.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Repeated => "repeated",
            Self::OutOfOrder => "out of order",
            Self::Alone => "stamp alone",
            Self::NotFinite => "not finite",
            Self::BeyondRange { .. } => "beyond range",
            Self::Spike { .. } => "spike",
        }
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Repeated => f.write_str("its stamp has come before"),
            Self::OutOfOrder => f.write_str("it came too late to be put in its place"),
            Self::Alone => f.write_str("no other stamp agrees with its own"),
            Self::NotFinite => f.write_str("angular velocity or linear acceleration is not finite"),
            Self::BeyondRange { what, value, limit } => {
                write!(f, "{what} is {value:.4e}, expected at most {limit}")
            }
            Self::Spike { what, value, limit } => write!(
                f,
                "{what} jumps by {value:.4} for one sample, expected at most {limit}"
            ),
        }
    }
}

/// A sample that is not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refused {
    /// Its stamp.
    pub stamp: Stamp,
    /// Why.
    pub why: Refusal,
}

/// Counts of a stream since it was made. They go on over restarts and epochs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StreamCounts {
    /// Samples that were used (the first one of every epoch included).
    pub samples: u64,
    /// Holes in the stream.
    pub gaps: u64,
    /// Samples missing in those holes.
    pub lost: u64,
    /// Samples refused because their stamp had come before.
    pub repeated: u64,
    /// Samples refused because they came too late to be put in order.
    pub backward: u64,
    /// Samples refused because no other stamp agreed with theirs.
    pub alone: u64,
    /// Samples refused because a value was not finite.
    pub not_finite: u64,
    /// Samples refused because a value lay beyond the range of the sensor.
    pub beyond_range: u64,
    /// Samples refused because they jumped away from both their neighbours.
    pub spikes: u64,
    /// Samples put in their place that had come out of it.
    pub reordered: u64,
    /// Times that the clock was set back, ran too far ahead, or was started anew after a hole; the first start is none.
    pub restarts: u64,
    /// Joint states and velocities that were refused, or that a full queue pushed out.
    pub side_refused: u64,
}

impl StreamCounts {
    /// Samples that came and were not used.
    pub fn refused(&self) -> u64 {
        self.repeated
            + self.backward
            + self.alone
            + self.not_finite
            + self.beyond_range
            + self.spikes
    }

    /// Counts a refusal.
    pub(super) fn refuse(&mut self, why: &Refusal) {
        *match why {
            Refusal::Repeated => &mut self.repeated,
            Refusal::OutOfOrder => &mut self.backward,
            Refusal::Alone => &mut self.alone,
            Refusal::NotFinite => &mut self.not_finite,
            Refusal::BeyondRange { .. } => &mut self.beyond_range,
            Refusal::Spike { .. } => &mut self.spikes,
        } += 1;
    }
}
