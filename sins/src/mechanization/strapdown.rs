//! Strapdown mechanization in the local-level frame, from angle and velocity increments.
//!
//! With α = ∫ω dt and u = ∫f dt over one sampling interval of a block that turns while it measures:
//!
//! - rotation vector Δθ = α + k α₋ × α (coning),
//! - velocity in the block frame of the start of the interval
//!   Δv = u + (1 − cos α)/α² α × u + (α − sin α)/α³ α × (α × u) + k (α₋ × u + u₋ × α) (rotation, sculling),
//! - v ← v + (I − ½ ζ×) C_b^n Δv + \[g − (2 ω_ie + ω_en) × v\] T, ζ = (ω_ie + ω_en) T,
//! - C ← exp(−ζ×) C exp(Δθ×), here ζ with the mean of the velocities before and after.
//!
//! The minus marks the interval before. For rates that are linear in time over both intervals, of lengths T₋ and T, the
//! factor is k = T² / (6 T₋ (T₋ + T)), which is the textbook's 1/12 where T₋ = T (Savage, J. Guidance 21, 1998, for equal ones).
//!
//! Without a vertical channel a ship's height is known, and the vertical velocity stays zero. With one both are integrated; by
//! itself it is unstable (normal gravity falls with height), so something must measure height or vertical velocity.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::earth::rotation::small_rotation;
use crate::earth::{LocalEarth, Position};
use crate::error::Error;
use crate::sensor::Increment;

/// The earth is computed anew when the latitude has moved by this much \[rad\] (6 mm; 1e-7 deg/h of earth rate).
const LATITUDE_STEP_RAD: f64 = 1e-9;
/// And when the height has changed by this much \[m\]; in between gravity goes by its gradient.
const HEIGHT_STEP_M: f64 = 10.0;

/// An increment corrected for the turning of the block within it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrectedIncrement {
    /// Rotation vector of the interval \[rad\].
    pub rotation: Vector3<f64>,
    /// Velocity gained, in the block frame at the start of the interval \[m/s\].
    pub velocity: Vector3<f64>,
}

/// Coning, rotation and sculling corrections; remembers the interval before.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct IncrementCorrector {
    previous: Option<Increment>,
}

impl IncrementCorrector {
    /// Corrects the next increment.
    #[inline]
    pub fn correct(&mut self, increment: &Increment) -> CorrectedIncrement {
        let Increment {
            interval_s,
            angle,
            velocity,
        } = *increment;
        // (1 − cos α)/α² and (α − sin α)/α³: at 10 Hz and 5 deg/s the second order is 13 ug of gravity, and a vertical channel
        // would take it for an error of the sensors.
        let squared = angle.norm_squared();
        let once = angle.cross(&velocity);
        let mut corrected = CorrectedIncrement {
            rotation: angle,
            velocity: velocity
                + (0.5 - squared / 24.0) * once
                + (1.0 / 6.0 - squared / 120.0) * angle.cross(&once),
        };
        if let Some(previous) = self.previous {
            let k = interval_s * interval_s
                / (6.0 * previous.interval_s * (previous.interval_s + interval_s));
            corrected.rotation += k * previous.angle.cross(&angle);
            corrected.velocity +=
                k * (previous.angle.cross(&velocity) + previous.velocity.cross(&angle));
        }
        self.previous = Some(*increment);
        corrected
    }

    /// Forgets the interval before: after a hole in the stream it is not a neighbour.
    pub fn forget(&mut self) {
        self.previous = None;
    }
}

/// Attitude, velocity and position of the block.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NavigationState {
    /// Turns b into n (ENU).
    pub attitude: UnitQuaternion<f64>,
    /// Velocity over ground in n (E, N, U) \[m/s\]; U is zero without a vertical channel.
    pub velocity: Vector3<f64>,
    /// Position; without a vertical channel the height stays as it was given.
    pub position: Position,
}

impl NavigationState {
    /// Refuses numbers that nobody has navigated with, such as those of a damaged file.
    ///
    /// # Errors
    /// [`Error::Snapshot`] with what they are of, or as [`Position::checked`].
    pub fn check(&self) -> Result<(), Error> {
        let refused = |what: &str| Error::Snapshot {
            reason: format!("{what} cannot be"),
        };
        self.position.checked()?;
        // Not a number is not near anything.
        let off_unit = (self.attitude.norm() - 1.0).abs();
        if off_unit.is_nan() || off_unit > 1e-6 {
            return Err(refused("an attitude"));
        }
        if !self.velocity.iter().all(|v| v.is_finite()) {
            return Err(refused("a velocity"));
        }
        Ok(())
    }
}

