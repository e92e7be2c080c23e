//! The white noise of the sensors as their samples at rest show it, to hold against what was said of it.
//!
//! Averages over one, two and four seconds are compared with those before them (Allan variances `A₁`, `A₂`, `A₄` of IEEE
//! Std 952). White noise of density N has `A₁ = N²/1 s`, `A₄ = N²/4 s`; counts of quantum q add `q²/(4 τ²)` to each, so
//! `N² = (16 A₄ − A₁)/3 · 1 s` is free of them, as long as they are no coarser than the noise of a second. Motion of the
//! ship and anything that wanders makes `4 A₄` greater than `A₁`, or takes `2 A₂` off the line between them: then
//! nothing is said.

use std::ops::AddAssign;

use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};

use crate::sensor::{Increment, NoiseDensity};

/// Length of the short averages \[s\], and how many of them make a long one.
const SHORT_S: f64 = 1.0;
const LONG: u32 = 4;
/// A block that turns faster does not rest \[rad/s\].
const RESTS_RAD_S: f64 = 0.005;
/// Fewer differences of long averages say nothing.
const FEWEST: f64 = 50.0;
/// The short averages may be so many times the white noise, for counts.
const MOST_COUNTS: f64 = 2.0;
/// So many sigmas of chance are allowed.
const SIGMAS: f64 = 5.0;
/// And so much is no error of a density that was told.
const TOLERANCE: f64 = 1.2;

type Axes = SVector<f64, 6>;

/// Averages of one length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Averages {
    before: Option<Axes>,
    /// Σ (difference)² · length / 2.
    squares: Axes,
    count: f64,
}

impl Averages {
    fn take(&mut self, average: Axes, seconds: f64) {
        if let Some(before) = self.before.replace(average) {
            let difference = average - before;
            self.squares += difference.component_mul(&difference) * (0.5 * seconds);
            self.count += 1.0;
        }
    }

    /// Allan variance times length.
    fn density_squared(&self) -> Axes {
        self.squares / self.count.max(1.0)
    }
}

/// Noise at rest: gyroscopes, then accelerometers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseAtRest {
    sum: Axes,
    seconds: f64,
    /// The last short sum: a turn may have begun in it, so that it is taken when the next one is at rest too.
    held: Option<(Axes, f64)>,
    /// The block has turned meanwhile.
    has_turned: bool,
    long: Axes,
    long_seconds: f64,
    in_long: u32,
    /// The first half of a long sum, and how long it took.
    half: Axes,
    half_seconds: f64,
    short_averages: Averages,
    middle_averages: Averages,
    long_averages: Averages,
}

impl Default for NoiseAtRest {
    fn default() -> Self {
        Self {
            sum: Axes::zeros(),
            seconds: 0.0,
            held: None,
            has_turned: false,
            long: Axes::zeros(),
            long_seconds: 0.0,
            in_long: 0,
            half: Axes::zeros(),
            half_seconds: 0.0,
            short_averages: Averages::default(),
            middle_averages: Averages::default(),
            long_averages: Averages::default(),
        }
    }
}

impl NoiseAtRest {
    /// Takes an interval of a block that rests; what lies across a hole is no sample of the noise.
    #[inline]
    pub(super) fn take(&mut self, increment: &Increment, has_hole: bool) {
        if has_hole {
            return self.interrupt();
        }
        self.sum.fixed_rows_mut::<3>(0).add_assign(&increment.angle);
        let mut forces = self.sum.fixed_rows_mut::<3>(3);
        forces.add_assign(&increment.velocity);
        self.seconds += increment.interval_s;
        if self.seconds > SHORT_S - 1e-6 {
            self.end_short();
        }
    }

    fn end_short(&mut self) {
        let (sum, seconds) = (self.sum, self.seconds);
        (self.sum, self.seconds) = (Axes::zeros(), 0.0);
        let turns = sum.fixed_rows::<3>(0).norm() > RESTS_RAD_S * seconds;
        self.has_turned |= turns;
        if turns || seconds > 1.5 * SHORT_S {
            return self.interrupt();
        }
        let Some((sum, seconds)) = self.held.replace((sum, seconds)) else {
            return;
        };
        self.short_averages.take(sum / seconds, seconds);
        self.long += sum;
        self.long_seconds += seconds;
        self.in_long += 1;
        if self.in_long == LONG / 2 {
            (self.half, self.half_seconds) = (self.long, self.long_seconds);
            self.middle_averages
                .take(self.half / self.half_seconds, self.half_seconds);
        }
        if self.in_long == LONG {
            let seconds = self.long_seconds - self.half_seconds;
            self.middle_averages
                .take((self.long - self.half) / seconds, seconds);
            self.long_averages
                .take(self.long / self.long_seconds, self.long_seconds);
            (self.long, self.long_seconds, self.in_long) = (Axes::zeros(), 0.0, 0);
        }
    }

    /// What comes next does not go on from what came before.
    #[inline]
    pub(super) fn interrupt(&mut self) {
        if self.seconds == 0.0 && self.held.is_none() && self.long_averages.before.is_none() {
            return;
        }
        self.short_averages.before = None;
        self.middle_averages.before = None;
        self.long_averages.before = None;
        *self = Self {
            has_turned: self.has_turned,
            short_averages: self.short_averages,
            middle_averages: self.middle_averages,
            long_averages: self.long_averages,
            ..Self::default()
        };
    }

