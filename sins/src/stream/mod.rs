//! Samples, joint states and velocities as they come, put into the order of their stamps and cut into epochs.
//!
//! Three steps, each in its file, each of which holds back only what looks odd:
//! 1. [`plausibility`] refuses what no sensor gave. A jump waits for the next sample, which tells a spike from a motion.
//! 2. [`order`] is the clock. What does not follow the usual interval waits for the next arrival.
//! 3. [`Stream`] joins the samples with what came beside them. Samples wait for the joint state and the velocity of their time where
//!    the settings say so, and behind a hole always for the joint state, because the encoders say what the table turned in it. All
//!    patience is counted by the samples' own stamps, never by a clock. What has been waited for in vain is not waited for
//!    again until it speaks: a topic that dies costs its patience once.
//!
//! An **epoch** is a stretch of time without a break. What belongs to one (the sample before, the readings of the joints) is
//! one value that is made anew when an epoch begins; nothing is cleared by hand. Positions pass through where they are measured
//! against; for the place of an alignment only the newest counts, which has no need of order.
//!
//! ```
//! use sins::{Stamp, sensor::ImuSample, stream::{Item, Stream, StreamSettings}};
//!
//! let mut stream = Stream::new(StreamSettings::default())?;
//! let (mut intervals, mut refused, mut epochs) = (0, 0, 0);
//! let mut take = |item: Item| match item {
//!     Item::Epoch { .. } => epochs += 1,
//!     Item::Interval(..) => intervals += 1,
//!     Item::Refused(_) => refused += 1,
//! };
//! for k in 0..100 {
//!     let mut sample = ImuSample::at_rest(Stamp::from_nanos(k * 10_000_000), 9.8);
//!     if k == 50 {
//!         sample.angular_rate.x = 1e30;
//!     }
//!     stream.push_sample(&sample);
//!     while let Some(item) = stream.next() {
//!         take(item);
//!     }
//! }
//! stream.end();
//! while let Some(item) = stream.next() {
//!     take(item);
//! }
//! assert_eq!((epochs, intervals, refused), (1, 98, 1));
//! assert_eq!((stream.counts().gaps, stream.counts().lost), (1, 1));
//! # Ok::<(), sins::Error>(())
//! ```

pub mod counts;
pub mod joint_history;
mod lane;
pub mod order;
pub mod plausibility;
mod reading;

use serde::{Deserialize, Serialize};

use counts::{Refused, StreamCounts};
use joint_history::JointHistory;
use lane::Lane;
use order::{EpochCause, Follows, Ordered, StampOrder};
use plausibility::{SensorRange, Sieve, Sifted};
pub use reading::Reading;

use crate::error::Error;
use crate::sensor::{ImuSample, Increment, PositionMeasurement, VelocityMeasurement};
use crate::table::JointSample;
use crate::time::{Stamp, seconds_to_nanos};

/// How long a sample behind a hole waits for the joint state of its time, by the stamps \[s\].
const HOLE_PATIENCE_S: f64 = 2.0;
/// Settings of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StreamSettings {
    /// A longer hole begins an epoch, unless the joints tell the turn in it \[s\].
    pub longest_bridge_s: f64,
    /// A longer hole begins an epoch, whatever the joints tell \[s\].
    pub longest_told_hole_s: f64,
    /// How much later than a sample its joint state may come \[s\]; 0: only samples behind a hole wait.
    pub joint_patience_s: f64,
    /// How much later than a sample its velocity may come \[s\]; none: velocities are left aside.
    pub velocity_patience_s: Option<f64>,
    /// How much later than a sample its position may come \[s\]; none: positions are left aside.
    pub position_patience_s: Option<f64>,
    /// What the sensors can give.
    pub range: SensorRange,
}

impl Default for StreamSettings {
    fn default() -> Self {
        Self {
            longest_bridge_s: 5.0,
            longest_told_hole_s: 3600.0,
            joint_patience_s: 0.0,
            velocity_patience_s: None,
            position_patience_s: None,
            range: SensorRange::default(),
        }
    }
}

/// What the encoders say of a hole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableTurn {
    /// Angles (outer, inner) at the last sample before it \[rad\].
    pub from: [f64; 2],
    /// Angles at the first sample after it \[rad\].
    pub to: [f64; 2],
    /// One-sigma of each, by the distance of the readings in time \[rad\]; the encoders' own noise is not in it.
    pub sigma_rad: f64,
}

