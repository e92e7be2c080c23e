//! What is known of a sensor before it is measured, by its grade.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::filter::InitialUncertainty;
use super::groups::antenna::Antenna;
use super::groups::arms::AccelerometerArms;
use super::groups::bias::Bias;
use super::groups::delay::AccelerometerDelay;
use super::groups::g_sensitivity::GyroscopeGSensitivity;
use super::groups::navigation::Navigation;
use super::groups::quadratic::AccelerometerQuadratic;
use super::groups::scale::{AccelerometerMatrix, GyroscopeMatrix};
use super::groups::table::{BaseAttitude, Table};
use super::groups::vertical::Vertical;
use super::model::Whole;
use crate::sensor::NoiseDensity;
use crate::units::{
    ARC_SECOND, DEG_PER_HOUR, DEG_PER_HOUR_PER_G, DEG_PER_SQRT_HOUR, MICRO_G, MICRO_G_PER_G2, PPM,
};

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
        let hour = 60.0;
        let common = GroupPriors::default();
        match self {
            Self::RingLaser => common,
            Self::FibreOptic => GroupPriors {
                gyroscope_scale_factor: 300.0 * PPM,
                gyroscope_installation_rad: 60.0 * ARC_SECOND,
                accelerometer_scale_factor: 300.0 * PPM,
                accelerometer_installation_rad: 60.0 * ARC_SECOND,
                accelerometer_quadratic_per_m_s2: 30.0 * MICRO_G_PER_G2,
                gyroscope_g_sensitivity_rad_s_per_m_s2: 0.03 * DEG_PER_HOUR_PER_G,
                accelerometer_delay_s: 2e-3,
                gyroscope_drift_walk_rad_s_sqrt_s: 0.03 * DEG_PER_HOUR / hour,
                accelerometer_bias_walk_m_s2_sqrt_s: 10.0 * MICRO_G / hour,
                ..common
            },
            Self::Mems => GroupPriors {
                gyroscope_scale_factor: 2000.0 * PPM,
                gyroscope_installation_rad: 600.0 * ARC_SECOND,
                accelerometer_scale_factor: 2000.0 * PPM,
                accelerometer_installation_rad: 600.0 * ARC_SECOND,
                accelerometer_quadratic_per_m_s2: 300.0 * MICRO_G_PER_G2,
                accelerometer_arm_m: 0.05,
                gyroscope_g_sensitivity_rad_s_per_m_s2: 5.0 * DEG_PER_HOUR_PER_G,
                accelerometer_delay_s: 5e-3,
                gyroscope_drift_walk_rad_s_sqrt_s: 3.0 * DEG_PER_HOUR / hour,
                accelerometer_bias_walk_m_s2_sqrt_s: 100.0 * MICRO_G / hour,
                ..common
            },
        }
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

/// One-sigma of what the whole model has beyond the paper's states. A group whose sigma is zero is not estimated; a negative
/// number stands for what the grade says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupPriors {
    /// Height \[m\].
    pub height_m: f64,
    /// Gyroscope scale factors.
    pub gyroscope_scale_factor: f64,
    /// Gyroscope installation angles \[rad\].
    pub gyroscope_installation_rad: f64,
    /// Accelerometer scale factors.
    pub accelerometer_scale_factor: f64,
    /// Accelerometer installation angles \[rad\].
    pub accelerometer_installation_rad: f64,
    /// Quadratic coefficients \[1/(m/s²)\].
    pub accelerometer_quadratic_per_m_s2: f64,
    /// Components of the accelerometers' arms \[m\].
    pub accelerometer_arm_m: f64,
    /// g-sensitivities \[rad/s per m/s²\].
    pub gyroscope_g_sensitivity_rad_s_per_m_s2: f64,
    /// Delay of the accelerometers \[s\].
    pub accelerometer_delay_s: f64,
    /// Non-orthogonality of the table's axes \[rad\].
    pub table_nonorthogonality_rad: f64,
    /// Tilts of the inner axis in the block \[rad\].
    pub inner_axis_tilt_rad: f64,
    /// Zero of the inner encoder \[rad\].
    pub encoder_zero_rad: f64,
    /// Sine and cosine of the encoders' eccentricities \[rad\].
    pub encoder_eccentricity_rad: f64,
    /// Components of the antenna's arm, beyond what was told of it \[m\].
    pub antenna_arm_m: f64,
    /// Walk of the gyroscope drifts, density \[rad/s/√s\].
    pub gyroscope_drift_walk_rad_s_sqrt_s: f64,
    /// Walk of the accelerometer biases, density \[m/s²/√s\].
    pub accelerometer_bias_walk_m_s2_sqrt_s: f64,
    /// What a turn costs that no state describes, as a share of it.
    pub turn_noise: f64,
}

