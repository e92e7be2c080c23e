//! The tree of frames that stands aboard: earth → map → odom → base_link → outer link → inner link → block.
//!
//! - `earth` is Earth-Centred-Earth-Fixed, `map` East-North-Up at the origin of the odometry (REP-105); `odom` is the same frame, for this system
//!   has no jumps to keep out of it.
//! - The outer link turns with the outer joint against `base_link`; at zero its axes are the block's, right-forward-up.
//! - The inner link turns with the inner joint against the outer link; the block (`imu_link`) is fixed in it.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::earth::{ECCENTRICITY_SQUARED, LocalEarth};
use crate::rotation::base_link_to_block;
use crate::self_calibration::PositionFix;
use crate::turntable::Turntable;

/// A child frame in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Origin of the child in the parent's axes \[m\].
    pub translation: Vector3<f64>,
    /// Turns vectors of the child into those of the parent.
    pub rotation: UnitQuaternion<f64>,
}

/// The outer link in `base_link` and the inner link in the outer one, at joint `angles` (outer, inner) \[rad\]. The origins of
/// all three are one point: the table's intersection of axes, where the block is taken to be.
pub fn table_links(table: &Turntable, angles: [f64; 2]) -> [Frame; 2] {
    let joint = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
    [
        base_link_to_block().inverse() * joint(table.outer.unit(), angles[0]),
        joint(table.inner.unit(), angles[1]),
    ]
    .map(|rotation| Frame {
        translation: Vector3::zeros(),
        rotation,
    })
}

/// The East-North-Up frame at `origin` in the Earth-Centred-Earth-Fixed one.
pub fn map_in_earth(origin: &PositionFix) -> Frame {
    let earth = LocalEarth::at(origin.latitude, origin.height);
    let (sin_longitude, cos_longitude) = origin.longitude.sin_cos();
    let (sin, cos) = (earth.sin_latitude, earth.cos_latitude);
    let polar = earth.transverse_radius_m
        - ECCENTRICITY_SQUARED * (earth.transverse_radius_m - origin.height);
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
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::earth::{EARTH_RATE_RAD_S, FLATTENING, SEMI_MAJOR_AXIS_M};
    use crate::turntable::Axis;

    /// Down the tree the block has the attitude that the navigator takes the ship's from.
    #[test]
    fn the_tree_ends_at_the_block() {
        let table = Turntable::new(Axis::Y, Axis::Z).unwrap();
        let angles = [0.7, -2.1];
        let [outer, inner] = table_links(&table, angles);
        let block_to_base = outer.rotation * inner.rotation;
        let expected = base_link_to_block().inverse() * table.attitude(angles);
        assert!(block_to_base.angle_to(&expected) < 1e-12);
        // At zero the block's forward axis (y) is base_link's x.
        let [outer, inner] = table_links(&table, [0.0; 2]);
        let forward = outer.rotation * inner.rotation * Vector3::y();
        assert!((forward - Vector3::x()).norm() < 1e-12);
    }

    /// Poles and equator lie on the axes; the earth's rotation is about z; a metre up is a metre along the local vertical.
    #[test]
    fn map_stands_on_the_ellipsoid() {
        let at = |latitude: f64, longitude: f64, height: f64| {
            map_in_earth(&PositionFix {
                latitude,
                longitude,
                height,
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
