//! The clock of a stream: stamps put in order, and what each means after the one before it.
//!
//! A stamp that follows its predecessor by about the usual interval goes through at once. Anything else is held back until the
//! next arrival tells what it was: a neighbour that came swapped, a hole, a clock that was set, or a stamp that is alone in its
//! opinion. Two consecutive arrivals that agree with each other, and not with the clock, move the clock; one never does.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::counts::{Refusal, StreamCounts};
use crate::time::Stamp;

/// An interval longer than this multiple of the usual one looks like missing samples.
const GAP_RATIO: f64 = 1.75;
/// Two arrivals this many usual intervals apart agree with each other.
const AGREE_RATIO: f64 = 10.0;
/// How fast the usual interval follows a change of rate, as a fraction of itself a sample.
const FOLLOW: f64 = 0.01;
/// Samples that the first usual interval is taken from; they are held back until it is known.
const START: usize = 8;
/// Arrivals that a held sample outlives.
const WINDOW: u32 = 8;
/// Samples that are held back at most.
const HELD: usize = 8;
/// Used samples that a repeat is recognized by.
const RECENT: usize = 8;

/// Why an epoch began.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum EpochCause {
    /// The first samples came.
    First,
    /// A hole too long to be bridged.
    Hole {
        /// Its length \[s\].
        seconds: f64,
    },
    /// The clock was set back.
    SetBack {
        /// By so much \[s\].
        seconds: f64,
    },
    /// Somebody asked for it.
    Asked,
}

impl std::fmt::Display for EpochCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::First => f.write_str("the first samples came"),
            Self::Hole { seconds } => write!(f, "a hole of {seconds:.3} s"),
            Self::SetBack { seconds } => write!(f, "the stamps were set back by {seconds:.3} s"),
            Self::Asked => f.write_str("asked for"),
        }
    }
}

/// What a stamp means after the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Follows {
    /// It starts the clock.
    Begins(EpochCause),
    /// It follows its predecessor after so many seconds.
    Regular(f64),
    /// Samples are missing before it.
    Hole {
        /// Time since the sample before the hole \[s\].
        interval_s: f64,
        /// Missing samples, by the usual interval.
        lost: u64,
    },
}

/// What comes out, in order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Ordered<T> {
    /// A sample in its place.
    Next(Stamp, T, Follows),
    /// A sample that has none.
    Refused(Stamp, Refusal),
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Held<T> {
    stamp: Stamp,
    value: T,
    /// Arrivals since.
    age: u32,
    /// Nothing that fits the clock has come since.
    fresh: bool,
}

/// Puts samples in the order of their stamps and counts what it sees.
///
/// ```
/// use sins::Stamp;
/// use sins::stream::order::{Ordered, StampOrder};
///
/// let mut order = StampOrder::default();
/// for millis in [0, 10, 20, 40, 30, 50, 0, 60, 70] {
///     order.push(Stamp::from_nanos(millis * 1_000_000), ());
/// }
/// order.end();
/// let mut used = Vec::new();
/// while let Some(next) = order.pop() {
///     if let Ordered::Next(stamp, ..) = next {
///         used.push(stamp.nanos() / 1_000_000);
///     }
/// }
/// assert_eq!(used, [0, 10, 20, 30, 40, 50, 60, 70]);
/// assert_eq!((order.counts().gaps, order.counts().refused()), (0, 1));
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StampOrder<T> {
    last: Option<Stamp>,
    usual_s: Option<f64>,
    /// Why the clock starts with the next sample.
    cause: EpochCause,
    start: Vec<(Stamp, T)>,
    held: VecDeque<Held<T>>,
    /// The last samples in their place, in a ring.
    recent: Vec<(Stamp, T)>,
    recent_oldest: usize,
    last_hole: Option<(Stamp, Stamp)>,
    ready: VecDeque<Ordered<T>>,
    counts: StreamCounts,
}

impl<T> Default for StampOrder<T> {
    fn default() -> Self {
        Self {
            last: None,
            usual_s: None,
            cause: EpochCause::First,
            start: Vec::new(),
            held: VecDeque::new(),
            recent: Vec::with_capacity(RECENT),
            recent_oldest: 0,
            last_hole: None,
            ready: VecDeque::new(),
            counts: StreamCounts::default(),
        }
    }
}

