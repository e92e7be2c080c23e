//! What the stamps of a sample stream say: intervals, gaps, repeats, time that runs back.

use crate::time::Stamp;

/// An interval longer than this multiple of the usual one means that samples are missing.
const GAP_RATIO: f64 = 1.75;
/// How fast the running median follows a change of rate, as a fraction of itself a sample.
const MEDIAN_STEP: f64 = 0.01;

/// What one stamp means after the one before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interval {
    /// The first sample: it ends an interval of unknown length, so it only starts the clock.
    First,
    /// A sample that follows its predecessor; the length of its interval \[s\].
    Regular(f64),
    /// A sample after a hole; the time since the last sample \[s\] and how many samples are missing.
    Gap {
        /// Time since the sample before the hole \[s\].
        interval_s: f64,
        /// Missing samples, by the usual interval.
        lost: u64,
    },
    /// The stamp of the last sample again. The sample must not be used.
    Repeated,
    /// Earlier than the last sample by this much \[s\]. The sample must not be used.
    Backward(f64),
}

/// Counts of a stream since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamCounts {
    /// Samples that were used (the first one included).
    pub samples: u64,
    /// Holes in the stream.
    pub gaps: u64,
    /// Samples missing in those holes.
    pub lost: u64,
    /// Samples refused because their stamp repeated the last one.
    pub repeated: u64,
    /// Samples refused because their stamp ran back.
    pub backward: u64,
}

/// Classifies stamps as they come, by a running median of the intervals.
#[derive(Clone, Debug, Default)]
pub struct SampleClock {
    last: Option<Stamp>,
    median_s: Option<f64>,
    counts: StreamCounts,
}

impl SampleClock {
    /// Says what the next stamp means, and counts it.
    pub fn classify(&mut self, stamp: Stamp) -> Interval {
        let Some(last) = self.last else {
            self.last = Some(stamp);
            self.counts.samples = 1;
            return Interval::First;
        };
        if stamp == last {
            self.counts.repeated += 1;
            return Interval::Repeated;
        }
        let interval_s = stamp.seconds_since(last);
        if interval_s < 0.0 {
            self.counts.backward += 1;
            return Interval::Backward(-interval_s);
        }
        self.last = Some(stamp);
        self.counts.samples += 1;
        let median = *self.median_s.get_or_insert(interval_s);
        let step = MEDIAN_STEP * median;
        self.median_s = Some(median + (interval_s - median).clamp(-step, step));
        if interval_s > GAP_RATIO * median {
            let lost = ((interval_s / median).round() as u64)
                .saturating_sub(1)
                .max(1);
            self.counts.gaps += 1;
            self.counts.lost += lost;
            return Interval::Gap { interval_s, lost };
        }
        Interval::Regular(interval_s)
    }

    /// Stamp of the last sample that was used.
    pub fn last(&self) -> Option<Stamp> {
        self.last
    }

    /// The usual sampling interval \[s\], once two samples have come.
    pub fn usual_interval_s(&self) -> Option<f64> {
        self.median_s
    }

    /// Counts since the start of the stream.
    pub fn counts(&self) -> StreamCounts {
        self.counts
    }

    /// Forgets the last stamp, so that the next sample starts the clock anew; the counts go on.
    pub fn restart(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(stamps_ms: &[i64]) -> (SampleClock, Vec<Interval>) {
        let mut clock = SampleClock::default();
        let kinds = stamps_ms
            .iter()
            .map(|ms| clock.classify(Stamp::from_nanos(ms * 1_000_000)))
            .collect();
        (clock, kinds)
    }

    /// Two missing samples are one gap of two.
    #[test]
    fn a_hole_is_counted_by_stamp() {
        let (clock, kinds) = run(&[0, 10, 20, 50, 60]);
        assert_eq!(
            kinds[3],
            Interval::Gap {
                interval_s: 0.03,
                lost: 2
            }
        );
        assert_eq!(
            (
                clock.counts().gaps,
                clock.counts().lost,
                clock.counts().samples
            ),
            (1, 2, 5)
        );
    }

    /// Jitter of 40 % of the interval loses nothing.
    #[test]
    fn jitter_is_no_gap() {
        let (clock, _) = run(&[0, 10, 24, 30, 36, 50, 60]);
        assert_eq!(clock.counts().gaps, 0);
    }

    /// A repeated and an earlier stamp are refused and counted, and the clock stays where it was.
    #[test]
    fn repeats_and_steps_back_are_refused() {
        let (clock, kinds) = run(&[0, 10, 10, 5, 20]);
        assert_eq!(kinds[2], Interval::Repeated);
        assert_eq!(kinds[3], Interval::Backward(0.005));
        assert_eq!(kinds[4], Interval::Regular(0.01));
        assert_eq!(
            (
                clock.counts().repeated,
                clock.counts().backward,
                clock.counts().samples
            ),
            (1, 1, 3)
        );
    }
}
