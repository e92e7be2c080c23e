//! The sending end of a topic.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use futures::FutureExt;
use ros2_client::Message;
use rustdds::GUID;

use crate::graph::Graph;
use crate::lifecycle::Gate;
use crate::qos::Qos;

/// What became of a message.
#[must_use = "who says that something was published must look whether it was; else `left_to_diagnostics` says who tells it"]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Published {
    /// The middleware took it, for the subscribers that there are.
    Sent,
    /// Nobody subscribes now; the topic is transient local, so that it is kept for whoever comes.
    Kept,
    /// Nobody subscribes: it is lost.
    Unheard,
    /// The node is not active: nothing leaves it.
    Inactive,
    /// The middleware had no room for it or no way to write it.
    Refused {
        /// Messages of this publisher that it refused so far.
        dropped: u64,
    },
}

impl Published {
    /// Whether somebody gets it: subscribers that are there, or those of a transient local topic that come later.
    pub fn is_on_its_way(self) -> bool {
        matches!(self, Self::Sent | Self::Kept)
    }

    /// Nobody has to be told here: refusals are counted, logged at their beginning and end, and told by the diagnostics task
    /// `topics`.
    pub fn left_to_diagnostics(self) {}
}

impl fmt::Display for Published {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sent => f.write_str("published"),
            Self::Kept => {
                f.write_str("kept for later subscribers: nobody subscribes to it at present")
            }
            Self::Unheard => f.write_str("not published: nobody subscribes to it"),
            Self::Inactive => f.write_str("not published: the node is not active"),
            Self::Refused { dropped } => write!(
                f,
                "not published: the middleware refused it, {dropped} messages so far"
            ),
        }
    }
}

/// Publishes messages of one type on one topic. Clones share the same writer.
///
/// [`publish`](Self::publish) never waits: where the window of unacknowledged samples is full (a subscriber hangs or
/// was killed), the message is dropped, counted and told in the diagnostics. A sender that runs faster than real
/// time uses [`publish_within`](Self::publish_within), which waits for room: that is the back-pressure.
#[derive(Debug)]
pub struct Publisher<M: Message> {
    shared: Arc<Shared<M>>,
}

impl<M: Message> Clone for Publisher<M> {
    fn clone(&self) -> Self {
        Self {
            shared: Arc::clone(&self.shared),
        }
    }
}

struct Shared<M: Message> {
    writer: ros2_client::Publisher<M>,
    guid: GUID,
    graph: Arc<Graph>,
    gate: Gate,
    transient_local: bool,
    /// The newest message of a topic that keeps the present alone, until somebody is there to get it. RustDDS would keep up to
    /// 8192 where nobody acknowledges them, and send them all to whoever comes (`docs/upstream/rustdds-latched-history.md`).
    present: Option<Mutex<Option<M>>>,
    // Told once while the gate is closed.
    told_inactive: AtomicBool,
    statistics: Arc<PublisherStatistics>,
}

impl<M: Message> fmt::Debug for Shared<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Publisher")
            .field("topic", &self.statistics.topic)
            .finish_non_exhaustive()
    }
}

impl<M: Message> Shared<M> {
    // The message is taken or put in one step, so a panic elsewhere leaves it whole.
    fn present(&self) -> Option<MutexGuard<'_, Option<M>>> {
        let present = self.present.as_ref()?;
        Some(present.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Keeps the message, and hands it back where somebody is there to hear it. In this order: whoever is matched between the two
    /// steps is told by [`Publisher::deliver_present`].
    fn hold_until_heard<'a>(
        &self,
        mut present: MutexGuard<'a, Option<M>>,
        message: M,
    ) -> (MutexGuard<'a, Option<M>>, Option<M>) {
        *present = Some(message);
        let heard = if self.graph.matched(self.guid) > 0 {
            present.take()
        } else {
            None
        };
        (present, heard)
    }
}

impl<M: Message> Drop for Shared<M> {
    fn drop(&mut self) {
        self.graph.forget(self.guid);
    }
}

/// Counters of a publisher, shared with the diagnostics.
#[derive(Debug, Default)]
pub struct PublisherStatistics {
    topic: String,
    published: AtomicU64,
    dropped: AtomicU64,
    dropping: AtomicBool,
}

impl PublisherStatistics {
    /// Absolute name of the topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Messages that the middleware took.
    pub fn published(&self) -> u64 {
        self.published.load(Ordering::Relaxed)
    }

    /// Messages that had no room.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

impl<M: Message> Publisher<M> {
    pub(crate) fn new(
        writer: ros2_client::Publisher<M>,
        topic: &str,
        graph: Arc<Graph>,
        gate: Gate,
        qos: Qos,
    ) -> Self {
        let guid = writer.guid();
        graph.register(guid, topic, None);
        let statistics = Arc::new(PublisherStatistics {
            topic: topic.to_owned(),
            ..Default::default()
        });
        Self {
            shared: Arc::new(Shared {
                writer,
                guid,
                graph,
                gate,
                transient_local: qos.transient_local,
                present: (qos.transient_local && qos.depth == 1).then(Mutex::default),
                told_inactive: AtomicBool::new(false),
                statistics,
            }),
        }
    }

