//! Who is matched with whom, and who cannot be.
//!
//! ros2-client keeps this in its Spinner, which we do not run: it subscribes `/clock` as the wrong type
//! (`docs/upstream/ros2-client-clock.md`). The node's
//! own `ros_discovery_info` does not need the Spinner, so that tools see the node all the same.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use futures::StreamExt;
use futures::task::AtomicWaker;
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent as Event, GUID, QosPolicies, StatusEvented,
    policy,
};
use tokio::sync::watch;

use crate::node_names::NodeNames;

/// One end of a topic that belongs to us.
#[derive(Debug, Default)]
struct Endpoint {
    topic: String,
    matched: BTreeSet<GUID>,
    incompatible: BTreeMap<GUID, String>,
    fallback: Option<Arc<Fallback>>,
}

/// What a reliable reader shares with the graph, to serve best-effort writers too.
#[derive(Debug, Default)]
pub(crate) struct Fallback {
    writers: Mutex<BTreeSet<GUID>>,
    pub(crate) waker: AtomicWaker,
}

impl Fallback {
    /// Best-effort writers that the reliable reader cannot hear.
    pub(crate) fn writers(&self) -> MutexGuard<'_, BTreeSet<GUID>> {
        self.writers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What is there at the other ends, by the names that DDS has for topics.
pub(crate) struct MatchedTopics {
    readers: BTreeSet<String>,
    writers: BTreeSet<String>,
}

impl MatchedTopics {
    /// Whether both of our ends have found those of a server; `service` is its absolute name.
    pub(crate) fn has_server(&self, service: &str) -> bool {
        self.readers.contains(&format!("rq{service}Request"))
            && self.writers.contains(&format!("rr{service}Reply"))
    }

