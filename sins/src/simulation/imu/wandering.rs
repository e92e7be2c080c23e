//! Errors of the sensors that do not stand still: walks, Gauss-Markov processes, trends, and the warming up after switching on.

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::range;
use crate::simulation::{Stream, generator};

/// How drift, bias and scale factors wander. By default not at all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wandering {
    /// Density of the walk of the gyroscopes' drifts \[rad/s/√s\].
    pub gyroscope_walk: Vector3<f64>,
    /// Density of the walk of the accelerometers' biases \[m/s²/√s\].
    pub accelerometer_walk: Vector3<f64>,
    /// Standard deviation of a Gauss-Markov part of the drifts \[rad/s\].
    pub gyroscope_markov_std: Vector3<f64>,
    /// Standard deviation of a Gauss-Markov part of the biases \[m/s²\].
    pub accelerometer_markov_std: Vector3<f64>,
    /// Correlation time of both; 0: there is no such part \[s\].
    pub markov_time_s: f64,
    /// Steady growth of the drifts \[rad/s²\].
    pub gyroscope_trend: Vector3<f64>,
    /// Steady growth of the biases \[m/s³\].
    pub accelerometer_trend: Vector3<f64>,
    /// Time constant of the warming up, whose parts are A exp(−t/T); 0: it is over \[s\].
    pub warm_up_s: f64,
    /// A of the drifts \[rad/s\].
    pub gyroscope_warm_up: Vector3<f64>,
    /// A of the biases \[m/s²\].
    pub accelerometer_warm_up: Vector3<f64>,
    /// A of the gyroscopes' scale factors.
    pub gyroscope_scale_warm_up: Vector3<f64>,
    /// A of the accelerometers' scale factors.
    pub accelerometer_scale_warm_up: Vector3<f64>,
}

/// What is to be added to the constant errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wandered {
    pub gyroscope_drift: Vector3<f64>,
    pub accelerometer_bias: Vector3<f64>,
    pub gyroscope_scale: Vector3<f64>,
    pub accelerometer_scale: Vector3<f64>,
}

impl Wandering {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        for (name, values) in [
            ("walk of the drifts [rad/s/√s]", &self.gyroscope_walk),
            ("walk of the biases [m/s²/√s]", &self.accelerometer_walk),
            (
                "Gauss-Markov part of the drifts [rad/s]",
                &self.gyroscope_markov_std,
            ),
            (
                "Gauss-Markov part of the biases [m/s²]",
                &self.accelerometer_markov_std,
            ),
        ] {
            values
                .iter()
                .try_for_each(|value| range::not_negative(name, *value).map(|_| ()))?;
        }
        for (name, values) in [
            ("trend of the drifts [rad/s²]", &self.gyroscope_trend),
            ("trend of the biases [m/s³]", &self.accelerometer_trend),
            ("warming up of the drifts [rad/s]", &self.gyroscope_warm_up),
            (
                "warming up of the biases [m/s²]",
                &self.accelerometer_warm_up,
            ),
            (
                "warming up of the gyroscopes' scale factors",
                &self.gyroscope_scale_warm_up,
            ),
            (
                "warming up of the accelerometers' scale factors",
                &self.accelerometer_scale_warm_up,
            ),
        ] {
            values
                .iter()
                .try_for_each(|value| range::finite(name, *value).map(|_| ()))?;
        }
        range::not_negative("correlation time [s]", self.markov_time_s)?;
        range::not_negative("time constant of the warming up [s]", self.warm_up_s)?;
        Ok(())
    }
}

/// The wandering under way.
#[derive(Clone, Debug)]
pub(super) struct Walker {
    settings: Wandering,
    generator: Xoshiro256PlusPlus,
    elapsed_s: f64,
    walked: [Vector3<f64>; 2],
    markov: [Vector3<f64>; 2],
    still: bool,
}

impl Walker {
    pub fn new(settings: Wandering, seed: u64) -> Self {
        let mut walker = Self {
            settings,
            generator: generator(seed, Stream::Walk),
            elapsed_s: 0.0,
            walked: [Vector3::zeros(); 2],
            markov: [Vector3::zeros(); 2],
            still: settings == Wandering::default(),
        };
        if settings.markov_time_s > 0.0 {
            let parts = [
                settings.gyroscope_markov_std,
                settings.accelerometer_markov_std,
            ];
            walker.markov = parts.map(|std| walker.normals().component_mul(&std));
        }
        walker
    }

