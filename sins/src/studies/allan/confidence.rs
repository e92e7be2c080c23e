//! How sure an Allan variance is: equivalent degrees of freedom by the type of noise.
//!
//! Greenhall and Riley 2003, "Uncertainty of stability variances based on finite differences"; NIST SP 1065, 5.4.1. The
//! sums are taken as they are: there are at most [`DENSEST`](super::deviation::DENSEST) starts an averaging time, so
//! that no approximation for many of them is needed.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Order of the difference: Allan's is the second of the phase.
const ORDER: u64 = 2;
/// From this averaging factor on, samples count as infinitely short against the averaging time.
const CONTINUOUS: u64 = 32;
/// From so many degrees on the cube root of chi-square is normal to five digits (Wilson and Hilferty 1931).
const MANY_DEGREES: f64 = 300.0;

/// A type of noise, by the exponent of its spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseType {
    /// White noise of the angle or velocity: what rounding to increments leaves.
    Quantization,
    /// White noise of the rate or force.
    White,
    /// Flicker: bias instability.
    Flicker,
    /// A walk of the rate or force.
    Walk,
}

impl NoiseType {
    /// Exponent α of the spectrum of the rate, f^α.
    pub fn exponent(self) -> i32 {
        match self {
            Self::Quantization => 2,
            Self::White => 0,
            Self::Flicker => -1,
            Self::Walk => -2,
        }
    }
}

/// Equivalent degrees of freedom of an overlapping Allan variance with this averaging factor, which has so many starts
/// an averaging time and so many terms in all.
pub fn degrees_of_freedom(noise: NoiseType, factor: u64, starts: u64, terms: u64) -> f64 {
    let (starts, terms) = (starts.max(1), terms.max(1));
    let near = terms.min((ORDER + 1) * starts);
    let alpha = noise.exponent();
    let z = |lag: u64| covariance(lag as f64 / starts as f64, factor, alpha);
    let zero = z(0);
    let share = |lag: u64| 1.0 - lag as f64 / terms as f64;
    let edge = z(near);
    let sum = zero * zero
        + share(near) * edge * edge
        + 2.0
            * (1..near)
                .map(|lag| share(lag) * z(lag).powi(2))
                .sum::<f64>();
    terms as f64 * zero * zero / sum
}

/// Covariance of two second differences whose starts are `t` averaging times apart; its scale does not matter.
fn covariance(t: f64, factor: u64, alpha: i32) -> f64 {
    let x = |t: f64| of_phase(t, factor, alpha);
    6.0 * x(t) - 4.0 * (x(t - 1.0) + x(t + 1.0)) + x(t - 2.0) + x(t + 2.0)
}

/// The generalized autocovariance of the phase.
fn of_phase(t: f64, factor: u64, alpha: i32) -> f64 {
    if alpha == NoiseType::Quantization.exponent() {
        // White: nothing but itself, to half a sample.
        return f64::from(u8::from(t.abs() * (factor as f64) < 0.5));
    }
    if factor >= CONTINUOUS {
        return spectral(t, alpha + 2);
    }
    let sample = 1.0 / factor as f64;
    let square = (factor * factor) as f64;
    square * (2.0 * spectral(t, alpha) - spectral(t - sample, alpha) - spectral(t + sample, alpha))
}

/// s_w(t, α) of the reference.
fn spectral(t: f64, alpha: i32) -> f64 {
    let t = t.abs();
    let logarithm = if t > 0.0 { t.ln() } else { 0.0 };
    match alpha {
        2 => -t,
        1 => t * t * logarithm,
        0 => t.powi(3),
        -1 => -t.powi(4) * logarithm,
        _ => -t.powi(5),
    }
}

/// The ends between which the true deviation lies with probability `confidence`, by what was found.
pub fn band(deviation: f64, degrees: f64, confidence: f64) -> [f64; 2] {
    let tail = 0.5 * (1.0 - confidence);
    [1.0 - tail, tail].map(|p| deviation * (degrees / chi_square(degrees, p)).sqrt())
}

fn chi_square(degrees: f64, probability: f64) -> f64 {
    if degrees < MANY_DEGREES {
        return ChiSquared::new(degrees).map_or(f64::NAN, |d| d.inverse_cdf(probability));
    }
    let normal = statrs::distribution::Normal::standard().inverse_cdf(probability);
    let c = 2.0 / (9.0 * degrees);
    degrees * (1.0 - c + normal * c.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// What `allantools.edf_greenhall(alpha, d=2, m, N, overlapping=True)` of PyPI gives (2024.6), with N the number of
    /// phases; it takes approximations where there are more than a hundred starts.
    #[test]
    fn degrees_are_those_of_an_independent_program() {
        use NoiseType::{Flicker, Quantization, Walk, White};
        for (noise, factor, phases, wanted) in [
            (White, 1, 1001, 782.03),
            (White, 8, 1001, 165.988),
            (White, 64, 1001, 21.2395),
            (Flicker, 8, 1001, 143.288),
            (Walk, 8, 1001, 114.023),
            (Quantization, 8, 1001, 508.696),
            (White, 256, 100_001, 583.694),
            (Flicker, 1024, 100_001, 112.793),
            (Walk, 1024, 100_001, 88.9708),
            (Quantization, 64, 100_001, 51_380.19),
        ] {
            let terms = phases - 2 * factor;
            let degrees = degrees_of_freedom(noise, factor, factor, terms);
            assert!(
                (degrees / wanted - 1.0).abs() < 0.03,
                "{noise:?} {factor}: {degrees}, {wanted}"
            );
        }
    }

    /// Bands are those of chi-square, and both ways to it agree where they meet.
    #[test]
    fn bands_are_those_of_chi_square() {
        // 10 degrees: 3.247 and 20.483 leave 2.5 % on either side.
        let [lower, upper] = band(1.0, 10.0, 0.95);
        assert!((lower - (10.0_f64 / 20.483).sqrt()).abs() < 1e-4);
        assert!((upper - (10.0_f64 / 3.247).sqrt()).abs() < 1e-4);
        let [near, far] = [MANY_DEGREES - 1e-9, MANY_DEGREES].map(|d| band(1.0, d, 0.95));
        assert!((near[0] - far[0]).abs() < 1e-5 && (near[1] - far[1]).abs() < 1e-5);
    }
}
