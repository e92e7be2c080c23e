//! The links of the table as frames: outer link in `base_link`, inner link in the outer one.
//!
//! - The outer link turns with the outer joint against `base_link`; at zero its axes are the block's, right-forward-up.
//! - The inner link turns with the inner joint against the outer link; the block (`imu_link`) is fixed in it.

use nalgebra::{UnitQuaternion, Vector3};

use super::Turntable;
use crate::earth::frames::Frame;
use crate::earth::rotation::base_link_to_block;

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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::Axis;

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
}
