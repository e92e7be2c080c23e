//! Watches the stamps of a sampled stream: rate, gaps, repeated and backward stamps.
//!
//! It stands on nothing, so that a node and the report on a recording count alike.

use std::collections::VecDeque;

/// Intervals that the usual interval is taken from.
const WINDOW: usize = 31;
/// An interval this much longer than the usual one is a gap.
const GAP_FACTOR: f64 = 1.5;

/// Counters of one stream. Pure: feed it every stamp, ask it at any time.
///
/// The usual interval is the median of the last 31, so that it is found out and not assumed, and follows a change of
/// rate. A gap is an interval longer than 1.5 times the usual one.
///
/// ```
/// let mut monitor = stream_monitor::StreamMonitor::default();
/// for k in [0, 1, 2, 3, 4, 7, 8, 8] {
///     monitor.ingest(k * 10_000_000);
/// }
/// assert_eq!((monitor.gaps(), monitor.lost(), monitor.repeated()), (1, 2, 1));
/// assert_eq!(monitor.rate(), Some(100.0));
/// ```
#[derive(Clone, Debug, Default)]
pub struct StreamMonitor {
    received: u64,
    gaps: u64,
    lost: u64,
    repeated: u64,
    backward: u64,
    zero: u64,
    last_nanos: Option<i64>,
    longest_nanos: i64,
    recent: VecDeque<i64>,
    sorted: Vec<i64>,
}

impl StreamMonitor {
    /// Takes the next stamp, in nanoseconds; `true` where it follows a gap.
    pub fn ingest(&mut self, stamp_nanos: i64) -> bool {
        self.received += 1;
        if stamp_nanos == 0 {
            self.zero += 1;
            return false;
        }
        let Some(last) = self.last_nanos else {
            self.last_nanos = Some(stamp_nanos);
            return false;
        };
        let interval = stamp_nanos - last;
        if interval == 0 {
            self.repeated += 1;
            return false;
        }
        self.last_nanos = Some(stamp_nanos);
        if interval < 0 {
            self.backward += 1;
            return false;
        }
        self.longest_nanos = self.longest_nanos.max(interval);
        let usual = self.interval_nanos();
        let is_gap = usual.is_some_and(|usual| interval as f64 > GAP_FACTOR * usual as f64);
        if let (true, Some(usual)) = (is_gap, usual) {
            self.gaps += 1;
            self.lost += ((interval as f64 / usual as f64).round() as u64).saturating_sub(1);
        }
        self.remember(interval);
        is_gap
    }

    fn remember(&mut self, interval: i64) {
        if self.recent.len() == WINDOW
            && let Some(oldest) = self.recent.pop_front()
            && let Ok(at) = self.sorted.binary_search(&oldest)
        {
            self.sorted.remove(at);
        }
        self.recent.push_back(interval);
        let at = self.sorted.partition_point(|kept| *kept < interval);
        self.sorted.insert(at, interval);
    }

    /// The usual interval; `None` before three intervals.
    pub fn interval_nanos(&self) -> Option<i64> {
        (self.sorted.len() >= 3).then(|| self.sorted[self.sorted.len() / 2])
    }

    /// Samples in a second of stamp time, by the usual interval.
    pub fn rate(&self) -> Option<f64> {
        self.interval_nanos().map(|nanos| 1e9 / nanos as f64)
    }

    /// Stamps taken.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Times that samples are missing.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Samples missing in all gaps, by the usual interval.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Stamps equal to the one before.
    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Stamps earlier than the one before.
    pub fn backward(&self) -> u64 {
        self.backward
    }

    /// Stamps that were never set.
    pub fn zero(&self) -> u64 {
        self.zero
    }

    /// How much the last 31 intervals differ: the longest less the shortest; `None` before three intervals.
    pub fn jitter_nanos(&self) -> Option<i64> {
        match (self.sorted.as_slice(), self.interval_nanos()) {
            ([shortest, .., longest], Some(_)) => Some(longest - shortest),
            _ => None,
        }
    }

    /// Newest stamp.
    pub fn last_nanos(&self) -> Option<i64> {
        self.last_nanos
    }

    /// Longest interval.
    pub fn longest_nanos(&self) -> i64 {
        self.longest_nanos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(stamps: impl IntoIterator<Item = i64>) -> StreamMonitor {
        let mut monitor = StreamMonitor::default();
        stamps.into_iter().for_each(|stamp| {
            monitor.ingest(stamp);
        });
        monitor
    }

    /// Jitter below half an interval is no gap.
    #[test]
    fn jitter_is_no_gap() {
        let monitor = of((0..100).map(|k| k * 1000 + if k % 2 == 0 { 200 } else { 0 }));
        assert_eq!((monitor.gaps(), monitor.lost()), (0, 0));
    }

    /// A pause is one gap, with the samples it should have had.
    #[test]
    fn a_pause_is_one_gap() {
        let monitor = of((0..50).chain(150..200).map(|k| k * 1000));
        assert_eq!((monitor.gaps(), monitor.lost()), (1, 100));
    }

    /// Another rate becomes the usual one, instead of gaps for ever.
    #[test]
    fn a_change_of_rate_is_followed() {
        let monitor = of((0..100)
            .map(|k| k * 1000)
            .chain((0..100).map(|k| 100_000 + k * 4000)));
        assert_eq!(monitor.interval_nanos(), Some(4000));
        assert!(monitor.gaps() <= 16, "{}", monitor.gaps());
    }

    /// Stamps that stand or go back are counted and give no interval.
    #[test]
    fn repeated_and_backward_stamps_are_counted() {
        let monitor = of([0, 10, 20, 30, 30, 20, 30, 40]);
        assert_eq!(
            (monitor.repeated(), monitor.backward(), monitor.gaps()),
            (1, 1, 0)
        );
    }
}