    /// The densities \[rad/√s, m/s/√s\] with the share of each that is one sigma of chance; `None` of an axis that is not at rest, or
    /// of too few samples.
    fn found(&self) -> [Option<(f64, f64)>; 6] {
        let count = self.long_averages.count;
        if count < FEWEST {
            return [None; 6];
        }
        let short = self.short_averages.density_squared();
        let middle = self.middle_averages.density_squared();
        let long = self.long_averages.density_squared();
        // One sigma of a mean of squared differences of neighbours, as a share.
        let chance = (3.0 / count).sqrt();
        std::array::from_fn(|axis| {
            let white = (4.0 * long[axis] - short[axis]) / 3.0;
            // White noise and counts lie on a line over 1 / length, and do not rise with the length.
            let expected = long[axis] + (short[axis] - long[axis]) / 3.0;
            let is_line = (middle[axis] - expected).abs() <= SIGMAS * chance * expected;
            let is_at_rest = is_line && long[axis] <= (1.0 + SIGMAS * chance) * short[axis];
            // Counts that the noise does not make even are no noise of their own.
            let is_even = short[axis] <= MOST_COUNTS * white;
            (is_even && is_at_rest).then(|| {
                let share = 0.5 * 4.0 * long[axis] / (3.0 * white) * chance;
                (white.sqrt(), share)
            })
        })
    }

    /// The densities \[rad/√s, m/s/√s\]; `None` of an axis that is not at rest, or of too few samples.
    pub fn densities(&self) -> [Option<f64>; 6] {
        self.found().map(|found| found.map(|(density, _)| density))
    }

    /// The densities, where every axis has one and the block never turned.
    pub(super) fn whole(&self) -> Option<NoiseDensity> {
        if self.has_turned {
            return None;
        }
        let [gx, gy, gz, ax, ay, az] = self.densities();
        Some(NoiseDensity {
            gyroscope: Vector3::new(gx?, gy?, gz?),
            accelerometer: Vector3::new(ax?, ay?, az?),
        })
    }

    /// The axis (gyroscopes, then accelerometers) that is noisiest against what was told: by how much, and how much that may be.
    pub(super) fn against(&self, told: &NoiseDensity) -> Option<(usize, f64, f64)> {
        let told = told.gyroscope.iter().chain(&told.accelerometer);
        self.found()
            .into_iter()
            .zip(told)
            .enumerate()
            .filter_map(|(axis, (seen, told))| {
                let (seen, share) = seen?;
                Some((axis, seen / told, TOLERANCE + SIGMAS * share))
            })
            .max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const INTERVAL_S: f64 = 0.01;
    const EARTH_RAD_S: f64 = 5e-5;

    /// Samples of white noise with these densities, counted in quanta, on a block that swings; `seconds` of them.
    fn seen(densities: [f64; 2], quantum: f64, swing: f64, seconds: usize) -> NoiseAtRest {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut noise = NoiseAtRest::default();
        let (mut true_angle, mut told_angle) = (Vector3::<f64>::zeros(), Vector3::zeros());
        for k in 0..seconds * 100 {
            let mut white = |density: f64| {
                Vector3::from_fn(|_, _| {
                    let drawn: f64 = StandardNormal.sample(&mut rng);
                    drawn * density * INTERVAL_S.sqrt()
                })
            };
            let phase = std::f64::consts::TAU * k as f64 * INTERVAL_S / 7.3;
            true_angle += white(densities[0])
                + Vector3::repeat((EARTH_RAD_S + swing * phase.cos()) * INTERVAL_S);
            let counted = true_angle.map(|angle| (angle / quantum).floor() * quantum);
            let increment = Increment {
                interval_s: INTERVAL_S,
                angle: counted - told_angle,
                velocity: Vector3::z() * 9.8 * INTERVAL_S + white(densities[1]),
            };
            told_angle = counted;
            noise.take(&increment, k % 90_000 == 50_000);
        }
        noise
    }

    /// Densities are found within their chance, also where a count is nearly twice the noise of a second; three times what was told
    /// is told, and what is right is not.
    #[test]
    fn densities_are_found() {
        let densities = [3e-7, 1e-4];
        for quantum in [1e-12, 5e-7] {
            let noise = seen(densities, quantum, 0.0, 14_400);
            for (axis, found) in noise.found().into_iter().enumerate() {
                let (density, share) = found.unwrap();
                let ratio = density / densities[axis / 3];
                assert!(share < 0.06, "{quantum} {axis}: {share}");
                assert!(
                    (ratio - 1.0).abs() < 4.0 * share,
                    "{quantum} {axis}: {ratio}"
                );
            }
            let told = |factor: f64| NoiseDensity {
                gyroscope: Vector3::repeat(densities[0]),
                accelerometer: Vector3::new(1.0, 1.0, factor) * densities[1],
            };
            let (_, ratio, bound) = noise.against(&told(1.0)).unwrap();
            assert!(ratio < bound, "{ratio} {bound}");
            let (axis, ratio, bound) = noise.against(&told(1.0 / 3.0)).unwrap();
            assert!(axis == 5 && ratio > bound, "{axis} {ratio} {bound}");
        }
    }

    /// A ship that swings by as much as her gyroscopes' noise has no noise at rest; her accelerometers here still have.
    #[test]
    fn motion_is_not_noise() {
        let noise = seen([3e-7, 1e-4], 1e-12, 1e-6, 3_600);
        let found = noise.densities();
        assert!(found[..3].iter().all(Option::is_none), "{found:?}");
        assert!(found[3..].iter().all(Option::is_some), "{found:?}");
    }
}