/// A hole in the samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hole {
    /// Time since the sample before it \[s\].
    pub interval_s: f64,
    /// Missing samples, by the usual interval.
    pub lost: u64,
    /// The samples at its ends.
    pub ends: [ImuSample; 2],
    /// What was turned in it, where the encoders say so.
    pub turned: Option<TableTurn>,
}

/// A position, and how the table stood at the end of its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositionAt {
    /// The position.
    pub measurement: PositionMeasurement,
    /// Angles (outer, inner) \[rad\]; zero where no joint state has come.
    pub angles: [f64; 2],
}

/// One interval between two samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Its end.
    pub stamp: Stamp,
    /// What the sensors gathered; over a hole, by the mean of its ends.
    pub increment: Increment,
    /// The last velocity at or before its end that has not been handed out.
    pub velocity: Option<VelocityMeasurement>,
    /// The last position at or before its end that has not been handed out.
    pub position: Option<Box<PositionAt>>,
    /// Where samples are missing in it.
    pub hole: Option<Box<Hole>>,
}

/// What comes out of a stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// An epoch begins with this sample, which ends an interval of unknown length.
    Epoch {
        /// The sample.
        sample: ImuSample,
        /// Why.
        cause: EpochCause,
    },
    /// An interval, and the sample that ends it.
    Interval(Interval, ImuSample),
    /// A sample that is not used.
    Refused(Refused),
}

/// What belongs to one epoch, and to no other.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Epoch {
    previous: Option<ImuSample>,
    joints: JointHistory,
}

/// The stream: inputs in, items out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Stream {
    settings: StreamSettings,
    sieve: Sieve,
    order: StampOrder<ImuSample>,
    joints: Lane<JointSample>,
    velocities: Lane<VelocityMeasurement>,
    positions: Lane<PositionMeasurement>,
    epoch: Epoch,
    newest: Option<Stamp>,
    ended: bool,
}

