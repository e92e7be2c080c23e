//! Topics whose type is known only at run time: payloads as they are, for recorders and players.

use std::collections::BTreeMap;
use std::fmt;

use ros2_client::Message;
use rustdds::RTPSEntity;
use rustdds::policy::{Durability, Reliability};
use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};

use crate::error::Result;
use crate::node::Node;
use crate::publisher::Publisher;
use crate::qos::Qos;
use crate::qos_overrides::Overrides;
use crate::subscription::Subscription;

/// A message of any type as its little-endian CDR, without the four bytes of encapsulation in front.
///
/// (ros2-client does not hand the encapsulation over, so that a big-endian sender's payload cannot be told from a
/// little-endian one, `docs/upstream/ros2-client-raw-payloads.md`. ROS 2 runs on no big-endian machine.)
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Payload(pub Vec<u8>);

impl Message for Payload {}

impl Serialize for Payload {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut bytes = serializer.serialize_tuple(self.0.len())?;
        for byte in &self.0 {
            bytes.serialize_element(byte)?;
        }
        bytes.end()
    }
}

impl<'de> Deserialize<'de> for Payload {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ToTheEnd;
        impl<'de> Visitor<'de> for ToTheEnd {
            type Value = Payload;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the bytes of a message")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Payload, A::Error> {
                let mut payload = Vec::with_capacity(512);
                // CDR has no length of the whole: the only error that reading bytes can give is their end.
                while let Ok(Some(byte)) = bytes.next_element() {
                    payload.push(byte);
                }
                Ok(Payload(payload))
            }
        }
        deserializer.deserialize_tuple(usize::MAX, ToTheEnd)
    }
}

/// What the publishers of a topic offer together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiscoveredPublisher {
    /// Absolute name of the topic.
    pub topic: String,
    /// Full name of the type, `package/msg/Name`.
    pub type_name: String,
    /// All of them are reliable.
    pub reliable: bool,
    /// All of them are transient local.
    pub transient_local: bool,
}

impl Node {
    /// The topics that others publish, each type of each once. What this node publishes itself is left out.
    pub fn discovered_publishers(&self) -> Vec<DiscoveredPublisher> {
        let participant = self.participant();
        let own = participant.guid().prefix;
        let mut found: BTreeMap<(String, String), DiscoveredPublisher> = BTreeMap::new();
        for writer in participant.discovered_writers() {
            let data = writer.publication_topic_data;
            if data.key.prefix == own {
                continue;
            }
            let Some((topic, type_name)) = ros_names(&data.topic_name, &data.type_name) else {
                continue;
            };
            let reliable = matches!(data.reliability, Some(Reliability::Reliable { .. }));
            let transient_local = data.durability >= Some(Durability::TransientLocal);
            found
                .entry((topic.clone(), type_name.clone()))
                .and_modify(|publisher| {
                    publisher.reliable &= reliable;
                    publisher.transient_local &= transient_local;
                })
                .or_insert(DiscoveredPublisher {
                    topic,
                    type_name,
                    reliable,
                    transient_local,
                });
        }
        found.into_values().collect()
    }

    /// A publisher of payloads of a type that is known by its name, `package/msg/Name`.
    ///
    /// # Errors
    /// [`crate::Error::Name`] or [`crate::Error::Create`].
    pub fn raw_publisher(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
    ) -> Result<Publisher<Payload>> {
        self.publisher_of(topic, type_name, qos, self.gate(), Overrides::None)
    }

    /// A subscription of payloads of a type that is known by its name, `package/msg/Name`.
    ///
    /// # Errors
    /// [`crate::Error::Name`] or [`crate::Error::Create`].
    pub fn raw_subscription(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
    ) -> Result<Subscription<Payload>> {
        self.subscription_of(topic, type_name, qos, self.gate(), Overrides::None)
    }
}

/// Topic and type as ROS names them; `None` for what is no ROS topic (services, actions' services, discovery, plain DDS).
fn ros_names(topic: &str, type_name: &str) -> Option<(String, String)> {
    let topic = topic.strip_prefix("rt/")?;
    let (package, kind) = type_name.split_once("::msg::dds_::")?;
    Some((
        format!("/{topic}"),
        format!("{package}/msg/{}", kind.strip_suffix('_')?),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// DDS names become ROS names; what is no topic of ROS becomes none.
    #[test]
    fn names() {
        assert_eq!(
            ros_names("rt/imu/data_raw", "sensor_msgs::msg::dds_::Imu_"),
            Some(("/imu/data_raw".into(), "sensor_msgs/msg/Imu".into()))
        );
        assert_eq!(
            ros_names("rr/n/get_parametersReply", "a::srv::dds_::B_Response_"),
            None
        );
        assert_eq!(ros_names("rt/x", "Plain"), None);
    }
}
