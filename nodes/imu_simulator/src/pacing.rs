//! Simulated time against the wall clock.

use std::time::{Duration, Instant};

/// A simulation that is later than this does not race to catch up: time goes on from where it is.
const MAX_LAG: Duration = Duration::from_millis(100);

/// Says when the next sample is due.
#[derive(Clone, Debug)]
pub struct Pacer {
    speed: f64,
    wall: Instant,
    simulated_nanos: i64,
}

impl Pacer {
    /// Simulated time `simulated_nanos` is now; `speed` is the multiple of real time, 0 for no pacing at all.
    pub fn new(speed: f64, now: Instant, simulated_nanos: i64) -> Self {
        Self {
            speed,
            wall: now,
            simulated_nanos,
        }
    }

    /// When simulated time is to be `simulated_nanos`; `None`: at once, whenever that is.
    pub fn due(&self, simulated_nanos: i64) -> Option<Instant> {
        if self.speed == 0.0 {
            return None;
        }
        let ahead_s = (simulated_nanos - self.simulated_nanos).max(0) as f64 * 1e-9 / self.speed;
        // A wait beyond what an Instant can hold is as good as any other that nobody lives to see.
        Some(self.wall + Duration::from_secs_f64(ahead_s.min(1e9)))
    }

    /// Forgets a lag that cannot be caught up in a moment.
    pub fn forgive(&mut self, now: Instant, simulated_nanos: i64) {
        if self
            .due(simulated_nanos)
            .is_some_and(|due| now.saturating_duration_since(due) > MAX_LAG)
        {
            (self.wall, self.simulated_nanos) = (now, simulated_nanos);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 100 times real time a second of simulation is due after 10 ms; without pacing at once.
    #[test]
    fn due_times_follow_the_speed() {
        let now = Instant::now();
        let pacer = Pacer::new(100.0, now, 5);
        assert_eq!(
            pacer.due(1_000_000_005),
            Some(now + Duration::from_millis(10))
        );
        assert_eq!(Pacer::new(0.0, now, 5).due(1_000_000_005), None);
    }

    /// A short lag is made good, a long one is forgiven.
    #[test]
    fn only_long_lags_are_forgiven() {
        let start = Instant::now();
        for (late_ms, shift_ms) in [(50, 0), (500, 500)] {
            let mut pacer = Pacer::new(1.0, start, 0);
            pacer.forgive(start + Duration::from_millis(late_ms), 0);
            assert_eq!(pacer.due(0), Some(start + Duration::from_millis(shift_ms)));
        }
    }
}
