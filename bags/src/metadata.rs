//! `metadata.yaml` and quality of service, as rosbag2 writes them (version 9) and has written them (numbers or names).

use ros2_interfaces::Qos;
use serde::{Deserialize, Serialize};

/// Name of the metadata file in the directory of a bag.
pub(crate) const FILE_NAME: &str = "metadata.yaml";
/// The distribution whose conventions the bags follow.
pub(crate) const DISTRIBUTION: &str = "jazzy";

/// Reads `offered_qos_profiles`; empty where there are none or they cannot be understood.
pub(crate) fn parse_profiles(yaml: &str) -> Vec<Qos> {
    if yaml.trim().is_empty() {
        return Vec::new();
    }
    let profiles: Vec<QosRead> = serde_saphyr::from_str(yaml).unwrap_or_default();
    profiles.into_iter().map(Qos::from).collect()
}

/// Writes `offered_qos_profiles`.
pub(crate) fn write_profiles(profiles: &[Qos]) -> Result<String, String> {
    let profiles: Vec<QosWritten> = profiles.iter().map(|&qos| qos.into()).collect();
    serde_saphyr::to_string(&profiles).map_err(|error| error.to_string())
}

/// A policy by its name, or by its number in bags of older distributions.
#[derive(Deserialize)]
#[serde(untagged)]
enum Policy {
    Number(u64),
    Name(String),
}

impl Policy {
    fn is(&self, name: &str, number: u64) -> bool {
        match self {
            Self::Name(own) => own == name,
            Self::Number(own) => *own == number,
        }
    }
}

#[derive(Deserialize)]
struct QosRead {
    history: Policy,
    #[serde(default)]
    depth: usize,
    reliability: Policy,
    durability: Policy,
}

impl From<QosRead> for Qos {
    fn from(read: QosRead) -> Self {
        Self {
            depth: if read.history.is("keep_all", 2) {
                0
            } else {
                read.depth.max(1)
            },
            reliable: !read.reliability.is("best_effort", 2),
            transient_local: read.durability.is("transient_local", 1),
            // A player sends samples anew.
            lifespan: None,
        }
    }
}

#[derive(Clone, Copy, Serialize)]
struct Span {
    sec: u64,
    nsec: u64,
}

/// What rosbag2 writes for a span that never ends.
const FOREVER: Span = Span {
    sec: 9_223_372_036,
    nsec: 854_775_807,
};

/// A profile with every field that rosbag2 expects.
#[derive(Serialize)]
pub(crate) struct QosWritten {
    history: &'static str,
    depth: usize,
    reliability: &'static str,
    durability: &'static str,
    deadline: Span,
    lifespan: Span,
    liveliness: &'static str,
    liveliness_lease_duration: Span,
    avoid_ros_namespace_conventions: bool,
}

impl From<Qos> for QosWritten {
    fn from(qos: Qos) -> Self {
        Self {
            history: if qos.depth == 0 {
                "keep_all"
            } else {
                "keep_last"
            },
            depth: qos.depth,
            reliability: if qos.reliable {
                "reliable"
            } else {
                "best_effort"
            },
            durability: if qos.transient_local {
                "transient_local"
            } else {
                "volatile"
            },
            deadline: FOREVER,
            lifespan: FOREVER,
            liveliness: "automatic",
            liveliness_lease_duration: FOREVER,
            avoid_ros_namespace_conventions: false,
        }
    }
}

/// The part of `metadata.yaml` that a reader needs.
#[derive(Deserialize)]
pub(crate) struct MetadataRead {
    pub rosbag2_bagfile_information: InformationRead,
}

#[derive(Deserialize)]
pub(crate) struct InformationRead {
    #[serde(default)]
    pub storage_identifier: String,
    #[serde(default)]
    pub compression_mode: String,
    #[serde(default)]
    pub relative_file_paths: Vec<String>,
}

#[derive(Serialize)]
pub(crate) struct Metadata {
    pub rosbag2_bagfile_information: Information,
}

#[derive(Serialize)]
pub(crate) struct Information {
    pub version: u32,
    pub storage_identifier: &'static str,
    pub duration: Nanoseconds,
    pub starting_time: SinceEpoch,
    pub message_count: u64,
    pub topics_with_message_count: Vec<TopicWithCount>,
    pub compression_format: &'static str,
    pub compression_mode: &'static str,
    pub relative_file_paths: Vec<String>,
    pub files: Vec<FileInformation>,
    pub custom_data: Option<()>,
    pub ros_distro: &'static str,
}

#[derive(Clone, Copy, Serialize)]
pub(crate) struct Nanoseconds {
    pub nanoseconds: u64,
}

#[derive(Clone, Copy, Serialize)]
pub(crate) struct SinceEpoch {
    pub nanoseconds_since_epoch: u64,
}

#[derive(Serialize)]
pub(crate) struct TopicWithCount {
    pub topic_metadata: TopicMetadata,
    pub message_count: u64,
}

#[derive(Serialize)]
pub(crate) struct TopicMetadata {
    pub name: String,
    #[serde(rename = "type")]
    pub type_name: String,
    pub serialization_format: &'static str,
    pub offered_qos_profiles: Vec<QosWritten>,
    pub type_description_hash: String,
}

#[derive(Serialize)]
pub(crate) struct FileInformation {
    pub path: String,
    pub starting_time: SinceEpoch,
    pub duration: Nanoseconds,
    pub message_count: u64,
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// What is written is read back the same.
    #[test]
    fn profiles_there_and_back() {
        let profiles = [
            Qos::reliable(1000),
            Qos::latched(1),
            Qos {
                depth: 0,
                reliable: false,
                transient_local: false,
                lifespan: None,
            },
        ];
        assert_eq!(
            parse_profiles(&write_profiles(&profiles).unwrap()),
            profiles
        );
    }

    /// Bags of Humble and Iron have numbers for names.
    #[test]
    fn numbers_of_older_distributions() {
        let yaml = "- history: 1\n  depth: 5\n  reliability: 2\n  durability: 1\n  lifespan:\n    sec: 1\n    nsec: 2\n";
        assert_eq!(
            parse_profiles(yaml),
            [Qos {
                depth: 5,
                reliable: false,
                transient_local: true,
                lifespan: None,
            }]
        );
    }

    /// Nonsense is no profile, and no panic.
    #[test]
    fn nonsense_is_no_profile() {
        assert_eq!(parse_profiles("{{"), []);
        assert_eq!(parse_profiles(""), []);
    }
}
