//! How long the block has rested on its table.

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

/// A block that turns faster is turned by its table \[rad/s\].
const TURNS_RAD_S: f64 = 0.009;
/// So long after a turn its errors are still on the way into the velocity \[s\].
const AFTER_S: f64 = 60.0;
/// And from here on the block counts as at rest \[s\].
const QUIET_S: f64 = 120.0;

/// Time since the block was last turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    attitude: UnitQuaternion<f64>,
    since_turn_s: f64,
}

impl Rest {
    pub(super) fn new(attitude: UnitQuaternion<f64>) -> Self {
        Self {
            attitude,
            since_turn_s: 0.0,
        }
    }

    /// Another step, at the end of which the block stands like this.
    pub(super) fn turned(&mut self, attitude: UnitQuaternion<f64>, seconds: f64) {
        let turned = attitude.angle_to(&self.attitude);
        self.attitude = attitude;
        if turned > TURNS_RAD_S * seconds {
            self.since_turn_s = 0.0;
        } else {
            self.since_turn_s += seconds;
        }
    }

    /// The block turns, or did so lately.
    pub(super) fn is_after_turn(&self) -> bool {
        self.since_turn_s <= AFTER_S
    }

    /// No turn for long enough.
    pub(super) fn is_quiet(&self) -> bool {
        self.since_turn_s > QUIET_S
    }
}
