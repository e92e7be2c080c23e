//! What the simulator knew, and the error of the attitude against it.

use std::collections::VecDeque;

use nalgebra::UnitQuaternion;
use rotary_sins_msgs::Calibration;
use rotary_sins_msgs::convert::stamp_from_time;
use sins::{earth::rotation::HeadingPitchRoll, table::Turntable, time::Stamp};

use super::thin::{POINTS, Thinned};

/// True poses that are kept for an estimate of the same time.
const POSES: usize = 256;
/// Readings of the joints that are kept for an estimate that comes late.
const READINGS: usize = 8192;
/// Estimates that wait for the joints or the pose of their time.
const WAITING: usize = 256;
/// A reading of the joints this far from the true attitude says nothing of it \[ns\].
const NEAR_NS: u64 = 500_000_000;
/// Joints that differ by less are at rest \[rad\].
const REST_RAD: f64 = 1e-6;
/// A block that turns by this much more than its joints is carried by a ship that moves \[rad\]. Encoders and table are good to
/// less.
const CARRIED_RAD: f64 = 3e-4;

/// True attitude and errors.
pub struct Truth {
    /// True sensor errors, and the attitude of the block at its stamp.
    pub calibration: Option<Calibration>,
    table: Turntable,
    /// Joints at the stamp of the calibration.
    first_joints: Option<[f64; 2]>,
    joints: VecDeque<(Stamp, [f64; 2])>,
    poses: VecDeque<(Stamp, UnitQuaternion<f64>, [f64; 3])>,
    /// The ship turns too: her attitude is known at the times of her true poses alone.
    ship_moves: bool,
    waiting: VecDeque<(Stamp, UnitQuaternion<f64>)>,
    errors: Thinned<[f64; 3]>,
    last_error: Option<(Stamp, [f64; 3])>,
}

impl Truth {
    /// Nothing is known yet of a block on this table.
    pub fn new(table: Turntable) -> Self {
        Self {
            calibration: None,
            table,
            first_joints: None,
            joints: VecDeque::new(),
            poses: VecDeque::new(),
            ship_moves: false,
            waiting: VecDeque::new(),
            errors: Thinned::new(POINTS),
            last_error: None,
        }
    }

    /// True attitude of the ship: the block's with the joints turned back.
    fn ship(&self) -> Option<UnitQuaternion<f64>> {
        let block = self.calibration.as_ref()?.attitude.rotation()?;
        Some(block * self.table.attitude(self.first_joints?).inverse())
    }

    /// True heading, pitch and roll of the ship.
    pub fn vehicle(&self) -> Option<HeadingPitchRoll> {
        Some(HeadingPitchRoll::from_attitude(&self.ship()?))
    }

    /// Takes the truth that was told first.
    pub fn take_calibration(&mut self, truth: Calibration) {
        self.calibration.get_or_insert(truth);
    }

    /// Takes a reading of the joints.
    pub fn take_joints(&mut self, stamp: Stamp, angles: [f64; 2]) {
        push_bounded(&mut self.joints, (stamp, angles), READINGS);
        if self.first_joints.is_none()
            && let Some(truth) = &self.calibration
        {
            // The truth is latched: it may come behind the readings of its time.
            let known = stamp_from_time(truth.header.stamp);
            let distance = |reading: &&(Stamp, [f64; 2])| reading.0.nanos().abs_diff(known.nanos());
            let nearest = self.joints.iter().min_by_key(distance);
            self.first_joints = nearest
                .filter(|reading| distance(reading) < NEAR_NS)
                .map(|reading| reading.1);
        }
        self.catch_up(stamp);
    }

    /// Takes a true pose of the block.
    pub fn take_pose(&mut self, stamp: Stamp, attitude: UnitQuaternion<f64>, place: [f64; 3]) {
        // Of the two before, the joints have come.
        if !self.ship_moves && self.is_carried() {
            self.ship_moves = true;
            self.errors = Thinned::new(POINTS);
            self.last_error = None;
        }
        push_bounded(&mut self.poses, (stamp, attitude, place), POSES);
        if self.joints.is_empty() {
            self.catch_up(stamp);
        }
    }

