//! What the electronics make of the samples: whole counts, stamps that are a little off, and covariance fields that may be wrong.

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::range;
use crate::sensor::sample::ImuSample;
use crate::simulation::{Stream, generator};

/// How samples leave the IMU. By default as they are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutputSettings {
    /// Angle of a count of the gyroscopes; 0: none \[rad\].
    pub angle_count_rad: f64,
    /// Velocity of a count of the accelerometers; 0: none \[m/s\].
    pub velocity_count_m_s: f64,
    /// One sigma by which a stamp is off; cut at 0.45 of the interval, so that stamps stay in order \[s\].
    pub stamp_jitter_s: f64,
    /// The variance that a sample states over its true one; 0: it says that it does not know.
    pub stated_variance_ratio: f64,
}

impl Default for OutputSettings {
    fn default() -> Self {
        Self {
            angle_count_rad: 0.0,
            velocity_count_m_s: 0.0,
            stamp_jitter_s: 0.0,
            stated_variance_ratio: 1.0,
        }
    }
}

impl OutputSettings {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        for (name, value) in [
            ("count of the gyroscopes [rad]", self.angle_count_rad),
            ("count of the accelerometers [m/s]", self.velocity_count_m_s),
            ("jitter of the stamps [s]", self.stamp_jitter_s),
            ("ratio of the stated variance", self.stated_variance_ratio),
        ] {
            range::not_negative(name, value)?;
        }
        Ok(())
    }
}

/// The electronics with what they hold back.
#[derive(Clone, Debug)]
pub(super) struct Electronics {
    settings: OutputSettings,
    generator: Xoshiro256PlusPlus,
    /// What was gathered and is no whole count yet: angle \[rad\] and velocity \[m/s\].
    rest: [Vector3<f64>; 2],
}

impl Electronics {
    pub fn new(settings: OutputSettings, seed: u64) -> Self {
        Self {
            settings,
            generator: generator(seed, Stream::Stamp),
            rest: [Vector3::zeros(); 2],
        }
    }

    /// The sample as it leaves.
    pub fn pass(&mut self, mut sample: ImuSample, interval_nanos: i64) -> ImuSample {
        let OutputSettings {
            angle_count_rad,
            velocity_count_m_s,
            stamp_jitter_s,
            stated_variance_ratio,
        } = self.settings;
        let interval_s = interval_nanos as f64 * 1e-9;
        let counted = [
            (&mut sample.angular_rate, angle_count_rad),
            (&mut sample.specific_force, velocity_count_m_s),
        ];
        for ((average, count), rest) in counted.into_iter().zip(&mut self.rest) {
            if count > 0.0 {
                let gathered = *average * interval_s + *rest;
                let whole = gathered.map(|value| (value / count).round() * count);
                *rest = gathered - whole;
                *average = whole / interval_s;
            }
        }
        if stamp_jitter_s > 0.0 {
            let normal: f64 = StandardNormal.sample(&mut self.generator);
            let limit = 0.45 * interval_s;
            sample.stamp = sample
                .stamp
                .plus_seconds((normal * stamp_jitter_s).clamp(-limit, limit));
        }
        if stated_variance_ratio != 1.0 {
            sample.angular_rate_variance *= stated_variance_ratio;
            sample.specific_force_variance *= stated_variance_ratio;
        }
        sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    fn sample(rate: f64) -> ImuSample {
        ImuSample {
            angular_rate: Vector3::new(rate, 0.0, 0.0),
            angular_rate_variance: Vector3::repeat(4.0),
            ..ImuSample::at_rest(Stamp::from_nanos(1_000_000_000), 9.8)
        }
    }

    /// Counts are whole, and nothing is lost: over many samples the mean is the rate.
    #[test]
    fn counts_are_whole_and_none_is_lost() {
        let settings = OutputSettings {
            angle_count_rad: 1e-6,
            velocity_count_m_s: 1e-3,
            ..OutputSettings::default()
        };
        let mut electronics = Electronics::new(settings, 1);
        let (mut angle, mut velocity) = (0.0, 0.0);
        for _ in 0..1000 {
            let out = electronics.pass(sample(3.7e-5), 10_000_000);
            let counts = out.angular_rate.x * 0.01 / 1e-6;
            assert!((counts - counts.round()).abs() < 1e-9);
            angle += out.angular_rate.x * 0.01;
            velocity += out.specific_force.z * 0.01;
        }
        assert!((angle - 3.7e-4).abs() < 0.51e-6 && (velocity - 98.0).abs() < 0.51e-3);
    }

    /// Stamps spread by the jitter and stay in order; the variance is stated as told.
    #[test]
    fn stamps_and_variances_are_as_set() {
        let settings = OutputSettings {
            stamp_jitter_s: 0.002,
            stated_variance_ratio: 0.1,
            ..OutputSettings::default()
        };
        let mut electronics = Electronics::new(settings, 1);
        let (mut square, mut greatest, n) = (0.0, 0.0f64, 10_000);
        for _ in 0..n {
            let out = electronics.pass(sample(0.0), 10_000_000);
            assert!((out.angular_rate_variance.x - 0.4).abs() < 1e-15);
            let off = out.stamp.seconds_since(sample(0.0).stamp);
            square += off * off;
            greatest = greatest.max(off.abs());
        }
        assert!(((square / f64::from(n)).sqrt() / 0.002 - 1.0).abs() < 0.04);
        assert!(greatest <= 0.0045 + 1e-9);
        let unknown = OutputSettings {
            stated_variance_ratio: 0.0,
            ..OutputSettings::default()
        };
        let out = Electronics::new(unknown, 1).pass(sample(0.0), 10_000_000);
        assert_eq!(out.angular_rate_variance.x, 0.0);
    }
}
