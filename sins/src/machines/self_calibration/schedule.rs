//! When a covariance step is due, by the stamps.

use serde::{Deserialize, Serialize};

use crate::time::{Stamp, seconds_to_nanos};

/// Covariance steps at a period, and no sooner than half of one after a step of another cause.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Schedule {
    period_nanos: i64,
    next: Stamp,
}

impl Schedule {
    /// The first step is due a period after `start`.
    pub(super) fn new(start: Stamp, period_s: f64) -> Self {
        let period_nanos = seconds_to_nanos(period_s).max(1);
        Self {
            period_nanos,
            next: start.plus_nanos(period_nanos),
        }
    }

    /// The time between steps \[s\].
    pub(super) fn period_s(&self) -> f64 {
        self.period_nanos as f64 * 1e-9
    }

    /// Whether it was made with this period.
    pub(super) fn has_period(&self, period_s: f64) -> bool {
        self.period_nanos == seconds_to_nanos(period_s).max(1)
    }

    /// Whether a step is due at the end of an interval of this length: at the sample that is nearest to its time.
    #[inline]
    pub(super) fn is_due(&self, stamp: Stamp, interval_s: f64) -> bool {
        // Most samples are farther from it than an interval, and need not be rounded.
        let ahead_nanos = self.next.nanos() - stamp.nanos();
        ahead_nanos as f64 <= 1e9 * interval_s && seconds_to_nanos(0.5 * interval_s) >= ahead_nanos
    }

    /// The step was made; the next one is due at the next time of the period.
    pub(super) fn made(&mut self, stamp: Stamp, interval_s: f64) {
        let reached = stamp.plus_nanos(seconds_to_nanos(0.5 * interval_s));
        let behind = reached.nanos() - self.next.nanos();
        if behind >= 0 {
            let periods = behind / self.period_nanos + 1;
            self.next = self.next.plus_nanos(periods * self.period_nanos);
        }
    }

    /// A measurement made the step. The period begins with it, and the next step is due where no other measurement comes for
    /// half a period more.
    pub(super) fn made_by_measurement(&mut self, stamp: Stamp) {
        self.next = stamp.plus_nanos(self.period_nanos + self.period_nanos / 2);
    }
}
