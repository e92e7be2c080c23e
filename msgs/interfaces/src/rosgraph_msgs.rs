//! The simulated clock.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;
use crate::ros_message;

/// What time it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// ROS time.
    pub clock: Time,
}

ros_message!(
    Clock,
    "rosgraph_msgs/msg/Clock",
    include_str!("../definitions/rosgraph_msgs/Clock.msg"),
    "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    [Time]
);
