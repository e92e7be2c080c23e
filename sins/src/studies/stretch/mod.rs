//! What a stretch of a run does to a covariance: dwells and rotations as elements that join, for every study that looks at many
//! schemes or ahead.

mod element;
mod space;
mod way;

pub(in crate::studies) use element::{Element, Scratch};
pub(in crate::studies) use way::{EncodersRead, Way, motion, rotation_element};

pub use space::Space;
pub use way::{Measurements, Physics, States};
