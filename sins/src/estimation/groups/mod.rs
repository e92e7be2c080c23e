//! The groups of error states, a file each.

pub mod antenna;
pub mod arms;
pub mod bias;
pub mod delay;
pub mod g_sensitivity;
pub mod navigation;
pub mod quadratic;
pub mod scale;
pub mod table;
pub mod vertical;
