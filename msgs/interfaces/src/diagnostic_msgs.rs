//! How a node is.

use serde::{Deserialize, Serialize};

use crate::ros_message;
use crate::std_msgs::Header;

/// A named value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeyValue {
    /// Its name.
    pub key: String,
    /// The value as text.
    pub value: String,
}

/// How one part of a node is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// One of `OK`, `WARN`, `ERROR`, `STALE`.
    pub level: u8,
    /// Which part.
    pub name: String,
    /// How it is, in one line.
    pub message: String,
    /// Which device.
    pub hardware_id: String,
    /// Details.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// Well.
    pub const OK: u8 = 0;
    /// A person should look.
    pub const WARN: u8 = 1;
    /// It does not do its work.
    pub const ERROR: u8 = 2;
    /// Nothing was heard of it.
    pub const STALE: u8 = 3;
}

/// How a node is, part by part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// When.
    pub header: Header,
    /// The parts.
    pub status: Vec<DiagnosticStatus>,
}

ros_message!(
    KeyValue,
    "diagnostic_msgs/msg/KeyValue",
    include_str!("../definitions/diagnostic_msgs/KeyValue.msg"),
    "RIHS01_d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42",
    []
);
ros_message!(
    DiagnosticStatus,
    "diagnostic_msgs/msg/DiagnosticStatus",
    include_str!("../definitions/diagnostic_msgs/DiagnosticStatus.msg"),
    "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
    [KeyValue]
);
ros_message!(
    DiagnosticArray,
    "diagnostic_msgs/msg/DiagnosticArray",
    include_str!("../definitions/diagnostic_msgs/DiagnosticArray.msg"),
    "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    [Header, DiagnosticStatus]
);
