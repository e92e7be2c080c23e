//! The last readings of the joints, and the angles at any time near them.

use serde::{Deserialize, Serialize};

use crate::table::JointSample;
use crate::time::Stamp;

/// Readings that differ by less are those of a joint at rest \[rad\]: four sigmas of a usual encoder, 12 arcsec.
const AT_REST_RAD: f64 = 6e-5;
/// How fast a joint may change its rate \[rad/s²\]: the table of the paper, 2.5 deg/s².
const ACCELERATION_RAD_S2: f64 = 0.044;
/// A line through two readings is followed so far beyond them, in times of their distance.
const FARTHEST_SHARE: f64 = 2.0;

/// The last three readings.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct JointHistory {
    earlier: Option<JointSample>,
    before: Option<JointSample>,
    last: Option<JointSample>,
}

impl JointHistory {
    /// Takes a reading. One of the same time replaces the last; an earlier one begins anew.
    pub fn push(&mut self, sample: JointSample) {
        match self.last {
            Some(last) if sample.stamp > last.stamp => {
                (self.earlier, self.before) = (self.before, self.last);
            }
            Some(last) if sample.stamp < last.stamp => (self.earlier, self.before) = (None, None),
            _ => {}
        }
        self.last = Some(sample);
    }

    /// The last reading.
    pub fn last(&self) -> Option<&JointSample> {
        self.last.as_ref()
    }

    /// Angles and rates at `stamp`: on the line through the last two readings between them, held outside, zero where none has
    /// come.
    pub fn at(&self, stamp: Stamp) -> JointSample {
        JointSample {
            stamp,
            position: self.interpolate(stamp, |reading| reading.position),
            velocity: self.interpolate(stamp, |reading| reading.velocity),
        }
    }

    /// Angles (outer, inner) \[rad\] at `stamp`: on the line through the last two readings between them, held outside. Zero
    /// where none has come: an IMU without a table.
    pub fn angles_at(&self, stamp: Stamp) -> [f64; 2] {
        self.interpolate(stamp, |reading| reading.position)
    }

    /// Angles at `stamp` and how far they may be off the line \[rad\]; `None` where the readings do not enclose it. A joint whose
    /// rate changes by α within the time h between two readings is off by up to α h² / 8.
    pub fn told_at(&self, stamp: Stamp) -> Option<([f64; 2], f64)> {
        let last = self.last.filter(|last| last.stamp >= stamp)?;
        if last.stamp == stamp {
            return Some((last.position, 0.0));
        }
        let before = self.before.filter(|before| before.stamp <= stamp)?;
        let rests = (0..2).all(|i| (last.position[i] - before.position[i]).abs() < AT_REST_RAD);
        let apart_s = last.stamp.seconds_since(before.stamp);
        let off = if rests {
            0.0
        } else {
            ACCELERATION_RAD_S2 * apart_s * apart_s / 8.0
        };
        Some((self.angles_at(stamp), off))
    }

    /// Angles at `stamp` on the line through the last two readings before it, and how far they may be off it \[rad\].
    pub fn foretold_at(&self, stamp: Stamp) -> Option<([f64; 2], f64)> {
        let (before, last) = (self.before?, self.last?);
        if last.stamp > stamp {
            return on_line(&before, &self.earlier?, stamp);
        }
        on_line(&last, &before, stamp)
    }

    /// Angles at a `stamp` before the last reading, on the line through it and the `next` one, and how far they may be off it
    /// \[rad\].
    pub fn traced_back_to(&self, stamp: Stamp, next: &JointSample) -> Option<([f64; 2], f64)> {
        let last = self.last.filter(|last| last.stamp >= stamp)?;
        on_line(&last, next, stamp)
    }

    fn interpolate(&self, stamp: Stamp, value: fn(&JointSample) -> [f64; 2]) -> [f64; 2] {
        match (self.before, self.last) {
            (_, None) => [0.0; 2],
            (None, Some(last)) => value(&last),
            (Some(before), Some(last)) => {
                let share =
                    stamp.seconds_since(before.stamp) / last.stamp.seconds_since(before.stamp);
                let share = share.clamp(0.0, 1.0);
                let (from, to) = (value(&before), value(&last));
                [0, 1].map(|i| from[i] + share * (to[i] - from[i]))
            }
        }
    }
}

