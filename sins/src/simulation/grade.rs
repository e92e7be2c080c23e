//! Grades of sensors: what is typically wrong with one, to be drawn from a seed.

use nalgebra::{Matrix3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{EncoderSettings, ImuErrorSettings, Stream, Wandering, generator};
use crate::earth::STANDARD_GRAVITY_M_S2;
use crate::error::Error;
use crate::sensor::{NoiseDensity, SensorErrors};
use crate::table::TableErrors;
use crate::units::{ARC_SECOND, DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G, PPM};

/// A kind of sensor block on its table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SensorGrade {
    /// No errors and no noise.
    Ideal,
    /// The paper's Table 1: drifts, biases and noise, and nothing else.
    #[default]
    Table1,
    /// What is left of a good ring laser after its maker's calibration.
    RingLaser,
    /// A fibre-optic one of middling grade.
    FibreOptic,
    /// Micromechanical.
    Mems,
}

/// Names of the grades, as people write them.
pub const GRADE_NAMES: [&str; 5] = ["ideal", "table-1", "ring-laser", "fibre-optic", "mems"];

/// A drawn block on its drawn table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnSensor {
    /// Errors of the IMU.
    pub imu: ImuErrorSettings,
    /// Errors of the table.
    pub table: TableErrors,
    /// Noise of the encoders.
    pub encoder: EncoderSettings,
}

/// One sigma of everything that is drawn, in the units that people use.
struct Spread {
    drift_deg_per_hour: f64,
    bias_ug: f64,
    gyroscope_scale_ppm: f64,
    gyroscope_installation_arcsec: f64,
    accelerometer_scale_ppm: f64,
    accelerometer_installation_arcsec: f64,
    quadratic_ug_per_g2: f64,
    g_sensitivity_deg_per_hour_per_g: f64,
    delay_ms: f64,
    /// Density of the walks: deg/h/√h and ug/√h.
    walk: (f64, f64),
    /// White noise: deg/√h and ug/√Hz.
    noise: (f64, f64),
}

/// Each accelerometer stands so far out on its own axis \[m\].
const ARM_M: f64 = 0.02;
/// One sigma of every component of an arm beside that, and of the block's displacement \[m\].
const ARM_SPREAD_M: f64 = 0.006;
/// No draw is further out than so many sigmas: a maker sorts the others out.
const LIMIT_SIGMA: f64 = 2.5;

impl SensorGrade {
    /// All of them, in the order of [`GRADE_NAMES`].
    pub const ALL: [Self; 5] = [
        Self::Ideal,
        Self::Table1,
        Self::RingLaser,
        Self::FibreOptic,
        Self::Mems,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        GRADE_NAMES[self as usize]
    }

    /// The grade of this name.
    ///
    /// # Errors
    /// [`Error::Setting`] with all names.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|grade| grade.name() == name)
            .ok_or_else(|| Error::setting("grade of the sensor", name, GRADE_NAMES.join(", ")))
    }

    fn spread(self) -> Option<Spread> {
        match self {
            Self::Ideal | Self::Table1 => None,
            Self::RingLaser => Some(Spread {
                drift_deg_per_hour: 0.01,
                bias_ug: 100.0,
                gyroscope_scale_ppm: 4.0,
                gyroscope_installation_arcsec: 2.0,
                accelerometer_scale_ppm: 35.0,
                accelerometer_installation_arcsec: 6.0,
                quadratic_ug_per_g2: 5.0,
                g_sensitivity_deg_per_hour_per_g: 0.001,
                delay_ms: 0.3,
                walk: (1e-4, 0.3),
                noise: (1e-3, 10.0),
            }),
            Self::FibreOptic => Some(Spread {
                drift_deg_per_hour: 0.5,
                bias_ug: 500.0,
                gyroscope_scale_ppm: 100.0,
                gyroscope_installation_arcsec: 20.0,
                accelerometer_scale_ppm: 150.0,
                accelerometer_installation_arcsec: 20.0,
                quadratic_ug_per_g2: 20.0,
                g_sensitivity_deg_per_hour_per_g: 0.02,
                delay_ms: 0.5,
                walk: (5e-3, 3.0),
                noise: (0.02, 30.0),
            }),
            Self::Mems => Some(Spread {
                drift_deg_per_hour: 10.0,
                bias_ug: 2000.0,
                gyroscope_scale_ppm: 1000.0,
                gyroscope_installation_arcsec: 200.0,
                accelerometer_scale_ppm: 1000.0,
                accelerometer_installation_arcsec: 200.0,
                quadratic_ug_per_g2: 100.0,
                g_sensitivity_deg_per_hour_per_g: 2.0,
                delay_ms: 1.0,
                walk: (0.3, 30.0),
                noise: (0.15, 80.0),
            }),
        }
    }

    /// A block of this grade on its table. The grades without a spread are the same for every seed.
    pub fn draw(self, seed: u64) -> DrawnSensor {
        let Some(spread) = self.spread() else {
            return DrawnSensor {
                imu: if self == Self::Ideal {
                    ImuErrorSettings::perfect()
                } else {
                    ImuErrorSettings::default()
                },
                table: TableErrors::default(),
                encoder: EncoderSettings::default(),
            };
        };
        let mut draw = Draw(generator(seed, Stream::Grade));
        let errors = SensorErrors {
            gyroscope_drift: draw.vector(spread.drift_deg_per_hour * DEG_PER_HOUR),
            accelerometer_bias: draw.vector(spread.bias_ug * MICRO_G),
            gyroscope_matrix: draw.matrix(
                spread.gyroscope_scale_ppm * PPM,
                spread.gyroscope_installation_arcsec * ARC_SECOND,
            ),
            accelerometer_matrix: draw
                .matrix(
                    spread.accelerometer_scale_ppm * PPM,
                    spread.accelerometer_installation_arcsec * ARC_SECOND,
                )
                .lower_triangle(),
            accelerometer_quadratic: draw
                .vector(spread.quadratic_ug_per_g2 * MICRO_G / STANDARD_GRAVITY_M_S2.powi(2)),
            accelerometer_arms: draw.arms(),
            gyroscope_g_sensitivity: Matrix3::from_diagonal(&draw.vector(
                spread.g_sensitivity_deg_per_hour_per_g * DEG_PER_HOUR / STANDARD_GRAVITY_M_S2,
            )),
            // Late, never early.
            accelerometer_delay_s: spread.delay_ms * 1e-3 * (1.0 + 0.3 * draw.normal()),
        };
        let per_root_hour = 1.0 / 60.0;
        DrawnSensor {
            imu: ImuErrorSettings {
                errors,
                noise: NoiseDensity {
                    gyroscope: Vector3::repeat(spread.noise.0 * DEG_PER_SQRT_HOUR),
                    accelerometer: Vector3::repeat(spread.noise.1 * MICRO_G),
                },
                wandering: Wandering {
                    gyroscope_walk: Vector3::repeat(spread.walk.0 * DEG_PER_HOUR * per_root_hour),
                    accelerometer_walk: Vector3::repeat(spread.walk.1 * MICRO_G * per_root_hour),
                    ..Wandering::default()
                },
                ..ImuErrorSettings::perfect()
            },
            table: draw.table(),
            encoder: EncoderSettings {
                position_std_rad: 3.0 * ARC_SECOND,
                ..EncoderSettings::default()
            },
        }
    }
}

