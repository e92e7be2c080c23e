//! The noise of the sensors from a record at rest: Allan deviations of each axis, and the noises in them.
//!
//! [`Allan`] is fed readings one after the other, of a record of any length. Its memory is that of
//! [`deviation::BYTES_AN_OCTAVE`] an octave of averaging times, whatever the length: 2.8 MB for a day at 1 kHz.
//! Where the table turns (by its joints, or by a rate that no rest has) the stretch ends, with a guard before and after;
//! no difference reaches over that, nor over a hole. Shorter holes are bridged, and counted.
//!
//! Sources: IEEE 952-1997, annex C; NIST SP 1065.

pub mod confidence;
mod counts;
pub mod deviation;
pub mod fit;

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

use confidence::{NoiseType, band, degrees_of_freedom};
use counts::Beginning;
use deviation::{AXES, Deviations, starts};
use fit::{Fit, Variance};

use crate::error::Error;
use crate::sensor::ImuSample;
use crate::stream::counts::{Refused, StreamCounts};
use crate::stream::{Interval, Item, Reading, Stream, StreamSettings};
use crate::time::Stamp;

/// Names of the axes, in the order of all arrays here.
pub const AXIS_NAMES: [&str; AXES] = [
    "gyroscope_x",
    "gyroscope_y",
    "gyroscope_z",
    "accelerometer_x",
    "accelerometer_y",
    "accelerometer_z",
];
/// Fewer samples at rest say nothing.
const LEAST_SAMPLES: u64 = 64;
/// A joint that has moved by more turns \[rad\]: what encoders of any grade do not show at rest.
const TURN_RAD: f64 = 1e-3;
/// An axis that is faster than this turns \[rad/s\]: 1 deg/s.
const TURN_RATE_RAD_S: f64 = 0.017_453_292_519_943_295;
/// So long before and after a turn nothing is used \[s\]: a table is still slow then.
const GUARD_S: f64 = 2.0;

/// What to say, and what to bridge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AllanSettings {
    /// Probability that the truth lies within a band.
    pub confidence: f64,
    /// A longer hole in the samples ends a stretch \[s\].
    pub longest_bridge_s: f64,
}

impl Default for AllanSettings {
    fn default() -> Self {
        Self {
            confidence: 0.95,
            longest_bridge_s: 1.0,
        }
    }
}

/// A point of a curve; deviations in rad/s or m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples that are averaged.
    pub factor: u64,
    /// Averaging time \[s\].
    pub tau_s: f64,
    /// Second differences that it is made of.
    pub terms: u64,
    /// Allan deviation.
    pub deviation: f64,
    /// Ends between which the true one lies.
    pub band: [f64; 2],
    /// Equivalent degrees of freedom.
    pub degrees_of_freedom: f64,
    /// The noise that is greatest here.
    pub noise: NoiseType,
}

/// What is known of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// By averaging time.
    pub points: Vec<Point>,
    /// The noises in it.
    pub fit: Fit,
    /// The increment that all increments are multiples of, where the sensor gives whole counts \[rad or m/s\].
    pub count: Option<f64>,
}

impl Axis {
    /// The least deviation; 1.5 times it is no less than the bias instability.
    pub fn least(&self) -> Option<&Point> {
        let by_deviation = |a: &&Point, b: &&Point| a.deviation.total_cmp(&b.deviation);
        self.points.iter().min_by(by_deviation)
    }
}

/// What a record says.
#[derive(Clone, Debug, PartialEq)]
pub struct AllanResult {
    /// Mean sampling interval \[s\].
    pub interval_s: f64,
    /// Samples at rest, those that stand for missing ones among them.
    pub samples: u64,
    /// Unbroken stretches.
    pub stretches: u64,
    /// Missing samples that were bridged.
    pub bridged: u64,
    /// Samples that were left out because the table turned.
    pub turning: u64,
    /// What became of all samples.
    pub counts: StreamCounts,
    /// In the order of [`AXIS_NAMES`].
    pub axes: [Axis; AXES],
    /// What the phases took \[bytes\].
    pub memory_bytes: usize,
}

