//! Coarse alignment in the inertial frame, from any heading, without a prior.
//!
//! The gyroscopes carry the block's attitude in the inertial frame i_b0 (the block frame frozen at the start), whatever the
//! ship or the table does meanwhile. In that frame the integral of the specific force is, at rest, that of gravity carried
//! round by the earth, which is known in n_0 (the navigation frame frozen at the start) from the latitude and the clock.
//! One rotation takes the one to the other; it is found from all the pairs by least squares (Wahba's problem, by singular
//! value decomposition: Markley, J. Astronautical Sciences 36, 1988). Averages of raw samples are nowhere used: bursts of
//! motion turn the block and are followed by the gyroscopes, and pushes integrate to the velocity that remains of them.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::earth::rotation::small_rotation;
use crate::earth::{EARTH_RATE_RAD_S, LocalEarth};
use crate::error::Error;
use crate::mechanization::strapdown::IncrementCorrector;
use crate::sensor::Increment;

/// Time between the pairs that enter the least squares \[s\].
const PAIR_INTERVAL_S: f64 = 1.0;
/// How far the mean length of the specific force may lie from gravity before it is no measurement of it, as a fraction.
const GRAVITY_TOLERANCE: f64 = 0.02;

/// Gathers increments; solves for the attitude at the start when asked.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CoarseAlignment {
    corrector: IncrementCorrector,
    /// Turns b into i_b0.
    attitude: UnitQuaternion<f64>,
    /// ∫ f dt in i_b0 \[m/s\].
    velocity: Vector3<f64>,
    seconds: f64,
    next_pair_s: f64,
    /// Time since the start \[s\] and velocity in i_b0 there \[m/s\].
    pairs: Vec<(f64, Vector3<f64>)>,
    /// ∫ |f| dt \[m/s\].
    force_path: f64,
}

/// What coarse alignment found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseAttitude {
    /// Attitude at the **start** of the gathering, turns b into n.
    pub at_start: UnitQuaternion<f64>,
    /// Root mean square of the velocity that the rotation does not explain \[m/s\].
    pub residual_m_s: f64,
}

impl Default for CoarseAlignment {
    fn default() -> Self {
        Self {
            corrector: IncrementCorrector::default(),
            attitude: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            seconds: 0.0,
            next_pair_s: PAIR_INTERVAL_S,
            pairs: Vec::new(),
            force_path: 0.0,
        }
    }
}

impl CoarseAlignment {
    /// Takes in one interval.
    pub fn ingest(&mut self, increment: &Increment) {
        let corrected = self.corrector.correct(increment);
        self.velocity += self.attitude * corrected.velocity;
        self.attitude = UnitQuaternion::new_normalize(
            (self.attitude * small_rotation(&corrected.rotation)).into_inner(),
        );
        self.seconds += increment.interval_s;
        self.force_path += increment.velocity.norm();
        if self.seconds >= self.next_pair_s {
            self.pairs.push((self.seconds, self.velocity));
            self.next_pair_s += PAIR_INTERVAL_S;
        }
    }

    /// Length of what has been gathered \[s\].
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The attitude at the start.
    ///
    /// # Errors
    /// [`Error::Alignment`] where the specific force has not the length of gravity (a wrong unit, a broken accelerometer) or
    /// the velocity left over exceeds `residual_limit_m_s` (not at rest, or rates in a wrong unit).
    pub fn solve(
        &self,
        latitude_rad: f64,
        height_m: f64,
        residual_limit_m_s: f64,
    ) -> Result<CoarseAttitude, Error> {
        let earth = LocalEarth::at(latitude_rad, height_m);
        let mean_force = self.force_path / self.seconds;
        let gravity = earth.gravity_m_s2;
        if (mean_force / gravity - 1.0).abs() > GRAVITY_TOLERANCE || !mean_force.is_finite() {
            return Err(Error::Alignment {
                reason: format!(
                    "the specific force is {mean_force:.4} m/s² long on average over {:.0} s, expected gravity, {gravity:.4} m/s² \
                     (is linear_acceleration in m/s²?)",
                    self.seconds
                ),
            });
        }
        let reference: Vec<_> = self
            .pairs
            .iter()
            .map(|(t, v)| (gravity_integral(&earth, *t), *v))
            .collect();
        let profile: Matrix3<f64> = reference
            .iter()
            .map(|(known, measured)| known * measured.transpose())
            .sum();
        let svd = profile.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
            return Err(Error::Alignment {
                reason: "the velocity profile has no singular value decomposition".into(),
            });
        };
        let handedness = (u.determinant() * v_t.determinant()).signum();
        let rotation = polish(
            u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handedness)) * v_t,
            &reference,
        );
        let squares: f64 = reference
            .iter()
            .map(|(known, measured)| (known - rotation * measured).norm_squared())
            .sum();
        let residual_m_s = (squares / reference.len() as f64).sqrt();
        if residual_m_s.is_nan() || residual_m_s > residual_limit_m_s {
            return Err(Error::Alignment {
                reason: format!(
                    "{residual_m_s:.3} m/s of velocity are left over after {:.0} s, expected less than {residual_limit_m_s} m/s: \
                     the ship is not at rest, or angular_velocity is not in rad/s",
                    self.seconds
                ),
            });
        }
        Ok(CoarseAttitude {
            at_start: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                rotation,
            )),
            residual_m_s,
        })
    }
}

