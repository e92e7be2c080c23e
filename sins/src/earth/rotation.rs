//! Attitude: conventions, small rotations, and the angles that a navigator reads.
//!
//! 1. Quaternions are Hamilton's, nalgebra's own `UnitQuaternion`; the attitude turns b into n: `v_n = q * v_b`.
//! 2. The navigation frame n is East-North-Up.
//! 3. The block frame b at zero joint angles is right-forward-up: at heading 0 its x is East, y North, z Up.
//! 4. Heading is that of the y axis, clockwise from true north, in \[0, 2π). Pitch is positive with y up, roll with x down
//!    (right side down). `C_b^n = R_z(−heading) R_x(pitch) R_y(roll)`.
//! 5. The vehicle frame `base_link` is forward-left-up (ROS REP-103): its x is the y of the block at zero joint angles.
//! 6. Misalignment φ: the calculated frame n' is n turned by φ, `C' = (I − φ×) C`.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Heading, pitch and roll \[rad\] by the conventions of this module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeadingPitchRoll {
    /// Clockwise from true north, 0..2π.
    pub heading: f64,
    /// Positive with the y axis above the horizon.
    pub pitch: f64,
    /// Positive with the x axis below the horizon.
    pub roll: f64,
}

impl HeadingPitchRoll {
    /// The angles of an attitude (b to n, ENU). At ±90° of pitch heading and roll are one angle; roll is then zero.
    pub fn from_attitude(attitude: &UnitQuaternion<f64>) -> Self {
        let c = attitude.to_rotation_matrix();
        let pitch = c[(2, 1)].clamp(-1.0, 1.0).asin();
        let (heading, roll) = if c[(2, 1)].abs() < 1.0 - 1e-12 {
            (c[(0, 1)].atan2(c[(1, 1)]), (-c[(2, 0)]).atan2(c[(2, 2)]))
        } else {
            ((-c[(1, 0)]).atan2(c[(0, 0)]), 0.0)
        };
        Self {
            heading: heading.rem_euclid(TAU),
            pitch,
            roll,
        }
    }

    /// One-sigma of the three angles \[rad\] for a ship near level at this heading, by the covariance of the misalignment (E, N, U)
    /// \[rad²\]: heading takes φ_U, pitch and roll take φ about the ship's own x and y.
    pub fn sigma(heading: f64, misalignment: &Matrix3<f64>) -> Self {
        let (sin, cos) = heading.sin_cos();
        let along =
            |axis: Vector3<f64>| (axis.transpose() * misalignment * axis)[0].max(0.0).sqrt();
        Self {
            heading: along(Vector3::z()),
            pitch: along(Vector3::new(cos, -sin, 0.0)),
            roll: along(Vector3::new(sin, cos, 0.0)),
        }
    }

    /// The attitude (b to n, ENU) that has these angles.
    pub fn attitude(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -self.heading)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.pitch)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.roll)
    }
}

/// The rotation that turns `base_link` (forward-left-up) into the block frame at zero joint angles (right-forward-up).
pub fn base_link_to_block() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2)
}

/// The matrix of the cross product, `skew(a) b = a × b`.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    a.cross_matrix()
}

/// The rotation of a rotation vector \[rad\]. The same as nalgebra's `from_scaled_axis`, without its division by the angle
/// for the small angles of one sampling interval (series to the sixth order, exact in f64 below 0.05 rad).
pub fn small_rotation(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle2 = vector.norm_squared();
    if angle2 > 0.0025 {
        return UnitQuaternion::from_scaled_axis(*vector);
    }
    let h2 = 0.25 * angle2;
    let cos = 1.0 - h2 * (0.5 - h2 * (1.0 / 24.0 - h2 / 720.0));
    let sinc = 0.5 * (1.0 - h2 * (1.0 / 6.0 - h2 * (1.0 / 120.0 - h2 / 5040.0)));
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::from_parts(cos, vector * sinc))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heading 90 points the y axis (bow) east and the x axis (starboard) south.
    #[test]
    fn heading_turns_clockwise() {
        let q = HeadingPitchRoll {
            heading: FRAC_PI_2,
            pitch: 0.0,
            roll: 0.0,
        }
        .attitude();
        assert!((q * Vector3::y() - Vector3::x()).norm() < 1e-15);
        assert!((q * Vector3::x() + Vector3::y()).norm() < 1e-15);
    }

    /// Bow up is positive pitch, starboard down is positive roll.
    #[test]
    fn signs_of_pitch_and_roll() {
        let up = HeadingPitchRoll {
            heading: 0.3,
            pitch: 0.1,
            roll: 0.0,
        }
        .attitude();
        assert!((up * Vector3::y()).z > 0.0);
        let heeled = HeadingPitchRoll {
            heading: 0.3,
            pitch: 0.0,
            roll: 0.1,
        }
        .attitude();
        assert!((heeled * Vector3::x()).z < 0.0);
    }

    /// Angles to attitude and back.
    #[test]
    fn angles_round_trip() {
        let angles = HeadingPitchRoll {
            heading: 5.9,
            pitch: -0.4,
            roll: 2.8,
        };
        let back = HeadingPitchRoll::from_attitude(&angles.attitude());
        assert!(
            (back.heading - 5.9).abs() < 1e-12
                && (back.pitch + 0.4).abs() < 1e-12
                && (back.roll - 2.8).abs() < 1e-12
        );
    }

    /// base_link's x (forward) is the block's y.
    #[test]
    fn base_link_is_forward_left_up() {
        assert!((base_link_to_block() * Vector3::x() - Vector3::y()).norm() < 1e-15);
        assert!((base_link_to_block() * Vector3::y() + Vector3::x()).norm() < 1e-15);
    }

    /// The series of a small rotation is nalgebra's exact one, up to and across the switch.
    #[test]
    fn small_rotation_is_exact() {
        for scale in [0.0, 1e-9, 1e-4, 0.03, 0.06] {
            let v = Vector3::new(0.6, -0.64, 0.48) * scale;
            let exact = UnitQuaternion::from_scaled_axis(v);
            assert!(
                (small_rotation(&v).coords - exact.coords).norm() < 3e-16,
                "{scale}"
            );
        }
    }
}