    /// The newest true place, with its time.
    pub fn place(&self) -> Option<(Stamp, [f64; 3])> {
        self.poses.back().map(|pose| (pose.0, pose.2))
    }

    /// Takes an estimated attitude of the block. Its error is worked out when the joints have come as far.
    pub fn take_estimate(&mut self, stamp: Stamp, attitude: UnitQuaternion<f64>) {
        push_bounded(&mut self.waiting, (stamp, attitude), WAITING);
        let newest = self.joints.back().map(|reading| reading.0);
        if let Some(newest) = newest.or_else(|| self.place().map(|place| place.0)) {
            self.catch_up(newest);
        }
    }

    fn catch_up(&mut self, now: Stamp) {
        while self.waiting.front().is_some_and(|first| first.0 <= now)
            && let Some((stamp, attitude)) = self.waiting.pop_front()
        {
            if let Some(truth) = self.block_at(stamp) {
                let error = misalignment(&attitude, &truth);
                self.errors.push(stamp, error);
                self.last_error = Some((stamp, error));
            }
        }
    }

    /// Whether between the last two poses the block turned by more than its joints did.
    fn is_carried(&self) -> bool {
        let mut newest = self.poses.iter().rev();
        let (Some(last), Some(before)) = (newest.next(), newest.next()) else {
            return false;
        };
        let joints = |time: Stamp| {
            let at = self.joints.partition_point(|reading| reading.0 < time);
            self.joints.get(at).filter(|reading| reading.0 == time)
        };
        let (Some(there), Some(here)) = (joints(last.0), joints(before.0)) else {
            return false;
        };
        let by_joints: f64 = (there.1.iter().zip(here.1))
            .map(|(a, b)| (a - b).abs())
            .sum();
        last.1.angle_to(&before.1) > by_joints + CARRIED_RAD
    }

    /// The true attitude of the block: its pose of this very time; else, of a ship that rests, hers with the joints of this
    /// time, or with those before and after it, where they rest.
    fn block_at(&self, stamp: Stamp) -> Option<UnitQuaternion<f64>> {
        if let Some(pose) = self.poses.iter().rev().find(|pose| pose.0 == stamp) {
            return Some(pose.1);
        }
        if self.ship_moves {
            return None;
        }
        let after = self.joints.partition_point(|reading| reading.0 < stamp);
        let (time, angles) = *self.joints.get(after)?;
        if time != stamp {
            let before = self.joints.get(after.checked_sub(1)?)?.1;
            let rest = before
                .iter()
                .zip(angles)
                .all(|(a, b)| (a - b).abs() < REST_RAD);
            rest.then_some(())?;
        }
        Some(self.ship()? * self.table.attitude(angles))
    }

    /// Error of the attitude about East, North, Up at this time \[rad\].
    pub fn error_at(&self, stamp: Stamp) -> Option<[f64; 3]> {
        self.last_error
            .filter(|(time, _)| *time == stamp)
            .map(|(_, error)| error)
    }

    /// Errors of the attitude about East, North, Up \[rad\], thinned.
    pub fn errors(&self) -> Vec<(Stamp, [f64; 3])> {
        self.errors.points()
    }
}

/// φ of an attitude about East, North, Up \[rad\]: C' = (I − φ×) C.
fn misalignment(found: &UnitQuaternion<f64>, truth: &UnitQuaternion<f64>) -> [f64; 3] {
    (-(found * truth.inverse()).scaled_axis()).into()
}