/// Draws within [`LIMIT_SIGMA`].
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    fn normal(&mut self) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.0);
        normal.clamp(-LIMIT_SIGMA, LIMIT_SIGMA)
    }

    fn vector(&mut self, std: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| std * self.normal())
    }

    fn matrix(&mut self, scale: f64, angle_rad: f64) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| {
            let std = if row == column { scale } else { angle_rad };
            std * self.normal()
        })
    }

    fn arms(&mut self) -> Matrix3<f64> {
        let displaced = self.vector(ARM_SPREAD_M);
        Matrix3::from_fn(|sensor, component| {
            let own = if sensor == component { ARM_M } else { 0.0 };
            own + displaced[component] + ARM_SPREAD_M * self.normal()
        })
    }

    /// Arc seconds of a machined table.
    fn table(&mut self) -> TableErrors {
        let mut angle = |arcsec: f64| arcsec * ARC_SECOND * self.normal();
        TableErrors {
            nonorthogonality_rad: angle(5.0),
            inner_axis_tilt_rad: [angle(5.0), angle(5.0)],
            encoder_zero_outer_rad: angle(20.0),
            encoder_zero_inner_rad: angle(20.0),
            encoder_eccentricity_outer_rad: [angle(4.0), angle(4.0)],
            encoder_eccentricity_inner_rad: [angle(4.0), angle(4.0)],
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::simulation::ImuErrors;

    /// Every grade has its name, is accepted by the IMU, and is the same for the same seed.
    #[test]
    fn grades_are_drawn_by_name_and_seed() {
        for name in GRADE_NAMES {
            let grade = SensorGrade::named(name).unwrap();
            assert_eq!(grade.name(), name);
            assert_eq!(grade.draw(4), grade.draw(4));
            assert_eq!(grade.draw(4) == grade.draw(5), grade.spread().is_none());
            ImuErrors::new(grade.draw(4).imu, 1).unwrap();
        }
        let message = SensorGrade::named("brass").unwrap_err().to_string();
        assert!(message.contains("ring-laser"), "{message}");
    }

    /// The default is the paper's Table 1.
    #[test]
    fn table_1_is_the_default() {
        assert_eq!(
            SensorGrade::default().draw(9).imu,
            ImuErrorSettings::default()
        );
    }

    /// Over many seeds what is drawn has the spread that the grade says, cut at 2.5 sigma.
    #[test]
    fn draws_have_their_spread() {
        let draws: Vec<_> = (0..400)
            .map(|seed| SensorGrade::RingLaser.draw(seed))
            .collect();
        let rms = |value: &dyn Fn(&DrawnSensor) -> f64| {
            (draws.iter().map(|d| value(d).powi(2)).sum::<f64>() / draws.len() as f64).sqrt()
        };
        let drift = rms(&|d| d.imu.errors.gyroscope_drift.x) / DEG_PER_HOUR;
        assert!((drift / 0.01 - 0.98).abs() < 0.12, "{drift}");
        let scale = rms(&|d| d.imu.errors.gyroscope_matrix.m22) / PPM;
        assert!((scale / 4.0 - 0.98).abs() < 0.12, "{scale}");
        let delays = draws.iter().map(|d| d.imu.errors.accelerometer_delay_s);
        assert!(delays.clone().all(|delay| delay > 0.0));
        assert!((delays.sum::<f64>() / 400.0 - 3e-4).abs() < 2e-5);
    }
}
