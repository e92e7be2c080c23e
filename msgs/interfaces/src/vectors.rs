//! Vectors and quaternions of messages as those of nalgebra, and back.

use nalgebra::{Quaternion as RawQuaternion, UnitQuaternion, Vector3};

use crate::geometry_msgs;

impl From<geometry_msgs::Vector3> for Vector3<f64> {
    fn from(v: geometry_msgs::Vector3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<Vector3<f64>> for geometry_msgs::Vector3 {
    fn from(v: Vector3<f64>) -> Self {
        Self {
            x: v.x,
            y: v.y,
            z: v.z,
        }
    }
}

impl From<UnitQuaternion<f64>> for geometry_msgs::Quaternion {
    fn from(q: UnitQuaternion<f64>) -> Self {
        Self {
            x: q.i,
            y: q.j,
            z: q.k,
            w: q.w,
        }
    }
}

impl geometry_msgs::Quaternion {
    /// As a rotation, normalised; `None` where it is zero or not finite.
    pub fn rotation(&self) -> Option<UnitQuaternion<f64>> {
        let raw = RawQuaternion::new(self.w, self.x, self.y, self.z);
        let norm = raw.norm();
        (norm.is_finite() && norm > 0.0).then(|| UnitQuaternion::new_unchecked(raw / norm))
    }
}
