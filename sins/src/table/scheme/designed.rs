//! Schemes that `rotary-sins design-scheme` found. The manual (docs/schemes.md) has their figures.

use super::{About, Rotation, Scheme};
use crate::table::Axis::{X, Y};

impl Scheme {
    /// Ten rotations about x and y for the paper's thirteen states, by the search's first version: at its worst heading
    /// azimuth 10.7 arcsec after 4 h, drifts below 0.002 deg/h after 0.71 h, biases below 10 ug after 0.31 h (noise D).
    pub fn designed() -> Self {
        let rotations = [
            (X, -180.0),
            (Y, 270.0),
            (Y, -180.0),
            (Y, -270.0),
            (X, 180.0),
            (Y, 180.0),
            (X, 360.0),
            (Y, 180.0),
            (X, -360.0),
            (Y, -180.0),
        ];
        let rotation = |(axis, deg): (_, f64)| Rotation::new(About::Axis(axis), deg.to_radians());
        Self::new("designed", rotations.map(rotation).to_vec())
    }
}
