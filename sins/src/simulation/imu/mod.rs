//! The error model of the simulated IMU.
//!
//! Deterministic errors are [`SensorErrors`], made from what each sensor truly feels (an accelerometer at its own place, squares
//! before they are averaged), and not by the formulas that a filter takes them out with. What no filter knows comes beside
//! them: an asymmetric scale factor, all that [wanders](Wandering), and what the [electronics](OutputSettings) make of a sample.
//! White noise by density comes on top, with σ = density/√dt for one sample.

#[cfg(test)]
mod effects;
mod output;
mod wandering;

pub use output::OutputSettings;
pub use wandering::Wandering;

use output::Electronics;
use wandering::{Walker, Wandered};

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::{Stream, TruthSample, generator};
use crate::error::Error;
use crate::range;
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::{ImuSample, NoiseDensity};
use crate::units::{DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G};

/// The two readings of the paper's noise of '0.001 deg/h', which it gives without a bandwidth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NoiseReading {
    /// 0.001 deg/√h and 10 ug/√Hz.
    #[default]
    D,
    /// 0.001 deg/h/√Hz, which is 1.667e-5 deg/√h, and 10 ug/√Hz.
    H,
}

impl NoiseReading {
    /// Its letter.
    pub fn letter(self) -> &'static str {
        match self {
            Self::D => "D",
            Self::H => "H",
        }
    }

    /// The densities, the same on every axis.
    pub fn density(self) -> NoiseDensity {
        // 1 deg/h/√Hz in rad/√s is the same number as 1 deg/h in rad/s.
        let gyroscope = match self {
            Self::D => 0.001 * DEG_PER_SQRT_HOUR,
            Self::H => 0.001 * DEG_PER_HOUR,
        };
        NoiseDensity {
            gyroscope: Vector3::repeat(gyroscope),
            accelerometer: Vector3::repeat(10.0 * MICRO_G),
        }
    }
}

/// What is wrong with the IMU.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImuErrorSettings {
    /// The errors of the model. The delay of the accelerometers is made by the plant, which has to be told the same.
    pub errors: SensorErrors,
    /// White noise.
    pub noise: NoiseDensity,
    /// Half the difference of a gyroscope's scale factors for positive and negative rates: error a |ω|.
    pub gyroscope_asymmetry: Vector3<f64>,
    /// What does not stand still.
    pub wandering: Wandering,
    /// How samples leave.
    pub output: OutputSettings,
}

impl Default for ImuErrorSettings {
    /// Table 1 of the paper: 0.01 deg/h and 100 ug on every axis, no scale factors, no installation angles; noise read as D.
    fn default() -> Self {
        Self {
            errors: SensorErrors::constant(
                Vector3::repeat(0.01 * DEG_PER_HOUR),
                Vector3::repeat(100.0 * MICRO_G),
            ),
            noise: NoiseReading::D.density(),
            ..Self::perfect()
        }
    }
}

impl ImuErrorSettings {
    /// An IMU without any error.
    pub fn perfect() -> Self {
        Self {
            errors: SensorErrors::default(),
            noise: NoiseDensity {
                gyroscope: Vector3::zeros(),
                accelerometer: Vector3::zeros(),
            },
            gyroscope_asymmetry: Vector3::zeros(),
            wandering: Wandering::default(),
            output: OutputSettings::default(),
        }
    }