impl Default for GroupPriors {
    /// Of a ring laser, after its maker calibrated it.
    fn default() -> Self {
        let hour = 60.0;
        Self {
            height_m: 10.0,
            gyroscope_scale_factor: 50.0 * PPM,
            gyroscope_installation_rad: 20.0 * ARC_SECOND,
            accelerometer_scale_factor: 50.0 * PPM,
            accelerometer_installation_rad: 20.0 * ARC_SECOND,
            accelerometer_quadratic_per_m_s2: 10.0 * MICRO_G_PER_G2,
            accelerometer_arm_m: 0.03,
            gyroscope_g_sensitivity_rad_s_per_m_s2: 0.003 * DEG_PER_HOUR_PER_G,
            accelerometer_delay_s: 0.5e-3,
            table_nonorthogonality_rad: 60.0 * ARC_SECOND,
            inner_axis_tilt_rad: 60.0 * ARC_SECOND,
            encoder_zero_rad: 60.0 * ARC_SECOND,
            encoder_eccentricity_rad: 10.0 * ARC_SECOND,
            antenna_arm_m: 10.0,
            gyroscope_drift_walk_rad_s_sqrt_s: 1e-4 * DEG_PER_HOUR / hour,
            accelerometer_bias_walk_m_s2_sqrt_s: 0.1 * MICRO_G / hour,
            turn_noise: 0.0,
        }
    }
}

impl GroupPriors {
    /// Everything as the grade says.
    pub const BY_GRADE: Self = Self {
        height_m: -1.0,
        gyroscope_scale_factor: -1.0,
        gyroscope_installation_rad: -1.0,
        accelerometer_scale_factor: -1.0,
        accelerometer_installation_rad: -1.0,
        accelerometer_quadratic_per_m_s2: -1.0,
        accelerometer_arm_m: -1.0,
        gyroscope_g_sensitivity_rad_s_per_m_s2: -1.0,
        accelerometer_delay_s: -1.0,
        table_nonorthogonality_rad: -1.0,
        inner_axis_tilt_rad: -1.0,
        encoder_zero_rad: -1.0,
        encoder_eccentricity_rad: -1.0,
        antenna_arm_m: -1.0,
        gyroscope_drift_walk_rad_s_sqrt_s: -1.0,
        accelerometer_bias_walk_m_s2_sqrt_s: -1.0,
        turn_noise: -1.0,
    };

    /// With the grade's numbers in place of negative ones.
    #[must_use]
    pub fn resolved(mut self, grade: Grade) -> Self {
        let of_grade = grade.groups();
        for (own, from) in self.values_mut().into_iter().zip(of_grade.named()) {
            if *own < 0.0 {
                *own = from.1;
            }
        }
        self
    }

    fn values_mut(&mut self) -> [&mut f64; 17] {
        [
            &mut self.height_m,
            &mut self.gyroscope_scale_factor,
            &mut self.gyroscope_installation_rad,
            &mut self.accelerometer_scale_factor,
            &mut self.accelerometer_installation_rad,
            &mut self.accelerometer_quadratic_per_m_s2,
            &mut self.accelerometer_arm_m,
            &mut self.gyroscope_g_sensitivity_rad_s_per_m_s2,
            &mut self.accelerometer_delay_s,
            &mut self.table_nonorthogonality_rad,
            &mut self.inner_axis_tilt_rad,
            &mut self.encoder_zero_rad,
            &mut self.encoder_eccentricity_rad,
            &mut self.antenna_arm_m,
            &mut self.gyroscope_drift_walk_rad_s_sqrt_s,
            &mut self.accelerometer_bias_walk_m_s2_sqrt_s,
            &mut self.turn_noise,
        ]
    }

