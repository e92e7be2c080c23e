//! The simulated world: a ship, a table on it, an IMU on the table, and what aids it.
//!
//! [`Plant`] is the truth: it turns the table as commanded and gives, for every sampling interval, the exact average of angular
//! rate and specific force. [`ImuErrors`], [`Encoder`] and [`Aiding`] make measurements of it. One truth can be measured
//! any number of times with other errors and seeds, which is what a Monte Carlo does. [`Simulator`] is the plant with one set of
//! sensors; [`Run`] is a simulator and a [`Sequencer`](crate::table::scheme::Sequencer) in lockstep, in memory.
//!
//! Everything random comes from generators seeded by the caller, one stream for each sensor: the same seed gives the
//! same samples to the last bit, and another encoder does not change the noise of the IMU.

mod aiding;
mod block;
mod encoder;
mod grade;
mod imu;
mod plant;
mod readings;
mod run;
mod ship;
mod simulator;
mod table;
mod truth;

pub use aiding::{Aiding, AidingSettings, PositionFix, TimeWindow, VelocityFix};
pub use encoder::{Encoder, EncoderSettings};
pub use grade::{DrawnSensor, GRADE_NAMES, SensorGrade};
pub use imu::{ImuErrorSettings, ImuErrors, NoiseReading, OutputSettings, Wandering};
pub use plant::{Plant, PlantSettings};
pub use run::Run;
pub use ship::{Course, Hull, MotionSettings, Ship, ShipMotion, ShipState, Swing, WaveSystem};
pub use simulator::{Simulator, SimulatorSettings, Tick};
pub use table::{Table, TableSettings};
pub use truth::{AccelerometerTruth, TruthSample};

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Which sensor a stream of random numbers belongs to.
#[derive(Clone, Copy)]
enum Stream {
    Imu = 0,
    Encoder = 1,
    Position = 2,
    Velocity = 3,
    Sea = 4,
    Walk = 5,
    Stamp = 6,
    Outlier = 7,
    Grade = 8,
}

/// The generator of one sensor: streams of one seed are 2^128 numbers apart.
fn generator(seed: u64, stream: Stream) -> Xoshiro256PlusPlus {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..stream as usize {
        generator.jump();
    }
    generator
}

/// A moment that comes round `rate_hz` times a second, counted without drift in whole numbers.
///
/// Rates are taken to the millihertz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cadence {
    millihertz: i128,
}

impl Cadence {
    fn new(name: &str, rate_hz: f64, max_hz: f64) -> Result<Self, crate::Error> {
        let millihertz = (rate_hz * 1e3).round();
        if !(1.0..=max_hz * 1e3).contains(&millihertz) {
            return Err(crate::Error::setting(
                name,
                rate_hz,
                format!("0.001 to {max_hz} Hz"),
            ));
        }
        Ok(Self {
            millihertz: millihertz as i128,
        })
    }

    /// When the `count`-th moment comes, from the start \[ns\].
    fn nanos(self, count: u64) -> i64 {
        ((i128::from(count) * 1_000_000_000_000 + self.millihertz / 2) / self.millihertz) as i64
    }

    /// How many moments have come by `nanos` from the start.
    fn count(self, nanos: i64) -> i64 {
        ((i128::from(nanos) * self.millihertz + self.millihertz / 2).div_euclid(1_000_000_000_000))
            as i64
    }

    /// Whether one of the moments lies after `from` and not after `to` \[ns from the start\].
    fn comes_in(self, from: i64, to: i64) -> bool {
        self.count(to) > self.count(from)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Stamps of a rate that does not divide a second neither drift nor repeat.
    #[test]
    fn cadence_does_not_drift() {
        let cadence = Cadence::new("rate", 300.0, 1000.0).unwrap();
        assert_eq!(cadence.nanos(1), 3_333_333);
        assert_eq!(cadence.nanos(300 * 86_400), 86_400_000_000_000);
        assert!(Cadence::new("rate", 0.0, 1000.0).is_err());
    }

    /// A slow cadence picks the right one of the fast one's moments, whether it divides it or not.
    #[test]
    fn slow_cadence_counts_on_fast_moments() {
        for (fast, slow) in [(100.0, 1.0), (300.0, 100.0), (300.0, 7.0), (10.0, 10.0)] {
            let (f, s) = (
                Cadence::new("f", fast, 1e3).unwrap(),
                Cadence::new("s", slow, 1e3).unwrap(),
            );
            let hits = (0..fast as u64 * 60)
                .filter(|k| s.comes_in(f.nanos(*k), f.nanos(k + 1)))
                .count();
            assert_eq!(hits, slow as usize * 60, "{fast} {slow}");
        }
    }
}
