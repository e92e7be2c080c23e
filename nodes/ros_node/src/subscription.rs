//! The receiving end of a topic.

use std::collections::BTreeMap;
use std::pin::{Pin, pin};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use futures::{FutureExt, Stream, StreamExt};
use ros2_client::{Gid, Message, MessageInfo};
use rustdds::{GUID, Topic};

use crate::graph::{Fallback, Graph};
use crate::lifecycle::Gate;
use crate::node::spread;
use crate::qos::{Profile, Qos};

/// Receives messages of one type from one topic; also a [`Stream`] of them that never ends.
///
/// # Reliable, and all the same open to best effort
/// A reader that asks for best effort hears every publisher, but loses samples under load even from a reliable one.
/// So a subscription made with a reliable [`Qos`] asks for reliability, and only when a best-effort publisher shows
/// up, it makes a second, best-effort reader, from which it takes the samples of just such publishers. Nothing is
/// lost from reliable publishers, nothing comes twice.
///
/// What comes while a managed node is not active is passed over and counted: on activation a stream begins with the present.
/// Of transient local topics the last messages are the present state; they are given out all the same.
pub struct Subscription<M: Message + 'static> {
    reader: ros2_client::Subscription<M>,
    best_effort: Option<ros2_client::Subscription<M>>,
    fallback: Arc<Fallback>,
    node: Arc<Mutex<ros2_client::Node>>,
    dds_topic: Topic,
    depth: usize,
    graph: Arc<Graph>,
    gate: Gate,
    transient_local: bool,
    /// The opening of the gate that was seen last.
    opened_nanos: i64,
    /// What was received before this is passed over, until something newer has come.
    passed_over_before: Option<i64>,
    last_sequence_numbers: BTreeMap<Gid, i64>,
    statistics: Arc<SubscriptionStatistics>,
}

// No field is ever pinned: streams are made anew for every poll.
impl<M: Message + 'static> Unpin for Subscription<M> {}

impl<M: Message + 'static> std::fmt::Debug for Subscription<M> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Subscription")
            .field("statistics", &self.statistics)
            .finish_non_exhaustive()
    }
}

/// Counters of a subscription, shared with the diagnostics.
#[derive(Debug, Default)]
pub struct SubscriptionStatistics {
    topic: String,
    received: AtomicU64,
    lost: AtomicU64,
    undecodable: AtomicU64,
    passed_over: AtomicU64,
}

impl SubscriptionStatistics {
    /// Absolute name of the topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Messages received.
    pub fn received(&self) -> u64 {
        self.received.load(Ordering::Relaxed)
    }

    /// Messages that a publisher sent and that were never taken, by the middleware's own numbering: lost on the way, or
    /// overwritten in the reader's cache, which is as deep as the [`Qos`] says, by a node that did not catch up.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Messages that came while the node was not active.
    pub fn passed_over(&self) -> u64 {
        self.passed_over.load(Ordering::Relaxed)
    }

    /// Messages that were no messages of the type.
    pub fn undecodable(&self) -> u64 {
        self.undecodable.load(Ordering::Relaxed)
    }
}

impl<M: Message + 'static> Drop for Subscription<M> {
    fn drop(&mut self) {
        self.graph.forget(self.reader.guid());
    }
}