    /// The whole model with these, and those of navigation, biases and drifts.
    pub fn model(&self, initial: &InitialUncertainty) -> Whole {
        Whole {
            navigation: Navigation {
                position_m: initial.position_m,
                velocity_m_s: initial.velocity_m_s,
                misalignment_rad: initial.misalignment_rad,
            },
            vertical: Vertical {
                height_m: self.height_m,
                velocity_m_s: initial.velocity_m_s,
            },
            bias: Bias {
                accelerometer_bias_m_s2: initial.accelerometer_bias_m_s2,
                gyroscope_drift_rad_s: initial.gyroscope_drift_rad_s,
                accelerometer_walk_m_s2_sqrt_s: self.accelerometer_bias_walk_m_s2_sqrt_s,
                gyroscope_walk_rad_s_sqrt_s: self.gyroscope_drift_walk_rad_s_sqrt_s,
            },
            gyroscope_matrix: GyroscopeMatrix {
                scale_factor: self.gyroscope_scale_factor,
                installation_rad: self.gyroscope_installation_rad,
            },
            accelerometer_matrix: AccelerometerMatrix {
                scale_factor: self.accelerometer_scale_factor,
                installation_rad: self.accelerometer_installation_rad,
            },
            quadratic: AccelerometerQuadratic {
                quadratic_per_m_s2: self.accelerometer_quadratic_per_m_s2,
            },
            arms: AccelerometerArms {
                arm_m: self.accelerometer_arm_m,
            },
            g_sensitivity: GyroscopeGSensitivity {
                g_sensitivity_rad_s_per_m_s2: self.gyroscope_g_sensitivity_rad_s_per_m_s2,
            },
            delay: AccelerometerDelay {
                delay_s: self.accelerometer_delay_s,
            },
            table: Table {
                nonorthogonality_rad: self.table_nonorthogonality_rad,
                inner_axis_tilt_rad: self.inner_axis_tilt_rad,
                encoder_zero_rad: self.encoder_zero_rad,
                encoder_eccentricity_rad: self.encoder_eccentricity_rad,
            },
            antenna: Antenna {
                arm_m: self.antenna_arm_m,
            },
            base: BaseAttitude {
                walk_rad_sqrt_s: 0.0,
            },
        }
    }

    /// Every one-sigma with its name, as settings and refusals name it.
    pub fn named(&self) -> [(&'static str, f64); 17] {
        [
            ("height_m", self.height_m),
            ("gyroscope_scale_factor", self.gyroscope_scale_factor),
            (
                "gyroscope_installation_rad",
                self.gyroscope_installation_rad,
            ),
            (
                "accelerometer_scale_factor",
                self.accelerometer_scale_factor,
            ),
            (
                "accelerometer_installation_rad",
                self.accelerometer_installation_rad,
            ),
            (
                "accelerometer_quadratic_per_m_s2",
                self.accelerometer_quadratic_per_m_s2,
            ),
            ("accelerometer_arm_m", self.accelerometer_arm_m),
            (
                "gyroscope_g_sensitivity_rad_s_per_m_s2",
                self.gyroscope_g_sensitivity_rad_s_per_m_s2,
            ),
            ("accelerometer_delay_s", self.accelerometer_delay_s),
            (
                "table_nonorthogonality_rad",
                self.table_nonorthogonality_rad,
            ),
            ("inner_axis_tilt_rad", self.inner_axis_tilt_rad),
            ("encoder_zero_rad", self.encoder_zero_rad),
            ("encoder_eccentricity_rad", self.encoder_eccentricity_rad),
            ("antenna_arm_m", self.antenna_arm_m),
            (
                "gyroscope_drift_walk_rad_s_sqrt_s",
                self.gyroscope_drift_walk_rad_s_sqrt_s,
            ),
            (
                "accelerometer_bias_walk_m_s2_sqrt_s",
                self.accelerometer_bias_walk_m_s2_sqrt_s,
            ),
            ("turn_noise", self.turn_noise),
        ]
    }
}

/// One-sigma of the azimuth that gyroscopes of this drift \[rad/s\] find against the earth's rate: ε / (ω cos L), at least
/// 10 deg and at most 60 deg \[rad\].
pub fn azimuth_prior_rad(drift_rad_s: &Vector3<f64>, cos_latitude: f64) -> f64 {
    let north = crate::earth::EARTH_RATE_RAD_S * cos_latitude;
    (1.5 * drift_rad_s.amax() / north).clamp(10f64.to_radians(), 60f64.to_radians())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A negative number stands for the grade's, zero switches a group off, and names go with their numbers.
    #[test]
    fn the_grade_fills_what_is_not_given() {
        let given = GroupPriors {
            accelerometer_arm_m: 0.0,
            accelerometer_delay_s: 1e-3,
            ..GroupPriors::BY_GRADE
        };
        let resolved = given.resolved(Grade::Mems);
        let expected = GroupPriors {
            accelerometer_arm_m: 0.0,
            accelerometer_delay_s: 1e-3,
            ..Grade::Mems.groups()
        };
        assert_eq!(resolved, expected);
        let mut marked = GroupPriors::BY_GRADE;
        for (number, value) in marked.values_mut().into_iter().enumerate() {
            *value = number as f64;
        }
        let in_order = marked
            .named()
            .iter()
            .enumerate()
            .all(|(i, (_, v))| *v == i as f64);
        assert!(in_order);
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
