//! What the velocity error is measured against, and when.

use serde::{Deserialize, Serialize};

use super::Reference;
use super::schedule::Schedule;
use crate::sensor::VelocityMeasurement;
use crate::stream::{Interval, PositionAt};
use crate::time::Stamp;

/// What is to be done at the end of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Due {
    /// Nothing but integration.
    Nothing,
    /// A covariance step without a measurement.
    Step,
    /// A covariance step and an update by a velocity.
    Update(VelocityMeasurement),
    /// A covariance step and an update by a position.
    Position(PositionAt),
}

/// The velocity reference with its schedule.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Aiding {
    reference: Reference,
    schedule: Schedule,
    last_position: Option<Stamp>,
}

impl Aiding {
    pub(super) fn new(reference: Reference, schedule: Schedule) -> Self {
        Self {
            reference,
            schedule,
            last_position: None,
        }
    }

    /// Whether its steps come so often.
    pub(super) fn has_period(&self, period_s: f64) -> bool {
        self.schedule.has_period(period_s)
    }

    /// What the velocity error is measured against.
    pub(super) fn reference(&self) -> Reference {
        self.reference
    }

    /// What is due at the end of this interval. One step at most, be it due by the clock, by a measurement, or by both.
    #[inline]
    pub(super) fn due(&mut self, interval: &Interval) -> Due {
        let (stamp, seconds) = (interval.stamp, interval.increment.interval_s);
        match self.reference {
            Reference::Moored { sigma_m_s } | Reference::Auto { sigma_m_s, .. } => {
                if !self.schedule.is_due(stamp, seconds) {
                    return Due::Nothing;
                }
                self.schedule.made(stamp, seconds);
                Due::Update(VelocityMeasurement {
                    east_north: [0.0; 2],
                    sigma: [sigma_m_s; 2],
                })
            }
            Reference::Position { .. } => {
                // A receiver may tell more often than a covariance step is worth.
                let is_close = self
                    .last_position
                    .is_some_and(|last| stamp.seconds_since(last) < 0.5 * self.schedule.period_s());
                if let Some(position) = interval.position.as_deref().filter(|_| !is_close) {
                    self.schedule.made_by_measurement(stamp);
                    self.last_position = Some(stamp);
                    return Due::Position(*position);
                }
                if !self.schedule.is_due(stamp, seconds) {
                    return Due::Nothing;
                }
                self.schedule.made(stamp, seconds);
                Due::Step
            }
            Reference::Measured { .. } => {
                if let Some(measurement) = interval.velocity {
                    self.schedule.made_by_measurement(stamp);
                    return Due::Update(measurement);
                }
                if !self.schedule.is_due(stamp, seconds) {
                    return Due::Nothing;
                }
                self.schedule.made(stamp, seconds);
                Due::Step
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::{ImuSample, Increment};

    /// Velocities once a second that fall between the due times make one step each, and none of them is called missing.
    #[test]
    fn a_measurement_and_a_due_step_make_one_step() {
        let schedule = Schedule::new(Stamp::default(), 1.0);
        let mut aiding = Aiding::new(Reference::Measured { patience_s: 1.0 }, schedule);
        let (mut updates, mut steps) = (0, 0);
        for k in 1..=9000_i64 {
            let sample = ImuSample::at_rest(Stamp::from_nanos(k * 10_000_000), 9.8);
            let measured = VelocityMeasurement {
                east_north: [0.0; 2],
                sigma: [0.1; 2],
            };
            let is_measured = k % 100 == 37 && !(4000..5000).contains(&k);
            let interval = Interval {
                stamp: sample.stamp,
                increment: Increment::from_averages(
                    0.01,
                    &sample.angular_rate,
                    &sample.specific_force,
                ),
                velocity: is_measured.then_some(measured),
                position: None,
                hole: None,
            };
            match aiding.due(&interval) {
                Due::Update(_) => updates += 1,
                Due::Step => steps += 1,
                Due::Nothing | Due::Position(_) => {}
            }
        }
        assert_eq!((updates, steps), (80, 10));
    }
}