impl<T: Copy + PartialEq> StampOrder<T> {
    /// Takes a sample.
    #[inline]
    pub fn push(&mut self, stamp: Stamp, value: T) {
        let Some(usual) = self.usual_s else {
            self.gather_start(stamp, value);
            return;
        };
        let Some(last) = self.last else {
            self.begin(stamp, value, self.cause);
            return;
        };
        let interval_s = stamp.seconds_since(last);
        if interval_s > 0.0 && interval_s <= GAP_RATIO * usual {
            self.accept(stamp, value, Follows::Regular(interval_s));
            if !self.held.is_empty() {
                self.look_at_held();
            }
        } else {
            self.take_odd(stamp, value, usual);
        }
    }

    /// What comes next, in order; `None` until more has arrived.
    #[inline]
    pub fn pop(&mut self) -> Option<Ordered<T>> {
        self.ready.pop_front()
    }

    /// The same, left where it is.
    #[inline]
    pub fn peek(&self) -> Option<&Ordered<T>> {
        self.ready.front()
    }

    /// Samples that are ready.
    pub fn ready(&self) -> usize {
        self.ready.len()
    }

    /// No more will come: what is held back gets its place, or none.
    pub fn end(&mut self) {
        self.leave_start();
        // The last sample behind a hole has nobody to agree with it, and nobody to speak against it.
        while let Some(held) = self.held.pop_front() {
            self.refuse_held(&held);
        }
    }

    /// Starts the clock anew with the next sample; counts and the usual interval stay.
    pub fn restart(&mut self, cause: EpochCause) {
        self.leave_start();
        while let Some(held) = self.held.pop_front() {
            self.refuse_held(&held);
        }
        self.ready
            .retain(|ordered| matches!(ordered, Ordered::Refused(..)));
        self.last = None;
        self.last_hole = None;
        self.recent.clear();
        self.recent_oldest = 0;
        self.cause = cause;
    }

    /// Stamp of the newest sample in its place.
    pub fn last(&self) -> Option<Stamp> {
        self.last
    }

    /// The usual sampling interval \[s\], once it is known.
    pub fn usual_interval_s(&self) -> Option<f64> {
        self.usual_s
    }

    /// Counts of what was pushed.
    pub fn counts(&self) -> StreamCounts {
        self.counts
    }

    /// Between which samples the last hole was.
    pub(super) fn last_hole(&self) -> Option<(Stamp, Stamp)> {
        self.last_hole
    }

    /// Samples that wait for the next arrival to tell what they are.
    pub fn undecided(&self) -> usize {
        self.start.len() + self.held.len()
    }

    pub(super) fn counts_mut(&mut self) -> &mut StreamCounts {
        &mut self.counts
    }

    /// The first samples only tell the usual interval: two in a burst, a hole or a wild stamp among them must not be it.
    fn gather_start(&mut self, stamp: Stamp, value: T) {
        if self.start.iter().any(|(before, _)| *before == stamp) {
            self.refuse(stamp, Refusal::Repeated);
            return;
        }
        self.start.push((stamp, value));
        if self.start.len() >= START {
            self.leave_start();
        }
    }