    /// Whether somebody publishes on the topic of this absolute name.
    pub(crate) fn has_publisher(&self, topic: &str) -> bool {
        self.writers.contains(&format!("rt{topic}"))
    }
}

/// Matches of all our endpoints.
#[derive(Debug)]
pub(crate) struct Graph {
    endpoints: Mutex<BTreeMap<GUID, Endpoint>>,
    node_names: NodeNames,
    changed: watch::Sender<u64>,
}

impl Graph {
    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self {
            endpoints: Mutex::default(),
            node_names: NodeNames::default(),
            changed: watch::Sender::new(0),
        })
    }

    /// Names an endpoint, for messages.
    pub(crate) fn register(&self, guid: GUID, topic: &str, fallback: Option<Arc<Fallback>>) {
        let mut endpoints = self.endpoints();
        let endpoint = endpoints.entry(guid).or_default();
        topic.clone_into(&mut endpoint.topic);
        endpoint.fallback = fallback;
    }

    pub(crate) fn forget(&self, guid: GUID) {
        self.endpoints().remove(&guid);
    }

    /// Number of remote endpoints that this one is matched with.
    pub(crate) fn matched(&self, guid: GUID) -> usize {
        self.endpoints()
            .get(&guid)
            .map_or(0, |endpoint| endpoint.matched.len())
    }

    /// The nodes whose publishers a reader is matched with or hears by its fallback, in the order of their names; one that has
    /// two publishers stands there twice.
    pub(crate) fn publishers(&self, reader: GUID) -> Vec<String> {
        let writers = self.endpoints().get(&reader).map(|endpoint| {
            let by_fallback = endpoint.fallback.iter().flat_map(|f| f.writers().clone());
            endpoint
                .matched
                .iter()
                .copied()
                .chain(by_fallback)
                .collect()
        });
        let writers: Vec<GUID> = writers.unwrap_or_default();
        let mut names: Vec<String> = writers.into_iter().map(|w| self.node_names.of(w)).collect();
        names.sort();
        names
    }

    /// Changes what is known of the names of nodes.
    pub(crate) fn tell_nodes(&self, tell: impl FnOnce(&NodeNames)) {
        tell(&self.node_names);
        self.changed.send_modify(|count| *count += 1);
    }

    /// Topics of the remote ends that ours are matched with.
    pub(crate) fn matched_topics(&self, participant: &DomainParticipant) -> MatchedTopics {
        let endpoints = self.endpoints();
        let is_matched = |remote: GUID| {
            endpoints
                .values()
                .any(|endpoint| endpoint.matched.contains(&remote))
        };
        let readers = participant.discovered_readers().into_iter();
        let writers = participant.discovered_writers().into_iter();
        MatchedTopics {
            readers: readers
                .filter(|reader| is_matched(reader.reader_proxy.remote_reader_guid))
                .map(|reader| reader.subscription_topic_data.topic_name().clone())
                .collect(),
            writers: writers
                .filter(|writer| is_matched(writer.writer_proxy.remote_writer_guid))
                .map(|writer| writer.publication_topic_data.topic_name)
                .collect(),
        }
    }

    /// Every incompatibility there is: topic and what does not fit.
    pub(crate) fn incompatible(&self) -> Vec<(String, String)> {
        let endpoints = self.endpoints();
        let all = endpoints.values().flat_map(|e| {
            e.incompatible
                .values()
                .map(|why| (e.topic.clone(), why.clone()))
        });
        all.collect()
    }

    /// Tells that something has changed, from the moment of the call on.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// Waits until at least `count` remote endpoints are matched; `false` where the time ran out.
    pub(crate) async fn wait_for(&self, guid: GUID, count: usize, timeout: Duration) -> bool {
        let mut changed = self.changed.subscribe();
        let enough = async {
            while self.matched(guid) < count {
                if changed.changed().await.is_err() {
                    break;
                }
            }
        };
        tokio::time::timeout(timeout, enough).await.is_ok()
    }

    /// Follows the participant's events until the task is stopped.
    pub(crate) async fn follow(self: Arc<Self>, participant: DomainParticipant) {
        let listener = participant.status_listener();
        let mut events = std::pin::pin!(listener.as_async_status_stream());
        while let Some(event) = events.next().await {
            self.apply(&event);
        }
    }

    fn apply(&self, event: &Event) {
        {
            let mut endpoints = self.endpoints();
            match event {
                Event::RemoteReaderMatched {
                    local_writer: local,
                    remote_reader: remote,
                }
                | Event::RemoteWriterMatched {
                    local_reader: local,
                    remote_writer: remote,
                } => {
                    let endpoint = endpoints.entry(*local).or_default();
                    endpoint.matched.insert(*remote);
                    endpoint.incompatible.remove(remote);
                }
                Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                    endpoints
                        .values_mut()
                        .for_each(|endpoint| endpoint.lose(|remote| remote == guid));
                }
                Event::ParticipantLost { id, .. } => {
                    self.node_names.forget(|gone| gone.prefix == *id);
                    endpoints
                        .values_mut()
                        .for_each(|endpoint| endpoint.lose(|remote| remote.prefix == *id));
                }
                Event::RemoteReaderQosIncompatible {
                    local_writer,
                    remote_reader,
                    requested_qos,
                    offered_qos,
                } => {
                    let endpoint = endpoints.entry(*local_writer).or_default();
                    endpoint.refuse(*remote_reader, "a subscription", requested_qos, offered_qos);
                }
                Event::RemoteWriterQosIncompatible {
                    local_reader,
                    remote_writer,
                    requested_qos,
                    offered_qos,
                } => {
                    let endpoint = endpoints.entry(*local_reader).or_default();
                    let only_reliability = differences(requested_qos, offered_qos) == [RELIABILITY];
                    match &endpoint.fallback {
                        Some(fallback) if only_reliability => {
                            fallback.writers().insert(*remote_writer);
                            fallback.waker.wake();
                        }
                        _ => endpoint.refuse(
                            *remote_writer,
                            "a publisher",
                            requested_qos,
                            offered_qos,
                        ),
                    }
                }
                _ => return,
            }
        }
        self.changed.send_modify(|count| *count += 1);
    }

    // Every change under the lock is a single insertion or removal, so that a panic elsewhere leaves it whole.
    fn endpoints(&self) -> MutexGuard<'_, BTreeMap<GUID, Endpoint>> {
        self.endpoints
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Endpoint {
    fn lose(&mut self, lost: impl Fn(&GUID) -> bool) {
        self.matched.retain(|remote| !lost(remote));
        self.incompatible.retain(|remote, _| !lost(remote));
        if let Some(fallback) = &self.fallback {
            fallback.writers().retain(|remote| !lost(remote));
        }
    }

    fn refuse(
        &mut self,
        remote: GUID,
        whose: &str,
        requested: &QosPolicies,
        offered: &QosPolicies,
    ) {
        let policies = differences(requested, offered);
        let policies = if policies.is_empty() {
            "another policy".to_owned()
        } else {
            policies.join(" and ")
        };
        let why = format!("{whose} has incompatible quality of service ({policies})");
        if self.incompatible.insert(remote, why.clone()).is_none() {
            tracing::error!("{}: {why}; nothing will be exchanged with it", self.topic);
        }
    }
}

const RELIABILITY: &str = "reliability: reliable requested, best effort offered";

/// Policies where less is offered than requested.
fn differences(requested: &QosPolicies, offered: &QosPolicies) -> Vec<&'static str> {
    let mut found = Vec::new();
    let reliable = |qos: &QosPolicies| {
        matches!(
            qos.reliability(),
            Some(policy::Reliability::Reliable { .. })
        )
    };
    if reliable(requested) && !reliable(offered) {
        found.push(RELIABILITY);
    }
    let durability = |qos: &QosPolicies| qos.durability().unwrap_or(policy::Durability::Volatile);
    if durability(requested) > durability(offered) {
        found.push("durability: transient local requested, volatile offered");
    }
    let deadline = |qos: &QosPolicies| {
        qos.deadline()
            .map_or(rustdds::Duration::INFINITE, |deadline| deadline.0)
    };
    if deadline(requested) < deadline(offered) {
        found.push("deadline: shorter requested than offered");
    }
    found
}
