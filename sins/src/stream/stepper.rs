//! From samples to intervals: what the stamps allow the integration to do with each sample.

use crate::error::Error;
use crate::sensor::Increment;
use crate::sensor::sample::ImuSample;
use crate::stream::sampling::{Interval, SampleClock, StreamCounts};
use crate::time::Stamp;

/// One interval between samples, ready to be integrated.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// End of the interval.
    pub stamp: Stamp,
    /// What the sensors gathered.
    pub increment: Increment,
    /// One-sigma of the angle \[rad\] and the velocity \[m/s\] where the interval bridges a hole in the stream.
    pub bridged: Option<[f64; 2]>,
}

/// What a sample means for the integration.
#[derive(Clone, Copy, Debug)]
pub enum Arrival {
    /// The first sample, or the first after a jump: it only starts the clock.
    Start,
    /// An interval to integrate.
    Step(Step),
    /// Left out: its stamp repeats the last one or lies a little before it.
    LeftOut,
    /// The stamps jumped by more than can be bridged; this sample starts the clock anew.
    Jump {
        /// Last stamp before the jump.
        from: Stamp,
        /// Stamp of this sample.
        to: Stamp,
    },
}

/// Forms steps from samples and counts what it sees.
#[derive(Clone, Debug)]
pub struct Stepper {
    clock: SampleClock,
    previous: Option<ImuSample>,
    longest_bridge_s: f64,
    not_finite: u64,
    jumps: u64,
}

impl Stepper {
    /// Bridges holes of up to `longest_bridge_s` \[s\].
    pub fn new(longest_bridge_s: f64) -> Self {
        Self {
            clock: SampleClock::default(),
            previous: None,
            longest_bridge_s,
            not_finite: 0,
            jumps: 0,
        }
    }

    /// Takes a sample.
    ///
    /// # Errors
    /// [`Error::NotFinite`]; the sample is left out and counted.
    pub fn take(&mut self, sample: &ImuSample) -> Result<Arrival, Error> {
        if !sample.is_finite() {
            self.not_finite += 1;
            return Err(Error::NotFinite {
                what: "angular velocity or linear acceleration",
                stamp: sample.stamp,
            });
        }
        let before = self.clock.last();
        let (interval_s, hole) = match self.clock.classify(sample.stamp) {
            Interval::First => {
                self.previous = Some(*sample);
                return Ok(Arrival::Start);
            }
            Interval::Repeated => return Ok(Arrival::LeftOut),
            Interval::Backward(by) if by <= self.longest_bridge_s => return Ok(Arrival::LeftOut),
            Interval::Regular(interval_s) => (interval_s, false),
            Interval::Gap { interval_s, .. } if interval_s <= self.longest_bridge_s => {
                (interval_s, true)
            }
            Interval::Backward(_) | Interval::Gap { .. } => {
                self.jumps += 1;
                self.clock.restart();
                self.clock.classify(sample.stamp);
                self.previous = Some(*sample);
                return Ok(Arrival::Jump {
                    from: before.unwrap_or_default(),
                    to: sample.stamp,
                });
            }
        };
        let previous = self.previous.replace(*sample);
        let mut step = Step {
            stamp: sample.stamp,
            increment: Increment::from_averages(
                interval_s,
                &sample.angular_rate,
                &sample.specific_force,
            ),
            bridged: None,
        };
        if let Some(p) = previous.filter(|_| hole) {
            // Over a hole the rates are taken half way between its ends, and as uncertain as half their difference.
            step.increment = Increment::from_averages(
                interval_s,
                &(0.5 * (p.angular_rate + sample.angular_rate)),
                &(0.5 * (p.specific_force + sample.specific_force)),
            );
            step.bridged = Some([
                0.5 * interval_s * (p.angular_rate - sample.angular_rate).norm(),
                0.5 * interval_s * (p.specific_force - sample.specific_force).norm(),
            ]);
        }
        Ok(Arrival::Step(step))
    }

    /// Starts anew with the next sample; the counts go on.
    pub fn restart(&mut self) {
        self.clock.restart();
        self.previous = None;
    }

    /// Stamp of the last sample that was used.
    pub fn last(&self) -> Option<Stamp> {
        self.clock.last()
    }

    /// The usual sampling interval \[s\].
    pub fn usual_interval_s(&self) -> Option<f64> {
        self.clock.usual_interval_s()
    }

    /// Used, missing and refused samples, by stamp.
    pub fn counts(&self) -> StreamCounts {
        self.clock.counts()
    }

    /// Samples left out because a value was not finite.
    pub fn not_finite(&self) -> u64 {
        self.not_finite
    }

    /// Jumps of the stamps that could not be bridged.
    pub fn jumps(&self) -> u64 {
        self.jumps
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::Vector3;

    fn sample(millis: i64, rate: f64) -> ImuSample {
        ImuSample {
            stamp: Stamp::from_nanos(millis * 1_000_000),
            angular_rate: Vector3::x() * rate,
            specific_force: Vector3::z() * 9.8,
            angular_rate_variance: Vector3::zeros(),
            specific_force_variance: Vector3::zeros(),
        }
    }

    /// A hole of two samples in the middle of a turn is bridged by the mean of its ends, and says how uncertain that is.
    #[test]
    fn a_hole_is_bridged_and_its_uncertainty_told() {
        let mut stepper = Stepper::new(5.0);
        for ms in [0, 10, 20] {
            stepper.take(&sample(ms, 0.1)).unwrap();
        }
        let Arrival::Step(step) = stepper.take(&sample(50, 0.2)).unwrap() else {
            panic!("expected a step")
        };
        assert!((step.increment.angle.x - 0.15 * 0.03).abs() < 1e-15);
        assert!((step.bridged.unwrap()[0] - 0.05 * 0.03).abs() < 1e-15);
        assert_eq!(stepper.counts().lost, 2);
    }

    /// A hole too long to bridge, and a step back as long, start the clock anew.
    #[test]
    fn jumps_start_anew() {
        let mut stepper = Stepper::new(1.0);
        for ms in [0, 10] {
            stepper.take(&sample(ms, 0.0)).unwrap();
        }
        assert!(matches!(
            stepper.take(&sample(5000, 0.0)).unwrap(),
            Arrival::Jump { .. }
        ));
        assert!(matches!(
            stepper.take(&sample(5010, 0.0)).unwrap(),
            Arrival::Step(_)
        ));
        assert!(matches!(
            stepper.take(&sample(10, 0.0)).unwrap(),
            Arrival::Jump { .. }
        ));
        assert_eq!(stepper.jumps(), 2);
    }

    /// A sample that is not finite is refused with its stamp, and the next one spans the hole it leaves.
    #[test]
    fn not_finite_is_refused() {
        let mut stepper = Stepper::new(1.0);
        for ms in [0, 10] {
            stepper.take(&sample(ms, 0.0)).unwrap();
        }
        let error = stepper.take(&sample(20, f64::NAN)).unwrap_err();
        assert!(error.to_string().contains("20000000 ns"), "{error}");
        assert!(
            matches!(stepper.take(&sample(30, 0.0)).unwrap(), Arrival::Step(s) if s.bridged.is_some())
        );
        assert_eq!(stepper.not_finite(), 1);
    }
}
