//! What the block and the antenna are fixed to, as far as it has been found.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::table::TableErrors;

/// What has been found of what is fixed in the ship: the table that carries the block, its base, the antenna.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Installation {
    /// Errors of the table's axes and encoders.
    pub table: TableErrors,
    /// Attitude of the table's base: turns the axes that the block has at zero joints into n. None until encoders have been
    /// used.
    pub base: Option<UnitQuaternion<f64>>,
    /// What is to be added to the antenna's arm as it was told, in the ship: starboard, forward, up \[m\].
    pub antenna_arm_m: Vector3<f64>,
}