    fn normals(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut self.generator))
    }

    /// Lets time pass.
    pub fn pass(&mut self, interval_s: f64) {
        if self.still {
            return;
        }
        self.elapsed_s += interval_s;
        let settings = self.settings;
        let root = interval_s.sqrt();
        for (sensor, density) in [settings.gyroscope_walk, settings.accelerometer_walk]
            .into_iter()
            .enumerate()
        {
            let step = self.normals().component_mul(&density) * root;
            self.walked[sensor] += step;
        }
        if settings.markov_time_s > 0.0 {
            let stays = (-interval_s / settings.markov_time_s).exp();
            let comes = (1.0 - stays * stays).sqrt();
            let parts = [
                settings.gyroscope_markov_std,
                settings.accelerometer_markov_std,
            ];
            for (sensor, std) in parts.into_iter().enumerate() {
                let new = self.normals().component_mul(&std) * comes;
                self.markov[sensor] = self.markov[sensor] * stays + new;
            }
        }
    }

    /// What has been wandered by now.
    pub fn wandered(&self) -> Wandered {
        if self.still {
            return Wandered::default();
        }
        let settings = &self.settings;
        let warm = if settings.warm_up_s > 0.0 {
            (-self.elapsed_s / settings.warm_up_s).exp()
        } else {
            0.0
        };
        Wandered {
            gyroscope_drift: self.walked[0]
                + self.markov[0]
                + settings.gyroscope_trend * self.elapsed_s
                + settings.gyroscope_warm_up * warm,
            accelerometer_bias: self.walked[1]
                + self.markov[1]
                + settings.accelerometer_trend * self.elapsed_s
                + settings.accelerometer_warm_up * warm,
            gyroscope_scale: settings.gyroscope_scale_warm_up * warm,
            accelerometer_scale: settings.accelerometer_scale_warm_up * warm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After t seconds a walk has spread by its density times √t, however long the steps are.
    #[test]
    fn a_walk_spreads_with_the_root_of_time() {
        let settings = Wandering {
            gyroscope_walk: Vector3::repeat(1e-9),
            accelerometer_walk: Vector3::repeat(1e-6),
            ..Wandering::default()
        };
        for interval_s in [1.0, 4.0] {
            let (mut gyroscope, mut accelerometer, n) = (0.0, 0.0, 400);
            for seed in 0..n {
                let mut walker = Walker::new(settings, seed);
                for _ in 0..(400.0 / interval_s) as u32 {
                    walker.pass(interval_s);
                }
                let wandered = walker.wandered();
                gyroscope += wandered.gyroscope_drift.norm_squared() / 3.0;
                accelerometer += wandered.accelerometer_bias.norm_squared() / 3.0;
            }
            assert!((gyroscope / n as f64 / (400.0 * 1e-18) - 1.0).abs() < 0.15);
            assert!((accelerometer / n as f64 / (400.0 * 1e-12) - 1.0).abs() < 0.15);
        }
    }

    /// A Gauss-Markov part keeps its standard deviation, and 1/e of itself after its correlation time.
    #[test]
    fn a_markov_part_is_stationary() {
        let settings = Wandering {
            gyroscope_markov_std: Vector3::repeat(2.0),
            markov_time_s: 100.0,
            ..Wandering::default()
        };
        let (mut variance, mut covariance, n) = (0.0, 0.0, 3000);
        for seed in 0..n {
            let mut walker = Walker::new(settings, seed);
            let first = walker.wandered().gyroscope_drift;
            for _ in 0..50 {
                walker.pass(2.0);
            }
            let last = walker.wandered().gyroscope_drift;
            variance += last.norm_squared() / 3.0 / n as f64;
            covariance += first.dot(&last) / 3.0 / n as f64;
        }
        assert!((variance / 4.0 - 1.0).abs() < 0.06, "{variance}");
        assert!(
            (covariance / 4.0 - (-1f64).exp()).abs() < 0.05,
            "{covariance}"
        );
    }

    /// A trend of 5 ug/h is 20 ug after 4 h; what warms up has 1/e left after its time constant.
    #[test]
    fn trends_and_warming_up_are_as_written() {
        let ug = crate::units::MICRO_G;
        let settings = Wandering {
            accelerometer_trend: Vector3::repeat(5.0 * ug / 3600.0),
            warm_up_s: 3600.0,
            gyroscope_scale_warm_up: Vector3::new(1e-5, 0.0, 0.0),
            ..Wandering::default()
        };
        let mut walker = Walker::new(settings, 1);
        assert_eq!(walker.wandered().gyroscope_scale.x, 1e-5);
        for _ in 0..3600 {
            walker.pass(4.0);
        }
        let wandered = walker.wandered();
        assert!((wandered.accelerometer_bias.y / ug - 20.0).abs() < 1e-9);
        assert!((wandered.gyroscope_scale.x / 1e-5 - (-4f64).exp()).abs() < 1e-9);
    }
}
