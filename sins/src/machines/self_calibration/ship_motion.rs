//! How the moored ship moves, as the innovations of her velocity show it while the block rests.
//!
//! The variance of the velocity that is taken to be zero has a floor, which is what the settings say, and follows the innovations
//! slowly above it: `r = ν² − (s − r')` of every update, of which the filter's own uncertainty `s − r'` is taken out (adaptive
//! filtering by covariance matching: Mehra, IEEE Trans. Automatic Control 17, 1972). Turns do not teach it: what they leave in
//! the velocity is the sensor's.

use serde::{Deserialize, Serialize};

use crate::estimation::measurement::Innovation;

/// How fast it follows \[s\].
const MEMORY_S: f64 = 300.0;

/// Velocity of the ship, east, north, up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ShipMotion {
    /// Variance that the innovations show \[m²/s²\].
    learned: [f64; 3],
    floor_m_s: f64,
    /// So much more variance than what was learned is used.
    allowance: f64,
}

impl ShipMotion {
    /// Begins at one sigma of `starting_m_s`, and never goes below one of `floor_m_s`.
    pub(super) fn new(starting_m_s: f64, floor_m_s: f64) -> Self {
        Self {
            learned: [starting_m_s.max(floor_m_s).powi(2); 3],
            floor_m_s,
            allowance: 1.0,
        }
    }

    /// Waves come in groups: what was learned over five minutes may be half of what the next one brings.
    pub(super) fn with_allowance(self, allowance: f64) -> Self {
        let learned = self.learned.map(|variance| variance / allowance);
        Self {
            learned,
            allowance,
            ..self
        }
    }

    /// One-sigma of an axis \[m/s\]; where nothing above the floor was seen, the floor to the last bit.
    #[inline]
    pub(super) fn sigma_m_s(&self, axis: usize) -> f64 {
        let variance = self.allowance * self.learned[axis];
        if variance > self.floor_m_s.powi(2) * (1.0 + 1e-12) {
            variance.sqrt()
        } else {
            self.floor_m_s
        }
    }

    /// Whether she was seen to move by more than she was said to.
    pub(super) fn is_above_floor(&self) -> bool {
        (0..3).any(|axis| self.sigma_m_s(axis) > self.floor_m_s)
    }

    /// One-sigma of the axes \[m/s\].
    pub(super) fn sigmas_m_s(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.sigma_m_s(axis))
    }

    /// Takes the innovation of an update that was made with a sigma of `used_m_s`.
    #[inline]
    pub(super) fn learn(
        &mut self,
        axis: usize,
        innovation: &Innovation,
        used_m_s: f64,
        seconds: f64,
    ) {
        let share = (seconds / MEMORY_S).min(1.0);
        let seen = innovation.value.powi(2) - (innovation.variance - used_m_s.powi(2));
        let least = self.floor_m_s.powi(2) / self.allowance;
        let learned = &mut self.learned[axis];
        *learned = (*learned + (seen - *learned) * share).max(least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Innovations below the floor change nothing, to the last bit; those above it are followed within some memories, and forgotten
    /// again.
    #[test]
    fn motion_is_followed_above_the_floor() {
        let mut motion = ShipMotion::new(0.0, 0.01).with_allowance(2.0);
        let innovation = |value: f64, variance: f64| Innovation {
            value,
            variance: variance + 1e-6,
        };
        let mut go = |value: f64, updates: usize| {
            for k in 0..updates {
                let signed = if k % 2 == 0 { value } else { -value };
                let sigma = motion.sigma_m_s(0);
                motion.learn(0, &innovation(signed, sigma.powi(2)), sigma, 1.0);
            }
            motion.sigmas_m_s()
        };
        let [still, other, _] = go(1e-3, 1000);
        assert!(still.to_bits() == 0.01_f64.to_bits() && other.to_bits() == still.to_bits());
        let [rolling, ..] = go(0.3, 1500);
        assert!((rolling / 0.3 - 2.0_f64.sqrt()).abs() < 0.01, "{rolling}");
        let [calm, ..] = go(1e-3, 3000);
        assert!((calm - 0.01).abs() < 1e-9, "{calm}");
    }
}
