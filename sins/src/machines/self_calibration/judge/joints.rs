//! Joints against gyroscopes: a moored ship does not turn while her table does.
//!
//! With the joints turned back to zero the block shows the ship. Before and after a motion she must stand alike: where she does not,
//! the joints turn about other axes, the other way, or by another angle than they say.

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

use crate::stream::joint_history::JointHistory;
use crate::table::Turntable;
use crate::time::Stamp;
use crate::units::ARC_SECOND;

/// A joint has moved where two readings a step apart differ by more \[rad\].
const MOVED_RAD: f64 = 60.0 * ARC_SECOND;
/// A reading older than this says nothing of now \[s\].
const OLDEST_READING_S: f64 = 1.0;
/// At rest the ship is compared with herself after so many steps.
const REST_STEPS: u32 = 40;
/// What table and encoders may be off \[rad\].
const TABLE_RAD: f64 = 180.0 * ARC_SECOND;
/// A motion during which the filter learned more of the attitude says nothing, one-sigma \[rad\].
const LEARNED_RAD: f64 = 60.0 * ARC_SECOND;
/// So many times her turn at rest a turn over a motion may be.
const TIMES: f64 = 5.0;
/// So many motions make a test.
const FEWEST: u32 = 2;

/// How the ship turned while her table did, and while it rested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Joints {
    before: Option<([f64; 2], UnitQuaternion<f64>)>,
    /// Where she stood when the joints last rested, and how uncertain that was.
    rested: Option<(UnitQuaternion<f64>, f64)>,
    moving: bool,
    steps: u32,
    motions: u32,
    rests: u32,
    moved_rad2: f64,
    rested_rad2: f64,
}

impl Joints {
    /// Takes the end of a covariance step: the block's attitude and its one-sigma.
    pub(in crate::machines::self_calibration) fn take(
        &mut self,
        stamp: Stamp,
        joints: &JointHistory,
        turntable: Turntable,
        attitude: &UnitQuaternion<f64>,
        sigma_rad: f64,
    ) {
        let is_fresh = joints
            .last()
            .is_some_and(|last| stamp.seconds_since(last.stamp).abs() <= OLDEST_READING_S);
        if !is_fresh {
            (self.before, self.rested) = (None, None);
            return;
        }
        let angles = joints.angles_at(stamp);
        let ship = attitude * turntable.attitude(angles).inverse();
        let Some((angles_before, _)) = self.before.replace((angles, ship)) else {
            return;
        };
        let rests = (0..2).all(|i| (angles[i] - angles_before[i]).abs() < MOVED_RAD);
        if !rests {
            self.moving = true;
            return;
        }
        let Some((stood, sigma)) = self.rested else {
            (self.rested, self.moving, self.steps) = (Some((ship, sigma_rad)), false, 0);
            return;
        };
        self.steps += 1;
        if !self.moving && self.steps < REST_STEPS {
            return;
        }
        let turned = stood.angle_to(&ship).powi(2);
        if self.moving {
            // What the filter has learned meanwhile moves the ship, too.
            if sigma.powi(2) - sigma_rad.powi(2) < LEARNED_RAD.powi(2) {
                self.motions += 1;
                self.moved_rad2 += turned;
            }
        } else {
            self.rests += 1;
            self.rested_rad2 += turned;
        }
        (self.rested, self.moving, self.steps) = (Some((ship, sigma_rad)), false, 0);
    }

    /// How far the ship seems to turn with a motion of her table, and how far she may \[rad\]; `None` after too few.
    pub fn turn(&self) -> Option<(f64, f64)> {
        (self.motions >= FEWEST && self.rests > 0).then(|| {
            let at_rest = (self.rested_rad2 / f64::from(self.rests)).sqrt();
            let bound = TABLE_RAD.max(TIMES * at_rest);
            ((self.moved_rad2 / f64::from(self.motions)).sqrt(), bound)
        })
    }
}
