//! Innovations after turns against innovations far from them.
//!
//! What a turn does to a sensor whose errors are described is described too: innovations after it are as large as at rest. A scale
//! factor, an angle, an arm or a bias that the filter holds for something else jumps into the velocity with every turn. Taken
//! one by one innovations show little of it, because the ship's motion is in each of them; a jump of the level lasts, so that
//! their means over [`BLOCK`] show it.

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::super::rest::Rest;

/// Innovations of so many updates are taken together.
const BLOCK: u32 = 20;
/// Fewer values say nothing yet.
const FEWEST: f64 = 24.0;
/// Probability that a test fails when all is well.
const FALSE_ALARM: f64 = 1e-5;
/// How far the level at rest may be off the filter's for reasons that cost nothing: rounding of counts, say.
const LEVEL_TOLERANCE: f64 = 1.15;

/// A mean square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanSquare {
    sum: f64,
    count: f64,
}

impl MeanSquare {
    fn add(&mut self, values: &[f64]) {
        self.sum += values.iter().map(|value| value * value).sum::<f64>();
        self.count += values.len() as f64;
    }

    fn and(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            count: self.count + other.count,
        }
    }

    /// The mean; zero of nothing.
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    /// Of so many values.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// How far above one it may be by chance.
    fn excess(&self) -> f64 {
        ChiSquared::new(self.count.max(1.0)).map_or(f64::INFINITY, |d| {
            d.inverse_cdf(1.0 - FALSE_ALARM) / self.count.max(1.0)
        })
    }
}

/// Means of normalized innovations over 20 updates, east, north and up, times the root of their number: of variance one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Turns {
    rest: Rest,
    sums: [f64; 3],
    summed: u32,
    /// While the block turns and shortly after.
    pub after: MeanSquare,
    /// At rest.
    pub quiet: MeanSquare,
    /// At rest, upwards.
    pub quiet_up: MeanSquare,
    /// Over long stretches, turns or not.
    pub stretches: [Stretches; LENGTHS.len()],
}

/// Innovations of so many updates are taken together to see whether they are white: what wanders slowly leaves each of them where it
/// should be, and their sum not.
const LENGTHS: [u32; 2] = [40, 80];

/// Means over stretches of one length, east and north, times the root of their number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stretches {
    length: u32,
    sums: [f64; 3],
    summed: u32,
    /// Mean square, east and north.
    pub along: MeanSquare,
    /// Mean square, upwards.
    pub up: MeanSquare,
}

impl Stretches {
    fn new(length: u32) -> Self {
        Self {
            length,
            sums: [0.0; 3],
            summed: 0,
            along: MeanSquare::default(),
            up: MeanSquare::default(),
        }
    }

    fn count(&mut self, normalized: [f64; 3]) {
        for (sum, value) in self.sums.iter_mut().zip(normalized) {
            *sum += value;
        }
        self.summed += 1;
        if self.summed == self.length {
            let root = f64::from(self.length).sqrt();
            let means = self.sums.map(|sum| sum / root);
            self.along.add(&means[..2]);
            self.up.add(&means[2..]);
            (self.sums, self.summed) = ([0.0; 3], 0);
        }
    }
}

impl Turns {
    pub(super) fn new(attitude: UnitQuaternion<f64>) -> Self {
        Self::after(Rest::new(attitude))
    }

    fn after(rest: Rest) -> Self {
        Self {
            rest,
            sums: [0.0; 3],
            summed: 0,
            after: MeanSquare::default(),
            quiet: MeanSquare::default(),
            quiet_up: MeanSquare::default(),
            stretches: LENGTHS.map(Stretches::new),
        }
    }

    /// Counts anew.
    pub(super) fn forget(&mut self) {
        *self = Self::after(self.rest);
    }

    /// Another step, at the end of which the block stands like this.
    pub(super) fn turned(&mut self, attitude: UnitQuaternion<f64>, seconds: f64) {
        self.rest.turned(attitude, seconds);
    }

    /// No turn for long enough.
    pub(super) fn is_quiet(&self) -> bool {
        self.rest.is_quiet()
    }

    /// Counts normalized innovations, east, north and up.
    pub(super) fn count(&mut self, normalized: [f64; 3]) {
        for stretches in &mut self.stretches {
            stretches.count(normalized);
        }
        let is_after = self.rest.is_after_turn();
        if !(is_after || self.is_quiet()) {
            (self.sums, self.summed) = ([0.0; 3], 0);
            return;
        }
        for (sum, value) in self.sums.iter_mut().zip(normalized) {
            *sum += value;
        }
        self.summed += 1;
        if self.summed == BLOCK {
            let means = self.sums.map(|sum| sum / f64::from(BLOCK).sqrt());
            if is_after {
                self.after.add(&means[..2]);
            } else {
                self.quiet.add(&means[..2]);
                self.quiet_up.add(&means[2..]);
            }
            (self.sums, self.summed) = ([0.0; 3], 0);
        }
    }

    /// Mean square after turns over that at rest, and how large it may be by chance; `None` where too few have been counted. A level
    /// at rest below the filter's own is taken as it is.
    pub fn ratio(&self) -> Option<(f64, f64)> {
        (self.after.count >= FEWEST && self.quiet.count >= FEWEST).then(|| {
            // F of two numbers of degrees, its variance made of both.
            let (of_after, of_quiet) = (self.after.excess() - 1.0, self.quiet.excess() - 1.0);
            (
                self.after.mean() / self.quiet.mean(),
                1.0 + of_after.hypot(of_quiet),
            )
        })
    }

    /// The mean square over long stretches that is farthest above one, and how far it may be by chance.
    pub fn whiteness(&self) -> Option<(f64, f64)> {
        let found = self.stretches.iter();
        found
            .flat_map(|stretches| [stretches.along, stretches.up])
            .filter(|square| square.count >= FEWEST)
            .map(|square| (square.mean(), square.excess() * LEVEL_TOLERANCE))
            .max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))
    }

    /// Mean square at rest, upwards too, and how large it may be.
    pub fn at_rest(&self) -> Option<(f64, f64)> {
        let all = self.quiet.and(self.quiet_up);
        (all.count >= FEWEST).then(|| (all.mean(), all.excess() * LEVEL_TOLERANCE))
    }
}
