//! The result as JSON; SI units.

use serde::Serialize;
use sins::studies::allan::{
    AXIS_NAMES, AllanResult, AllanSettings, Axis,
    confidence::NoiseType,
    fit::{Coefficient, NOISES},
};

use super::{NodeNoise, is_gyroscope};

/// A curve that its four noises explain has about 1; from here on something else moved the samples.
const UNEXPLAINED: f64 = 4.0;

/// The result as JSON.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Makes the same again.
    pub command: String,
    /// The bag.
    pub bag: String,
    /// Samples at rest, those that stand for missing ones among them.
    pub samples: u64,
    /// Mean sampling interval.
    pub interval_s: f64,
    /// Length of all stretches together.
    pub duration_s: f64,
    /// Unbroken stretches.
    pub stretches: u64,
    /// Missing samples that were bridged.
    pub bridged_samples: u64,
    /// Samples that were left out because the table turned.
    pub turning_samples: u64,
    /// Holes.
    pub gaps: u64,
    /// Missing samples.
    pub lost_samples: u64,
    /// Samples that no sensor gave, or whose stamps have no place.
    pub refused_samples: u64,
    /// Probability that the truth lies within a band.
    pub confidence: f64,
    /// What the phases took.
    pub memory_bytes: usize,
    /// Samples that are averaged; one a point of all curves.
    pub averaging_factor: Vec<u64>,
    /// Averaging time.
    pub tau_s: Vec<f64>,
    /// Second differences of a point.
    pub terms: Vec<u64>,
    /// Gyroscopes x, y, z, then accelerometers.
    pub axes: Vec<AxisReport>,
    /// What calibrator and compensator are to be told, in their units.
    pub parameters: NodeNoise,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// One axis: rad/s or m/s².
#[derive(Clone, Debug, Serialize)]
pub struct AxisReport {
    /// `gyroscope_x` and so on.
    pub name: &'static str,
    /// Unit of the deviations.
    pub unit: &'static str,
    /// Overlapping Allan deviation.
    pub deviation: Vec<f64>,
    /// Lower end of its band.
    pub lower: Vec<f64>,
    /// Upper end of its band.
    pub upper: Vec<f64>,
    /// Equivalent degrees of freedom.
    pub degrees_of_freedom: Vec<f64>,
    /// The noise that is greatest there.
    pub noise_type: Vec<NoiseType>,
    /// Deviation of the fitted noises.
    pub fitted: Vec<f64>,
    /// Q, σ² = 3 Q²/τ²: rad or m/s.
    pub quantization: CoefficientReport,
    /// N, σ² = N²/τ: rad/√s or m/s/√s.
    pub white_noise: CoefficientReport,
    /// B, σ² = B² 2 ln 2/π: rad/s or m/s².
    pub bias_instability: CoefficientReport,
    /// K, σ² = K² τ/3: rad/s/√s or m/s²/√s.
    pub rate_walk: CoefficientReport,
    /// The increment that all increments are multiples of, rad or m/s; null where the samples are as fine as their numbers.
    pub count: Option<f64>,
    /// The least deviation ...
    pub least_deviation: f64,
    /// ... and its averaging time.
    pub least_tau_s: f64,
    /// Far above 1: other things than these noises move the samples.
    pub reduced_chi_square: f64,
}

/// A coefficient, null where the record does not show it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CoefficientReport {
    /// Its value.
    pub value: Option<f64>,
    /// One sigma.
    pub std: Option<f64>,
    /// It is not greater than this, by two sigmas.
    pub upper: f64,
}

impl From<Coefficient> for CoefficientReport {
    fn from(coefficient: Coefficient) -> Self {
        Self {
            value: coefficient.found.map(|(value, _)| value),
            std: coefficient.found.map(|(_, std)| std),
            upper: coefficient.upper,
        }
    }
}

impl AxisReport {
    /// A coefficient.
    pub fn coefficient(&self, noise: NoiseType) -> CoefficientReport {
        match noise {
            NoiseType::Quantization => self.quantization,
            NoiseType::White => self.white_noise,
            NoiseType::Flicker => self.bias_instability,
            NoiseType::Walk => self.rate_walk,
        }
    }

    fn of(name: &'static str, is_gyroscope: bool, axis: &Axis) -> Self {
        let points = || axis.points.iter();
        let [quantization, white_noise, bias_instability, rate_walk] =
            NOISES.map(|noise| axis.fit.of(noise).into());
        let least = axis.least();
        Self {
            name,
            unit: if is_gyroscope { "rad/s" } else { "m/s^2" },
            deviation: points().map(|p| p.deviation).collect(),
            lower: points().map(|p| p.band[0]).collect(),
            upper: points().map(|p| p.band[1]).collect(),
            degrees_of_freedom: points().map(|p| p.degrees_of_freedom).collect(),
            noise_type: points().map(|p| p.noise).collect(),
            fitted: points()
                .map(|p| axis.fit.variance(p.tau_s).sqrt())
                .collect(),
            quantization,
            white_noise,
            bias_instability,
            rate_walk,
            count: axis.count,
            least_deviation: least.map_or(0.0, |p| p.deviation),
            least_tau_s: least.map_or(0.0, |p| p.tau_s),
            reduced_chi_square: axis.fit.reduced_chi_square,
        }
    }
}

/// The result as JSON.
pub fn report(
    result: &AllanResult,
    settings: &AllanSettings,
    bag: String,
    command: String,
    mut warnings: Vec<String>,
) -> Report {
    let points = || result.axes[0].points.iter();
    let axes: Vec<_> = (0..AXIS_NAMES.len())
        .map(|k| AxisReport::of(AXIS_NAMES[k], is_gyroscope(k), &result.axes[k]))
        .collect();
    for axis in axes.iter().filter(|a| a.reduced_chi_square > UNEXPLAINED) {
        warnings.push(format!(
            "{bag}: {}: the four noises do not explain the curve (chi-square {:.0} a degree of freedom): the block was moved, or \
             its temperature changed; sigmas are enlarged",
            axis.name, axis.reduced_chi_square
        ));
    }
    if result.bridged > 0 {
        warnings.push(format!(
            "{bag}: {} missing samples were bridged by the mean of their neighbours",
            result.bridged
        ));
    }
    Report {
        command,
        bag,
        samples: result.samples,
        interval_s: result.interval_s,
        duration_s: result.samples as f64 * result.interval_s,
        stretches: result.stretches,
        bridged_samples: result.bridged,
        turning_samples: result.turning,
        gaps: result.counts.gaps,
        lost_samples: result.counts.lost,
        refused_samples: result.counts.refused(),
        confidence: settings.confidence,
        memory_bytes: result.memory_bytes,
        averaging_factor: points().map(|p| p.factor).collect(),
        tau_s: points().map(|p| p.tau_s).collect(),
        terms: points().map(|p| p.terms).collect(),
        parameters: NodeNoise::of(&axes),
        axes,
        warnings,
    }
}
