//! The count of a sensor that gives whole counts: the increment that all increments are multiples of.

use super::deviation::AXES;

/// Samples that are looked at: enough to see every step of a few counts.
const LOOKED_AT: usize = 8192;
/// Fewer steps say nothing.
const LEAST_STEPS: usize = 3;
/// How far a step may be from a whole number of counts, in counts.
const OFF: f64 = 0.02;
/// A greater step is not told from its neighbours.
const GREATEST_COUNTS: f64 = 1e4;

/// The first samples of a record.
#[derive(Clone, Debug, Default)]
pub(super) struct Beginning {
    samples: Vec<[f64; AXES]>,
}

impl Beginning {
    pub fn push(&mut self, sample: &[f64; AXES]) {
        if self.samples.len() < LOOKED_AT {
            self.samples.push(*sample);
        }
    }

    /// The step of an axis; `None` where its samples are no multiples of one.
    pub fn step(&self, axis: usize) -> Option<f64> {
        let mut values: Vec<f64> = self.samples.iter().map(|sample| sample[axis]).collect();
        values.sort_by(f64::total_cmp);
        let (least, greatest) = (*values.first()?, *values.last()?);
        // What differs by rounding alone is the same.
        let rounding = 1e-9 * (greatest - least);
        let steps: Vec<f64> = values
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .filter(|step| *step > rounding)
            .collect();
        // Samples of a fine sensor are all different.
        if steps.len() < LEAST_STEPS || 2 * steps.len() > values.len() {
            return None;
        }
        let rough = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let is_whole = |step: f64| {
            let counts = step / rough;
            counts < GREATEST_COUNTS && (counts - counts.round()).abs() < OFF * counts.max(1.0)
        };
        let counts = ((greatest - least) / rough).round();
        steps
            .iter()
            .all(|step| is_whole(*step))
            .then(|| (greatest - least) / counts)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    /// Whole counts show their count, to rounding; samples as fine as their numbers, and a constant, show none.
    #[test]
    fn whole_counts_are_seen() {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut generator) };
        let mut beginning = Beginning::default();
        for _ in 0..5000 {
            let mut sample = [0.0; AXES];
            sample[0] = (12.0 * normal() + 0.3).round() * 4.848e-5;
            sample[1] = normal();
            sample[2] = 9.8;
            sample[3] = (normal() + 500.0).round() * 0.1226;
            beginning.push(&sample);
        }
        assert!((beginning.step(0).unwrap() / 4.848e-5 - 1.0).abs() < 1e-9);
        assert_eq!([1, 2].map(|axis| beginning.step(axis)), [None; 2]);
        assert!((beginning.step(3).unwrap() / 0.1226 - 1.0).abs() < 1e-9);
    }
}
