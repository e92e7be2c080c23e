//! The two-axis table: which body axis each joint turns about, and the attitude that joint angles make.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::time::Stamp;

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

/// A joint of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Joint {
    /// Fixed in the ship.
    Outer = 0,
    /// Carried by the outer one.
    Inner = 1,
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
        Self { outer: Axis::X, inner: Axis::Y }
    }
}

impl Turntable {
    /// Rotation of the block (b) against the ship (v) at joint `angles` (outer, inner) \[rad\]: `v = C_b^v b`.
    pub fn attitude(&self, angles: [f64; 2]) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.outer.unit() * angles[0])
            * UnitQuaternion::from_scaled_axis(self.inner.unit() * angles[1])
    }
}

/// The encoders' reading of both joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSample {
    /// When the joints stood there.
    pub stamp: Stamp,
    /// Angles (outer, inner), continuous \[rad\].
    pub position: [f64; 2],
    /// Rates (outer, inner) \[rad/s\].
    pub velocity: [f64; 2],
}

/// One point of a joint trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// From the start of the trajectory \[ns\].
    pub time_from_start_nanos: i64,
    /// Angles (outer, inner) \[rad\].
    pub position: [f64; 2],
    /// Rates (outer, inner) \[rad/s\].
    pub velocity: [f64; 2],
}

/// A motion of both joints, cubic Hermite between points (what a ros2_control joint_trajectory_controller does with
/// positions and velocities). A trapezoid of rate is four points, and the cubic through them is that trapezoid exactly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// The points in order of time; an empty trajectory means: stop where you are.
    pub points: Vec<TrajectoryPoint>,
}
