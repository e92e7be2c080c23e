//! The two-axis table: which body axis each joint turns about, and the attitude that joint angles make.

use std::fmt;
use std::str::FromStr;

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::time::Stamp;

pub mod errors;
pub mod links;
#[cfg(test)]
mod properties;
pub mod scheme;
mod tolerance;
mod trajectory;
mod waypoints;

pub use errors::{AttitudeDerivatives, TableErrors};
pub use tolerance::{JointTolerance, violation};
pub use trajectory::{Cubic, JointState, Trajectory, TrajectoryPoint};
pub use waypoints::{Waypoint, Waypoints};

/// Names of the joints in every message, outer first.
pub const JOINT_NAMES: [&str; 2] = ["outer_joint", "inner_joint"];

/// An axis of the block, at zero joint angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Right, where heading counts from y.
    X,
    /// Forward.
    Y,
    /// Up.
    Z,
}

impl Axis {
    /// The unit vector of this axis.
    pub fn unit(self) -> Vector3<f64> {
        match self {
            Self::X => Vector3::x(),
            Self::Y => Vector3::y(),
            Self::Z => Vector3::z(),
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

impl FromStr for Axis {
    type Err = Error;

    /// `x`, `y` or `z`.
    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "x" => Ok(Self::X),
            "y" => Ok(Self::Y),
            "z" => Ok(Self::Z),
            other => Err(Error::setting("axis", other, "x, y or z")),
        }
    }
}

/// A joint of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Joint {
    /// Fixed in the ship.
    Outer = 0,
    /// Carried by the outer one.
    Inner = 1,
}

impl Joint {
    /// Place of this joint in every pair of joint values.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Name of this joint in every message.
    pub const fn name(self) -> &'static str {
        JOINT_NAMES[self as usize]
    }
}

/// Which body axis each joint turns about. Default: outer x, inner y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Turntable {
    /// Axis of the outer joint, fixed in the ship.
    pub outer: Axis,
    /// Axis of the inner joint, carried by the outer one.
    pub inner: Axis,
}

impl Default for Turntable {
    fn default() -> Self {
        Self {
            outer: Axis::X,
            inner: Axis::Y,
        }
    }
}

impl Turntable {
    /// A table whose joints turn about these axes of the block (at zero joint angles).
    ///
    /// # Errors
    /// [`Error::Setting`] where both are the same axis.
    pub fn new(outer: Axis, inner: Axis) -> Result<Self, Error> {
        if outer == inner {
            return Err(Error::setting(
                "axis of the inner joint",
                inner,
                format!("an axis that is not the outer one ({outer})"),
            ));
        }
        Ok(Self { outer, inner })
    }

    /// The joint that turns about `axis`, if one does.
    pub fn joint_about(&self, axis: Axis) -> Option<Joint> {
        if axis == self.outer {
            Some(Joint::Outer)
        } else if axis == self.inner {
            Some(Joint::Inner)
        } else {
            None
        }
    }

    /// Rate of the block against the ship, in the axes of the block \[rad/s\]:
    /// ω = `R_innerᵀ` `e_outer` `θ̇_outer` + `e_inner` `θ̇_inner`, at joint `angles` \[rad\] and `rates` \[rad/s\] (outer, inner).
    pub fn body_rate(&self, angles: [f64; 2], rates: [f64; 2]) -> Vector3<f64> {
        let inner = self.inner.unit();
        let unturn = UnitQuaternion::from_scaled_axis(-inner * angles[1]);
        unturn * self.outer.unit() * rates[0] + inner * rates[1]
    }

    /// Rotation of the block (b) against the ship (v) at joint `angles` (outer, inner) \[rad\]: `v = C_b^v b`.
    pub fn attitude(&self, angles: [f64; 2]) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.outer.unit() * angles[0])
            * UnitQuaternion::from_scaled_axis(self.inner.unit() * angles[1])
    }
}

/// The encoders' reading of both joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointSample {
    /// When the joints stood there.
    pub stamp: Stamp,
    /// Angles (outer, inner), continuous \[rad\].
    pub position: [f64; 2],
    /// Rates (outer, inner) \[rad/s\].
    pub velocity: [f64; 2],
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The body rate is the derivative of the attitude, in every gimbal order.
    #[test]
    fn body_rate_is_the_derivative_of_attitude() {
        for (outer, inner) in [
            (Axis::X, Axis::Y),
            (Axis::Y, Axis::X),
            (Axis::Y, Axis::Z),
            (Axis::Z, Axis::X),
        ] {
            let table = Turntable::new(outer, inner).unwrap();
            let (angles, rates, h) = ([0.7, -1.9], [0.3, -0.8], 1e-5);
            let at = |t: f64| table.attitude([angles[0] + rates[0] * t, angles[1] + rates[1] * t]);
            let numerical = (at(-h).inverse() * at(h)).scaled_axis() / (2.0 * h);
            assert!((numerical - table.body_rate(angles, rates)).norm() < 1e-9);
        }
    }

    /// Two joints about one axis are no two-axis table.
    #[test]
    fn axes_must_differ() {
        let message = Turntable::new(Axis::Y, Axis::Y).unwrap_err().to_string();
        assert!(message.contains("inner joint is y"), "{message}");
    }

    /// A scheme asks for axes; the table says which joint has them.
    #[test]
    fn joints_are_found_by_axis() {
        let table = Turntable::default();
        assert_eq!(table.joint_about(Axis::X), Some(Joint::Outer));
        assert_eq!(table.joint_about(Axis::Y), Some(Joint::Inner));
        assert_eq!(table.joint_about(Axis::Z), None);
    }
}
