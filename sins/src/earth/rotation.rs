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
#[inline]
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
    use std::f64::consts::PI;

    use proptest::prelude::*;

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

    /// Any attitude: a random direction and angle of a rotation vector.
    fn attitudes() -> impl Strategy<Value = UnitQuaternion<f64>> {
        prop::array::uniform4(-1.0..1.0f64)
            .prop_filter("long enough to be normalized", |q| {
                q.iter().map(|part| part * part).sum::<f64>() > 1e-3
            })
            .prop_map(|[w, i, j, k]| {
                UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k))
            })
    }

    proptest! {
        /// An attitude has the angles that give it again, within what a pitch near ±90 deg leaves of them.
        #[test]
        fn attitude_to_angles_and_back(attitude in attitudes()) {
            let angles = HeadingPitchRoll::from_attitude(&attitude);
            prop_assert!((0.0..TAU).contains(&angles.heading));
            prop_assert!(angles.pitch.abs() <= FRAC_PI_2);
            // The arcsine has lost half of the digits where its argument is 1.
            prop_assert!(attitude.angle_to(&angles.attitude()) < 1e-7);
            if angles.pitch.cos() > 0.1 {
                prop_assert!(attitude.angle_to(&angles.attitude()) < 1e-13);
            }
        }

        /// Turning the ship about the vertical adds to her heading, and leaves pitch and roll.
        #[test]
        fn headings_add(heading in 0.0..TAU, turn in -TAU..TAU, pitch in -1.4..1.4f64, roll in -3.1..3.1f64) {
            let before = HeadingPitchRoll { heading, pitch, roll };
            let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -turn) * before.attitude();
            let after = HeadingPitchRoll::from_attitude(&turned);
            let off = (after.heading - heading - turn + PI).rem_euclid(TAU) - PI;
            prop_assert!(off.abs() < 1e-12, "{off}");
            prop_assert!((after.pitch - pitch).abs() < 1e-12 && (after.roll - roll).abs() < 1e-12);
        }

        /// A rotation vector and its opposite undo each other; halves about one axis make the whole; and a misalignment φ moves the
        /// attitude as C' = (I − φ×) C says.
        #[test]
        fn small_rotations_compose(vector in prop::array::uniform3(-0.03..0.03f64), attitude in attitudes()) {
            let vector = Vector3::from(vector);
            let rotation = small_rotation(&vector);
            prop_assert!((rotation.norm() - 1.0).abs() < 1e-15);
            prop_assert!((rotation * small_rotation(&-vector)).angle() < 1e-15);
            let half = small_rotation(&(vector / 2.0));
            prop_assert!((half * half).angle_to(&rotation) < 1e-15);
            let moved = small_rotation(&-vector) * attitude;
            let first_order = (Matrix3::identity() - skew(&vector)) * attitude.to_rotation_matrix().matrix();
            let off = (moved.to_rotation_matrix().matrix() - first_order).norm();
            prop_assert!(off <= vector.norm_squared(), "{off}");
        }
    }
}
