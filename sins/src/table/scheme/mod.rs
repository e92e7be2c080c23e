//! Rotation schemes: which rotations the table makes, how fast, and how long it dwells after each.
//!
//! A [`Scheme`] is what a person writes down. On a given [`Turntable`](crate::table::Turntable) it becomes a
//! [`Program`]: joints instead of axes, checked against the cable limits over all its cycles, with its time line.
//! A [`Sequencer`] runs the program against the joint states of a real or simulated table.
//!
//! A dwell comes first, at A (both joints at zero), and then one after every rotation. The dwell after the last rotation of a cycle
//! is the one from which the next cycle's first rotation leaves, so that a cycle lasts (its rotations + as many dwells).

mod designed;
mod file;
mod file_text;
mod program;
pub mod sequencer;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::error::Error;
use crate::table::{Axis, Joint};

pub use program::{Program, Segment, SegmentKind, Step};
pub use sequencer::Sequencer;

/// Names that [`Scheme::builtin`] knows.
pub const BUILTIN_NAMES: [&str; 5] = [
    "eight-position",
    "eight-position-yz",
    "static",
    "paper-experiment",
    "designed",
];

/// Table 1 of the paper: dwell in a position \[s\].
pub const DEFAULT_DWELL_S: f64 = 500.0;
/// Table 1 of the paper: 5 deg/s \[rad/s\].
pub const DEFAULT_RATE_RAD_S: f64 = 5.0 * PI / 180.0;
/// Table 1 of the paper: 2.5 deg/s² \[rad/s²\].
pub const DEFAULT_ACCELERATION_RAD_S2: f64 = 2.5 * PI / 180.0;

/// What a rotation turns about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The joint that turns about this axis of the block (at zero joint angles).
    Axis(Axis),
    /// This joint, whatever its axis.
    Joint(Joint),
}

/// One rotation and the dwell after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotation {
    /// What it turns about.
    pub about: About,
    /// Angle, counter-clockwise positive \[rad\].
    pub angle_rad: f64,
    /// Dwell after this rotation \[s\]; the scheme's where `None`.
    pub dwell_s: Option<f64>,
    /// Rate of this rotation \[rad/s\]; the scheme's where `None`.
    pub rate_rad_s: Option<f64>,
    /// Acceleration of this rotation \[rad/s²\]; the scheme's where `None`.
    pub acceleration_rad_s2: Option<f64>,
    /// Name of the position it leads to; a letter by the order of first visits where `None`.
    pub position: Option<String>,
}

impl Rotation {
    /// A rotation with the scheme's own dwell, rate and acceleration.
    pub fn new(about: About, angle_rad: f64) -> Self {
        Self {
            about,
            angle_rad,
            dwell_s: None,
            rate_rad_s: None,
            acceleration_rad_s2: None,
            position: None,
        }
    }
}

/// How far the cables let each joint turn: (min, max) of the continuous joint angle \[rad\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CableLimits {
    /// Of the outer joint.
    pub outer: (f64, f64),
    /// Of the inner joint.
    pub inner: (f64, f64),
}

impl CableLimits {
    /// No cables: slip rings on both joints.
    pub const NONE: Self = Self {
        outer: (f64::NEG_INFINITY, f64::INFINITY),
        inner: (f64::NEG_INFINITY, f64::INFINITY),
    };

    /// (min, max) of one joint \[rad\].
    pub fn of(&self, joint: Joint) -> (f64, f64) {
        match joint {
            Joint::Outer => self.outer,
            Joint::Inner => self.inner,
        }
    }
}

impl Default for CableLimits {
    /// One turn either way.
    fn default() -> Self {
        Self {
            outer: (-TAU, TAU),
            inner: (-TAU, TAU),
        }
    }
}