    fn leave_start(&mut self) {
        let mut start = std::mem::take(&mut self.start);
        let Some(first) = start.first().copied() else {
            return;
        };
        let mut intervals: Vec<f64> = start
            .windows(2)
            .map(|pair| pair[1].0.seconds_since(pair[0].0))
            .filter(|interval| *interval > 0.0)
            .collect();
        intervals.sort_by(f64::total_cmp);
        let Some(usual) = intervals.get(intervals.len() / 2).copied() else {
            // One sample, or none after another.
            self.begin(first.0, first.1, self.cause);
            for (stamp, _) in start.drain(1..) {
                self.refuse(stamp, Refusal::Alone);
            }
            return;
        };
        self.usual_s = Some(usual);
        self.counts.reordered += start
            .windows(2)
            .filter(|pair| pair[1].0 < pair[0].0)
            .count() as u64;
        start.sort_by_key(|(stamp, _)| *stamp);
        let near = |a: usize, b: usize| start[b].0.seconds_since(start[a].0) <= AGREE_RATIO * usual;
        let has_company: Vec<bool> = (0..start.len())
            .map(|at| (at > 0 && near(at - 1, at)) || (at + 1 < start.len() && near(at, at + 1)))
            .collect();
        let anybody = has_company.contains(&true);
        for (&(stamp, value), company) in start.iter().zip(has_company) {
            if anybody && !company {
                self.refuse(stamp, Refusal::Alone);
            } else if let Some(last) = self.last {
                self.follow(stamp, value, stamp.seconds_since(last), None);
            } else {
                self.begin(stamp, value, self.cause);
            }
        }
    }

    /// A stamp that does not follow the clock.
    fn take_odd(&mut self, stamp: Stamp, value: T, usual: f64) {
        if self.recent.contains(&(stamp, value)) || self.held.iter().any(|h| h.stamp == stamp) {
            self.refuse(stamp, Refusal::Repeated);
            return;
        }
        if let Some(before) = self.held.back().copied().filter(|held| held.fresh) {
            let apart = stamp.seconds_since(before.stamp);
            let pair = if apart > 0.0 && apart <= AGREE_RATIO * usual {
                Some([(before.stamp, before.value), (stamp, value)])
            } else if apart < 0.0 && -apart <= GAP_RATIO * usual {
                Some([(stamp, value), (before.stamp, before.value)])
            } else {
                None
            };
            if let Some(pair) = pair
                && self.move_clock(pair, apart < 0.0)
            {
                return;
            }
        }
        if self.last == Some(stamp) {
            self.refuse(stamp, Refusal::Repeated);
            return;
        }
        if self.held.len() == HELD
            && let Some(oldest) = self.held.pop_front()
        {
            self.refuse_held(&oldest);
        }
        self.held.push_back(Held {
            stamp,
            value,
            age: 0,
            fresh: true,
        });
    }

    /// Two that agree move the clock, ahead or back; says whether they did.
    fn move_clock(&mut self, [first, second]: [(Stamp, T); 2], swapped: bool) -> bool {
        let (Some(last), Some(usual)) = (self.last, self.usual_s) else {
            return false;
        };
        if first.0 > last {
            self.held.pop_back();
            self.counts.reordered += u64::from(swapped);
            // What was held before them and lies before them, close by, came swapped.
            let mut between: Vec<Held<T>> = Vec::new();
            self.held.retain(|held| {
                let before_s = first.0.seconds_since(held.stamp);
                let is_between =
                    held.stamp > last && before_s > 0.0 && before_s <= AGREE_RATIO * usual;
                if is_between {
                    between.push(*held);
                }
                !is_between
            });
            between.sort_by_key(|held| held.stamp);
            for held in between {
                self.follow(held.stamp, held.value, self.since_last(held.stamp), None);
            }
            let after_s = second.0.seconds_since(first.0);
            let next_s = (after_s <= GAP_RATIO * usual).then_some(after_s);
            self.follow(first.0, first.1, self.since_last(first.0), next_s);
            self.follow(second.0, second.1, after_s, None);
            return true;
        }
        if second.0 > last {
            return false;
        }
        self.held.pop_back();
        let is_late = self
            .last_hole
            .is_some_and(|(from, to)| first.0 > from && second.0 < to);
        if is_late {
            self.refuse(first.0, Refusal::OutOfOrder);
            self.refuse(second.0, Refusal::OutOfOrder);
            return true;
        }
        while let Some(held) = self.held.pop_front() {
            self.refuse_held(&held);
        }
        self.recent.clear();
        self.recent_oldest = 0;
        self.last_hole = None;
        let seconds = last.seconds_since(first.0);
        self.begin(first.0, first.1, EpochCause::SetBack { seconds });
        self.follow(second.0, second.1, second.0.seconds_since(first.0), None);
        true
    }

