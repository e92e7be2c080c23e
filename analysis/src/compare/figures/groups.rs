//! The nine states in three groups that share a picture and a threshold.

use sins::{
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    estimation::groups::navigation::MISALIGNMENT,
    estimation::model,
    estimation::state::StateLabel,
    units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G},
};

use crate::compare::claims::{BIAS_FOUND_UG, DRIFT_FOUND_DEG_H};

/// A group of three states that share a picture.
pub struct Group {
    /// Its name.
    pub name: &'static str,
    /// For files and anchors.
    pub id: &'static str,
    /// Names of its states.
    pub states: [&'static str; 3],
    /// Sigma below which a state counts as found, SI; azimuth only where the group is misalignment.
    pub threshold: f64,
}

/// Misalignment, drifts, biases.
pub const GROUPS: [Group; 3] = [
    Group {
        name: "Misalignment",
        id: "misalignment",
        states: MISALIGNMENT,
        threshold: 60.0 * ARC_SECOND,
    },
    Group {
        name: "Gyroscope drift",
        id: "drift",
        states: GYROSCOPE_DRIFT,
        threshold: DRIFT_FOUND_DEG_H * DEG_PER_HOUR,
    },
    Group {
        name: "Accelerometer bias",
        id: "bias",
        states: ACCELEROMETER_BIAS,
        threshold: BIAS_FOUND_UG * MICRO_G,
    },
];

/// Whether the group's threshold is meant for this state: of the misalignments only the azimuth.
pub fn threshold_applies(group: &Group, state: &str) -> bool {
    group.states != MISALIGNMENT || state == MISALIGNMENT[2]
}

impl Group {
    /// Labels of its states.
    pub fn labels(&self) -> impl Iterator<Item = &'static StateLabel> {
        self.states.into_iter().filter_map(model::label)
    }
}

/// What the group's threshold is asked of.
pub fn threshold_state(group: &Group) -> &'static str {
    if group.states == MISALIGNMENT {
        "σ of φU"
    } else {
        "σ"
    }
}

/// The group's threshold with its unit.
pub fn threshold_text(group: &Group) -> String {
    let label = group.labels().next();
    label.map_or_else(String::new, |label| {
        format!("{} {}", group.threshold / label.scale, label.unit)
    })
}