    /// Hands the message over without waiting and says what became of it. A node that is not active publishes nothing.
    pub fn publish(&self, message: M) -> Published {
        if !self.is_active() {
            return Published::Inactive;
        }
        let Some(present) = self.shared.present() else {
            return self.write(message);
        };
        match self.shared.hold_until_heard(present, message) {
            // The lock is held meanwhile: what is newer is written later.
            (present, Some(message)) => {
                let published = self.write(message);
                drop(present);
                published
            }
            (_, None) => Published::Kept,
        }
    }

    fn write(&self, message: M) -> Published {
        // The first poll either puts the sample into the window or finds it full; nothing is left behind.
        let outcome = self.shared.writer.async_publish(message).now_or_never();
        self.account(outcome.map(|result| result.map_err(|error| error.to_string())))
    }

    /// What hands a message that was kept to the first who subscribes; to be run as long as the node lives. None for a topic that
    /// does not keep the present alone.
    pub(crate) fn deliver_present(&self) -> Option<impl Future<Output = ()> + Send + use<M>>
    where
        M: Send + Sync + 'static,
    {
        self.shared.present.as_ref()?;
        let mut changes = self.shared.graph.changes();
        // The task must not keep the publisher.
        let shared = Arc::downgrade(&self.shared);
        Some(async move {
            while changes.changed().await.is_ok() {
                let Some(shared) = Weak::upgrade(&shared) else {
                    return;
                };
                let publisher = Self { shared };
                let Some(mut present) = publisher.shared.present() else {
                    return;
                };
                if present.is_some()
                    && publisher.subscriber_count() > 0
                    && let Some(message) = present.take()
                {
                    publisher.write(message).left_to_diagnostics();
                }
            }
        })
    }

    /// Waits up to `timeout` for room in the window; the message may be refused all the same.
    pub async fn publish_within(&self, message: M, timeout: Duration) -> Published {
        if !self.is_active() {
            return Published::Inactive;
        }
        if self.shared.present.is_some() {
            return self.publish(message);
        }
        let outcome =
            tokio::time::timeout(timeout, self.shared.writer.async_publish(message)).await;
        self.account(
            outcome
                .ok()
                .map(|result| result.map_err(|error| error.to_string())),
        )
    }

    /// Whether the node is active; where it is not, the first message kept back is told.
    fn is_active(&self) -> bool {
        let active = self.shared.gate.is_open();
        let told = &self.shared.told_inactive;
        if active {
            told.store(false, Ordering::Relaxed);
        } else if !told.swap(true, Ordering::Relaxed) {
            tracing::debug!(
                "{}: nothing is published while the node is not active",
                self.topic()
            );
        }
        active
    }

    fn account(&self, outcome: Option<Result<(), String>>) -> Published {
        let statistics = &self.shared.statistics;
        let reason = match outcome {
            Some(Ok(())) => {
                statistics.published.fetch_add(1, Ordering::Relaxed);
                if statistics.dropping.swap(false, Ordering::Relaxed) {
                    tracing::info!(
                        "{}: published again, {} dropped so far",
                        statistics.topic,
                        statistics.dropped()
                    );
                }
                return self.received_by(self.subscriber_count());
            }
            Some(Err(error)) => error,
            None => {
                "the window is full of samples that a subscriber does not acknowledge".to_owned()
            }
        };
        let dropped = statistics.dropped.fetch_add(1, Ordering::Relaxed) + 1;
        if !statistics.dropping.swap(true, Ordering::Relaxed) {
            tracing::warn!("{}: messages are dropped: {reason}", statistics.topic);
        }
        Published::Refused { dropped }
    }

    fn received_by(&self, subscribers: usize) -> Published {
        match (subscribers, self.shared.transient_local) {
            (0, true) => Published::Kept,
            (0, false) => Published::Unheard,
            _ => Published::Sent,
        }
    }

    /// As [`publish`](Self::publish), where anybody subscribes; otherwise the message is not even made. For volatile
    /// topics: nobody who comes later would get it, and making and serializing it and waking the middleware costs as
    /// much as sending it.
    pub fn publish_if_heard(&self, make: impl FnOnce() -> M) -> Published {
        if !self.is_active() {
            return Published::Inactive;
        }
        if self.subscriber_count() == 0 {
            return Published::Unheard;
        }
        self.publish(make())
    }

    /// Number of matched subscribers.
    pub fn subscriber_count(&self) -> usize {
        self.shared.graph.matched(self.shared.guid)
    }

    /// Waits until at least `count` subscribers are matched; `false` where the time ran out.
    pub async fn wait_for_subscribers(&self, count: usize, timeout: Duration) -> bool {
        self.shared
            .graph
            .wait_for(self.shared.guid, count, timeout)
            .await
    }

    /// Absolute name of the topic.
    pub fn topic(&self) -> &str {
        &self.shared.statistics.topic
    }

    /// The counters.
    pub fn statistics(&self) -> Arc<PublisherStatistics> {
        Arc::clone(&self.shared.statistics)
    }
}
