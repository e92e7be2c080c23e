//! Errors of the table and the attitude of its base, which encoders show: they couple into nothing and stand still.
//!
//! The outer encoder's zero is no state: it is the base's attitude.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval};
use crate::estimation::installation::Installation;
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::units::ARC_SECOND;

/// What is known before of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// One-sigma of the non-orthogonality \[rad\].
    pub nonorthogonality_rad: f64,
    /// One-sigma of the inner axis' tilts in the block \[rad\].
    pub inner_axis_tilt_rad: f64,
    /// One-sigma of the inner encoder's zero \[rad\].
    pub encoder_zero_rad: f64,
    /// One-sigma of sine and cosine of the encoders' eccentricities \[rad\].
    pub encoder_eccentricity_rad: f64,
}

const fn label(name: &'static str, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(name, symbol, words, "arcsec", ARC_SECOND)
}

impl Group for Table {
    const LABELS: &'static [StateLabel] = &[
        label("table_nonorthogonality_rad", "γ", "table non-orthogonality"),
        label("inner_axis_tilt_1_rad", "τ1", "inner axis tilt 1"),
        label("inner_axis_tilt_2_rad", "τ2", "inner axis tilt 2"),
        label("encoder_zero_inner_rad", "zi", "inner encoder zero"),
        label(
            "encoder_eccentricity_outer_sine_rad",
            "sο",
            "outer encoder eccentricity, sine",
        ),
        label(
            "encoder_eccentricity_outer_cosine_rad",
            "co",
            "outer encoder eccentricity, cosine",
        ),
        label(
            "encoder_eccentricity_inner_sine_rad",
            "si",
            "inner encoder eccentricity, sine",
        ),
        label(
            "encoder_eccentricity_inner_cosine_rad",
            "ci",
            "inner encoder eccentricity, cosine",
        ),
    ];
    const OF_TABLE: bool = true;

    type Gathered = ();

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma[0] = self.nonorthogonality_rad;
        sigma[1..3].fill(self.inner_axis_tilt_rad);
        sigma[3] = self.encoder_zero_rad;
        sigma[4..].fill(self.encoder_eccentricity_rad);
    }

    fn couple(&self, (): &(), _interval: &Interval, _into: &mut Coupling<'_>) {}

    fn correct_installation(x: &[f64], installation: &mut Installation) {
        let errors = &mut installation.table;
        errors.nonorthogonality_rad += x[0];
        errors.inner_axis_tilt_rad[0] += x[1];
        errors.inner_axis_tilt_rad[1] += x[2];
        errors.encoder_zero_inner_rad += x[3];
        for side in 0..2 {
            errors.encoder_eccentricity_outer_rad[side] += x[4 + side];
            errors.encoder_eccentricity_inner_rad[side] += x[6 + side];
        }
    }

    fn found_of_installation(installation: &Installation, x: &mut [f64]) {
        let errors = &installation.table;
        x[0] = errors.nonorthogonality_rad;
        x[1..3].copy_from_slice(&errors.inner_axis_tilt_rad);
        x[3] = errors.encoder_zero_inner_rad;
        x[4..6].copy_from_slice(&errors.encoder_eccentricity_outer_rad);
        x[6..8].copy_from_slice(&errors.encoder_eccentricity_inner_rad);
    }
}

/// Names of the errors of the base's attitude about east, north and up.
pub const BASE_ATTITUDE: [&str; 3] = [
    "base_attitude_east_rad",
    "base_attitude_north_rad",
    "base_attitude_up_rad",
];

/// The base's attitude error ψ: the calculated base stands at B' = (I − ψ×) B. Nothing is known of it before encoders begin,
/// and then it walks as much as the ship moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseAttitude {
    /// Walk, density \[rad/√s\].
    pub walk_rad_sqrt_s: f64,
}

impl Group for BaseAttitude {
    const LABELS: &'static [StateLabel] = &[
        label(BASE_ATTITUDE[0], "ψE", "base attitude east"),
        label(BASE_ATTITUDE[1], "ψN", "base attitude north"),
        label(BASE_ATTITUDE[2], "ψU", "base attitude up"),
    ];
    const OF_BASE: bool = true;

    type Gathered = ();

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma.fill(0.0);
    }

    fn walk(&self, rate: &mut [f64]) {
        rate.fill(self.walk_rad_sqrt_s.powi(2));
    }

    fn couple(&self, (): &(), _interval: &Interval, _into: &mut Coupling<'_>) {}

    fn correct_installation(x: &[f64], installation: &mut Installation) {
        if let Some(base) = &mut installation.base {
            let turn = Vector3::from_column_slice(x);
            *base = UnitQuaternion::from_scaled_axis(turn) * *base;
        }
    }
}