impl Stream {
    /// A stream that waits for its first sample.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(settings: StreamSettings) -> Result<Self, Error> {
        settings.range.check()?;
        Ok(Self {
            settings,
            sieve: Sieve::new(settings.range),
            order: StampOrder::default(),
            joints: Lane::default(),
            velocities: Lane::default(),
            positions: Lane::default(),
            epoch: Epoch::default(),
            newest: None,
            ended: false,
        })
    }

    /// The settings that it was made with.
    pub fn settings(&self) -> &StreamSettings {
        &self.settings
    }

    /// Takes a sample.
    #[inline]
    pub fn push_sample(&mut self, sample: &ImuSample) {
        self.newest = Some(sample.stamp);
        let order = &mut self.order;
        self.sieve.push(sample, |sifted| sort(order, sifted));
    }

    /// Takes a reading of the joints.
    ///
    /// # Errors
    /// [`Error::NotFinite`]; the reading is left out.
    pub fn push_joints(&mut self, joints: JointSample) -> Result<(), Error> {
        for (what, values) in [
            ("joint position", joints.position),
            ("joint velocity", joints.velocity),
        ] {
            if !values.iter().all(|value| value.is_finite()) {
                return Err(Error::NotFinite {
                    what,
                    stamp: joints.stamp,
                });
            }
        }
        if self.joints.push(joints.stamp, joints) {
            self.epoch.joints = JointHistory::default();
        }
        Ok(())
    }

    /// Takes a velocity over ground, where velocities are asked for.
    ///
    /// # Errors
    /// [`Error::NotFinite`], or [`Error::Setting`] where a sigma is not positive; the velocity is left out.
    pub fn push_velocity(
        &mut self,
        stamp: Stamp,
        measurement: VelocityMeasurement,
    ) -> Result<(), Error> {
        if !measurement.east_north.iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite {
                what: "aiding velocity",
                stamp,
            });
        }
        if !measurement.sigma.iter().all(|v| v.is_finite() && *v > 0.0) {
            return Err(Error::setting(
                "one-sigma of the aiding velocity in m/s",
                format!("{:?}", measurement.sigma),
                "positive numbers",
            ));
        }
        if self.settings.velocity_patience_s.is_some() {
            self.velocities.push(stamp, measurement);
        }
        Ok(())
    }

    /// Takes a position, where positions are asked for and it says how well it knows.
    ///
    /// # Errors
    /// As [`Position::checked`](crate::earth::Position::checked); the position is left out.
    pub fn push_position(&mut self, measurement: PositionMeasurement) -> Result<(), Error> {
        measurement.position.checked()?;
        if self.settings.position_patience_s.is_some() && measurement.is_measured() {
            self.positions.push(measurement.stamp, measurement);
        }
        Ok(())
    }

    /// No more will come: what is held back or waits gets its place, or none.
    pub fn end(&mut self) {
        let order = &mut self.order;
        self.sieve.end(|sifted| sort(order, sifted));
        self.order.end();
        self.ended = true;
    }

    /// Begins an epoch with the next sample. What waits is left out; counts go on.
    pub fn restart(&mut self) {
        let order = &mut self.order;
        self.sieve.end(|sifted| sort(order, sifted));
        self.order.restart(EpochCause::Asked);
        self.epoch = Epoch {
            // The encoders go on, whoever asks for a restart.
            previous: None,
            ..self.epoch
        };
    }

    /// What comes next; `None` until more has arrived.
    #[allow(clippy::should_implement_trait, reason = "more may come after None")]
    pub fn next(&mut self) -> Option<Item> {
        let &Ordered::Next(stamp, _, follows) = self.order.peek()? else {
            let refused = self.order.pop()?;
            return match refused {
                Ordered::Refused(stamp, why) => Some(Item::Refused(Refused { stamp, why })),
                Ordered::Next(..) => None,
            };
        };
        if self.must_wait(stamp, follows) {
            return None;
        }
        let Some(Ordered::Next(_, sample, _)) = self.order.pop() else {
            return None;
        };
        Some(match follows {
            Follows::Begins(cause) => self.begin(sample, cause),
            Follows::Regular(interval_s) => self.interval(sample, interval_s, None),
            Follows::Hole { interval_s, lost } => self.behind_hole(sample, interval_s, lost),
        })
    }

    /// Readings of the joints up to the sample that was handed out last.
    pub fn joints(&self) -> &JointHistory {
        &self.epoch.joints
    }

    /// Stamp of the newest sample that arrived, be it handed out or not.
    pub fn newest(&self) -> Option<Stamp> {
        self.newest
    }

    /// The usual sampling interval \[s\].
    pub fn usual_interval_s(&self) -> Option<f64> {
        self.order.usual_interval_s()
    }

    /// Samples that wait, for the next arrival or for what belongs to their time.
    pub fn waiting(&self) -> usize {
        self.order.ready() + self.order.undecided() + usize::from(self.sieve.waits())
    }

    /// Whether samples wait for a joint state or a velocity.
    pub fn waits_beside(&self) -> bool {
        self.order.ready() > 0
    }

    /// Counts of everything so far.
    pub fn counts(&self) -> StreamCounts {
        StreamCounts {
            side_refused: self.joints.refused()
                + self.velocities.refused()
                + self.positions.refused(),
            ..self.order.counts()
        }
    }

    #[inline]
    fn must_wait(&mut self, stamp: Stamp, follows: Follows) -> bool {
        let Some(newest) = self.order.last().filter(|_| !self.ended) else {
            return false;
        };
        // Behind a clock that was set back there is nothing to wait for on the old one.
        let mut age_nanos = newest.nanos() - stamp.nanos();
        // And in a hole nothing could come.
        if let Some((from, to)) = self.order.last_hole()
            && stamp <= from
        {
            age_nanos -= to.nanos() - from.nanos();
        }
        let joint_patience_s = match follows {
            Follows::Hole { .. } => self.settings.joint_patience_s.max(HOLE_PATIENCE_S),
            _ => self.settings.joint_patience_s,
        };
        let told = match (follows, self.epoch.previous) {
            // What was read before the hole says little of its end.
            (Follows::Hole { .. }, Some(previous)) => self.joints.tells(previous.stamp, stamp),
            _ => self.joints.covers(stamp),
        };
        if joint_patience_s > 0.0 && self.joints.is_awaited() && !told {
            if (0..seconds_to_nanos(joint_patience_s)).contains(&age_nanos) {
                return true;
            }
            self.joints.give_up();
        }
        let within = |patience_s: f64| (0..=seconds_to_nanos(patience_s)).contains(&age_nanos);
        if let Some(patience_s) = self.settings.velocity_patience_s
            && !self.velocities.is_silent()
            && !self.velocities.covers(stamp)
        {
            if within(patience_s) {
                return true;
            }
            self.velocities.give_up();
        }
        if let Some(patience_s) = self.settings.position_patience_s
            && self.positions.is_awaited()
            && !self.positions.covers(stamp)
        {
            if within(patience_s) {
                return true;
            }
            self.positions.give_up();
        }
        false
    }

    fn begin(&mut self, sample: ImuSample, cause: EpochCause) -> Item {
        if matches!(cause, EpochCause::SetBack { .. }) {
            self.joints.begin_epoch();
            self.velocities.begin_epoch();
            self.positions.begin_epoch();
            self.epoch = Epoch::default();
        }
        self.epoch.previous = Some(sample);
        self.take_joints(sample.stamp);
        // A velocity of before the first interval belongs to none.
        while self.velocities.pop_until(sample.stamp).is_some() {}
        while self.positions.pop_until(sample.stamp).is_some() {}
        Item::Epoch { sample, cause }
    }

    fn behind_hole(&mut self, sample: ImuSample, interval_s: f64, lost: u64) -> Item {
        let before = self.epoch.previous.map(|previous| previous.stamp);
        let from = before.and_then(|before| {
            while let Some((_, joints)) = self.joints.pop_until(before) {
                self.epoch.joints.push(joints);
            }
            let foretold = self.epoch.joints.foretold_at(before);
            self.take_joints(before);
            surer(self.epoch.joints.told_at(before), foretold)
        });
        self.take_joints(sample.stamp);
        let enclosed = self.epoch.joints.told_at(sample.stamp);
        let next = self.joints.peek();
        let traced = next.and_then(|next| self.epoch.joints.traced_back_to(sample.stamp, next));
        let to = surer(enclosed, traced);
        let turned = from.zip(to).map(|(from, to)| TableTurn {
            from: from.0,
            to: to.0,
            sigma_rad: from.1.hypot(to.1),
        });
        let longest_s = if turned.is_some() {
            self.settings.longest_told_hole_s
        } else {
            self.settings.longest_bridge_s
        };
        if interval_s > longest_s {
            self.order.counts_mut().restarts += 1;
            self.epoch = Epoch {
                previous: None,
                ..self.epoch
            };
            let seconds = interval_s;
            return self.begin(sample, EpochCause::Hole { seconds });
        }
        self.interval(sample, interval_s, Some((lost, turned)))
    }

    #[inline]
    fn interval(
        &mut self,
        sample: ImuSample,
        interval_s: f64,
        hole: Option<(u64, Option<TableTurn>)>,
    ) -> Item {
        self.take_joints(sample.stamp);
        let mut velocity = None;
        while let Some((_, next)) = self.velocities.pop_until(sample.stamp) {
            velocity = Some(next);
        }
        let mut position = None;
        while let Some((_, measurement)) = self.positions.pop_until(sample.stamp) {
            position = Some(Box::new(PositionAt {
                measurement,
                angles: self.epoch.joints.angles_at(sample.stamp),
            }));
        }
        let (mut rate, mut force) = (sample.angular_rate, sample.specific_force);
        let hole = hole.and_then(|(lost, turned)| {
            let before = self.epoch.previous?;
            // Over a hole the rates are taken half way between its ends.
            rate = 0.5 * (before.angular_rate + rate);
            force = 0.5 * (before.specific_force + force);
            Some(Box::new(Hole {
                interval_s,
                lost,
                ends: [before, sample],
                turned,
            }))
        });
        self.epoch.previous = Some(sample);
        let interval = Interval {
            stamp: sample.stamp,
            increment: Increment::from_averages(interval_s, &rate, &force),
            velocity,
            position,
            hole,
        };
        Item::Interval(interval, sample)
    }

    /// Readings of the joints, up to the first that is not earlier than `stamp`.
    #[inline]
    fn take_joints(&mut self, stamp: Stamp) {
        while self
            .epoch
            .joints
            .last()
            .is_none_or(|last| last.stamp < stamp)
        {
            let Some((_, joints)) = self.joints.pop() else {
                return;
            };
            self.epoch.joints.push(joints);
        }
    }
}

/// Whichever of two tellings of the joints' angles is surer.
fn surer(one: Option<([f64; 2], f64)>, other: Option<([f64; 2], f64)>) -> Option<([f64; 2], f64)> {
    match (one, other) {
        (Some(one), Some(other)) => Some(if other.1 < one.1 { other } else { one }),
        (one, other) => one.or(other),
    }
}

#[inline]
fn sort(order: &mut StampOrder<ImuSample>, sifted: Sifted<'_>) {
    match sifted {
        Sifted::Good(sample) => order.push(sample.stamp, *sample),
        Sifted::Bad(sample, why) => order.refuse(sample.stamp, why),
    }
}

#[cfg(test)]
#[path = "stream_tests.rs"]
mod tests;
