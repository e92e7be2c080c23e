//! The last readings of the joints, and the angles at any time near them.

use crate::error::Error;
use crate::table::JointSample;
use crate::time::Stamp;

/// The last two readings.
#[derive(Clone, Copy, Debug, Default)]
pub struct JointHistory {
    before: Option<JointSample>,
    last: Option<JointSample>,
}

impl JointHistory {
    /// Takes a reading; one that is not later than the last replaces it.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn push(&mut self, sample: JointSample) -> Result<(), Error> {
        if !sample.position.iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite {
                what: "joint position",
                stamp: sample.stamp,
            });
        }
        if self.last.is_some_and(|last| sample.stamp > last.stamp) {
            self.before = self.last;
        }
        self.last = Some(sample);
        Ok(())
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

    /// Between two readings the angles lie on the line, outside they are held.
    #[test]
    fn interpolates_and_holds() {
        let mut history = JointHistory::default();
        assert_eq!(history.angles_at(Stamp::from_nanos(0)), [0.0; 2]);
        history.push(reading(0, 1.0)).unwrap();
        history.push(reading(100, 2.0)).unwrap();
        assert!(history.push(reading(110, f64::NAN)).is_err());
        assert_eq!(
            history.angles_at(Stamp::from_nanos(25_000_000)),
            [1.25, -1.25]
        );
        assert_eq!(
            history.angles_at(Stamp::from_nanos(500_000_000)),
            [2.0, -2.0]
        );
        assert_eq!(history.angles_at(Stamp::from_nanos(-1)), [1.0, -1.0]);
    }
}
