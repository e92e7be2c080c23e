//! Frames of the earth, and a frame in its parent.
//!
//! The tree that stands aboard is earth → map → odom → base_link → outer link → inner link → block. `earth` is
//! Earth-Centred-Earth-Fixed, `map` East-North-Up at the origin of the odometry (REP-105); `odom` is the same frame, for this
//! system has no jumps to keep out of it. The links of the table are in [`crate::table::links`].

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::position::Position;
use super::{ECCENTRICITY_SQUARED, LocalEarth};

/// A child frame in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Origin of the child in the parent's axes \[m\].
    pub translation: Vector3<f64>,
    /// Turns vectors of the child into those of the parent.
    pub rotation: UnitQuaternion<f64>,
}

/// The East-North-Up frame at `origin` in the Earth-Centred-Earth-Fixed one.
pub fn map_in_earth(origin: &Position) -> Frame {
    let earth = LocalEarth::at(origin.latitude_rad, origin.height_m);
    let (sin_longitude, cos_longitude) = origin.longitude_rad.sin_cos();
    let (sin, cos) = (earth.sin_latitude, earth.cos_latitude);
    let polar = earth.transverse_radius_m
        - ECCENTRICITY_SQUARED * (earth.transverse_radius_m - origin.height_m);
    let east = Vector3::new(-sin_longitude, cos_longitude, 0.0);
    let north = Vector3::new(-sin * cos_longitude, -sin * sin_longitude, cos);
    let up = Vector3::new(cos * cos_longitude, cos * sin_longitude, sin);
    Frame {
        translation: Vector3::new(
            earth.transverse_radius_m * up.x,
            earth.transverse_radius_m * up.y,
            polar * sin,
        ),
        rotation: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
            Matrix3::from_columns(&[east, north, up]),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::{EARTH_RATE_RAD_S, FLATTENING, SEMI_MAJOR_AXIS_M};

    /// Poles and equator lie on the axes; the earth's rotation is about z; a metre up is a metre along the local vertical.
    #[test]
    fn map_stands_on_the_ellipsoid() {
        let at = |latitude: f64, longitude: f64, height: f64| {
            map_in_earth(&Position {
                latitude_rad: latitude,
                longitude_rad: longitude,
                height_m: height,
            })
        };
        let b = SEMI_MAJOR_AXIS_M * (1.0 - FLATTENING);
        let pole = at(std::f64::consts::FRAC_PI_2, 0.3, 10.0).translation;
        assert!(
            (pole - Vector3::new(0.0, 0.0, b + 10.0)).norm() < 1e-6,
            "{pole}"
        );
        let equator = at(0.0, std::f64::consts::FRAC_PI_2, 5.0).translation;
        assert!((equator - Vector3::new(0.0, SEMI_MAJOR_AXIS_M + 5.0, 0.0)).norm() < 1e-6);
        let (low, high) = (at(0.8, 2.0, 0.0), at(0.8, 2.0, 1.0));
        let up = low.rotation * Vector3::z();
        assert!((high.translation - low.translation - up).norm() < 1e-8);
        let rate = low.rotation * LocalEarth::at(0.8, 0.0).earth_rate();
        assert!((rate - Vector3::z() * EARTH_RATE_RAD_S).norm() < 1e-18);
    }
}
