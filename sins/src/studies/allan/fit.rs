//! The four noises of IEEE 952 in a curve of Allan variances: quantization 3 Q²/τ², white noise N²/τ, bias instability
//! B² 2 ln 2/π, rate walk K² τ/3.
//!
//! Weighted least squares for Q², N², B², K², none of them negative; the weights are those of the fitted curve, found by
//! repetition. Overlapping variances of neighbouring octaves share information, and must not be counted twice: an
//! averaging factor weighs as much as its disjoint pairs of averages, which for white noise are what all octaves
//! together have to say. A noise that is not twice its own sigma is left out, and an upper limit is said for it.

use nalgebra::{DMatrix, DVector};

use super::confidence::NoiseType;

/// The noises, in the order of their slopes.
pub const NOISES: [NoiseType; 4] = [
    NoiseType::Quantization,
    NoiseType::White,
    NoiseType::Flicker,
    NoiseType::Walk,
];
/// A square that is less of its sigmas is not seen.
const SEEN_SIGMAS: f64 = 2.0;
/// Disjoint averages of flicker and of a walk are not independent as those of white noise are: the sigmas of their squares are
/// greater by so much (150 drawn records each of three ratios of walk to white noise gave 1.30 to 1.43).
const CORRELATED: f64 = std::f64::consts::SQRT_2;
/// Repetitions for the weights; they settle within ten.
const REPETITIONS: usize = 30;

/// A variance of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variance {
    /// Averaging time \[s\].
    pub tau_s: f64,
    /// Allan variance.
    pub value: f64,
    /// Disjoint pairs of averages.
    pub pairs: f64,
}

/// What was found of one noise: Q, N, B or K, each in the unit of the axis times s, √s, 1, 1/√s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficient {
    /// Its value with one-sigma, where it is seen.
    pub found: Option<(f64, f64)>,
    /// It is not greater than this (by two sigmas), seen or not.
    pub upper: f64,
}

/// The fitted noises.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fit {
    /// In the order of [`NOISES`].
    pub coefficients: [Coefficient; 4],
    /// Weighted squares of what the curve leaves, a degree of freedom. Far above 1: other things than these noises move
    /// the samples; the sigmas have grown by its root.
    pub reduced_chi_square: f64,
}

impl Fit {
    /// One of them.
    pub fn of(&self, noise: NoiseType) -> Coefficient {
        NOISES
            .iter()
            .position(|each| *each == noise)
            .map_or_else(Coefficient::default, |at| self.coefficients[at])
    }

    /// Allan variance of the noises that were found, at an averaging time \[s\].
    pub fn variance(&self, tau_s: f64) -> f64 {
        NOISES.iter().map(|noise| self.part(*noise, tau_s)).sum()
    }

    /// The noise that is greatest at an averaging time \[s\].
    pub fn greatest(&self, tau_s: f64) -> NoiseType {
        let by_part =
            |a: &NoiseType, b: &NoiseType| self.part(*a, tau_s).total_cmp(&self.part(*b, tau_s));
        NOISES
            .into_iter()
            .max_by(by_part)
            .unwrap_or(NoiseType::White)
    }

    fn part(&self, noise: NoiseType, tau_s: f64) -> f64 {
        let value = self.of(noise).found.map_or(0.0, |(value, _)| value);
        value * value * shape(noise, tau_s)
    }
}

/// Allan variance of a noise whose coefficient is 1.
pub fn shape(noise: NoiseType, tau_s: f64) -> f64 {
    match noise {
        NoiseType::Quantization => 3.0 / (tau_s * tau_s),
        NoiseType::White => 1.0 / tau_s,
        NoiseType::Flicker => 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI,
        NoiseType::Walk => tau_s / 3.0,
    }
}

