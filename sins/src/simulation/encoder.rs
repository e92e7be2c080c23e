//! The angle encoders of the table.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::{Stream, generator};
use crate::error::Error;
use crate::range;
use crate::table::{JointSample, TableErrors};

/// What is wrong with the encoders. By default nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EncoderSettings {
    /// Smallest step of an angle; 0: none \[rad\].
    pub resolution_rad: f64,
    /// One sigma of an angle, before it is rounded to the resolution \[rad\].
    pub position_std_rad: f64,
    /// One sigma of a rate \[rad/s\].
    pub rate_std_rad_s: f64,
}

/// Reads the joints.
#[derive(Clone, Debug)]
pub struct Encoder {
    settings: EncoderSettings,
    errors: TableErrors,
    generator: Xoshiro256PlusPlus,
}

impl Encoder {
    /// Encoders with this noise and its seed, on a table with these errors.
    ///
    /// # Errors
    /// [`Error::Setting`] where a value is negative or not finite.
    pub fn new(settings: EncoderSettings, errors: TableErrors, seed: u64) -> Result<Self, Error> {
        for (name, value) in [
            ("encoder resolution [rad]", settings.resolution_rad),
            ("encoder noise [rad]", settings.position_std_rad),
            ("encoder rate noise [rad/s]", settings.rate_std_rad_s),
        ] {
            range::not_negative(name, value)?;
        }
        Ok(Self {
            settings,
            errors,
            generator: generator(seed, Stream::Encoder),
        })
    }

    /// What the encoders read where the joints truly stand at `truth`.
    pub fn read(&mut self, truth: &JointSample) -> JointSample {
        let EncoderSettings {
            resolution_rad,
            position_std_rad,
            rate_std_rad_s,
        } = self.settings;
        let mut sample = *truth;
        if !self.errors.is_zero() {
            sample.position = self.errors.readings(truth.position);
            let slopes = self.errors.reading_slopes(truth.position);
            sample.velocity = [0, 1].map(|joint| truth.velocity[joint] * slopes[joint]);
        }
        for joint in 0..2 {
            if position_std_rad > 0.0 {
                sample.position[joint] += position_std_rad * self.normal();
            }
            if resolution_rad > 0.0 {
                sample.position[joint] =
                    (sample.position[joint] / resolution_rad).round() * resolution_rad;
            }
            if rate_std_rad_s > 0.0 {
                sample.velocity[joint] += rate_std_rad_s * self.normal();
            }
        }
        sample
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.generator)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::time::Stamp;

    const TRUTH: JointSample = JointSample {
        stamp: Stamp::from_nanos(5),
        position: [1.0, -2.0],
        velocity: [0.1, 0.0],
    };

    /// Perfect by default; a resolution rounds; noise is noise.
    #[test]
    fn errors_are_as_set() {
        assert_eq!(
            Encoder::new(EncoderSettings::default(), TableErrors::default(), 1)
                .unwrap()
                .read(&TRUTH),
            TRUTH
        );
        let rounded = EncoderSettings {
            resolution_rad: 0.3,
            ..EncoderSettings::default()
        };
        let position = Encoder::new(rounded, TableErrors::default(), 1)
            .unwrap()
            .read(&TRUTH)
            .position;
        assert!((position[0] - 0.9).abs() < 1e-12 && (position[1] + 2.1).abs() < 1e-12);
        let noisy = EncoderSettings {
            position_std_rad: 1e-3,
            ..EncoderSettings::default()
        };
        let mut encoder = Encoder::new(noisy, TableErrors::default(), 1).unwrap();
        let square: f64 = (0..10_000)
            .map(|_| (encoder.read(&TRUTH).position[0] - 1.0).powi(2))
            .sum();
        assert!((square / 1e4 / 1e-6 - 1.0).abs() < 0.1);
        assert!(
            Encoder::new(
                EncoderSettings {
                    resolution_rad: -1.0,
                    ..EncoderSettings::default()
                },
                TableErrors::default(),
                1
            )
            .is_err()
        );
    }
    /// Zeros and eccentricities are read, and the rate is that of the reading.
    #[test]
    fn readings_are_those_of_the_table() {
        let errors = TableErrors {
            encoder_zero_inner_rad: 1e-4,
            encoder_eccentricity_outer_rad: [2e-4, -1e-4],
            ..TableErrors::default()
        };
        let mut encoder = Encoder::new(EncoderSettings::default(), errors, 1).unwrap();
        let read = encoder.read(&TRUTH);
        let (sin, cos) = 1f64.sin_cos();
        assert!((read.position[0] - 1.0 - 2e-4 * sin + 1e-4 * cos).abs() < 1e-15);
        assert!((read.position[1] + 2.0 - 1e-4).abs() < 1e-15);
        assert!((read.velocity[0] / 0.1 - 1.0 - 2e-4 * cos - 1e-4 * sin).abs() < 1e-14);
    }
}
