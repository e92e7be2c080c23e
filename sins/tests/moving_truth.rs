//! A ship that moves, known by her position in the inertial frame alone.
//!
//! Everything the sensors measure is differentiated from that position and from the block's attitude against inertial space:
//! no radius of curvature, no transport rate and no Coriolis term of the crate stands in the truth. What the mechanization
//! makes of the samples is held against it.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use sins::earth::{
    EARTH_RATE_RAD_S, ECCENTRICITY_SQUARED, LocalEarth, Position, SEMI_MAJOR_AXIS_M,
};
use sins::mechanization::strapdown::{NavigationState, Strapdown};
use sins::sensor::Increment;

/// Step of the numerical derivatives of the position \[s\]: far below the ship's periods, far above what rounding allows.
const POSITION_STEP_S: f64 = 4.0;
/// Step of the numerical derivative of the attitude \[s\].
const ATTITUDE_STEP_S: f64 = 0.05;

/// A ship that steams, weaves, rolls and swings her heading.
struct Ship {
    latitude_rad: f64,
    height_m: f64,
}

impl Ship {
    /// Where she is, as smooth functions of time; about 16 m/s.
    fn place(&self, t: f64) -> Position {
        let north_m = 9.0 * t + 500.0 * (t / 300.0).sin();
        let east_m = 13.0 * t + 700.0 * (t / 420.0).cos();
        Position {
            latitude_rad: self.latitude_rad + north_m / SEMI_MAJOR_AXIS_M,
            longitude_rad: 0.4 + east_m / (SEMI_MAJOR_AXIS_M * self.latitude_rad.cos()),
            height_m: self.height_m,
        }
    }

    /// Position in the earth-centred frame that turns with the earth \[m\].
    fn earth_fixed(&self, t: f64) -> Vector3<f64> {
        let Position {
            latitude_rad,
            longitude_rad,
            height_m,
        } = self.place(t);
        let normal =
            SEMI_MAJOR_AXIS_M / (1.0 - ECCENTRICITY_SQUARED * latitude_rad.sin().powi(2)).sqrt();
        let level = (normal + height_m) * latitude_rad.cos();
        Vector3::new(
            level * longitude_rad.cos(),
            level * longitude_rad.sin(),
            (normal * (1.0 - ECCENTRICITY_SQUARED) + height_m) * latitude_rad.sin(),
        )
    }

    /// Position in the inertial frame \[m\].
    fn inertial(&self, t: f64) -> Vector3<f64> {
        earth_turn(t) * self.earth_fixed(t)
    }

    /// Turns East-North-Up at the ship into the frame that turns with the earth.
    fn earth_from_local(&self, t: f64) -> Matrix3<f64> {
        let place = self.place(t);
        let (sin, cos) = place.latitude_rad.sin_cos();
        let (sin_longitude, cos_longitude) = place.longitude_rad.sin_cos();
        Matrix3::from_columns(&[
            Vector3::new(-sin_longitude, cos_longitude, 0.0),
            Vector3::new(-sin * cos_longitude, -sin * sin_longitude, cos),
            Vector3::new(cos * cos_longitude, cos * sin_longitude, sin),
        ])
    }

