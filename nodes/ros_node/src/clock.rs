//! The time of the node: the system's, or that of `/clock`.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rotary_sins_msgs::rosgraph_msgs;
use tokio::sync::watch;

use crate::subscription::Subscription;

/// Tells the time, in nanoseconds since the epoch.
#[derive(Clone, Debug)]
pub struct Clock {
    // `None`: system time. Otherwise the newest time of /clock, zero before the first.
    simulated: Option<Arc<watch::Sender<i64>>>,
}

impl Clock {
    pub(crate) fn new(use_sim_time: bool) -> Self {
        Self {
            simulated: use_sim_time.then(|| Arc::new(watch::Sender::new(0))),
        }
    }

    /// Now, in nanoseconds. In simulated time this is zero until `/clock` has been heard.
    pub fn now_nanos(&self) -> i64 {
        match &self.simulated {
            Some(time) => *time.borrow(),
            None => system_nanos(),
        }
    }

    /// Whether the time is that of `/clock`.
    pub fn is_simulated(&self) -> bool {
        self.simulated.is_some()
    }

    /// Waits until it is `nanos`; at once where it is later already.
    pub async fn sleep_until(&self, nanos: i64) {
        if let Some(time) = &self.simulated {
            // The sender lives in `self`, so that waiting can only end by the time having come.
            time.subscribe().wait_for(|now| *now >= nanos).await.ok();
        } else {
            let ahead = u64::try_from(nanos - system_nanos()).unwrap_or(0);
            tokio::time::sleep(Duration::from_nanos(ahead)).await;
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
        if self.simulated.is_some() {
            self.sleep_until(1).await;
        }
    }

    /// Follows `/clock` until the task is stopped.
    pub(crate) async fn follow(self, mut ticks: Subscription<rosgraph_msgs::Clock>) {
        let Some(time) = &self.simulated else { return };
        loop {
            let tick = ticks.recv().await.clock;
            let now = i64::from(tick.sec) * 1_000_000_000 + i64::from(tick.nanosec);
            let before = time.send_replace(now);
            if now < before {
                tracing::warn!("/clock went back by {:.3} s", (before - now) as f64 * 1e-9);
            }
        }
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
            clock.simulated.as_ref().unwrap().send_replace(now);
        }
        assert_eq!(sleeper.await.unwrap(), 1500);
    }
}