    /// Checks that every number is finite, densities are not negative and K_a is lower triangular.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        let each = |name: &str, values: &[f64], range: fn(&str, f64) -> Result<f64, Error>| {
            values
                .iter()
                .try_for_each(|value| range(name, *value).map(|_| ()))
        };
        let Self { errors, noise, .. } = self;
        for (name, values) in [
            ("gyroscope drift [rad/s]", errors.gyroscope_drift.as_slice()),
            (
                "accelerometer bias [m/s²]",
                errors.accelerometer_bias.as_slice(),
            ),
            ("gyroscope matrix K_g", errors.gyroscope_matrix.as_slice()),
            (
                "accelerometer matrix K_a",
                errors.accelerometer_matrix.as_slice(),
            ),
            (
                "accelerometer quadratic K_2 [1/(m/s²)]",
                errors.accelerometer_quadratic.as_slice(),
            ),
            (
                "accelerometer arm [m]",
                errors.accelerometer_arms.as_slice(),
            ),
            (
                "g-sensitivity [rad/s per m/s²]",
                errors.gyroscope_g_sensitivity.as_slice(),
            ),
            (
                "asymmetry of the gyroscopes",
                self.gyroscope_asymmetry.as_slice(),
            ),
        ] {
            each(name, values, range::finite)?;
        }
        for (name, density) in [
            ("angular random walk [rad/√s]", &noise.gyroscope),
            ("velocity random walk [m/s/√s]", &noise.accelerometer),
        ] {
            each(name, density.as_slice(), range::not_negative)?;
        }
        self.wandering.validate()?;
        self.output.validate()?;
        let k = &errors.accelerometer_matrix;
        each(
            "accelerometer matrix K_a above its diagonal",
            &[k.m12, k.m13, k.m23],
            |name, value| range::within(name, value, 0.0),
        )
    }
}

/// Makes samples of a real IMU from the truth.
#[derive(Clone, Debug)]
pub struct ImuErrors {
    settings: ImuErrorSettings,
    generator: Xoshiro256PlusPlus,
    walker: Walker,
    electronics: Electronics,
}

impl ImuErrors {
    /// An IMU with these errors and this seed of its noise.
    ///
    /// # Errors
    /// [`Error::Setting`] as [`ImuErrorSettings::validate`].
    pub fn new(settings: ImuErrorSettings, seed: u64) -> Result<Self, Error> {
        settings.validate()?;
        Ok(Self {
            settings,
            generator: generator(seed, Stream::Imu),
            walker: Walker::new(settings.wandering, seed),
            electronics: Electronics::new(settings.output, seed),
        })
    }

    /// The errors it has.
    pub fn settings(&self) -> &ImuErrorSettings {
        &self.settings
    }

    /// What the IMU delivers for an interval. Variances are those of this one sample, density² / dt.
    pub fn measure(&mut self, truth: &TruthSample) -> ImuSample {
        let per_second = 1e9 / truth.interval_nanos as f64;
        let root = per_second.sqrt();
        let noise = self.settings.noise;
        let gyroscope_noise = self.normals().component_mul(&noise.gyroscope) * root;
        let accelerometer_noise = self.normals().component_mul(&noise.accelerometer) * root;
        self.walker.pass(truth.interval_nanos as f64 * 1e-9);
        let errors = self.errors();
        // Each accelerometer feels the specific force at its own place.
        let by_arms = Vector3::from_fn(|i, _| {
            let arms = &truth.accelerometers.lever;
            arms.row(i).dot(&errors.accelerometer_arms.row(i))
        });
        let centre = truth.accelerometers.specific_force;
        let felt = centre + by_arms;
        // The average of the square at that place, but for how the arm's part goes with the rest within the interval.
        let square = truth.accelerometers.specific_force_square
            + (2.0 * centre + by_arms).component_mul(&by_arms);
        let rate = truth.angular_rate
            + errors.gyroscope_matrix * truth.angular_rate
            + errors.gyroscope_drift
            + errors.gyroscope_g_sensitivity * truth.specific_force
            + self
                .settings
                .gyroscope_asymmetry
                .component_mul(&truth.angular_rate_magnitude);
        let force = felt
            + errors.accelerometer_matrix * felt
            + errors.accelerometer_bias
            + errors.accelerometer_quadratic.component_mul(&square);
        let sample = ImuSample {
            stamp: truth.stamp,
            angular_rate: rate + gyroscope_noise,
            specific_force: force + accelerometer_noise,
            angular_rate_variance: noise.gyroscope.map(|d| d * d * per_second),
            specific_force_variance: noise.accelerometer.map(|d| d * d * per_second),
        };
        self.electronics.pass(sample, truth.interval_nanos)
    }

    /// The errors as they stand now: the constant ones and what has been wandered since.
    pub fn errors(&self) -> SensorErrors {
        let Wandered {
            gyroscope_drift,
            accelerometer_bias,
            gyroscope_scale,
            accelerometer_scale,
        } = self.walker.wandered();
        let mut errors = self.settings.errors;
        errors.gyroscope_drift += gyroscope_drift;
        errors.accelerometer_bias += accelerometer_bias;
        for axis in 0..3 {
            errors.gyroscope_matrix[(axis, axis)] += gyroscope_scale[axis];
            errors.accelerometer_matrix[(axis, axis)] += accelerometer_scale[axis];
        }
        errors
    }