    fn since_last(&self, stamp: Stamp) -> f64 {
        self.last.map_or(0.0, |last| stamp.seconds_since(last))
    }

    /// Accepts a sample that comes `interval_s` after the last one; where the next one is known, `next_s` after it, a late stamp is
    /// told from a hole: no sample is missing where two intervals make the time of two.
    fn follow(&mut self, stamp: Stamp, value: T, interval_s: f64, next_s: Option<f64>) {
        let usual = self.usual_s.unwrap_or(interval_s);
        let expected = |seconds: f64| (seconds / usual).round() as u64;
        let lost = if interval_s <= GAP_RATIO * usual {
            0
        } else if let Some(next_s) = next_s {
            expected(interval_s + next_s).saturating_sub(2)
        } else {
            expected(interval_s).saturating_sub(1).max(1)
        };
        let follows = if lost == 0 {
            Follows::Regular(interval_s)
        } else {
            Follows::Hole { interval_s, lost }
        };
        self.accept(stamp, value, follows);
    }

    fn begin(&mut self, stamp: Stamp, value: T, cause: EpochCause) {
        self.counts.restarts += u64::from(matches!(cause, EpochCause::SetBack { .. }));
        self.accept(stamp, value, Follows::Begins(cause));
    }

    #[inline]
    fn accept(&mut self, stamp: Stamp, value: T, follows: Follows) {
        self.counts.samples += 1;
        let interval_s = match follows {
            Follows::Begins(_) => None,
            Follows::Regular(interval_s) => Some(interval_s),
            Follows::Hole { interval_s, lost } => {
                self.counts.gaps += 1;
                self.counts.lost += lost;
                self.last_hole = self.last.map(|last| (last, stamp));
                Some(interval_s)
            }
        };
        if let Some((interval_s, usual)) = interval_s.zip(self.usual_s) {
            let step = FOLLOW * usual;
            self.usual_s = Some(usual + (interval_s - usual).clamp(-step, step));
        }
        self.last = Some(stamp);
        if let Some(oldest) = self.recent.get_mut(self.recent_oldest) {
            *oldest = (stamp, value);
        } else {
            self.recent.push((stamp, value));
        }
        self.recent_oldest = (self.recent_oldest + 1) % RECENT;
        self.ready.push_back(Ordered::Next(stamp, value, follows));
    }

    /// After a sample that fits the clock: those that were held may fit now, and the others grow old.
    fn look_at_held(&mut self) {
        while let (Some(last), Some(usual)) = (self.last, self.usual_s) {
            let fits = |held: &Held<T>| {
                let after_s = held.stamp.seconds_since(last);
                after_s > 0.0 && after_s <= GAP_RATIO * usual
            };
            let Some(at) = self.held.iter().position(fits) else {
                break;
            };
            if let Some(held) = self.held.remove(at) {
                self.counts.reordered += 1;
                let after_s = held.stamp.seconds_since(last);
                self.accept(held.stamp, held.value, Follows::Regular(after_s));
            }
        }
        for held in &mut self.held {
            held.fresh = false;
            held.age += 1;
        }
        while self.held.front().is_some_and(|held| held.age > WINDOW) {
            if let Some(held) = self.held.pop_front() {
                self.refuse_held(&held);
            }
        }
    }

    fn refuse_held(&mut self, held: &Held<T>) {
        let late_s = self.last.map_or(0.0, |last| last.seconds_since(held.stamp));
        let near_s = self.usual_s.unwrap_or(0.0) * 2.0 * f64::from(WINDOW);
        let in_hole = self
            .last_hole
            .is_some_and(|(from, to)| held.stamp > from && held.stamp < to);
        let why = if in_hole || (late_s >= 0.0 && late_s <= near_s) {
            Refusal::OutOfOrder
        } else {
            Refusal::Alone
        };
        self.refuse(held.stamp, why);
    }

    pub(super) fn refuse(&mut self, stamp: Stamp, why: Refusal) {
        self.counts.refuse(&why);
        self.ready.push_back(Ordered::Refused(stamp, why));
    }
}

#[cfg(test)]
#[path = "order_tests.rs"]
mod tests;
