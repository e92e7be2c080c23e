//! The nine states in three groups that share a picture and a threshold.

use std::ops::Range;

use sins::{
    estimation::error_state::{BIAS, DRIFT, MISALIGNMENT, STATE_LABELS},
    units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G},
};

use crate::compare::claims::{BIAS_FOUND_UG, DRIFT_FOUND_DEG_H};

/// A group of three states that share a picture.
pub struct Group {
    /// Its name.
    pub name: &'static str,
    /// For files and anchors.
    pub id: &'static str,
    /// Its states.
    pub states: Range<usize>,
    /// Sigma below which a state counts as found, SI; azimuth only where the group is misalignment.
    pub threshold: f64,
}

/// Misalignment, drifts, biases.
pub const GROUPS: [Group; 3] = [
    Group {
        name: "Misalignment",
        id: "misalignment",
        states: MISALIGNMENT..BIAS,
        threshold: 60.0 * ARC_SECOND,
    },
    Group {
        name: "Gyroscope drift",
        id: "drift",
        states: DRIFT..DRIFT + 3,
        threshold: DRIFT_FOUND_DEG_H * DEG_PER_HOUR,
    },
    Group {
        name: "Accelerometer bias",
        id: "bias",
        states: BIAS..DRIFT,
        threshold: BIAS_FOUND_UG * MICRO_G,
    },
];

/// Whether the group's threshold is meant for this state: of the misalignments only the azimuth.
pub fn threshold_applies(group: &Group, state: usize) -> bool {
    group.states.start != MISALIGNMENT || state == MISALIGNMENT + 2
}

/// What the group's threshold is asked of.
pub fn threshold_state(group: &Group) -> &'static str {
    if group.states.start == MISALIGNMENT {
        "σ of φU"
    } else {
        "σ"
    }
}

/// The group's threshold with its unit.
pub fn threshold_text(group: &Group) -> String {
    let label = &STATE_LABELS[group.states.start];
    format!("{} {}", group.threshold / label.scale, label.unit)
}