    /// Attitude of the block against East-North-Up: heading by ±1 rad, roll by 0.1 rad, pitch by 0.02 rad.
    fn local_from_block(t: f64) -> UnitQuaternion<f64> {
        let heading = (t / 110.0).sin();
        let roll = 0.1 * (std::f64::consts::TAU * t / 11.0).sin();
        let pitch = 0.02 * (std::f64::consts::TAU * t / 7.0).sin();
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -heading)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), roll)
    }

    /// Attitude of the block against inertial space.
    fn inertial_from_block(&self, t: f64) -> UnitQuaternion<f64> {
        let earth_from_local = UnitQuaternion::from_rotation_matrix(
            &Rotation3::from_matrix_unchecked(self.earth_from_local(t)),
        );
        earth_turn(t) * earth_from_local * Self::local_from_block(t)
    }

    /// Velocity over ground, East-North-Up \[m/s\]: the derivative of the position on the turning earth.
    fn velocity(&self, t: f64) -> Vector3<f64> {
        let h = POSITION_STEP_S;
        let at = |k: f64| self.earth_fixed(t + k * h);
        let derivative = (0.8 * (at(1.0) - at(-1.0)) - 0.2 * (at(2.0) - at(-2.0))
            + 4.0 / 105.0 * (at(3.0) - at(-3.0))
            - 1.0 / 280.0 * (at(4.0) - at(-4.0)))
            / h;
        self.earth_from_local(t).transpose() * derivative
    }

    /// Angular rate of the block against inertial space, block axes \[rad/s\].
    fn angular_rate(&self, t: f64) -> Vector3<f64> {
        let now = self.inertial_from_block(t).inverse();
        let turn = |k: f64| {
            let after = now * self.inertial_from_block(t + k * ATTITUDE_STEP_S);
            let before = now * self.inertial_from_block(t - k * ATTITUDE_STEP_S);
            // Both are turns from now; their rotation vectors differ in sign and in the even orders, which cancel.
            (after.scaled_axis() - before.scaled_axis()) / (2.0 * k * ATTITUDE_STEP_S)
        };
        let (one, two, three) = (turn(1.0), turn(2.0), turn(3.0));
        1.5 * one - 0.6 * two + 0.1 * three
    }

    /// Specific force, block axes \[m/s²\]: acceleration in the inertial frame less gravitation.
    fn specific_force(&self, t: f64) -> Vector3<f64> {
        let h = POSITION_STEP_S;
        let at = |k: f64| self.inertial(t + k * h);
        let acceleration = (-205.0 / 72.0 * at(0.0) + 1.6 * (at(1.0) + at(-1.0))
            - 0.2 * (at(2.0) + at(-2.0))
            + 8.0 / 315.0 * (at(3.0) + at(-3.0))
            - 1.0 / 560.0 * (at(4.0) + at(-4.0)))
            / (h * h);
        // Gravitation is gravity with the earth's centrifugal acceleration taken out again.
        let place = self.place(t);
        let gravity = LocalEarth::at(place.latitude_rad, place.height_m).gravity_m_s2;
        let up = earth_turn(t) * (self.earth_from_local(t) * Vector3::z());
        let position = self.inertial(t);
        let axis = Vector3::z() * EARTH_RATE_RAD_S;
        let gravitation = -up * gravity + axis.cross(&axis.cross(&position));
        self.inertial_from_block(t).inverse() * (acceleration - gravitation)
    }

    /// What an ideal IMU gathers from `t` on, by Gauss-Legendre quadrature over three points.
    fn increment(&self, t: f64, interval_s: f64) -> Increment {
        let middle = t + 0.5 * interval_s;
        let reach = 0.5 * interval_s * 0.6f64.sqrt();
        let mean = |value: &dyn Fn(f64) -> Vector3<f64>| {
            (5.0 * (value(middle - reach) + value(middle + reach)) + 8.0 * value(middle)) / 18.0
        };
        Increment::from_averages(
            interval_s,
            &mean(&|t| self.angular_rate(t)),
            &mean(&|t| self.specific_force(t)),
        )
    }

    fn state(&self, t: f64) -> NavigationState {
        NavigationState {
            attitude: Self::local_from_block(t),
            velocity: self.velocity(t),
            position: self.place(t),
        }
    }
}

/// The earth's turn since the start.
fn earth_turn(t: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), EARTH_RATE_RAD_S * t)
}

/// Two hours under way at 50 Hz.
fn errors_after_two_hours(latitude_rad: f64) -> (f64, f64, f64) {
    let ship = Ship {
        latitude_rad,
        height_m: 20.0,
    };
    let rate_hz = 50;
    let interval_s = 1.0 / f64::from(rate_hz);
    let mut strapdown = Strapdown::new(ship.state(0.0));
    let (mut position_m, mut attitude_rad, mut velocity_m_s) = (0.0f64, 0.0f64, 0.0f64);
    let steps = 2 * 3600 * rate_hz;
    for step in 0..steps {
        strapdown.propagate(&ship.increment(f64::from(step) * interval_s, interval_s));
        if (step + 1) % (60 * rate_hz) == 0 {
            let t = f64::from(step + 1) * interval_s;
            let (now, truth) = (strapdown.state(), ship.state(t));
            let mut speed = truth.velocity.norm();
            assert!((12.0..20.0).contains(&speed), "{speed} m/s at {t} s");
            speed = (now.velocity - truth.velocity).xy().norm();
            velocity_m_s = velocity_m_s.max(speed);
            let north =
                (now.position.latitude_rad - truth.position.latitude_rad) * SEMI_MAJOR_AXIS_M;
            let east = (now.position.longitude_rad - truth.position.longitude_rad)
                * SEMI_MAJOR_AXIS_M
                * latitude_rad.cos();
            position_m = position_m.max(north.hypot(east));
            attitude_rad = attitude_rad.max(now.attitude.angle_to(&truth.attitude));
        }
    }
    (position_m, attitude_rad, velocity_m_s)
}

/// Under way at 13 to 19 m/s, weaving, rolling and swinging, north, south and near the pole, the mechanization stays with the
/// truth. The bounds are what an independent integration at the same rate reached, and a wrong term is far beyond them: a
/// Coriolis term of the wrong sign costs kilometres, a transport rate left out 1e-2 rad.
#[test]
fn the_mechanization_follows_a_moving_ship() {
    for latitude_rad in [0.8, -0.5, 1.2] {
        let (position_m, attitude_rad, velocity_m_s) = errors_after_two_hours(latitude_rad);
        println!(
            "{latitude_rad}: {position_m:.4} m, {attitude_rad:.2e} rad, {velocity_m_s:.2e} m/s"
        );
        assert!(position_m < 0.12, "{latitude_rad}: {position_m} m");
        assert!(attitude_rad < 4e-8, "{latitude_rad}: {attitude_rad} rad");
        assert!(velocity_m_s < 1e-3, "{latitude_rad}: {velocity_m_s} m/s");
    }
}
