//! Odometry.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use crate::ros_message;
use crate::std_msgs::Header;

/// Pose in the frame of the header, twist in the child frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Time and frame of the pose.
    pub header: Header,
    /// Frame of the twist: the body.
    pub child_frame_id: String,
    /// Where the body is.
    pub pose: PoseWithCovariance,
    /// How it moves, in its own axes.
    pub twist: TwistWithCovariance,
}

ros_message!(
    Odometry,
    "nav_msgs/msg/Odometry",
    include_str!("../definitions/nav_msgs/Odometry.msg"),
    "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    [Header, PoseWithCovariance, TwistWithCovariance]
);
