//! The noise of the sensors from a bag at rest, as values, text, JSON, pictures and a parameter file.

mod figures;
mod page;
mod parameters;
mod summary;
mod text;

pub use figures::figures;
pub use page::page;
pub use parameters::{NodeNoise, parameter_file};
pub use sins::studies::allan::{Allan, AllanResult, AllanSettings};
pub use summary::{AxisReport, CoefficientReport, Report, report};
pub use text::text;

use sins::studies::allan::confidence::NoiseType;
use sins::units::{ARC_SECOND, DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G};

/// How people write a quantity: unit, and how much one of it is in SI.
#[derive(Clone, Copy, Debug)]
struct FieldUnit {
    name: &'static str,
    in_si: f64,
}

/// Whether an axis, by its place in all arrays, is one of a gyroscope.
fn is_gyroscope(axis: usize) -> bool {
    axis < 3
}

/// Unit of a deviation.
fn deviation_unit(axis: usize) -> FieldUnit {
    coefficient_unit(axis, NoiseType::Flicker)
}

/// Unit of a coefficient.
fn coefficient_unit(axis: usize, noise: NoiseType) -> FieldUnit {
    let (name, in_si) = match (is_gyroscope(axis), noise) {
        (true, NoiseType::Quantization) => ("arcsec", ARC_SECOND),
        (true, NoiseType::White) => ("deg/√h", DEG_PER_SQRT_HOUR),
        (true, NoiseType::Flicker) => ("deg/h", DEG_PER_HOUR),
        (true, NoiseType::Walk) => ("deg/h/√h", DEG_PER_HOUR / 60.0),
        (false, NoiseType::Quantization) => ("ug s", MICRO_G),
        (false, NoiseType::White) => ("ug/√Hz", MICRO_G),
        (false, NoiseType::Flicker) => ("ug", MICRO_G),
        (false, NoiseType::Walk) => ("ug/√h", MICRO_G / 60.0),
    };
    FieldUnit { name, in_si }
}

/// What a noise is called.
fn noise_name(noise: NoiseType) -> &'static str {
    match noise {
        NoiseType::Quantization => "quantization",
        NoiseType::White => "white noise",
        NoiseType::Flicker => "bias instability",
        NoiseType::Walk => "rate walk",
    }
}
