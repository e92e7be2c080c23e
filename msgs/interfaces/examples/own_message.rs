//! A message of one's own: its structure, its text, its hash, and what a registry makes of it.

use ros2_interfaces::std_msgs::Header;
use ros2_interfaces::{Registry, RegistryError, ros_message};
use serde::{Deserialize, Serialize};

/// One echo of a sonar.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Ping {
    /// When, and the frame of the transducer.
    header: Header,
    /// To the bottom \[m\].
    range: f64,
}

ros_message!(
    Ping,
    "acme_msgs/msg/Ping",
    "std_msgs/Header header\nfloat64 range  # to the bottom [m]\n",
    // Unknown yet: the registry computes it and says so.
    "RIHS01_",
    [Header]
);

fn main() {
    let mut registry = Registry::new();
    if let Err(RegistryError::Hash { name, computed, .. }) = registry.register::<Ping>() {
        println!("the hash of {name} is {computed}");
    }
}
