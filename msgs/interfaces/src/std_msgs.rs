//! Header and text.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;
use crate::ros_message;

/// When, and in which frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// When the data was taken.
    pub stamp: Time,
    /// The frame it is in.
    pub frame_id: std::string::String,
}

/// A text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct String {
    /// The text.
    pub data: std::string::String,
}

ros_message!(
    Header,
    "std_msgs/msg/Header",
    include_str!("../definitions/std_msgs/Header.msg"),
    "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    [Time]
);
ros_message!(
    String,
    "std_msgs/msg/String",
    include_str!("../definitions/std_msgs/String.msg"),
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    []
);