/// Angles at a stamp outside two readings, on their line beyond the nearer one. A joint whose rate changes by α is off the line by
/// up to α d (d + h) / 2 at the distance d from the nearer of two readings that are h apart; and the readings' own noise
/// grows by d / h.
fn on_line(near: &JointSample, far: &JointSample, stamp: Stamp) -> Option<([f64; 2], f64)> {
    let apart_s = near.stamp.seconds_since(far.stamp);
    let beyond_s = stamp.seconds_since(near.stamp);
    let share = beyond_s / apart_s;
    if !(0.0..=FARTHEST_SHARE).contains(&share) {
        return None;
    }
    let angles = [0, 1].map(|i| near.position[i] + share * (near.position[i] - far.position[i]));
    let (beyond_s, apart_s) = (beyond_s.abs(), apart_s.abs());
    let off = 0.5 * ACCELERATION_RAD_S2 * beyond_s * (beyond_s + apart_s);
    let noise = share * std::f64::consts::SQRT_2 * (AT_REST_RAD / 4.0);
    Some((angles, off.hypot(noise)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn reading(millis: i64, outer: f64) -> JointSample {
        JointSample {
            stamp: Stamp::from_nanos(millis * 1_000_000),
            position: [outer, -outer],
            velocity: [0.0; 2],
        }
    }

    fn at(millis: i64) -> Stamp {
        Stamp::from_nanos(millis * 1_000_000)
    }

    /// Between two readings the angles lie on the line, outside they are held.
    #[test]
    fn interpolates_and_holds() {
        let mut history = JointHistory::default();
        assert_eq!(history.angles_at(at(0)), [0.0; 2]);
        history.push(reading(0, 1.0));
        history.push(reading(100, 2.0));
        assert_eq!(history.angles_at(at(25)), [1.25, -1.25]);
        assert_eq!(history.angles_at(at(500)), [2.0, -2.0]);
        assert_eq!(history.angles_at(at(-1)), [1.0, -1.0]);
    }

    /// Equal stamps, in any order of arrival, never divide by zero.
    #[test]
    fn equal_stamps_give_angles() {
        let mut history = JointHistory::default();
        for (millis, outer) in [(10, 1.0), (20, 2.0), (10, 3.0), (10, 4.0), (10, 5.0)] {
            history.push(reading(millis, outer));
            for millis in [0, 10, 15, 20, 30] {
                assert!(history.angles_at(at(millis)).iter().all(|a| a.is_finite()));
            }
        }
        assert_eq!(history.angles_at(at(10)), [5.0, -5.0]);
    }

    /// Beyond two readings their line is followed for a while, on both sides, and the uncertainty grows.
    #[test]
    fn what_is_not_enclosed_is_on_the_line() {
        let mut history = JointHistory::default();
        history.push(reading(0, 1.0));
        assert_eq!(history.foretold_at(at(10)), None);
        history.push(reading(20, 1.002));
        let (angles, off) = history.foretold_at(at(30)).unwrap();
        assert!((angles[0] - 1.003).abs() < 1e-12 && (angles[1] + 1.003).abs() < 1e-12);
        assert!(off > 5e-6 && off < 2e-5, "{off}");
        assert!(history.foretold_at(at(50)).unwrap().1 > 2.0 * off);
        assert_eq!(history.foretold_at(at(100)), None);
        assert_eq!(history.foretold_at(at(10)), None);

        history.push(reading(5000, 2.0));
        assert_eq!(history.foretold_at(at(30)).unwrap().1, off);
        let next = reading(5020, 2.002);
        let (angles, off) = history.traced_back_to(at(4990), &next).unwrap();
        assert!((angles[0] - 1.999).abs() < 1e-12 && off < 2e-5);
        assert_eq!(history.traced_back_to(at(4000), &next), None);
        assert_eq!(history.traced_back_to(at(5010), &next), None);
    }

    /// What is told is enclosed by readings, and as exact as their distance in time allows.
    #[test]
    fn what_is_told_is_enclosed() {
        let mut history = JointHistory::default();
        history.push(reading(0, 1.0));
        history.push(reading(1000, 1.0));
        assert_eq!(history.told_at(at(500)), Some(([1.0, -1.0], 0.0)));
        assert_eq!(history.told_at(at(1001)), None);
        history.push(reading(2000, 1.1));
        assert!((history.told_at(at(1500)).unwrap().1 - 0.0055).abs() < 1e-9);
        assert_eq!(history.told_at(at(500)), None);
    }
}
