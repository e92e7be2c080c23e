//! Overlapping Allan deviation of a stream of any length in bounded memory.
//!
//! The samples of every axis are summed up to a phase x. With an averaging factor m the overlapping Allan variance is
//! the mean of (x(k + 2m) − 2 x(k + m) + x(k))² / (2 m²) over all k. To have all k, 2 m + 1 phases are kept, which a day
//! of samples does not allow. So the phases are decimated by octaves: up to [`DENSEST`] samples every k counts, and
//! beyond, at an averaging factor of `DENSEST` 2^l, every 2^l-th k. Each octave keeps 2 `DENSEST` + 1 phases, whatever
//! the length of the record, and loses next to nothing by it: neighbouring k share all but 1 / `DENSEST` of their
//! samples.

use std::collections::VecDeque;

/// Up to this averaging factor every start counts; beyond, so many starts an averaging time.
pub const DENSEST: usize = 1024;
/// Axes of the gyroscopes, then of the accelerometers.
pub const AXES: usize = 6;
/// Bytes that the phases of one octave take.
pub const BYTES_AN_OCTAVE: usize = (2 * DENSEST + 1) * size_of::<Phase>();

/// The sums of all axes.
type Phase = [f64; AXES];

/// What is known of one averaging factor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    /// Second differences.
    pub terms: u64,
    /// Sum of their squares, per axis.
    pub squares: [f64; AXES],
}

/// Phases that are 2^l samples apart.
#[derive(Clone, Debug)]
struct Octave {
    /// Since the stretch began, the newest at the end.
    phases: VecDeque<Phase>,
    /// Lags in phases of this octave, with what they gave.
    sums: Vec<(usize, Sum)>,
}

impl Octave {
    fn new(level: usize) -> Self {
        let lags = if level == 0 {
            (0..=DENSEST.ilog2()).map(|power| 1 << power).collect()
        } else {
            vec![DENSEST]
        };
        Self {
            phases: VecDeque::with_capacity(2 * DENSEST + 1),
            sums: lags.into_iter().map(|lag| (lag, Sum::default())).collect(),
        }
    }

    fn push(&mut self, phase: Phase) {
        if self.phases.len() == 2 * DENSEST + 1 {
            self.phases.pop_front();
        }
        self.phases.push_back(phase);
        let newest = self.phases.len() - 1;
        for (lag, sum) in &mut self.sums {
            let Some(first) = newest.checked_sub(2 * *lag) else {
                break;
            };
            let (first, middle) = (&self.phases[first], &self.phases[first + *lag]);
            for axis in 0..AXES {
                let second = phase[axis] - 2.0 * middle[axis] + first[axis];
                sum.squares[axis] += second * second;
            }
            sum.terms += 1;
        }
    }
}

/// The deviations of a stream, which may be broken into stretches: no difference reaches over a break.
#[derive(Clone, Debug, Default)]
pub struct Deviations {
    octaves: Vec<Octave>,
    /// The first sample: what is summed is the difference from it, so that the phases stay small.
    reference: Option<Phase>,
    phase: Phase,
    /// Samples since the stretch began.
    index: u64,
}

impl Deviations {
    /// Takes the next sample.
    pub fn push(&mut self, sample: &[f64; AXES]) {
        let reference = *self.reference.get_or_insert(*sample);
        if self.index == 0 {
            self.sum_up();
        }
        for axis in 0..AXES {
            self.phase[axis] += sample[axis] - reference[axis];
        }
        self.index += 1;
        self.sum_up();
    }

    /// Ends the stretch: what comes next does not follow what came last.
    pub fn part(&mut self) {
        for octave in &mut self.octaves {
            octave.phases.clear();
        }
        self.phase = [0.0; AXES];
        self.index = 0;
    }

    /// The phase goes to every octave whose turn it is.
    fn sum_up(&mut self) {
        // A phase at 0 belongs to all octaves; those that are not there yet get it when their second one is due.
        let due = match self.index {
            0 => self.octaves.len().max(1),
            index => index.trailing_zeros() as usize + 1,
        };
        // An octave without a single difference need not be there.
        let useful = |level: usize| level == 0 || self.index >= 1 << level;
        for level in 0..due {
            if level == self.octaves.len() {
                if !useful(level) {
                    break;
                }
                let mut octave = Octave::new(level);
                if self.index > 0 {
                    octave.push([0.0; AXES]);
                }
                self.octaves.push(octave);
            }
            self.octaves[level].push(self.phase);
        }
    }

