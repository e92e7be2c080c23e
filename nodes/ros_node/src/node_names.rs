//! Which node an endpoint belongs to: every participant of ROS 2 tells it on `ros_discovery_info`.
//!
//! ros2-client publishes ours, and would read those of others in its Spinner, which we do not run (see `graph`); its
//! message keeps the endpoints to itself, so that the fields stand here once more.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use futures::StreamExt;
use ros2_client::builtin_topics::ros_discovery;
use ros2_client::{Gid, Message};
use rustdds::{DomainParticipant, GUID, TopicKind};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::node::{Node, spread};
use crate::qos::{Profile, Qos};

/// Participants whose last words wait until they are taken.
const DEPTH: usize = 256;

/// rmw_dds_common/msg/ParticipantEntitiesInfo.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ParticipantEntities {
    gid: Gid,
    nodes: Vec<NodeEntities>,
}

impl Message for ParticipantEntities {}

/// rmw_dds_common/msg/NodeEntitiesInfo.
#[derive(Debug, Serialize, Deserialize)]
struct NodeEntities {
    namespace: String,
    name: String,
    readers: Vec<Gid>,
    writers: Vec<Gid>,
}

/// Full names of nodes by their publishers.
#[derive(Debug, Default)]
pub(crate) struct NodeNames {
    by_participant: Mutex<BTreeMap<GUID, BTreeMap<GUID, String>>>,
}

impl NodeNames {
    /// What a participant says of itself takes the place of what it said before.
    fn take(&self, told: ParticipantEntities) {
        let names = told.nodes.into_iter().flat_map(|node| {
            let name = format!("{}/{}", node.namespace.trim_end_matches('/'), node.name);
            let writers = node.writers.into_iter();
            writers.map(move |writer| (GUID::from(writer), name.clone()))
        });
        self.lock().insert(GUID::from(told.gid), names.collect());
    }

    /// Forgets a participant that has left.
    pub(crate) fn forget(&self, is_gone: impl Fn(&GUID) -> bool) {
        self.lock().retain(|participant, _| !is_gone(participant));
    }

    /// The node of a publisher; where its participant has not told, the number that `ros2 topic info -v` shows.
    pub(crate) fn of(&self, writer: GUID) -> String {
        let participants = self.lock();
        let found = participants.values().find_map(|names| names.get(&writer));
        found.cloned().unwrap_or_else(|| {
            let bytes = writer.to_bytes().map(|byte| format!("{byte:02x}"));
            format!("one that names no node (GID {})", bytes.join("."))
        })
    }

    // Every change is a single insertion or removal, so that a panic elsewhere leaves the map whole.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<GUID, BTreeMap<GUID, String>>> {
        self.by_participant
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Starts the task that listens to what participants say of themselves.
pub(crate) fn follow(node: &Node, participant: &DomainParticipant) -> Result<()> {
    let qos = Qos::latched(DEPTH).profile();
    let failed = |reason: String| Error::Create {
        what: format!("a subscription of {}", ros_discovery::TOPIC_NAME),
        reason,
    };
    let topic = participant
        .create_topic(
            ros_discovery::TOPIC_NAME.to_owned(),
            ros_discovery::TYPE_NAME.to_owned(),
            &ros_discovery::QOS_PUB,
            TopicKind::NoKey,
        )
        .map_err(|error| failed(error.to_string()))?;
    spread();
    let reader = node
        .ros()
        .create_subscription::<ParticipantEntities>(&topic, Some(qos))
        .map_err(|error| failed(error.to_string()))?;
    let graph = node.graph();
    node.spawn(async move {
        let mut told = std::pin::pin!(reader.async_stream());
        while let Some(taken) = told.next().await {
            match taken {
                Ok((told, _)) => graph.tell_nodes(|names| names.take(told)),
                Err(error) => tracing::debug!("{}: {error}", ros_discovery::TOPIC_NAME),
            }
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gid(participant: u8, endpoint: u8) -> Gid {
        let mut bytes = [participant; 16];
        bytes[12..].copy_from_slice(&[0, 0, endpoint, 3]);
        Gid::from(bytes)
    }

    fn node(namespace: &str, name: &str, writers: &[Gid]) -> NodeEntities {
        NodeEntities {
            namespace: namespace.to_owned(),
            name: name.to_owned(),
            readers: Vec::new(),
            writers: writers.to_vec(),
        }
    }

    /// Two nodes of one participant are told apart; the newest word counts, and nothing outlives its participant.
    #[test]
    fn publishers_have_the_names_of_their_nodes() {
        let names = NodeNames::default();
        let of = |endpoint| names.of(GUID::from(gid(1, endpoint)));
        assert!(of(1).ends_with("(GID 01.01.01.01.01.01.01.01.01.01.01.01.00.00.01.03)"));
        let tell = |nodes| {
            names.take(ParticipantEntities {
                gid: gid(1, 0),
                nodes,
            });
        };
        tell(vec![
            node("/", "driver", &[gid(1, 1)]),
            node("/ship", "simulator", &[gid(1, 2)]),
        ]);
        assert_eq!([of(1), of(2)], ["/driver", "/ship/simulator"]);
        tell(vec![node("/ship", "simulator", &[gid(1, 2)])]);
        assert!(of(1).starts_with("one that names no node"));
        names.forget(|participant| *participant == GUID::from(gid(1, 0)));
        assert!(of(2).starts_with("one that names no node"));
    }
}