    fn normals(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut self.generator))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::Matrix3;

    use crate::simulation::{Plant, PlantSettings};

    /// Without noise the model is (I + K) times the truth plus the offset.
    #[test]
    fn model_is_the_written_one() {
        let truth = Plant::new(PlantSettings::default()).unwrap().step();
        let errors = SensorErrors {
            gyroscope_matrix: Matrix3::from_row_slice(&[
                1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 6e-5, 7e-5, 8e-5, 9e-5,
            ]),
            accelerometer_matrix: Matrix3::from_row_slice(&[
                1e-5, 0.0, 0.0, 4e-5, 5e-5, 0.0, 7e-5, 8e-5, 9e-5,
            ]),
            ..ImuErrorSettings::default().errors
        };
        let settings = ImuErrorSettings {
            errors,
            ..ImuErrorSettings::perfect()
        };
        let sample = ImuErrors::new(settings, 1).unwrap().measure(&truth);
        let (w, f) = (truth.angular_rate, truth.specific_force);
        let x = w.x + 1e-5 * w.x + 2e-5 * w.y + 3e-5 * w.z + 4.848_136_811_095_36e-8;
        assert!((sample.angular_rate.x - x).abs() < 1e-20);
        let z = f.z + 7e-5 * f.x + 8e-5 * f.y + 9e-5 * f.z + 9.806_65e-4;
        assert!((sample.specific_force.z - z).abs() < 1e-14);
    }

    /// The spread of many samples is the density over √dt, which the variance fields say too.
    #[test]
    fn spread_is_density_over_root_dt() {
        for rate_hz in [10.0, 400.0] {
            let mut plant = Plant::new(PlantSettings {
                imu_rate_hz: rate_hz,
                ..PlantSettings::default()
            })
            .unwrap();
            let mut imu = ImuErrors::new(ImuErrorSettings::default(), 7).unwrap();
            let (mut gyroscope, mut accelerometer, n) = (0.0, 0.0, 20_000);
            let mut variances = (0.0, 0.0);
            for _ in 0..n {
                let truth = plant.step();
                let sample = imu.measure(&truth);
                gyroscope +=
                    (sample.angular_rate.y - truth.angular_rate.y - 4.848_136_811e-8).powi(2);
                accelerometer +=
                    (sample.specific_force.x - truth.specific_force.x - 9.806_65e-4).powi(2);
                variances = (
                    sample.angular_rate_variance.y,
                    sample.specific_force_variance.x,
                );
            }
            // 0.001 deg/√h is 2.9089e-7 rad/√s; 10 ug/√Hz is 9.80665e-5 m/s/√s.
            let (gyroscope, accelerometer) =
                (gyroscope / f64::from(n), accelerometer / f64::from(n));
            assert!((gyroscope / (2.908_882e-7_f64.powi(2) * rate_hz) - 1.0).abs() < 0.05);
            assert!((accelerometer / (9.806_65e-5_f64.powi(2) * rate_hz) - 1.0).abs() < 0.05);
            assert!((variances.0 / gyroscope - 1.0).abs() < 0.05);
            assert!((variances.1 / accelerometer - 1.0).abs() < 0.05);
        }
    }

    /// The same seed gives the same samples to the last bit, another one does not.
    #[test]
    fn seed_decides() {
        let truth = Plant::new(PlantSettings::default()).unwrap().step();
        let sample = |seed| {
            ImuErrors::new(ImuErrorSettings::default(), seed)
                .unwrap()
                .measure(&truth)
        };
        assert_eq!(sample(3), sample(3));
        assert_ne!(sample(3), sample(4));
    }

    /// A matrix that would turn the block's own axes is refused.
    #[test]
    fn upper_triangle_of_k_a_is_refused() {
        let mut settings = ImuErrorSettings::default();
        settings.errors.accelerometer_matrix.m12 = 1e-6;
        assert!(ImuErrors::new(settings, 0).is_err());
    }
}
