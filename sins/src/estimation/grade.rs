//! What is known of a sensor before it is measured, by its grade.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub use super::group_priors::GroupPriors;
use crate::sensor::NoiseDensity;
use crate::units::{DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G};

/// Angular random walk \[rad/√s\] above which a gyroscope is no ring laser: 0.01 deg/√h.
const RING_LASER_WALK: f64 = 0.01 * DEG_PER_SQRT_HOUR;
/// And above which it is micro-machined: 0.2 deg/√h.
const FIBRE_OPTIC_WALK: f64 = 0.2 * DEG_PER_SQRT_HOUR;

/// The grade of an inertial sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Grade {
    /// Ring laser or the best of fibre optic, with servo accelerometers: 0.01 deg/h, 100 ug.
    #[default]
    RingLaser,
    /// Fibre optic: 1 deg/h, 1 mg.
    FibreOptic,
    /// Micro-machined: 20 deg/h, 10 mg.
    Mems,
}

impl Grade {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::RingLaser, Self::FibreOptic, Self::Mems];

    /// The name that the command line and parameters carry.
    pub const fn name(self) -> &'static str {
        match self {
            Self::RingLaser => "ring-laser",
            Self::FibreOptic => "fibre-optic",
            Self::Mems => "mems",
        }
    }

    /// The grade that white noise of this density tells: drift and noise of a gyroscope go together.
    pub fn of_noise(noise: &NoiseDensity) -> Self {
        let walk = noise.gyroscope.amax();
        if walk <= RING_LASER_WALK {
            Self::RingLaser
        } else if walk <= FIBRE_OPTIC_WALK {
            Self::FibreOptic
        } else {
            Self::Mems
        }
    }

    /// One-sigma of gyroscope drift \[rad/s\] and accelerometer bias \[m/s²\].
    pub fn drift_and_bias(self) -> [f64; 2] {
        match self {
            Self::RingLaser => [0.01 * DEG_PER_HOUR, 100.0 * MICRO_G],
            Self::FibreOptic => [DEG_PER_HOUR, 1000.0 * MICRO_G],
            Self::Mems => [20.0 * DEG_PER_HOUR, 10_000.0 * MICRO_G],
        }
    }

    /// What is known of everything else.
    pub fn groups(self) -> GroupPriors {
        GroupPriors::of_grade(self)
    }
}

impl std::fmt::Display for Grade {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Grade {
    type Err = crate::error::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|grade| grade.name() == text)
            .ok_or_else(|| {
                crate::error::Error::setting("grade", text, "ring-laser, fibre-optic or mems")
            })
    }
}

/// One-sigma of the azimuth that gyroscopes of this drift \[rad/s\] find against the earth's rate: 1.5 ε / (ω cos L), at least
/// 10 deg and at most 60 deg \[rad\].
pub fn azimuth_prior_rad(drift_rad_s: &Vector3<f64>, cos_latitude: f64) -> f64 {
    let north = crate::earth::EARTH_RATE_RAD_S * cos_latitude;
    (1.5 * drift_rad_s.amax() / north).clamp(10f64.to_radians(), 60f64.to_radians())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use super::*;

    /// The azimuth's prior is half as much again as the drift over the earth's rate northwards, between 10 and 60 deg: 0.01 deg/h are
    /// below, 20 deg/h above, 3 deg/h between them, and more so at a higher latitude.
    #[test]
    fn azimuth_prior_is_drift_over_earth_rate() {
        let prior = |drift_deg_h: f64, latitude_deg: f64| {
            let drift = Vector3::new(0.0, drift_deg_h, -0.5 * drift_deg_h) * DEG_PER_HOUR;
            azimuth_prior_rad(&drift, latitude_deg.to_radians().cos()).to_degrees()
        };
        // The earth turns by 15.041 deg/h; cos 45 deg is 1/√2, cos 60 deg is 0.5.
        for (drift, latitude, expected) in [
            (0.01, 45.0, 10.0),
            (0.01, 60.0, 10.0),
            (3.0, 45.0, 4.5 / (15.041_07 * FRAC_1_SQRT_2) * 57.295_78),
            (3.0, 60.0, 4.5 / (15.041_07 * 0.5) * 57.295_78),
            (20.0, 45.0, 60.0),
            (20.0, 60.0, 60.0),
        ] {
            let found = prior(drift, latitude);
            assert!(
                (found - expected).abs() < 0.01,
                "{drift} {latitude}: {found}"
            );
        }
    }

    /// Gyroscopes of 0.001, 0.1 and 0.5 deg/√h are of three grades.
    #[test]
    fn noise_tells_the_grade() {
        for (walk, grade) in [
            (0.001, Grade::RingLaser),
            (0.1, Grade::FibreOptic),
            (0.5, Grade::Mems),
        ] {
            let noise = NoiseDensity {
                gyroscope: Vector3::repeat(walk * DEG_PER_SQRT_HOUR),
                accelerometer: Vector3::zeros(),
            };
            assert_eq!(Grade::of_noise(&noise), grade);
        }
    }
}
