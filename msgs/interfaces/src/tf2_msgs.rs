//! The tree of frames.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::TransformStamped;
use crate::ros_message;

/// Some of the tree's transforms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TFMessage {
    /// The transforms.
    pub transforms: Vec<TransformStamped>,
}

ros_message!(
    TFMessage,
    "tf2_msgs/msg/TFMessage",
    include_str!("../definitions/tf2_msgs/TFMessage.msg"),
    "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    [TransformStamped]
);
