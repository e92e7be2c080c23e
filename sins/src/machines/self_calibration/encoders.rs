//! Encoders as measurements: while the table rests on a ship that lies still, they say how the block stands in its base.
//!
//! The base is part of the ship. A ship that rolls by more than arc seconds within a second makes encoders worthless for a
//! filter that takes the base's attitude for a slow walk, so how much she moves is measured first, by the attitude itself,
//! which the gyroscopes carry from second to second far better than an encoder reads.

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

use crate::estimation::any_filter::AnyFilter;
use crate::estimation::filter::EncoderReading;
use crate::estimation::measurement::Outcome;
use crate::stream::joint_history::JointHistory;
use crate::table::Turntable;
use crate::time::Stamp;
use crate::units::ARC_SECOND;

/// What encoders are worth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EncoderAccuracy {
    /// One-sigma of a reading \[rad\].
    pub sigma_rad: f64,
    /// One-sigma about the axis across both joints, about which nothing turns: how the axes wobble \[rad\].
    pub wobble_sigma_rad: f64,
}

impl Default for EncoderAccuracy {
    fn default() -> Self {
        Self {
            sigma_rad: 3.0 * ARC_SECOND,
            wobble_sigma_rad: 3.0 * ARC_SECOND,
        }
    }
}

/// What became of the encoders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum EncoderUse {
    /// No reading has come, or nobody asks for them.
    #[default]
    Unused,
    /// How much the ship moves is being measured, or the attitude is not certain enough yet.
    Watching,
    /// The ship moves too much: her attitude changes by this much in a second, one-sigma \[rad\].
    ShipMoves(f64),
    /// So many readings have been used.
    Used(u64),
}

impl std::fmt::Display for EncoderUse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unused => f.write_str("encoders not used"),
            Self::Watching => f.write_str("encoders not used yet"),
            Self::ShipMoves(rate) => write!(
                f,
                "encoders not used: the ship turns by {:.1} arcsec in a second",
                rate / ARC_SECOND
            ),
            Self::Used(readings) => write!(f, "encoders read {readings} times"),
        }
    }
}

/// A joint has moved where two readings a second apart differ by more \[rad\].
const MOVED_RAD: f64 = 30.0 * ARC_SECOND;
/// A reading older than this says nothing of now \[s\].
const OLDEST_READING_S: f64 = 1.0;
/// So long the ship is watched before the first reading is used, in readings.
const WATCH: u32 = 60;
/// How fast the measured motion of the ship follows, in readings.
const MEMORY: f64 = 300.0;
/// A mean of so many readings over what the gyroscopes' noise makes is still that noise: four sigmas of it.
const STILL: f64 = 1.2;
/// A ship that turns by more than this in a second makes encoders worthless \[rad\].
const MOVES_RAD: f64 = 5.0 * ARC_SECOND;
/// A filter whose attitude is less certain is not linear enough for readings of arc seconds, one-sigma \[rad\]: the second order
/// of a misalignment φ is φ²/2, three arc seconds at 5.4 mrad.
const LINEAR_RAD: f64 = 5e-3;
/// A reading this far off, in squared sigmas, is left out.
const GATE: f64 = 25.0;
/// After so many readings left out in a row the base is taken to have been moved.
const GATED_IN_A_ROW: u32 = 10;

/// A covariance step: when, where the joints stood, and the attitude after everything was measured.
type Before = (Stamp, [f64; 2], UnitQuaternion<f64>);

/// The reader of encoders.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Encoders {
    before: Option<Before>,
    watched: u32,
    /// Mean square of the ship's turn in a second \[rad²/s\].
    motion: f64,
    gated: u32,
    used: u64,
}

impl Encoders {
    /// What became of them.
    pub(super) fn usage(&self) -> EncoderUse {
        match self.watched {
            0 => EncoderUse::Unused,
            watched if watched < WATCH => EncoderUse::Watching,
            _ if self.motion.sqrt() > MOVES_RAD => EncoderUse::ShipMoves(self.motion.sqrt()),
            _ if self.used == 0 => EncoderUse::Watching,
            _ => EncoderUse::Used(self.used),
        }
    }

    /// Looks at the joints at the end of a covariance step, and updates where they rest. `carried` is the attitude as the
    /// gyroscopes carried it to here, before anything was measured.
    pub(super) fn take(
        &mut self,
        stamp: Stamp,
        carried: &UnitQuaternion<f64>,
        joints: &JointHistory,
        turntable: Turntable,
        accuracy: &EncoderAccuracy,
        filter: &mut AnyFilter,
    ) {
        let fresh = joints
            .last()
            .is_some_and(|last| stamp.seconds_since(last.stamp).abs() <= OLDEST_READING_S);
        if !fresh {
            self.before = None;
            return;
        }
        let angles = joints.angles_at(stamp);
        let before = self.before.take();
        let reading = EncoderReading {
            turntable,
            angles,
            sigma_rad: accuracy.sigma_rad,
            wobble_sigma_rad: accuracy.wobble_sigma_rad,
        };
        self.measure(stamp, carried, before, &reading, filter);
        self.before = Some((stamp, angles, filter.navigation().attitude));
    }

    /// How the ship moves beyond what the gyroscopes' own noise makes of a ship that lies still \[rad/√s\].
    fn walk(&self, filter: &AnyFilter) -> f64 {
        let own = filter.noise().gyroscope.norm_squared();
        if self.motion <= STILL * own {
            return 0.0;
        }
        (self.motion - own).sqrt()
    }

    fn measure(
        &mut self,
        stamp: Stamp,
        carried: &UnitQuaternion<f64>,
        before: Option<Before>,
        reading: &EncoderReading,
        filter: &mut AnyFilter,
    ) {
        let Some((then, angles_then, attitude_then)) = before else {
            return;
        };
        let seconds = stamp.seconds_since(then);
        let rests =
            (0..2).all(|joint| (reading.angles[joint] - angles_then[joint]).abs() < MOVED_RAD);
        if !(rests && seconds > 0.0 && seconds < 10.0) {
            return;
        }
        let turn = carried.angle_to(&attitude_then).powi(2) / seconds;
        let memory = MEMORY.min(f64::from(self.watched) + 1.0);
        self.motion += (turn - self.motion) / memory;
        self.watched = self.watched.saturating_add(1);
        if self.watched < WATCH {
            return;
        }
        if self.motion.sqrt() > MOVES_RAD || filter.largest_misalignment_sigma() > LINEAR_RAD {
            filter.forget_base();
            return;
        }
        filter.set_base_walk(self.walk(filter));
        let outcomes = filter.update_encoders(reading, Some(GATE));
        if outcomes
            .iter()
            .all(|outcome| matches!(outcome, Outcome::Refused))
        {
            return;
        }
        self.used += 1;
        if outcomes
            .iter()
            .any(|outcome| matches!(outcome, Outcome::Gated(_)))
        {
            self.gated += 1;
            if self.gated >= GATED_IN_A_ROW {
                filter.forget_base();
                self.gated = 0;
            }
        } else {
            self.gated = 0;
        }
    }
}
