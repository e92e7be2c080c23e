//! Samples that no sensor gave: not finite, beyond the sensor's range, or a spike of one sample.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::counts::{Quantity, Refusal};
use crate::error::Error;
use crate::sensor::sample::ImuSample;

/// What the sensors can give.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorRange {
    /// Greatest angular rate of an axis \[rad/s\].
    pub rate_rad_s: f64,
    /// Greatest specific force of an axis \[m/s²\].
    pub force_m_s2: f64,
    /// Greatest change of the rate from one sample to the next that is believed where the one after it jumps back \[rad/s\].
    pub rate_step_rad_s: f64,
    /// The same of the specific force \[m/s²\].
    pub force_step_m_s2: f64,
}

impl Default for SensorRange {
    /// Wide enough for every marine unit: 20 rad/s (1100 deg/s) and 500 m/s² (51 g); spikes of 0.5 rad/s and 20 m/s².
    fn default() -> Self {
        Self {
            rate_rad_s: 20.0,
            force_m_s2: 500.0,
            rate_step_rad_s: 0.5,
            force_step_m_s2: 20.0,
        }
    }
}

impl SensorRange {
    /// Refuses limits that mean nothing.
    ///
    /// # Errors
    /// [`Error::Setting`] with the name of the limit.
    pub fn check(&self) -> Result<(), Error> {
        for (name, value) in [
            ("range.rate_rad_s", self.rate_rad_s),
            ("range.force_m_s2", self.force_m_s2),
            ("range.rate_step_rad_s", self.rate_step_rad_s),
            ("range.force_step_m_s2", self.force_step_m_s2),
        ] {
            if value.is_nan() || value <= 0.0 {
                return Err(Error::setting(name, value, "a positive number"));
            }
        }
        Ok(())
    }

    /// Why a sample by itself cannot be.
    #[inline]
    fn refusal(&self, sample: &ImuSample) -> Option<Refusal> {
        if are_within(&sample.angular_rate, self.rate_rad_s)
            && are_within(&sample.specific_force, self.force_m_s2)
        {
            return None;
        }
        if !sample.is_finite() {
            return Some(Refusal::NotFinite);
        }
        let (rate, force) = (sample.angular_rate.amax(), sample.specific_force.amax());
        let (what, value, limit) = if rate > self.rate_rad_s {
            (Quantity::AngularVelocity, rate, self.rate_rad_s)
        } else {
            (Quantity::LinearAcceleration, force, self.force_m_s2)
        };
        Some(Refusal::BeyondRange { what, value, limit })
    }

    /// The jump between two samples, where it is too great.
    #[inline]
    fn jump(&self, from: &Values, to: &ImuSample) -> Option<Refusal> {
        let rate = to.angular_rate - from.rate;
        let force = to.specific_force - from.force;
        if are_within(&rate, self.rate_step_rad_s) && are_within(&force, self.force_step_m_s2) {
            return None;
        }
        let (rate, force) = (rate.amax(), force.amax());
        let (what, value, limit) = if rate > self.rate_step_rad_s {
            (Quantity::AngularVelocity, rate, self.rate_step_rad_s)
        } else if force > self.force_step_m_s2 {
            (Quantity::LinearAcceleration, force, self.force_step_m_s2)
        } else {
            return None;
        };
        Some(Refusal::Spike { what, value, limit })
    }
}

/// Whether every component is a finite number and none is greater than the limit.
#[inline]
fn are_within(values: &Vector3<f64>, limit: f64) -> bool {
    // A comparison with NaN is false, and infinity is greater than the greatest number. Nothing branches but the whole.
    let limit = limit.min(f64::MAX);
    (values.x.abs() <= limit) & (values.y.abs() <= limit) & (values.z.abs() <= limit)
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Values {
    rate: Vector3<f64>,
    force: Vector3<f64>,
}

impl From<&ImuSample> for Values {
    fn from(sample: &ImuSample) -> Self {
        Self {
            rate: sample.angular_rate,
            force: sample.specific_force,
        }
    }
}

/// What the sieve says of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sifted<'a> {
    /// It may be used.
    Good(&'a ImuSample),
    /// It may not.
    Bad(&'a ImuSample, Refusal),
}

/// Holds a sample that jumps until the next one tells whether it was a spike.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Sieve {
    range: SensorRange,
    last: Option<Values>,
    suspect: Option<(ImuSample, Refusal)>,
}

impl Sieve {
    pub(super) fn new(range: SensorRange) -> Self {
        Self {
            range,
            last: None,
            suspect: None,
        }
    }

    /// Takes a sample and hands on what is decided.
    #[inline]
    pub(super) fn push(&mut self, sample: &ImuSample, mut on: impl FnMut(Sifted<'_>)) {
        if let Some(why) = self.range.refusal(sample) {
            on(Sifted::Bad(sample, why));
            return;
        }
        let from_last = self
            .last
            .as_ref()
            .and_then(|last| self.range.jump(last, sample));
        if let Some((suspect, why)) = self.suspect.take() {
            let from_suspect = self.range.jump(&Values::from(&suspect), sample);
            if from_last.is_none() && from_suspect.is_some() {
                on(Sifted::Bad(&suspect, why));
            } else {
                on(Sifted::Good(&suspect));
            }
            // What jumps on is motion; it need not wait again.
        } else if let Some(why) = from_last {
            self.suspect = Some((*sample, why));
            return;
        }
        self.last = Some(Values::from(sample));
        on(Sifted::Good(sample));
    }

    /// No more will come: a jump at the very end is not believed.
    pub(super) fn end(&mut self, mut on: impl FnMut(Sifted<'_>)) {
        if let Some((suspect, why)) = self.suspect.take() {
            on(Sifted::Bad(&suspect, why));
        }
    }

    /// Whether a sample waits for the next one.
    pub(super) fn waits(&self) -> bool {
        self.suspect.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    fn sample(rate: f64) -> ImuSample {
        ImuSample {
            stamp: Stamp::default(),
            angular_rate: Vector3::new(0.0, rate, 0.0),
            specific_force: Vector3::z() * 9.8,
            angular_rate_variance: Vector3::zeros(),
            specific_force_variance: Vector3::zeros(),
        }
    }

    fn sift(rates: &[f64]) -> (Vec<f64>, Vec<&'static str>) {
        let mut sieve = Sieve::default();
        let (mut good, mut bad) = (Vec::new(), Vec::new());
        let mut on = |sifted: Sifted<'_>| match sifted {
            Sifted::Good(sample) => good.push(sample.angular_rate.y),
            Sifted::Bad(_, why) => bad.push(why.name()),
        };
        for rate in rates {
            sieve.push(&sample(*rate), &mut on);
        }
        sieve.end(&mut on);
        (good, bad)
    }

    /// A spike of one sample is refused, what is not finite or beyond the range too, and a real start of motion is not.
    #[test]
    fn spikes_and_wild_numbers_are_refused() {
        assert_eq!(
            sift(&[0.0, 0.1, 1.1, 0.1]),
            (vec![0.0, 0.1, 0.1], vec!["spike"])
        );
        let wild = sift(&[0.0, f64::NAN, 1e30, 30.0, f64::INFINITY, 0.0]);
        let why = vec!["not finite", "beyond range", "beyond range", "not finite"];
        assert_eq!(wild, (vec![0.0, 0.0], why));
        let motion = [0.0, 1.0, 1.1, 2.0, 3.0, 3.1];
        assert_eq!(sift(&motion), (motion.to_vec(), vec![]));
        assert_eq!(sift(&[0.0, 0.0, 1.0]), (vec![0.0, 0.0], vec!["spike"]));
    }
}