/// A sample that waits for the guard.
#[derive(Clone, Copy, Debug)]
struct Held {
    stamp: Stamp,
    values: [f64; AXES],
    times: u64,
}

/// The analysis: readings in, a result at the end.
#[derive(Clone, Debug)]
pub struct Allan {
    settings: AllanSettings,
    stream: Stream,
    deviations: Deviations,
    beginning: Beginning,
    held: VecDeque<Held>,
    rest_angles: Option<[f64; 2]>,
    last_turn: Option<Stamp>,
    is_in_stretch: bool,
    refused: VecDeque<Refused>,
    regular: (u64, f64),
    samples: u64,
    stretches: u64,
    bridged: u64,
    turning: u64,
}

impl Allan {
    /// One that waits for its first sample.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(settings: AllanSettings) -> Result<Self, Error> {
        if !(settings.confidence > 0.0 && settings.confidence < 1.0) {
            return Err(Error::setting(
                "confidence",
                settings.confidence,
                "more than 0 and less than 1",
            ));
        }
        crate::range::not_negative("longest bridged hole [s]", settings.longest_bridge_s)?;
        Ok(Self {
            settings,
            stream: Stream::new(StreamSettings {
                longest_bridge_s: settings.longest_bridge_s,
                longest_told_hole_s: settings.longest_bridge_s,
                joint_patience_s: GUARD_S,
                ..StreamSettings::default()
            })?,
            deviations: Deviations::default(),
            beginning: Beginning::default(),
            held: VecDeque::new(),
            rest_angles: None,
            last_turn: None,
            is_in_stretch: false,
            refused: VecDeque::new(),
            regular: (0, 0.0),
            samples: 0,
            stretches: 0,
            bridged: 0,
            turning: 0,
        })
    }

    /// Takes a reading; positions and velocities say nothing here.
    ///
    /// # Errors
    /// [`Error::NotFinite`]; the reading is left out.
    pub fn push(&mut self, reading: &Reading) -> Result<(), Error> {
        match reading {
            Reading::Imu(sample) => self.stream.push_sample(sample),
            Reading::Joints(joints) => self.stream.push_joints(*joints)?,
            Reading::Fix(_) | Reading::Position(_) | Reading::Velocity(..) => return Ok(()),
        }
        self.drain();
        Ok(())
    }

    /// A sample that is not used.
    pub fn poll_refused(&mut self) -> Option<Refused> {
        self.refused.pop_front()
    }

    fn drain(&mut self) {
        while let Some(item) = self.stream.next() {
            match item {
                Item::Refused(refused) => self.refused.push_back(refused),
                Item::Epoch { .. } => {
                    self.use_held(None);
                    self.part();
                }
                Item::Interval(interval, sample) => self.take(&interval, &sample),
            }
        }
    }

    fn take(&mut self, interval: &Interval, sample: &ImuSample) {
        let (values, times) = if let Some(hole) = &interval.hole {
            // The mean of the ends, as often as samples are missing, and once for the one that ends it.
            let [a, b] = &hole.ends;
            let rate = 0.5 * (a.angular_rate + b.angular_rate);
            let force = 0.5 * (a.specific_force + b.specific_force);
            (joined(&rate, &force), hole.lost + 1)
        } else {
            self.regular.0 += 1;
            self.regular.1 += interval.increment.interval_s;
            (joined(&sample.angular_rate, &sample.specific_force), 1)
        };
        let stamp = interval.stamp;
        if self.turns(sample) {
            self.last_turn = Some(stamp);
            self.turning += self.held.iter().map(|held| held.times).sum::<u64>();
            self.held.clear();
            self.part();
        }
        let near = |turn: Stamp| stamp.seconds_since(turn) <= GUARD_S;
        if self.last_turn.is_some_and(near) {
            self.turning += times;
            return;
        }
        self.held.push_back(Held {
            stamp,
            values,
            times,
        });
        self.use_held(Some(stamp));
    }

    fn turns(&mut self, sample: &ImuSample) -> bool {
        let mut turns = sample.angular_rate.amax() > TURN_RATE_RAD_S;
        if self.stream.joints().last().is_some() {
            let angles = self.stream.joints().angles_at(sample.stamp);
            let rest = *self.rest_angles.get_or_insert(angles);
            if (0..2).any(|joint| (angles[joint] - rest[joint]).abs() > TURN_RAD) {
                self.rest_angles = Some(angles);
                turns = true;
            }
        }
        turns
    }

    /// Uses what is older than the guard before `newest`; all of it where nothing more comes.
    fn use_held(&mut self, newest: Option<Stamp>) {
        while let Some(held) = self.held.front().copied() {
            if newest.is_some_and(|newest| newest.seconds_since(held.stamp) <= GUARD_S) {
                return;
            }
            self.held.pop_front();
            if !self.is_in_stretch {
                self.is_in_stretch = true;
                self.stretches += 1;
            }
            self.samples += held.times;
            self.bridged += held.times - 1;
            if held.times == 1 {
                self.beginning.push(&held.values);
            }
            for _ in 0..held.times {
                self.deviations.push(&held.values);
            }
        }
    }

    fn part(&mut self) {
        self.is_in_stretch = false;
        self.deviations.part();
    }

    /// No more will come.
    ///
    /// # Errors
    /// [`Error::Setting`] where there are too few samples at rest.
    pub fn finish(&mut self) -> Result<AllanResult, Error> {
        self.stream.end();
        self.drain();
        self.use_held(None);
        if self.samples < LEAST_SAMPLES || self.regular.0 == 0 {
            return Err(Error::setting(
                "number of samples at rest",
                self.samples,
                format!(
                    "at least {LEAST_SAMPLES} (of {} the table turned)",
                    self.turning
                ),
            ));
        }
        let interval_s = self.regular.1 / self.regular.0 as f64;
        Ok(AllanResult {
            interval_s,
            samples: self.samples,
            stretches: self.stretches,
            bridged: self.bridged,
            turning: self.turning,
            counts: self.stream.counts(),
            axes: std::array::from_fn(|axis| self.axis(axis, interval_s)),
            memory_bytes: self.deviations.bytes(),
        })
    }

    fn axis(&self, axis: usize, interval_s: f64) -> Axis {
        let sums: Vec<_> = self
            .deviations
            .sums()
            // Fewer than one more averaging time than the least: no more than one degree of freedom.
            .filter(|(factor, sum)| sum.terms >= starts(*factor))
            .map(|(factor, sum)| {
                let mean = sum.squares[axis] / sum.terms as f64;
                let square = (factor * factor) as f64;
                (factor, sum.terms, mean / (2.0 * square))
            })
            .collect();
        let curve: Vec<_> = sums
            .iter()
            .map(|&(factor, terms, value)| Variance {
                tau_s: factor as f64 * interval_s,
                value,
                pairs: 0.5 * (terms as f64 / starts(factor) as f64 + 2.0),
            })
            .collect();
        let fit = fit::fit(&curve);
        let points = sums
            .iter()
            .map(|&(factor, terms, variance)| {
                let tau_s = factor as f64 * interval_s;
                let noise = fit.greatest(tau_s);
                let degrees = degrees_of_freedom(noise, factor, starts(factor), terms);
                let deviation = variance.sqrt();
                Point {
                    factor,
                    tau_s,
                    terms,
                    deviation,
                    band: band(deviation, degrees, self.settings.confidence),
                    degrees_of_freedom: degrees,
                    noise,
                }
            })
            .collect();
        Axis {
            points,
            fit,
            count: self.beginning.step(axis).map(|step| step * interval_s),
        }
    }
}

fn joined(rate: &nalgebra::Vector3<f64>, force: &nalgebra::Vector3<f64>) -> [f64; AXES] {
    [rate.x, rate.y, rate.z, force.x, force.y, force.z]
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
