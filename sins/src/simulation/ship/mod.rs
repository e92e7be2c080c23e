//! The ship: where it is, how it lies, and how it moves.

mod course;
mod motion;
mod sea;

pub use course::{Course, Swing};
pub use motion::{MotionSettings, ShipMotion};
pub use sea::{Hull, WaveSystem};

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::earth::{LocalEarth, Position};
use crate::error::Error;
use crate::range;

/// Where a ship lies on the earth and how, in a calm. How she moves about that is [`ShipMotion`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ship {
    /// Geodetic latitude, WGS-84 \[rad\].
    pub latitude_rad: f64,
    /// Longitude \[rad\].
    pub longitude_rad: f64,
    /// Height above the ellipsoid \[m\].
    pub height_m: f64,
    /// Heading of the y axis, clockwise from true north \[rad\].
    pub heading_rad: f64,
    /// Roll about the y axis, starboard (x) down positive \[rad\].
    pub roll_rad: f64,
    /// Pitch about the x axis, bow (y) up positive \[rad\].
    pub pitch_rad: f64,
}

impl Default for Ship {
    /// The paper's place, heading north, level.
    fn default() -> Self {
        Self {
            latitude_rad: 45.78_f64.to_radians(),
            longitude_rad: 126.67_f64.to_radians(),
            height_m: 0.0,
            heading_rad: 0.0,
            roll_rad: 0.0,
            pitch_rad: 0.0,
        }
    }
}

/// How the ship moves at one moment. Frame v: x right, y forward, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipState {
    /// Turns v into n (East-North-Up), C_v^n.
    pub attitude: UnitQuaternion<f64>,
    /// Against inertial space, in v \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Its derivative, in v \[rad/s²\].
    pub angular_acceleration: Vector3<f64>,
    /// Against n (East-North-Up), in v \[rad/s\].
    pub rate_over_level: Vector3<f64>,
    /// At the table's centre, in v \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// Over the earth, in n \[m/s\].
    pub velocity: Vector3<f64>,
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Longitude \[rad\].
    pub longitude_rad: f64,
    /// Height above the ellipsoid \[m\].
    pub height_m: f64,
}

impl ShipState {
    /// Where the table's centre is.
    pub fn position(&self) -> Position {
        Position {
            latitude_rad: self.latitude_rad,
            longitude_rad: self.longitude_rad,
            height_m: self.height_m,
        }
    }
}

impl Ship {
    /// Checks the ranges of all angles and of the height.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        let checks = [
            ("latitude [deg]", self.latitude_rad.to_degrees(), 89.9),
            ("longitude [deg]", self.longitude_rad.to_degrees(), 360.0),
            ("heading [deg]", self.heading_rad.to_degrees(), 360.0),
            ("roll [deg]", self.roll_rad.to_degrees(), 90.0),
            ("pitch [deg]", self.pitch_rad.to_degrees(), 89.0),
            ("height [m]", self.height_m, 20_000.0),
        ];
        for (name, value, max) in checks {
            range::within(name, value, max)?;
        }
        Ok(())
    }

    /// C_v^n = R_z(−heading) R_x(pitch) R_y(roll).
    fn attitude(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -self.heading_rad)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.pitch_rad)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.roll_rad)
    }

    /// The state of a ship at rest, at any time: the earth's rate and gravity are all there is.
    pub fn at(&self, _seconds: f64) -> ShipState {
        let earth = LocalEarth::at(self.latitude_rad, self.height_m);
        let attitude = self.attitude();
        ShipState {
            attitude,
            angular_rate: attitude.inverse() * earth.earth_rate(),
            angular_acceleration: Vector3::zeros(),
            rate_over_level: Vector3::zeros(),
            specific_force: attitude.inverse() * Vector3::new(0.0, 0.0, earth.gravity_m_s2),
            velocity: Vector3::zeros(),
            latitude_rad: self.latitude_rad,
            longitude_rad: self.longitude_rad,
            height_m: self.height_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// Heading 90: the y axis points East and x South; bow up raises y; starboard down lowers x.
    #[test]
    fn attitude_has_the_signs_of_the_sea() {
        let east = Ship {
            heading_rad: FRAC_PI_2,
            ..Ship::default()
        }
        .attitude();
        assert!((east * Vector3::y() - Vector3::x()).norm() < 1e-15);
        assert!((east * Vector3::x() + Vector3::y()).norm() < 1e-15);
        let bow_up = Ship {
            pitch_rad: 0.1,
            heading_rad: 2.0,
            ..Ship::default()
        }
        .attitude();
        assert!(((bow_up * Vector3::y()).z - 0.1_f64.sin()).abs() < 1e-15);
        let starboard_down = Ship {
            roll_rad: 0.1,
            heading_rad: 2.0,
            ..Ship::default()
        }
        .attitude();
        assert!(((starboard_down * Vector3::x()).z + 0.1_f64.sin()).abs() < 1e-15);
    }

    /// At rest on the northern half, north gyro sees Ω cos L and the up gyro Ω sin L; the accelerometer sees gravity up.
    #[test]
    fn rest_shows_earth_rate_and_gravity() {
        let ship = Ship::default();
        let (state, omega) = (ship.at(0.0), crate::earth::EARTH_RATE_RAD_S);
        let expected = omega * Vector3::new(0.0, ship.latitude_rad.cos(), ship.latitude_rad.sin());
        assert!((state.angular_rate - expected).norm() < 1e-18);
        assert!((state.specific_force.z - 9.8069).abs() < 1e-3);
    }

    /// A latitude beyond the pole is refused by name.
    #[test]
    fn ranges_are_checked() {
        let ship = Ship {
            latitude_rad: 2.0,
            ..Ship::default()
        };
        assert!(
            ship.validate()
                .is_err_and(|e| e.to_string().contains("latitude"))
        );
        let ship = Ship {
            roll_rad: f64::NAN,
            ..Ship::default()
        };
        assert!(ship.validate().is_err());
    }
}
