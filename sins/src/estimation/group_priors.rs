//! What is known of the whole model's groups before anything is measured: one table of the numbers of every grade.

use serde::{Deserialize, Serialize};

use super::filter::InitialUncertainty;
use super::grade::Grade;
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
use crate::units::{ARC_SECOND, DEG_PER_HOUR, DEG_PER_HOUR_PER_G, MICRO_G, MICRO_G_PER_G2, PPM};

/// √s in √h.
const SQRT_HOUR: f64 = 60.0;

/// Makes the structure, its names and its numbers from rows: words, field (the name carries its unit), and what a ring laser, a
/// fibre-optic and a micro-machined sensor have.
macro_rules! group_priors {
    ($($(#[doc = $words:literal])+ $field:ident: $by_grade:expr;)+) => {
        /// One-sigma of what the whole model has beyond the paper's states. A group whose sigma is zero is not estimated; a
        /// negative number stands for what the grade says.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        pub struct GroupPriors {
            $($(#[doc = $words])+ pub $field: f64,)+
        }

        impl GroupPriors {
            /// Everything as the grade says.
            pub const BY_GRADE: Self = Self { $($field: -1.0,)+ };

            /// How many they are.
            const COUNT: usize = [$(stringify!($field)),+].len();

            /// What sensors of a grade have, after their maker calibrated them.
            pub(super) fn of_grade(grade: Grade) -> Self {
                let of = |[ring_laser, fibre_optic, mems]: [f64; 3]| match grade {
                    Grade::RingLaser => ring_laser,
                    Grade::FibreOptic => fibre_optic,
                    Grade::Mems => mems,
                };
                Self { $($field: of($by_grade),)+ }
            }

            fn values_mut(&mut self) -> [&mut f64; Self::COUNT] {
                [$(&mut self.$field,)+]
            }

            /// Every one-sigma with its name, as settings and refusals name it.
            pub fn named(&self) -> [(&'static str, f64); Self::COUNT] {
                [$((stringify!($field), self.$field),)+]
            }
        }
    };
}

group_priors! {
    /// Height \[m\].
    height_m: [10.0; 3];
    /// Gyroscope scale factors.
    gyroscope_scale_factor: [50.0 * PPM, 300.0 * PPM, 2000.0 * PPM];
    /// Gyroscope installation angles \[rad\].
    gyroscope_installation_rad: [20.0 * ARC_SECOND, 60.0 * ARC_SECOND, 600.0 * ARC_SECOND];
    /// Accelerometer scale factors.
    accelerometer_scale_factor: [50.0 * PPM, 300.0 * PPM, 2000.0 * PPM];
    /// Accelerometer installation angles \[rad\].
    accelerometer_installation_rad: [20.0 * ARC_SECOND, 60.0 * ARC_SECOND, 600.0 * ARC_SECOND];
    /// Quadratic coefficients \[1/(m/s²)\].
    accelerometer_quadratic_per_m_s2: [10.0 * MICRO_G_PER_G2, 30.0 * MICRO_G_PER_G2, 300.0 * MICRO_G_PER_G2];
    /// Components of the accelerometers' arms \[m\].
    accelerometer_arm_m: [0.03, 0.03, 0.05];
    /// g-sensitivities \[rad/s per m/s²\].
    gyroscope_g_sensitivity_rad_s_per_m_s2:
        [0.003 * DEG_PER_HOUR_PER_G, 0.03 * DEG_PER_HOUR_PER_G, 5.0 * DEG_PER_HOUR_PER_G];
    /// Delay of the accelerometers \[s\].
    accelerometer_delay_s: [0.5e-3, 2e-3, 5e-3];
    /// Non-orthogonality of the table's axes \[rad\].
    table_nonorthogonality_rad: [60.0 * ARC_SECOND; 3];
    /// Tilts of the inner axis in the block \[rad\].
    inner_axis_tilt_rad: [60.0 * ARC_SECOND; 3];
    /// Zero of the inner encoder \[rad\].
    encoder_zero_rad: [60.0 * ARC_SECOND; 3];
    /// Sine and cosine of the encoders' eccentricities \[rad\].
    encoder_eccentricity_rad: [10.0 * ARC_SECOND; 3];
    /// Components of the antenna's arm, beyond what was told of it \[m\].
    antenna_arm_m: [10.0; 3];
    /// Walk of the gyroscope drifts, density \[rad/s/√s\].
    gyroscope_drift_walk_rad_s_sqrt_s:
        [1e-4 * DEG_PER_HOUR / SQRT_HOUR, 0.03 * DEG_PER_HOUR / SQRT_HOUR, 3.0 * DEG_PER_HOUR / SQRT_HOUR];
    /// Walk of the accelerometer biases, density \[m/s²/√s\].
    accelerometer_bias_walk_m_s2_sqrt_s:
        [0.1 * MICRO_G / SQRT_HOUR, 10.0 * MICRO_G / SQRT_HOUR, 100.0 * MICRO_G / SQRT_HOUR];
    /// What a turn costs that no state describes, as a share of it.
    turn_noise: [0.0; 3];
}

impl Default for GroupPriors {
    /// Of a ring laser.
    fn default() -> Self {
        Self::of_grade(Grade::RingLaser)
    }
}

impl GroupPriors {
    /// With the grade's numbers in place of negative ones.
    #[must_use]
    pub fn resolved(mut self, grade: Grade) -> Self {
        let of_grade = Self::of_grade(grade);
        for (own, (_, value)) in self.values_mut().into_iter().zip(of_grade.named()) {
            if *own < 0.0 {
                *own = value;
            }
        }
        self
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

    /// How a group is switched off, what all names of its states have, and how many they are.
    type Case = (fn(&mut GroupPriors), &'static str, usize);

    /// Every group that is switched off by itself takes its own states from the model, and no others: their prior is zero.
    #[test]
    fn a_group_that_is_switched_off_is_gone() {
        use super::super::model::Model;
        use crate::earth::Position;
        use crate::mechanization::strapdown::NavigationState;
        use nalgebra::{UnitQuaternion, Vector3};

        let initial = InitialUncertainty {
            position_m: 10.0,
            velocity_m_s: 0.01,
            misalignment_rad: Vector3::repeat(0.01),
            accelerometer_bias_m_s2: Vector3::repeat(1e-3),
            gyroscope_drift_rad_s: Vector3::repeat(1e-7),
        };
        let place = NavigationState {
            attitude: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            position: Position {
                latitude_rad: 0.8,
                longitude_rad: 0.0,
                height_m: 0.0,
            },
        };
        let switched_off = |change: fn(&mut GroupPriors)| {
            let mut priors = GroupPriors::default();
            change(&mut priors);
            let [all, rest] =
                [GroupPriors::default(), priors].map(|priors| priors.model(&initial).prior(&place));
            let names = Whole::STATES.iter().map(|label| label.name);
            let both = names.zip(all.iter().zip(rest.iter()));
            both.filter(|(_, (all, rest))| **all > 0.0 && **rest == 0.0)
                .map(|(name, _)| name)
                .collect::<Vec<_>>()
        };
        let cases: [Case; 13] = [
            (|p| p.height_m = 0.0, "height_", 1),
            (
                |p| p.gyroscope_scale_factor = 0.0,
                "gyroscope_scale_factor_",
                3,
            ),
            (
                |p| p.gyroscope_installation_rad = 0.0,
                "gyroscope_installation_",
                6,
            ),
            (
                |p| p.accelerometer_scale_factor = 0.0,
                "accelerometer_scale_factor_",
                3,
            ),
            (
                |p| p.accelerometer_installation_rad = 0.0,
                "accelerometer_installation_",
                3,
            ),
            (
                |p| p.accelerometer_quadratic_per_m_s2 = 0.0,
                "accelerometer_quadratic_",
                3,
            ),
            (|p| p.accelerometer_arm_m = 0.0, "accelerometer_arm_", 9),
            (
                |p| p.gyroscope_g_sensitivity_rad_s_per_m_s2 = 0.0,
                "gyroscope_g_sensitivity_",
                3,
            ),
            (
                |p| p.accelerometer_delay_s = 0.0,
                "accelerometer_delay_s",
                1,
            ),
            (
                |p| p.table_nonorthogonality_rad = 0.0,
                "nonorthogonality",
                1,
            ),
            (|p| p.inner_axis_tilt_rad = 0.0, "inner_axis_tilt", 2),
            (|p| p.encoder_zero_rad = 0.0, "encoder_zero", 1),
            (|p| p.encoder_eccentricity_rad = 0.0, "eccentricity", 4),
        ];
        for (change, words, count) in cases {
            let gone = switched_off(change);
            assert_eq!(gone.len(), count, "{words}: {gone:?}");
            assert!(
                gone.iter().all(|name| name.contains(words)),
                "{words}: {gone:?}"
            );
        }
        assert_eq!(switched_off(|p| p.antenna_arm_m = 0.0).len(), 3);
        assert!(switched_off(|_| ()).is_empty());
    }
}