/// Gauss-Newton steps of the same least squares from the decomposition's rotation: the profile's singular values lie seven
/// decades apart, which costs the decomposition as many digits.
fn polish(start: Matrix3<f64>, pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Matrix3<f64> {
    let mut rotation = start;
    for _ in 0..2 {
        let mut information = Matrix3::zeros();
        let mut gradient = Vector3::zeros();
        for (known, measured) in pairs {
            let turned = rotation * measured;
            let arm = turned.cross_matrix();
            information -= arm * arm;
            gradient += turned.cross(&(known - turned));
        }
        let Some(step) = information.cholesky().map(|c| c.solve(&gradient)) else {
            break;
        };
        rotation = Rotation3::from_scaled_axis(step) * rotation;
    }
    rotation
}

/// ∫₀ᵗ of the specific force at rest in n_0: (0, 0, g) turned about the earth's axis u by Ωτ \[m/s\],
/// g \[ (k·u) u t + sin Ωt / Ω (k − (k·u) u) + (1 − cos Ωt) / Ω (u × k) \] with k up.
fn gravity_integral(earth: &LocalEarth, t: f64) -> Vector3<f64> {
    let axis = Vector3::new(0.0, earth.cos_latitude, earth.sin_latitude);
    let up = Vector3::z();
    let along = axis * axis.dot(&up);
    let angle = EARTH_RATE_RAD_S * t;
    let half = 0.5 * angle;
    earth.gravity_m_s2
        * (along * t
            + (up - along) * (angle.sin() / EARTH_RATE_RAD_S)
            + axis.cross(&up) * (2.0 * half.sin().powi(2) / EARTH_RATE_RAD_S))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::earth::rotation::HeadingPitchRoll;

    fn gather(
        attitude: &UnitQuaternion<f64>,
        latitude: f64,
        seconds: usize,
        force_scale: f64,
    ) -> CoarseAlignment {
        let earth = LocalEarth::at(latitude, 0.0);
        let rate = attitude.inverse() * earth.earth_rate();
        let force = attitude.inverse() * (Vector3::z() * earth.gravity_m_s2 * force_scale);
        let mut coarse = CoarseAlignment::default();
        for _ in 0..seconds * 10 {
            coarse.ingest(&Increment::from_averages(0.1, &rate, &force));
        }
        coarse
    }

    /// Perfect sensors: any heading, both hemispheres, any face of the block down, to a hundredth of an arc-second.
    #[test]
    fn finds_any_attitude() {
        for latitude in [0.8, -0.6, 0.02] {
            for (heading, pitch, roll) in [(0.1, 0.0, 0.0), (3.3, 0.2, -0.1), (5.0, 1.2, 3.0)] {
                let attitude = HeadingPitchRoll {
                    heading,
                    pitch,
                    roll,
                }
                .attitude();
                let found = gather(&attitude, latitude, 120, 1.0)
                    .solve(latitude, 0.0, 0.5)
                    .unwrap();
                assert!(
                    found.at_start.angle_to(&attitude) < 5e-8,
                    "{latitude} {heading}: {found:?}"
                );
                assert!(found.residual_m_s < 1e-6);
            }
        }
    }

    /// Specific force in units of g is refused with a line that says so.
    #[test]
    fn force_in_g_is_refused() {
        let coarse = gather(&UnitQuaternion::identity(), 0.8, 60, 1.0 / 9.8);
        let error = coarse.solve(0.8, 0.0, 0.5).unwrap_err().to_string();
        assert!(error.contains("m/s²") && error.contains("1.000"), "{error}");
    }

    /// Rates in deg/s leave velocity over and are refused.
    #[test]
    fn rates_in_degrees_are_refused() {
        let earth = LocalEarth::at(0.8, 0.0);
        let mut coarse = CoarseAlignment::default();
        for _ in 0..1200 {
            let rate = earth.earth_rate() * 57.3;
            coarse.ingest(&Increment::from_averages(
                0.1,
                &rate,
                &(Vector3::z() * earth.gravity_m_s2),
            ));
        }
        assert!(
            coarse
                .solve(0.8, 0.0, 0.5)
                .unwrap_err()
                .to_string()
                .contains("rad/s")
        );
    }
}
