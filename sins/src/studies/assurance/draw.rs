//! Random numbers of a drawn world.

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A generator with the distributions that worlds are drawn from.
#[derive(Clone, Debug)]
pub struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// Numbers that the seed and the number of the world decide.
    pub fn new(seed: u64, world: u64) -> Self {
        // Neighbouring worlds share nothing: the golden ratio spreads their numbers over all bits.
        Self(Xoshiro256PlusPlus::seed_from_u64(
            seed ^ (world + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15),
        ))
    }

    /// A seed for the simulator.
    pub fn seed(&mut self) -> u64 {
        self.0.random()
    }

    /// One of both with equal chance.
    pub fn coin(&mut self) -> bool {
        self.0.random()
    }

    /// Uniform in a range.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Uniform in the logarithm.
    pub fn log_within(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    /// Normal with this one-sigma, cut at 2.5 sigma: a maker sorts the others out.
    pub fn normal(&mut self, sigma: f64) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.0);
        sigma * normal.clamp(-2.5, 2.5)
    }

    /// Either sign.
    pub fn signed(&mut self, size: f64) -> f64 {
        if self.coin() { size } else { -size }
    }

    /// A vector of [`Self::normal`] numbers.
    pub fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal(sigma))
    }

    /// A vector of numbers of this size and either sign.
    pub fn signs(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.signed(size))
    }

    /// A matrix of [`Self::normal`] numbers without a diagonal.
    pub fn off_diagonal(&mut self, sigma: f64) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| {
            if row == column {
                0.0
            } else {
                self.normal(sigma)
            }
        })
    }
}
