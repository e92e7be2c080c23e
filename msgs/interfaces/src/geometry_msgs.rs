//! Vectors, rotations, poses, twists. SI units; covariances are row-major.

use serde::{Deserialize, Serialize};

use crate::ros_message;
use crate::std_msgs::Header;

/// A free vector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// First component.
    pub x: f64,
    /// Second component.
    pub y: f64,
    /// Third component.
    pub z: f64,
}

/// A vector with its time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3Stamped {
    /// Time and frame.
    pub header: Header,
    /// The vector.
    pub vector: Vector3,
}

/// A position \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// First coordinate.
    pub x: f64,
    /// Second coordinate.
    pub y: f64,
    /// Third coordinate.
    pub z: f64,
}

/// A rotation as a unit quaternion (Hamilton).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// Vector part, first.
    pub x: f64,
    /// Vector part, second.
    pub y: f64,
    /// Vector part, third.
    pub z: f64,
    /// Scalar part.
    pub w: f64,
}

impl Default for Quaternion {
    /// No rotation.
    fn default() -> Self {
        Self {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        }
    }
}

/// A rotation with its time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QuaternionStamped {
    /// Time and frame.
    pub header: Header,
    /// The rotation.
    pub quaternion: Quaternion,
}

/// Where something is and how it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position \[m\].
    pub position: Point,
    /// Turns vectors of the body into the frame.
    pub orientation: Quaternion,
}

/// A pose with its time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// Time and frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}

/// A pose and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Of x, y, z \[m\] and the rotations about x, y, z \[rad\], row-major.
    #[serde(with = "serde_big_array::BigArray")]
    pub covariance: [f64; 36],
}

impl Default for PoseWithCovariance {
    /// All zero; fill in the covariance where it is known.
    fn default() -> Self {
        Self {
            pose: Pose::default(),
            covariance: [0.0; 36],
        }
    }
}

/// A pose and its uncertainty, with time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovarianceStamped {
    /// Time and frame.
    pub header: Header,
    /// The pose.
    pub pose: PoseWithCovariance,
}

/// Velocity and angular rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Velocity \[m/s\].
    pub linear: Vector3,
    /// Angular rate \[rad/s\].
    pub angular: Vector3,
}

/// Velocity and angular rate, with time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistStamped {
    /// Time and frame.
    pub header: Header,
    /// The twist.
    pub twist: Twist,
}

/// Velocity, angular rate and their uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The twist.
    pub twist: Twist,
    /// Of the velocity \[m/s\] and the angular rate \[rad/s\], row-major.
    #[serde(with = "serde_big_array::BigArray")]
    pub covariance: [f64; 36],
}

impl Default for TwistWithCovariance {
    /// All zero; fill in the covariance where it is known.
    fn default() -> Self {
        Self {
            twist: Twist::default(),
            covariance: [0.0; 36],
        }
    }
}

/// Velocity, angular rate and their uncertainty, with time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovarianceStamped {
    /// Time and frame.
    pub header: Header,
    /// The twist.
    pub twist: TwistWithCovariance,
}

/// A displacement and a rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Displacement \[m\].
    pub translation: Vector3,
    /// Turns vectors of the child frame into the parent frame.
    pub rotation: Quaternion,
}

/// Where a child frame stands in its parent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// Time and parent frame.
    pub header: Header,
    /// The child frame.
    pub child_frame_id: String,
    /// The child in the parent.
    pub transform: Transform,
}

ros_message!(
    Vector3,
    "geometry_msgs/msg/Vector3",
    include_str!("../definitions/geometry_msgs/Vector3.msg"),
    "RIHS01_cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d",
    []
);
ros_message!(
    Vector3Stamped,
    "geometry_msgs/msg/Vector3Stamped",
    include_str!("../definitions/geometry_msgs/Vector3Stamped.msg"),
    "RIHS01_d4829622288cbb443886e7ea94ea5671a3b1be6bab4ad04224432a65f7d7887a",
    [Header, Vector3]
);
ros_message!(
    Point,
    "geometry_msgs/msg/Point",
    include_str!("../definitions/geometry_msgs/Point.msg"),
    "RIHS01_6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881",
    []
);
ros_message!(
    Quaternion,
    "geometry_msgs/msg/Quaternion",
    include_str!("../definitions/geometry_msgs/Quaternion.msg"),
    "RIHS01_8a765f66778c8ff7c8ab94afcc590a2ed5325a1d9a076ffff38fbce36f458684",
    []
);
ros_message!(
    QuaternionStamped,
    "geometry_msgs/msg/QuaternionStamped",
    include_str!("../definitions/geometry_msgs/QuaternionStamped.msg"),
    "RIHS01_381add86c6c3160644d228ca342182c7fd6c7fab11c7a85ad817a9cc22dbac6e",
    [Header, Quaternion]
);
ros_message!(
    Pose,
    "geometry_msgs/msg/Pose",
    include_str!("../definitions/geometry_msgs/Pose.msg"),
    "RIHS01_d501954e9476cea2996984e812054b68026ae0bfae789d9a10b23daf35cc90fa",
    [Point, Quaternion]
);
ros_message!(
    PoseStamped,
    "geometry_msgs/msg/PoseStamped",
    include_str!("../definitions/geometry_msgs/PoseStamped.msg"),
    "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    [Header, Pose]
);
ros_message!(
    PoseWithCovariance,
    "geometry_msgs/msg/PoseWithCovariance",
    include_str!("../definitions/geometry_msgs/PoseWithCovariance.msg"),
    "RIHS01_9a7c0fd234b7f45c6098745ecccd773ca1085670e64107135397aee31c02e1bb",
    [Pose]
);
ros_message!(
    PoseWithCovarianceStamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    include_str!("../definitions/geometry_msgs/PoseWithCovarianceStamped.msg"),
    "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    [Header, PoseWithCovariance]
);
ros_message!(
    Twist,
    "geometry_msgs/msg/Twist",
    include_str!("../definitions/geometry_msgs/Twist.msg"),
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    [Vector3]
);
ros_message!(
    TwistStamped,
    "geometry_msgs/msg/TwistStamped",
    include_str!("../definitions/geometry_msgs/TwistStamped.msg"),
    "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    [Header, Twist]
);
ros_message!(
    TwistWithCovariance,
    "geometry_msgs/msg/TwistWithCovariance",
    include_str!("../definitions/geometry_msgs/TwistWithCovariance.msg"),
    "RIHS01_49f574f033f095d8b6cd1beaca5ca7925e296e84af1716d16c89d38b059c8c18",
    [Twist]
);
ros_message!(
    TwistWithCovarianceStamped,
    "geometry_msgs/msg/TwistWithCovarianceStamped",
    include_str!("../definitions/geometry_msgs/TwistWithCovarianceStamped.msg"),
    "RIHS01_77b67434531e6529b7a0091357b186b6ebdb17fd9ffd3e0c7ce9d3fb11a44563",
    [Header, TwistWithCovariance]
);
ros_message!(
    Transform,
    "geometry_msgs/msg/Transform",
    include_str!("../definitions/geometry_msgs/Transform.msg"),
    "RIHS01_beb83fbe698636351461f6f35d1abb20010c43d55374d81bd041f1ba2581fddc",
    [Vector3, Quaternion]
);
ros_message!(
    TransformStamped,
    "geometry_msgs/msg/TransformStamped",
    include_str!("../definitions/geometry_msgs/TransformStamped.msg"),
    "RIHS01_0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206",
    [Header, Transform]
);