fn push_bounded<T>(queue: &mut VecDeque<T>, value: T, most: usize) {
    if queue.len() == most {
        queue.pop_front();
    }
    queue.push_back(value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use sins::time::NANOS_PER_SECOND;

    const PHI: [f64; 3] = [1e-5, -2e-5, 3e-5];

    fn at(seconds: i64) -> Stamp {
        Stamp::from_nanos(seconds * NANOS_PER_SECOND)
    }

    fn ship() -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.02, -0.01, 2.5)
    }

    /// An attitude with a known error on a block whose joints stand so.
    fn found(angles: [f64; 2]) -> UnitQuaternion<f64> {
        let block = ship() * Turntable::default().attitude(angles);
        UnitQuaternion::from_scaled_axis(-Vector3::from(PHI)) * block
    }

    fn truth() -> Truth {
        let mut truth = Truth::new(Turntable::default());
        truth.take_calibration(Calibration {
            attitude: ship().into(),
            ..Calibration::default()
        });
        truth.take_joints(at(0), [0.0; 2]);
        truth
    }

    fn assert_found(truth: &Truth, seconds: i64) {
        let error = truth.error_at(at(seconds)).expect("an error");
        let difference = Vector3::from(error) - Vector3::from(PHI);
        assert!(difference.norm() < 1e-12, "{error:?}");
    }

    /// An estimate that comes before the joints of its time waits for them, whatever the table does.
    #[test]
    fn an_early_estimate_waits_for_its_joints() {
        let mut truth = truth();
        truth.take_estimate(at(5), found([0.3, -0.7]));
        assert_eq!(truth.error_at(at(5)), None);
        truth.take_joints(at(4), [0.2, -0.6]);
        truth.take_joints(at(5), [0.3, -0.7]);
        assert_found(&truth, 5);
    }

    /// A late estimate finds the joints of its time; between two readings of a table that turns there is nothing to be found.
    #[test]
    fn a_late_estimate_finds_its_joints() {
        let mut truth = truth();
        for (time, angle) in [(4, 0.2), (5, 0.3), (7, 0.5), (8, 0.5), (10, 0.5)] {
            truth.take_joints(at(time), [angle, 0.0]);
        }
        truth.take_estimate(at(5), found([0.3, 0.0]));
        assert_found(&truth, 5);
        truth.take_estimate(at(6), found([0.4, 0.0]));
        assert_eq!(truth.error_at(at(6)), None);
        truth.take_estimate(at(9), found([0.5, 0.0]));
        assert_found(&truth, 9);
    }

    /// The joints of a ship that moves say nothing of her: only a true pose of the very time does.
    #[test]
    fn a_ship_that_moves_is_where_her_poses_are() {
        let mut truth = truth();
        for time in 1..=3 {
            let angles = [0.1 * time as f64, 0.0];
            truth.take_joints(at(time), angles);
            let block = ship() * Turntable::default().attitude(angles);
            truth.take_pose(at(time), block, [0.0; 3]);
        }
        truth.take_joints(at(4), [0.3, 0.0]);
        truth.take_estimate(at(4), found([0.3, 0.0]));
        assert_found(&truth, 4);
        let rolled = UnitQuaternion::from_euler_angles(0.01, 0.0, 0.0) * ship();
        for time in 5..=6 {
            truth.take_joints(at(time), [0.3, 0.0]);
            let block = if time == 5 { rolled } else { ship() };
            let pose = block * Turntable::default().attitude([0.3, 0.0]);
            truth.take_pose(at(time), pose, [0.0; 3]);
        }
        truth.take_pose(at(7), ship(), [0.0; 3]);
        truth.take_joints(at(8), [0.3, 0.0]);
        truth.take_estimate(at(8), found([0.3, 0.0]));
        assert_eq!(truth.error_at(at(8)), None);
        assert!(truth.errors().is_empty());
        truth.take_pose(at(9), ship(), [0.0; 3]);
        truth.take_joints(at(9), [0.0; 2]);
        truth.take_estimate(at(9), found([0.0; 2]));
        assert_found(&truth, 9);
    }

    /// Without joints the true pose of the same time serves.
    #[test]
    fn a_pose_serves_without_joints() {
        let mut truth = Truth::new(Turntable::default());
        truth.take_estimate(at(2), found([0.1, 0.2]));
        let block = ship() * Turntable::default().attitude([0.1, 0.2]);
        truth.take_pose(at(2), block, [0.0; 3]);
        assert_found(&truth, 2);
    }
}
