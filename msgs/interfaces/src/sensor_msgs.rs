//! Inertial measurement units, joints, satellite fixes.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::{Quaternion, Vector3};
use crate::ros_message;
use crate::std_msgs::Header;

/// Angular rate and specific force, averaged over the sampling interval that **ends** at `header.stamp`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// End of the sampling interval, frame of the sensor block.
    pub header: Header,
    /// Turns vectors of the block into East-North-Up; void where `orientation_covariance[0]` is -1.
    pub orientation: Quaternion,
    /// Row-major \[rad²\]; -1 first where there is no orientation.
    pub orientation_covariance: [f64; 9],
    /// Angular rate against inertial space \[rad/s\].
    pub angular_velocity: Vector3,
    /// Of one sample, row-major \[rad²/s²\].
    pub angular_velocity_covariance: [f64; 9],
    /// Specific force \[m/s²\].
    pub linear_acceleration: Vector3,
    /// Of one sample, row-major \[m²/s⁴\].
    pub linear_acceleration_covariance: [f64; 9],
}

/// Joints by name: the arrays go together by index; an empty array means 'not measured'.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointState {
    /// When the joints stood there.
    pub header: Header,
    /// Names of the joints, in any order.
    pub name: Vec<String>,
    /// Angles \[rad\].
    pub position: Vec<f64>,
    /// Rates \[rad/s\].
    pub velocity: Vec<f64>,
    /// Torques \[N m\].
    pub effort: Vec<f64>,
}

/// What kind of fix it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NavSatStatus {
    /// One of the `STATUS_` constants.
    pub status: i8,
    /// Bits of the `SERVICE_` constants.
    pub service: u16,
}

impl NavSatStatus {
    /// Not yet known.
    pub const STATUS_UNKNOWN: i8 = -2;
    /// No fix.
    pub const STATUS_NO_FIX: i8 = -1;
    /// Unaugmented fix.
    pub const STATUS_FIX: i8 = 0;
    /// With satellite augmentation.
    pub const STATUS_SBAS_FIX: i8 = 1;
    /// With ground augmentation.
    pub const STATUS_GBAS_FIX: i8 = 2;
    /// Not known.
    pub const SERVICE_UNKNOWN: u16 = 0;
    /// GPS.
    pub const SERVICE_GPS: u16 = 1;
    /// GLONASS.
    pub const SERVICE_GLONASS: u16 = 2;
    /// BeiDou.
    pub const SERVICE_COMPASS: u16 = 4;
    /// Galileo.
    pub const SERVICE_GALILEO: u16 = 8;
}

/// A position on WGS-84.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NavSatFix {
    /// When, and the frame of the antenna.
    pub header: Header,
    /// What kind of fix it is.
    pub status: NavSatStatus,
    /// North positive \[deg\].
    pub latitude: f64,
    /// East positive \[deg\].
    pub longitude: f64,
    /// Above the ellipsoid \[m\].
    pub altitude: f64,
    /// East, North, Up, row-major \[m²\].
    pub position_covariance: [f64; 9],
    /// One of the `COVARIANCE_TYPE_` constants.
    pub position_covariance_type: u8,
}

impl NavSatFix {
    /// Not known.
    pub const COVARIANCE_TYPE_UNKNOWN: u8 = 0;
    /// Made from a dilution of precision.
    pub const COVARIANCE_TYPE_APPROXIMATED: u8 = 1;
    /// The diagonal is right.
    pub const COVARIANCE_TYPE_DIAGONAL_KNOWN: u8 = 2;
    /// All of it is right.
    pub const COVARIANCE_TYPE_KNOWN: u8 = 3;
}

ros_message!(
    Imu,
    "sensor_msgs/msg/Imu",
    include_str!("../definitions/sensor_msgs/Imu.msg"),
    "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
    [Header, Quaternion, Vector3]
);
ros_message!(
    JointState,
    "sensor_msgs/msg/JointState",
    include_str!("../definitions/sensor_msgs/JointState.msg"),
    "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    [Header]
);
ros_message!(
    NavSatStatus,
    "sensor_msgs/msg/NavSatStatus",
    include_str!("../definitions/sensor_msgs/NavSatStatus.msg"),
    "RIHS01_d1ed3befa628e09571bd273b888ba1c1fd187c9a5e0006b385d7e5e9095a3204",
    []
);
ros_message!(
    NavSatFix,
    "sensor_msgs/msg/NavSatFix",
    include_str!("../definitions/sensor_msgs/NavSatFix.msg"),
    "RIHS01_62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404",
    [Header, NavSatStatus]
);