impl<M: Message + 'static> Subscription<M> {
    pub(crate) fn new(
        reader: ros2_client::Subscription<M>,
        node: Arc<Mutex<ros2_client::Node>>,
        dds_topic: Topic,
        topic: &str,
        qos: Qos,
        graph: Arc<Graph>,
        gate: Gate,
    ) -> Self {
        let fallback = Arc::new(Fallback::default());
        graph.register(
            reader.guid(),
            topic,
            qos.reliable.then(|| Arc::clone(&fallback)),
        );
        Self {
            reader,
            best_effort: None,
            fallback,
            node,
            dds_topic,
            depth: qos.depth,
            transient_local: qos.transient_local,
            opened_nanos: gate.opened_nanos(),
            passed_over_before: None,
            graph,
            gate,
            last_sequence_numbers: BTreeMap::new(),
            statistics: Arc::new(SubscriptionStatistics {
                topic: topic.to_owned(),
                ..Default::default()
            }),
        }
    }

    /// The next message, whenever it comes. Cancelling the future loses nothing.
    pub async fn recv(&mut self) -> M {
        std::future::poll_fn(|context| self.poll_recv(context)).await
    }

    /// A message that has already arrived.
    pub fn try_recv(&mut self) -> Option<M> {
        self.recv().now_or_never()
    }

    /// Waits for the first message, then takes those that are there already, up to `limit`.
    pub async fn recv_batch(&mut self, limit: usize) -> Vec<M> {
        let mut batch = vec![self.recv().await];
        while batch.len() < limit {
            match self.try_recv() {
                Some(message) => batch.push(message),
                None => break,
            }
        }
        batch
    }

    fn poll_recv(&mut self, context: &mut Context<'_>) -> Poll<M> {
        if self.gate.poll_open(context).is_pending() {
            return Poll::Pending;
        }
        let opened = self.gate.opened_nanos();
        if std::mem::replace(&mut self.opened_nanos, opened) != opened {
            self.passed_over_before = (!self.transient_local).then_some(opened);
            // What the cache could not hold meanwhile was not lost on the way.
            self.last_sequence_numbers.clear();
        }
        self.fallback.waker.register(context.waker());
        loop {
            let Poll::Ready(taken) = poll_reader(&self.reader, context) else {
                break;
            };
            if let Some(message) = self.accept(taken, false) {
                return Poll::Ready(message);
            }
        }
        self.open_best_effort_where_needed();
        while let Some(reader) = &self.best_effort {
            let Poll::Ready(taken) = poll_reader(reader, context) else {
                break;
            };
            if let Some(message) = self.accept(taken, true) {
                return Poll::Ready(message);
            }
        }
        Poll::Pending
    }

    /// Counts what was taken; `None` where it is none of ours.
    fn accept(&mut self, taken: Taken<M>, by_best_effort: bool) -> Option<M> {
        let (message, info) = match taken {
            Ok(taken) => taken,
            Err(error) => {
                if self.statistics.undecodable.fetch_add(1, Ordering::Relaxed) == 0 {
                    tracing::error!(
                        "{}: a message cannot be read: {error}",
                        self.statistics.topic
                    );
                }
                return None;
            }
        };
        let publisher = info.publisher_gid();
        // Both readers share one cache: the best-effort one also sees what the reliable one delivers.
        if by_best_effort && !self.fallback.writers().contains(&GUID::from(publisher)) {
            return None;
        }
        let number = info.sequence_number();
        if let Some(before) = self.passed_over_before {
            if info
                .received_timestamp()
                .is_some_and(|at| at.to_nanos() < before)
            {
                self.last_sequence_numbers.insert(publisher, number);
                self.statistics.passed_over.fetch_add(1, Ordering::Relaxed);
                return None;
            }
            self.passed_over_before = None;
            tracing::info!(
                "{}: {} messages came while the node was not active and are passed over",
                self.statistics.topic,
                self.statistics.passed_over()
            );
        }
        if let Some(last) = self.last_sequence_numbers.insert(publisher, number) {
            let missing = u64::try_from(number - last - 1).unwrap_or(0);
            if missing > 0 {
                let lost = self.statistics.lost.fetch_add(missing, Ordering::Relaxed) + missing;
                tracing::debug!(
                    "{}: {missing} messages lost, {lost} in all",
                    self.statistics.topic
                );
            }
        }
        self.statistics.received.fetch_add(1, Ordering::Relaxed);
        Some(message)
    }

    fn open_best_effort_where_needed(&mut self) {
        if self.best_effort.is_some() || self.fallback.writers().is_empty() {
            return;
        }
        spread();
        let mut node = self.node.lock().unwrap_or_else(PoisonError::into_inner);
        match node.create_subscription(
            &self.dds_topic,
            Some(Qos::best_effort(self.depth).profile()),
        ) {
            Ok(reader) => {
                tracing::warn!(
                    "{}: a publisher offers best effort only; its lost samples stay lost",
                    self.statistics.topic
                );
                self.best_effort = Some(reader);
            }
            Err(error) => {
                tracing::error!(
                    "{}: cannot read from a best-effort publisher: {error}",
                    self.statistics.topic
                );
                self.fallback.writers().clear();
            }
        }
    }

    /// Number of matched publishers.
    pub fn publisher_count(&self) -> usize {
        self.graph.matched(self.reader.guid()) + self.fallback.writers().len()
    }

    /// Full names of the nodes of matched publishers, in their order; one with two publishers stands there twice. Of a
    /// publisher whose participant does not tell its nodes, a phrase with its GID.
    pub fn publishers(&self) -> Vec<String> {
        self.graph.publishers(self.reader.guid())
    }

    /// Waits until at least `count` reliable publishers are matched; `false` where the time ran out.
    pub async fn wait_for_publishers(&self, count: usize, timeout: Duration) -> bool {
        self.graph
            .wait_for(self.reader.guid(), count, timeout)
            .await
    }

    /// Absolute name of the topic.
    pub fn topic(&self) -> &str {
        &self.statistics.topic
    }

    /// The counters.
    pub fn statistics(&self) -> Arc<SubscriptionStatistics> {
        Arc::clone(&self.statistics)
    }
}

type Taken<M> = ros2_client::ReadResult<(M, MessageInfo)>;

fn poll_reader<M: Message + 'static>(
    reader: &ros2_client::Subscription<M>,
    context: &mut Context<'_>,
) -> Poll<Taken<M>> {
    // The stream is a view of the reader without state of its own; making one costs nothing.
    let mut stream = pin!(reader.async_stream());
    match stream.poll_next_unpin(context) {
        Poll::Ready(Some(taken)) => Poll::Ready(taken),
        Poll::Ready(None) | Poll::Pending => Poll::Pending,
    }
}

impl<M: Message + 'static> Stream for Subscription<M> {
    type Item = M;

    fn poll_next(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<M>> {
        self.get_mut().poll_recv(context).map(Some)
    }
}