/// A rotation scheme.
#[derive(Clone, Debug, PartialEq)]
pub struct Scheme {
    /// Name, for status and reports.
    pub name: String,
    /// The rotations of one cycle, from both joints at zero.
    pub rotations: Vec<Rotation>,
    /// Dwell at A and after every rotation \[s\].
    pub dwell_s: f64,
    /// The dwell that comes first \[s\]; `dwell_s` where `None`.
    pub first_dwell_s: Option<f64>,
    /// Cruise rate \[rad/s\].
    pub rate_rad_s: f64,
    /// Acceleration and deceleration \[rad/s²\].
    pub acceleration_rad_s2: f64,
    /// How many cycles; `None`: until stopped.
    pub cycles: Option<u32>,
    /// How far the cables let the joints turn.
    pub limits: CableLimits,
}

impl Scheme {
    /// A scheme with the dwell, rate and acceleration of the paper's Table 1, repeated until stopped.
    pub fn new(name: impl Into<String>, rotations: Vec<Rotation>) -> Self {
        Self {
            name: name.into(),
            rotations,
            dwell_s: DEFAULT_DWELL_S,
            first_dwell_s: None,
            rate_rad_s: DEFAULT_RATE_RAD_S,
            acceleration_rad_s2: DEFAULT_ACCELERATION_RAD_S2,
            cycles: None,
            limits: CableLimits::default(),
        }
    }

    /// The paper's ten rotations: x+180, x+90, x−180, x−90, y+90 (A, B, C, D, back to A, E), then the four about x again
    /// (F, G, H, back to E) and y−90 (A). No joint leaves −90..270 deg, so the cables come back as they were.
    pub fn eight_position() -> Self {
        Self::eight_position_about("eight-position", Axis::X, Axis::Y)
    }

    /// The same program with (x, y) → (y, z); its table is [`Scheme::default_table`]'s, outer y and inner z.
    pub fn eight_position_yz() -> Self {
        Self::eight_position_about("eight-position-yz", Axis::Y, Axis::Z)
    }

    /// No rotation at all: one dwell at A, repeated.
    pub fn stationary() -> Self {
        Self::new("static", Vec::new())
    }

    /// The paper's experiment (its section 5): 0.7 h at rest, then the eight positions until stopped.
    pub fn paper_experiment() -> Self {
        Self {
            name: "paper-experiment".to_owned(),
            first_dwell_s: Some(0.7 * 3600.0),
            ..Self::eight_position()
        }
    }

    fn eight_position_about(name: &str, first: Axis, second: Axis) -> Self {
        let swing =
            [PI, FRAC_PI_2, -PI, -FRAC_PI_2].map(|angle| Rotation::new(About::Axis(first), angle));
        let mut rotations = swing.to_vec();
        rotations.push(Rotation::new(About::Axis(second), FRAC_PI_2));
        rotations.extend(swing);
        rotations.push(Rotation::new(About::Axis(second), -FRAC_PI_2));
        Self::new(name, rotations)
    }

    /// A scheme by its name, if it is one of [`BUILTIN_NAMES`].
    pub fn builtin(name: &str) -> Option<Self> {
        match name {
            "eight-position" => Some(Self::eight_position()),
            "eight-position-yz" => Some(Self::eight_position_yz()),
            "static" => Some(Self::stationary()),
            "paper-experiment" => Some(Self::paper_experiment()),
            "designed" => Some(Self::designed()),
            _ => None,
        }
    }

    /// The table on which this scheme runs where the user names none: outer x and inner y, unless the scheme
    /// asks for other axes; then its axes in the order of their first use.
    pub fn default_table(&self) -> crate::table::Turntable {
        let default = crate::table::Turntable::default();
        let mut axes: Vec<Axis> = Vec::new();
        for rotation in &self.rotations {
            if let About::Axis(axis) = rotation.about
                && !axes.contains(&axis)
            {
                axes.push(axis);
            }
        }
        if axes.iter().all(|axis| default.joint_about(*axis).is_some()) {
            return default;
        }
        let outer = axes.first().copied().unwrap_or(default.outer);
        let inner =
            axes.get(1)
                .copied()
                .unwrap_or(if outer == Axis::Z { Axis::X } else { Axis::Z });
        crate::table::Turntable::new(outer, inner).unwrap_or(default)
    }

    fn error(&self, reason: impl Into<String>) -> Error {
        Error::Scheme {
            name: self.name.clone(),
            reason: reason.into(),
        }
    }
}