/// Fits the noises to a curve.
pub fn fit(curve: &[Variance]) -> Fit {
    let curve: Vec<_> = curve.iter().filter(|v| v.value > 0.0).copied().collect();
    if curve.is_empty() {
        return Fit::default();
    }
    let mut candidates: Vec<usize> = (0..NOISES.len()).collect();
    loop {
        let solution = settled(&curve, &candidates);
        let weakest = (0..solution.noises.len())
            .map(|k| (solution.noises[k], solution.squares[k] / solution.sigma(k)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match weakest {
            Some((noise, sigmas)) if sigmas < SEEN_SIGMAS && solution.noises.len() > 1 => {
                candidates.clone_from(&solution.noises);
                candidates.retain(|candidate| *candidate != noise);
            }
            _ => return said(&curve, &solution),
        }
    }
}

/// Squares of coefficients, none negative, with the weights of their own curve.
struct Solution {
    /// Those that are there, by their number in [`NOISES`].
    noises: Vec<usize>,
    squares: DVector<f64>,
    covariance: DMatrix<f64>,
    variances: Vec<f64>,
    chi_square: f64,
}

impl Solution {
    fn sigma(&self, k: usize) -> f64 {
        let growth = match NOISES[self.noises[k]] {
            NoiseType::Quantization | NoiseType::White => 1.0,
            NoiseType::Flicker | NoiseType::Walk => CORRELATED,
        };
        growth * self.covariance[(k, k)].max(0.0).sqrt()
    }

    fn reduced(&self) -> f64 {
        let degrees = self.variances.len().saturating_sub(self.noises.len());
        self.chi_square / degrees.max(1) as f64
    }
}

fn settled(curve: &[Variance], candidates: &[usize]) -> Solution {
    let mut variances: Vec<f64> = curve.iter().map(|v| v.value).collect();
    let mut best = Solution {
        noises: Vec::new(),
        squares: DVector::zeros(0),
        covariance: DMatrix::zeros(0, 0),
        variances: variances.clone(),
        chi_square: f64::INFINITY,
    };
    for _ in 0..REPETITIONS {
        best = not_negative(curve, candidates, &variances);
        let next: Vec<f64> = curve
            .iter()
            .map(|v| {
                let parts = best.noises.iter().zip(best.squares.iter());
                parts
                    .map(|(noise, square)| square * shape(NOISES[*noise], v.tau_s))
                    .sum()
            })
            .collect();
        let moved = next.iter().zip(&variances);
        let moved = moved.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        if next.iter().any(|variance| *variance <= 0.0) {
            break;
        }
        variances = next;
        if moved < 1e-9 {
            break;
        }
    }
    best.variances = variances;
    best
}

/// The best of all subsets whose squares are positive; with four noises there are fifteen.
fn not_negative(curve: &[Variance], candidates: &[usize], variances: &[f64]) -> Solution {
    let subsets = (1_usize..1 << candidates.len()).map(|mask| {
        let chosen = candidates.iter().enumerate();
        let chosen = chosen.filter(|(k, _)| mask >> k & 1 == 1);
        chosen.map(|(_, noise)| *noise).collect::<Vec<_>>()
    });
    let solutions = subsets.filter_map(|noises| least_squares(curve, &noises, variances));
    let allowed = solutions.filter(|s| s.squares.iter().all(|square| *square > 0.0));
    allowed
        .min_by(|a, b| a.chi_square.total_cmp(&b.chi_square))
        .unwrap_or_else(|| Solution {
            noises: Vec::new(),
            squares: DVector::zeros(0),
            covariance: DMatrix::zeros(0, 0),
            variances: variances.to_vec(),
            chi_square: f64::INFINITY,
        })
}

/// A variance over so many disjoint pairs has a relative variance of two by their number.
fn least_squares(curve: &[Variance], noises: &[usize], variances: &[f64]) -> Option<Solution> {
    let weight = |row: usize| (curve[row].pairs / 2.0).sqrt() / variances[row];
    let raw = DMatrix::from_fn(curve.len(), noises.len(), |row, column| {
        shape(NOISES[noises[column]], curve[row].tau_s) * weight(row)
    });
    // The columns differ by many powers of ten.
    let scale: Vec<f64> = raw.column_iter().map(|column| column.norm()).collect();
    let matrix = DMatrix::from_fn(curve.len(), noises.len(), |row, column| {
        raw[(row, column)] / scale[column]
    });
    let values = DVector::from_fn(curve.len(), |row, _| curve[row].value * weight(row));
    let inverse = (matrix.transpose() * &matrix).try_inverse()?;
    let scaled = &inverse * (matrix.transpose() * &values);
    let chi_square = (&matrix * &scaled - values).norm_squared();
    Some(Solution {
        noises: noises.to_vec(),
        squares: DVector::from_fn(noises.len(), |k, _| scaled[k] / scale[k]),
        covariance: DMatrix::from_fn(noises.len(), noises.len(), |i, j| {
            inverse[(i, j)] / (scale[i] * scale[j])
        }),
        variances: variances.to_vec(),
        chi_square,
    })
}

fn said(curve: &[Variance], solution: &Solution) -> Fit {
    let reduced = solution.reduced();
    let growth = reduced.max(1.0).sqrt();
    let mut fit = Fit {
        reduced_chi_square: reduced,
        ..Fit::default()
    };
    for (number, coefficient) in fit.coefficients.iter_mut().enumerate() {
        if let Some(k) = solution.noises.iter().position(|noise| *noise == number) {
            let (square, sigma) = (solution.squares[k], growth * solution.sigma(k));
            let value = square.sqrt();
            *coefficient = Coefficient {
                found: Some((value, sigma / (2.0 * value))),
                upper: (square + SEEN_SIGMAS * sigma).sqrt(),
            };
            continue;
        }
        let mut with = solution.noises.clone();
        with.push(number);
        if let Some(wider) = least_squares(curve, &with, &solution.variances) {
            let last = with.len() - 1;
            let square = wider.squares[last].max(0.0) + SEEN_SIGMAS * growth * wider.sigma(last);
            coefficient.upper = square.sqrt();
        }
    }
    fit
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn curve(coefficients: [f64; 4]) -> Vec<Variance> {
        (0..16)
            .map(|octave| {
                let tau_s = 0.01 * f64::from(1 << octave);
                let parts = NOISES.iter().zip(coefficients);
                Variance {
                    tau_s,
                    value: parts.map(|(noise, c)| c * c * shape(*noise, tau_s)).sum(),
                    pairs: 1e6 / f64::from(1 << octave),
                }
            })
            .collect()
    }

    /// A curve that is exactly four noises gives them back.
    #[test]
    fn an_exact_curve_gives_its_noises() {
        let wanted = [1e-4, 1e-3, 3e-3, 4e-3];
        let fit = fit(&curve(wanted));
        for (coefficient, wanted) in fit.coefficients.iter().zip(wanted) {
            let (value, sigma) = coefficient.found.unwrap();
            assert!((value / wanted - 1.0).abs() < 1e-6, "{value}, {wanted}");
            assert!(coefficient.upper > value && sigma > 0.0);
        }
        assert!(fit.reduced_chi_square < 1e-9);
        assert_eq!(fit.greatest(0.01), NoiseType::Quantization);
        assert_eq!(fit.greatest(300.0), NoiseType::Walk);
    }

    /// What is not there is not found, and its upper limit is small.
    #[test]
    fn what_is_not_there_is_not_found() {
        let fit = fit(&curve([0.0, 1e-3, 0.0, 0.0]));
        assert!((fit.of(NoiseType::White).found.unwrap().0 - 1e-3).abs() < 1e-9);
        for noise in [NoiseType::Quantization, NoiseType::Flicker, NoiseType::Walk] {
            let coefficient = fit.of(noise);
            assert_eq!(coefficient.found, None);
            let worst = coefficient.upper.powi(2) * shape(noise, 0.01);
            assert!(coefficient.upper > 0.0 && worst < 1e-4, "{noise:?}");
        }
    }
}