/// The mechanization: integrates increments into a [`NavigationState`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Strapdown {
    state: NavigationState,
    body_to_navigation: Matrix3<f64>,
    corrector: IncrementCorrector,
    earth: LocalEarth,
    earth_latitude: f64,
    earth_height: f64,
    vertical: bool,
}

impl Strapdown {
    /// Starts at a state.
    pub fn new(state: NavigationState) -> Self {
        Self {
            state,
            body_to_navigation: state.attitude.to_rotation_matrix().into_inner(),
            corrector: IncrementCorrector::default(),
            earth: LocalEarth::at(state.position.latitude_rad, state.position.height_m),
            earth_latitude: state.position.latitude_rad,
            earth_height: state.position.height_m,
            vertical: false,
        }
    }

    /// With a vertical channel or without one.
    #[must_use]
    pub fn with_vertical_channel(mut self, vertical: bool) -> Self {
        self.vertical = vertical;
        self
    }

    /// Where the integration stands.
    pub fn state(&self) -> &NavigationState {
        &self.state
    }

    /// C_b^n at the end of the last interval.
    #[inline]
    pub fn body_to_navigation(&self) -> &Matrix3<f64> {
        &self.body_to_navigation
    }

    /// The earth at the present latitude.
    pub fn earth(&self) -> &LocalEarth {
        &self.earth
    }

    /// Integrates one interval. Returns the velocity that the specific force gave, in n \[m/s\].
    pub fn propagate(&mut self, increment: &Increment) -> Vector3<f64> {
        let interval = increment.interval_s;
        let corrected = self.corrector.correct(increment);
        let earth_rate = self.earth.earth_rate();
        let frame_rate = earth_rate + self.earth.transport_rate(&self.state.velocity);
        let frame_rotation = frame_rate * interval;

        let in_start_frame = self.body_to_navigation * corrected.velocity;
        let gained = in_start_frame - 0.5 * frame_rotation.cross(&in_start_frame);
        let before = self.state.velocity;
        let coriolis = (earth_rate + frame_rate).cross(&before);
        let mut velocity = before + gained - coriolis * interval;
        if self.vertical {
            let above = self.state.position.height_m - self.earth_height;
            let gravity = self.earth.gravity_m_s2 + self.earth.gravity_gradient_per_s2 * above;
            velocity.z -= gravity * interval;
            self.state.position.height_m += 0.5 * (before.z + velocity.z) * interval;
        } else {
            velocity.z = 0.0;
        }

        let mean = 0.5 * (before + velocity);
        let transport = self.earth.transport_rate(&mean);
        self.state.position.latitude_rad -= transport.x * interval;
        self.state.position.longitude_rad += transport.y / self.earth.cos_latitude * interval;
        self.state.velocity = velocity;
        // The frame turns with the mean velocity: with the one before, Schuler's oscillation would grow by
        // (ν T)²/4 a step, 10 % in three days at one sample a second; so it neither grows nor dies.
        let mean_frame_rotation = (earth_rate + transport) * interval;
        self.set_attitude(
            small_rotation(&-mean_frame_rotation)
                * self.state.attitude
                * small_rotation(&corrected.rotation),
        );
        self.refresh_earth();
        gained
    }

    /// Takes estimated errors out of the state: misalignment φ (C = (I + φ×) C'), velocity, latitude and longitude errors.
    pub fn correct(
        &mut self,
        misalignment: &Vector3<f64>,
        velocity_error: &Vector3<f64>,
        position_error: [f64; 2],
    ) {
        self.set_attitude(UnitQuaternion::from_scaled_axis(*misalignment) * self.state.attitude);
        self.state.velocity -= velocity_error;
        self.state.position.latitude_rad -= position_error[0];
        self.state.position.longitude_rad -= position_error[1];
        self.refresh_earth();
    }

    /// Takes an estimated error of the height \[m\] out of the state.
    pub fn correct_height(&mut self, height_error_m: f64) {
        self.state.position.height_m -= height_error_m;
        self.refresh_earth();
    }

    /// Tells the mechanization that the next increment does not follow the last one.
    pub fn break_stream(&mut self) {
        self.corrector.forget();
    }

    #[inline]
    fn set_attitude(&mut self, attitude: UnitQuaternion<f64>) {
        // One Newton step keeps the norm at 1 to rounding; a full renormalization would cost a square root a sample.
        let q = attitude.into_inner();
        self.state.attitude = UnitQuaternion::new_unchecked(q * (1.5 - 0.5 * q.norm_squared()));
        self.body_to_navigation = self.state.attitude.to_rotation_matrix().into_inner();
    }

