//! The groups of error states, a file each.

pub mod bias;
pub mod navigation;
pub mod scale;
