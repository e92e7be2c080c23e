//! The WGS-84 earth: radii of curvature, normal gravity, and the rates of the local-level frame.
//!
//! Vectors are in the navigation frame n, East-North-Up.

pub mod frames;
pub mod position;
pub mod rotation;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub use position::Position;

/// Rotation rate of the earth, WGS-84 \[rad/s\].
pub const EARTH_RATE_RAD_S: f64 = 7.292_115e-5;
/// Semi-major axis, WGS-84 \[m\].
pub const SEMI_MAJOR_AXIS_M: f64 = 6_378_137.0;
/// Flattening, WGS-84.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared, f(2 − f).
pub const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);
/// Standard gravity; the `g` of the field unit ug \[m/s²\].
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
/// Normal gravity at the equator, WGS-84 \[m/s²\].
const EQUATORIAL_GRAVITY_M_S2: f64 = 9.780_325_335_9;
/// Somigliana's constant k = (b γ_p − a γ_e) / (a γ_e), WGS-84.
const SOMIGLIANA: f64 = 0.001_931_852_652_41;
/// m = ω² a² b / GM, WGS-84.
const CENTRIFUGAL_RATIO: f64 = 0.003_449_786_506_84;

/// Normal gravity on the ellipsoid (Somigliana's closed form) with the second-order free-air series in height
/// (NIMA TR8350.2, equations 4-1 and 4-3). Positive downwards \[m/s²\].
pub fn normal_gravity(latitude_rad: f64, height_m: f64) -> f64 {
    let sin2 = latitude_rad.sin().powi(2);
    let on_ellipsoid = EQUATORIAL_GRAVITY_M_S2 * (1.0 + SOMIGLIANA * sin2)
        / (1.0 - ECCENTRICITY_SQUARED * sin2).sqrt();
    let ratio = height_m / SEMI_MAJOR_AXIS_M;
    on_ellipsoid
        * (1.0 - 2.0 * ratio * (1.0 + FLATTENING + CENTRIFUGAL_RATIO - 2.0 * FLATTENING * sin2)
            + 3.0 * ratio * ratio)
}

/// What the earth is like at one place: everything the mechanization and the error model need there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalEarth {
    /// sin L.
    pub sin_latitude: f64,
    /// cos L.
    pub cos_latitude: f64,
    /// Meridian radius of curvature plus height, R_M + h \[m\].
    pub meridian_radius_m: f64,
    /// Prime-vertical radius of curvature plus height, R_N + h \[m\].
    pub transverse_radius_m: f64,
    /// 1/(R_M + h) \[1/m\]: the mechanization needs it at every sample, and a product is cheaper than a quotient.
    pub meridian_curvature_per_m: f64,
    /// 1/(R_N + h) \[1/m\].
    pub transverse_curvature_per_m: f64,
    /// tan L.
    pub tan_latitude: f64,
    /// dR_M/dL \[m/rad\].
    pub meridian_radius_slope_m: f64,
    /// dR_N/dL \[m/rad\].
    pub transverse_radius_slope_m: f64,
    /// Normal gravity, positive downwards \[m/s²\].
    pub gravity_m_s2: f64,
    /// How normal gravity changes with height \[1/s²\]; negative.
    pub gravity_gradient_per_s2: f64,
}

impl LocalEarth {
    /// The earth at a geodetic latitude \[rad\] and height above the ellipsoid \[m\].
    pub fn at(latitude_rad: f64, height_m: f64) -> Self {
        let (sin_latitude, cos_latitude) = latitude_rad.sin_cos();
        let w2 = 1.0 - ECCENTRICITY_SQUARED * sin_latitude * sin_latitude;
        let transverse = SEMI_MAJOR_AXIS_M / w2.sqrt();
        let meridian = transverse * (1.0 - ECCENTRICITY_SQUARED) / w2;
        let slope = ECCENTRICITY_SQUARED * sin_latitude * cos_latitude / w2;
        Self {
            sin_latitude,
            cos_latitude,
            meridian_radius_m: meridian + height_m,
            transverse_radius_m: transverse + height_m,
            meridian_curvature_per_m: (meridian + height_m).recip(),
            transverse_curvature_per_m: (transverse + height_m).recip(),
            tan_latitude: sin_latitude / cos_latitude,
            meridian_radius_slope_m: 3.0 * meridian * slope,
            transverse_radius_slope_m: transverse * slope,
            gravity_m_s2: normal_gravity(latitude_rad, height_m),
            gravity_gradient_per_s2: 0.5
                * (normal_gravity(latitude_rad, height_m + 1.0)
                    - normal_gravity(latitude_rad, height_m - 1.0)),
        }
    }

    /// Earth rate in n, ω_ie = Ω (0, cos L, sin L) \[rad/s\].
    #[inline]
    pub fn earth_rate(&self) -> Vector3<f64> {
        EARTH_RATE_RAD_S * Vector3::new(0.0, self.cos_latitude, self.sin_latitude)
    }

    /// Transport rate in n at velocity `v` (E, N, U), ω_en = (−v_N/(R_M+h), v_E/(R_N+h), v_E tan L/(R_N+h)) \[rad/s\].
    #[inline]
    pub fn transport_rate(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let east = v.x * self.transverse_curvature_per_m;
        Vector3::new(
            -v.y * self.meridian_curvature_per_m,
            east,
            east * self.tan_latitude,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal gravity at the equator, 45° and the pole, and its decrease with height, against the published WGS-84 values.
    #[test]
    fn gravity_agrees_with_published_values() {
        assert!((normal_gravity(0.0, 0.0) - 9.780_325_335_9).abs() < 1e-10);
        assert!((normal_gravity(45f64.to_radians(), 0.0) - 9.806_197_769).abs() < 1e-8);
        assert!((normal_gravity(90f64.to_radians(), 0.0) - 9.832_184_937_8).abs() < 1e-9);
        let slope = (normal_gravity(0.8, 100.0) - normal_gravity(0.8, 0.0)) / 100.0;
        assert!((slope + 3.086e-6).abs() < 1e-8, "{slope}");
    }

    /// At the equator R_M = a(1 − e²) and R_N = a; at the pole both are a²/b.
    #[test]
    fn radii_at_equator_and_pole() {
        let equator = LocalEarth::at(0.0, 0.0);
        assert!((equator.transverse_radius_m - SEMI_MAJOR_AXIS_M).abs() < 1e-6);
        assert!((equator.meridian_radius_m - 6_335_439.327).abs() < 1e-2);
        let pole = LocalEarth::at(std::f64::consts::FRAC_PI_2, 0.0);
        assert!((pole.meridian_radius_m - 6_399_593.626).abs() < 1e-2);
        assert!((pole.transverse_radius_m - 6_399_593.626).abs() < 1e-2);
    }

    /// The slopes of the radii are their derivatives.
    #[test]
    fn radius_slopes_are_derivatives() {
        let (l, d) = (0.7, 1e-5);
        let (low, high, mid) = (
            LocalEarth::at(l - d, 20.0),
            LocalEarth::at(l + d, 20.0),
            LocalEarth::at(l, 20.0),
        );
        let meridian = (high.meridian_radius_m - low.meridian_radius_m) / (2.0 * d);
        let transverse = (high.transverse_radius_m - low.transverse_radius_m) / (2.0 * d);
        assert!((meridian / mid.meridian_radius_slope_m - 1.0).abs() < 1e-6);
        assert!((transverse / mid.transverse_radius_slope_m - 1.0).abs() < 1e-6);
    }
}