    /// Averaging factors with at least one term, and what they gave.
    pub fn sums(&self) -> impl Iterator<Item = (u64, Sum)> + '_ {
        self.octaves.iter().enumerate().flat_map(|(level, octave)| {
            let sums = octave.sums.iter().filter(|(_, sum)| sum.terms > 0);
            sums.map(move |(lag, sum)| ((*lag as u64) << level, *sum))
        })
    }

    /// Bytes of phases that are kept.
    pub fn bytes(&self) -> usize {
        self.octaves.len() * BYTES_AN_OCTAVE
    }
}

/// Starts an averaging time at an averaging factor.
pub fn starts(factor: u64) -> u64 {
    factor.min(DENSEST as u64)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(count: usize) -> Vec<[f64; AXES]> {
        use rand_xoshiro::rand_core::SeedableRng;
        let mut generator = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
        (0..count)
            .map(|_| std::array::from_fn(|_| StandardNormal.sample(&mut generator)))
            .collect()
    }

    /// By the definition, from all phases at once; every `stride`-th start.
    fn by_definition(samples: &[[f64; AXES]], factor: usize, axis: usize) -> Sum {
        let mut phases = vec![0.0];
        for sample in samples {
            phases.push(phases[phases.len() - 1] + sample[axis]);
        }
        let stride = factor.div_ceil(DENSEST);
        let mut sum = Sum::default();
        for first in (0..phases.len().saturating_sub(2 * factor)).step_by(stride) {
            let second = phases[first + 2 * factor] - 2.0 * phases[first + factor] + phases[first];
            sum.terms += 1;
            sum.squares[axis] += second * second;
        }
        sum
    }

    /// The stream gives the definition's sums, at every octave, beyond the densest too.
    #[test]
    fn the_stream_gives_the_definition() {
        let samples = noise(20_000);
        let mut deviations = Deviations::default();
        for sample in &samples {
            deviations.push(sample);
        }
        let sums: Vec<_> = deviations.sums().collect();
        let factors: Vec<_> = sums.iter().map(|(factor, _)| *factor).collect();
        assert_eq!(factors, (0..14).map(|k| 1 << k).collect::<Vec<u64>>());
        for (factor, sum) in sums {
            for axis in 0..AXES {
                let wanted = by_definition(&samples, factor as usize, axis);
                assert_eq!(sum.terms, wanted.terms, "{factor}");
                let ratio = sum.squares[axis] / wanted.squares[axis];
                assert!((ratio - 1.0).abs() < 1e-9, "{factor}: {ratio}");
            }
        }
    }

    /// Nothing reaches over a break: two stretches give the sums of both.
    #[test]
    fn stretches_are_apart() {
        let samples = noise(9000);
        let mut deviations = Deviations::default();
        for (k, sample) in samples.iter().enumerate() {
            if k == 4000 {
                deviations.part();
            }
            deviations.push(sample);
        }
        for (factor, sum) in deviations.sums() {
            let [one, other] = [&samples[..4000], &samples[4000..]]
                .map(|part| by_definition(part, factor as usize, 2));
            assert_eq!(sum.terms, one.terms + other.terms, "{factor}");
            let ratio = sum.squares[2] / (one.squares[2] + other.squares[2]);
            assert!((ratio - 1.0).abs() < 1e-9, "{factor}: {ratio}");
        }
    }

    /// Memory grows with the logarithm of the length, and a day at 1 kHz stays below two megabytes.
    #[test]
    fn memory_is_bounded() {
        let mut deviations = Deviations::default();
        let mut kept = Vec::new();
        for k in 0..1_u32 << 20 {
            deviations.push(&[f64::from(k % 7); AXES]);
            if k.is_power_of_two() {
                kept.push(deviations.bytes());
            }
        }
        let octaves = (86_400_000_f64).log2().ceil();
        assert_eq!(kept[20 - 1] - kept[20 - 2], BYTES_AN_OCTAVE);
        assert!(
            octaves * (BYTES_AN_OCTAVE as f64) < 2.8e6,
            "{BYTES_AN_OCTAVE}"
        );
    }
}
