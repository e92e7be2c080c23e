//! The time of the node: the system's, or that of `/clock`, which the Spinner of ros2-client subscribes as another type
//! (`docs/upstream/ros2-client-clock.md`).

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ros2_interfaces::rosgraph_msgs;
use tokio::sync::watch;

use crate::subscription::Subscription;

/// Tells the time, in nanoseconds since the epoch. Clones are the same clock.
#[derive(Clone, Debug)]
pub struct Clock {
    source: Arc<watch::Sender<Source>>,
    jumps: Arc<Mutex<Jumps>>,
}

/// Jumps back, told at most so often: two publishers of `/clock` make one with nearly every tick.
const TELL_JUMPS: Duration = Duration::from_secs(10);

/// What there is to tell of jumps back.
#[derive(Debug, Default)]
struct Jumps {
    told: Option<Instant>,
    /// Since then.
    count: u64,
}

impl Jumps {
    /// A jump at `now`; how many there were since the last line, where a line is due.
    fn count(&mut self, now: Instant) -> Option<u64> {
        self.count += 1;
        let is_due = self
            .told
            .is_none_or(|told| now.saturating_duration_since(told) >= TELL_JUMPS);
        is_due.then(|| {
            self.told = Some(now);
            std::mem::take(&mut self.count)
        })
    }
}

/// Where the time comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    System,
    /// The newest time of `/clock`, zero before the first.
    Simulated(i64),
}

impl Source {
    const fn new(use_sim_time: bool) -> Self {
        if use_sim_time {
            Self::Simulated(0)
        } else {
            Self::System
        }
    }
}

impl Clock {
    pub(crate) fn new(use_sim_time: bool) -> Self {
        Self {
            source: Arc::new(watch::Sender::new(Source::new(use_sim_time))),
            jumps: Arc::default(),
        }
    }

    /// Switches between system time and that of `/clock`.
    fn simulate(&self, use_sim_time: bool) {
        if use_sim_time != self.is_simulated() {
            self.source.send_replace(Source::new(use_sim_time));
        }
    }

    /// Now, in nanoseconds. In simulated time this is zero until `/clock` has been heard.
    pub fn now_nanos(&self) -> i64 {
        match *self.source.borrow() {
            Source::Simulated(now) => now,
            Source::System => system_nanos(),
        }
    }

    /// Whether the time is that of `/clock`.
    pub fn is_simulated(&self) -> bool {
        *self.source.borrow() != Source::System
    }

    /// Waits until it is `nanos`; at once where it is later already.
    pub async fn sleep_until(&self, nanos: i64) {
        let mut source = self.source.subscribe();
        loop {
            let now = *source.borrow_and_update();
            // The sender lives in `self`, so that the channel does not close while anybody waits.
            match now {
                Source::Simulated(now) if now >= nanos => return,
                Source::Simulated(_) => {
                    source.changed().await.ok();
                }
                Source::System => {
                    let ahead = u64::try_from(nanos - system_nanos()).unwrap_or(0);
                    tokio::select! {
                        () = tokio::time::sleep(Duration::from_nanos(ahead)) => return,
                        _ = source.changed() => {}
                    }
                }
            }
        }
    }

    /// Waits for a span of this clock.
    pub async fn sleep(&self, span: Duration) {
        let nanos = i64::try_from(span.as_nanos()).unwrap_or(i64::MAX);
        self.sleep_until(self.now_nanos().saturating_add(nanos))
            .await;
    }

    /// Waits until there is a time: at once in system time, at the first `/clock` in simulated time.
    pub async fn wait_until_known(&self) {
        self.sleep_until(1).await;
    }

    /// Takes a time of `/clock`; without effect in system time.
    fn tick(&self, now: i64) {
        let mut before = now;
        self.source.send_if_modified(|source| match source {
            Source::Simulated(time) => {
                before = std::mem::replace(time, now);
                true
            }
            Source::System => false,
        });
        if now >= before {
            return;
        }
        // A panic elsewhere leaves a count that is right.
        let mut jumps = self.jumps.lock().unwrap_or_else(PoisonError::into_inner);
        let back_s = (before - now) as f64 * 1e-9;
        match jumps.count(Instant::now()) {
            Some(1) => tracing::warn!("/clock went back by {back_s:.3} s"),
            Some(times) => tracing::warn!(
                "/clock went back {times} times, the last time by {back_s:.3} s: does more than one node publish it?"
            ),
            None => {}
        }
    }

    /// Follows the parameter `use_sim_time`, and `/clock` while it is on, until the task is stopped. `subscribe` makes
    /// the subscription.
    pub(crate) async fn follow(
        self,
        use_sim_time: impl Fn() -> bool,
        mut changes: watch::Receiver<u64>,
        subscribe: impl Fn() -> Option<Subscription<rosgraph_msgs::Clock>>,
    ) {
        loop {
            let simulated = use_sim_time();
            if simulated != self.is_simulated() {
                let source = if simulated {
                    "that of /clock"
                } else {
                    "the system's"
                };
                tracing::info!("use_sim_time: the time is now {source}");
            }
            self.simulate(simulated);
            let mut ticks = if simulated { subscribe() } else { None };
            while use_sim_time() == simulated {
                tokio::select! {
                    tick = next(&mut ticks) => self.tick(tick.clock.nanos()),
                    changed = changes.changed() => if changed.is_err() { return },
                }
            }
        }
    }
}

/// The next tick; never, without a subscription.
async fn next(ticks: &mut Option<Subscription<rosgraph_msgs::Clock>>) -> rosgraph_msgs::Clock {
    match ticks {
        Some(ticks) => ticks.recv().await,
        None => std::future::pending().await,
    }
}

/// System time in nanoseconds since 1970.
pub(crate) fn system_nanos() -> i64 {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Simulated time stands still until it is set, and wakes sleepers when it passes their time.
    #[tokio::test]
    async fn sleepers_wake_by_simulated_time() {
        let clock = Clock::new(true);
        assert_eq!(clock.now_nanos(), 0);
        let sleeper = tokio::spawn({
            let clock = clock.clone();
            async move {
                clock.sleep_until(1000).await;
                clock.now_nanos()
            }
        });
        for now in [500, 1500] {
            tokio::task::yield_now().await;
            clock.tick(now);
        }
        assert_eq!(sleeper.await.unwrap(), 1500);
    }

    /// Two publishers that differ are a line in ten seconds, not one a tick.
    #[test]
    fn jumps_back_do_not_flood() {
        let (mut jumps, begin) = (Jumps::default(), Instant::now());
        let told: Vec<u64> = (0..1000)
            .filter_map(|tick| jumps.count(begin + Duration::from_millis(20 * tick)))
            .collect();
        assert_eq!(told, [1, 500]);
    }

    /// Switching the source wakes sleepers, which then go by the new one.
    #[tokio::test]
    async fn sleepers_survive_a_switch() {
        let clock = Clock::new(true);
        let sleeper = tokio::spawn({
            let clock = clock.clone();
            async move { clock.sleep_until(1000).await }
        });
        tokio::task::yield_now().await;
        assert!(!sleeper.is_finished());
        clock.simulate(false);
        assert!(!clock.is_simulated() && clock.now_nanos() > 1000);
        sleeper.await.unwrap();
        clock.simulate(true);
        assert_eq!(clock.now_nanos(), 0);
    }
}