    #[inline]
    fn refresh_earth(&mut self) {
        let position = &self.state.position;
        if (position.latitude_rad - self.earth_latitude).abs() > LATITUDE_STEP_RAD
            || (position.height_m - self.earth_height).abs() > HEIGHT_STEP_M
        {
            self.earth = LocalEarth::at(
                self.state.position.latitude_rad,
                self.state.position.height_m,
            );
            self.earth_latitude = self.state.position.latitude_rad;
            self.earth_height = self.state.position.height_m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::rotation::HeadingPitchRoll;

    /// A block that turns evenly under gravity gains gravity and nothing else, at 10 Hz and 5 deg/s to 1e-9 of it in every axis.
    #[test]
    fn gravity_is_gravity_while_the_block_turns() {
        let (dt, rate) = (0.1, Vector3::new(0.08, -0.03, 0.02));
        let up = Vector3::new(0.3, -0.2, 9.8);
        // ∫ exp(−τ ω×) f dτ of a force that stands still outside, from t to t + dt, by its series.
        let (a, half) = ((rate * dt).cross_matrix(), 0.5);
        let mean =
            Matrix3::identity() - a * half + a * a / 6.0 - a * a * a / 24.0 + a * a * a * a / 120.0;
        let mut corrector = IncrementCorrector::default();
        for k in 0..5 {
            let turned = small_rotation(&(rate * (dt * f64::from(k))));
            let increment = Increment {
                interval_s: dt,
                angle: rate * dt,
                velocity: mean * (turned.inverse() * up) * dt,
            };
            let corrected = corrector.correct(&increment);
            if k > 0 {
                let error = turned * corrected.velocity - up * dt;
                assert!(error.norm() < 1e-9 * up.norm() * dt, "{error}");
            }
        }
    }

    /// Classical coning of half-angle a. Without the correction the attitude drifts by ½ Ω a² (1 − sin x / x), x = Ω dt,
    /// the closed form of the interval's commutation integral; with it, next to nothing of that is left.
    #[test]
    fn coning_against_the_closed_form() {
        let (a, omega, dt): (f64, f64, f64) = (1e-3, 20.0, 0.005);
        let truth = |t: f64| {
            UnitQuaternion::from_scaled_axis(
                Vector3::new((omega * t).cos(), (omega * t).sin(), 0.0) * a,
            )
        };
        // ω_b = (−Ω sin a sin Ωt, Ω sin a cos Ωt, −2Ω sin²(a/2)): its integral over an interval, exactly.
        let angle = |t: f64| {
            Vector3::new(
                a.sin() * ((omega * (t + dt)).cos() - (omega * t).cos()),
                a.sin() * ((omega * (t + dt)).sin() - (omega * t).sin()),
                -2.0 * omega * (a / 2.0).sin().powi(2) * dt,
            )
        };
        let run = |corrected: bool| {
            let mut corrector = IncrementCorrector::default();
            let mut q = truth(0.0);
            corrector.correct(&Increment {
                interval_s: dt,
                angle: angle(-dt),
                velocity: Vector3::zeros(),
            });
            for k in 0..2000 {
                let t = f64::from(k) * dt;
                if !corrected {
                    corrector.forget();
                }
                let c = corrector.correct(&Increment {
                    interval_s: dt,
                    angle: angle(t),
                    velocity: Vector3::zeros(),
                });
                q *= small_rotation(&c.rotation);
            }
            (truth(10.0).inverse() * q).angle()
        };
        let x: f64 = omega * dt;
        let drift = 0.5 * omega * a * a * (1.0 - x.sin() / x) * 10.0;
        assert!(
            (run(false) / drift - 1.0).abs() < 0.02,
            "{} {drift}",
            run(false)
        );
        assert!(run(true) < 2e-3 * drift, "{} {drift}", run(true));
    }

    /// Sculling: turning about x and pushing along y in phase gives a velocity along z of ½ a b / Ω a second
    /// (a amplitude of the angle, b of the force); the sum over whole periods against the closed form.
    #[test]
    fn sculling_against_the_closed_form() {
        let (a, b, omega, dt): (f64, f64, f64, f64) = (1e-3, 1.0, 20.0, 0.005);
        let steps = 12_566; // 10 periods × 2π / (Ω dt), rounded: whole intervals
        let mut corrector = IncrementCorrector::default();
        let mut attitude = UnitQuaternion::identity();
        let mut velocity = Vector3::zeros();
        // Rate a Ω cos Ωt about x (angle a sin Ωt), force b sin Ωt along y.
        let increment = |t: f64| Increment {
            interval_s: dt,
            angle: Vector3::x() * a * ((omega * (t + dt)).sin() - (omega * t).sin()),
            velocity: Vector3::y() * b / omega * ((omega * t).cos() - (omega * (t + dt)).cos()),
        };
        corrector.correct(&increment(-dt));
        for k in 0..steps {
            let c = corrector.correct(&increment(f64::from(k) * dt));
            velocity += attitude * c.velocity;
            attitude *= small_rotation(&c.rotation);
        }
        // v_z = ∫ b sin Ωt · sin(a sin Ωt) dt = b J1(a) T over whole periods ≈ a b / 2 T.
        let expected = 0.5 * a * b * f64::from(steps) * dt;
        assert!(
            (velocity.z / expected - 1.0).abs() < 1e-3,
            "{} {expected}",
            velocity.z
        );
    }

    /// Two intervals of unequal length with rates linear in time: the correction is still that of the linear rates.
    #[test]
    fn unequal_intervals_use_their_own_lengths() {
        let (a, b) = (Vector3::new(0.3, -0.2, 0.1), Vector3::new(-4.0, 3.0, 5.0));
        let integral = |t0: f64, t1: f64| a * (t1 - t0) + b * (0.5 * (t1 * t1 - t0 * t0));
        let (t_before, t_now) = (0.004, 0.011);
        let mut corrector = IncrementCorrector::default();
        let zero = Vector3::zeros();
        corrector.correct(&Increment {
            interval_s: t_before,
            angle: integral(-t_before, 0.0),
            velocity: zero,
        });
        let c = corrector.correct(&Increment {
            interval_s: t_now,
            angle: integral(0.0, t_now),
            velocity: zero,
        });
        let coning = a.cross(&b) * t_now.powi(3) / 12.0;
        assert!((c.rotation - integral(0.0, t_now) - coning).norm() < 1e-9 * coning.norm() + 1e-18);
    }

    /// Schuler's oscillation keeps its amplitude over three days, at one sample a second: nothing in the integration feeds or
    /// damps it.
    #[test]
    fn schuler_oscillation_keeps_its_amplitude() {
        let latitude = 0.0;
        let earth = LocalEarth::at(latitude, 0.0);
        let start = NavigationState {
            attitude: small_rotation(&Vector3::new(1e-5, 0.0, 0.0)),
            velocity: Vector3::zeros(),
            position: Position {
                latitude_rad: latitude,
                longitude_rad: 0.0,
                height_m: 0.0,
            },
        };
        let mut strapdown = Strapdown::new(start);
        // A block that rests on the earth and is believed to be tilted by 1e-5.
        let rate = earth.earth_rate();
        let force = Vector3::z() * earth.gravity_m_s2;
        let (mut first, mut last) = (0.0f64, 0.0f64);
        for second in 0..72 * 3600 {
            strapdown.propagate(&Increment::from_averages(1.0, &rate, &force));
            let speed = strapdown.state().velocity.norm();
            if second < 3 * 3600 {
                first = first.max(speed);
            } else if second >= 69 * 3600 {
                last = last.max(speed);
            }
        }
        assert!((last / first - 1.0).abs() < 0.01, "{first} {last}");
    }

    /// Perfect sensors at rest: after an hour velocity, position and attitude stand where they were.
    #[test]
    fn at_rest_it_stays() {
        let latitude = 45.78f64.to_radians();
        let earth = LocalEarth::at(latitude, 0.0);
        let start = NavigationState {
            attitude: HeadingPitchRoll {
                heading: 0.7,
                pitch: 0.1,
                roll: -0.2,
            }
            .attitude(),
            velocity: Vector3::zeros(),
            position: Position {
                latitude_rad: latitude,
                longitude_rad: 2.0,
                height_m: 0.0,
            },
        };
        let rate = start.attitude.inverse() * earth.earth_rate();
        let force = start.attitude.inverse() * (Vector3::z() * earth.gravity_m_s2);
        let mut strapdown = Strapdown::new(start);
        for _ in 0..360_000 {
            strapdown.propagate(&Increment::from_averages(0.01, &rate, &force));
        }
        let end = strapdown.state();
        assert!(end.velocity.norm() < 1e-7, "{}", end.velocity);
        assert!((end.position.latitude_rad - latitude).abs() < 1e-11);
        assert!(end.attitude.angle_to(&start.attitude) < 1e-10);
        assert!((end.attitude.norm() - 1.0).abs() < 1e-14);
    }
}
