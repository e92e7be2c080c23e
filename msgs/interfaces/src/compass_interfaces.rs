//! Headings, as compasses and what listens to them have them.

use serde::{Deserialize, Serialize};

use crate::ros_message;
use crate::std_msgs::Header;

/// Where the vehicle points.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Azimuth {
    /// Time and frame of the vehicle.
    pub header: Header,
    /// The angle, in `unit`.
    pub azimuth: f64,
    /// Its variance, in the square of `unit`.
    pub variance: f64,
    /// One of the constants.
    pub unit: u8,
    /// Where zero is, and which way it grows: one of the constants.
    pub orientation: u8,
    /// Which north: one of the constants.
    pub reference: u8,
}

impl Azimuth {
    /// Radians.
    pub const UNIT_RAD: u8 = 0;
    /// Degrees.
    pub const UNIT_DEG: u8 = 1;
    /// Zero is East, counter-clockwise.
    pub const ORIENTATION_ENU: u8 = 0;
    /// Zero is North, clockwise.
    pub const ORIENTATION_NED: u8 = 1;
    /// Magnetic north.
    pub const REFERENCE_MAGNETIC: u8 = 0;
    /// True north.
    pub const REFERENCE_GEOGRAPHIC: u8 = 1;
    /// North of the UTM grid.
    pub const REFERENCE_UTM: u8 = 2;
}

ros_message!(
    Azimuth,
    "compass_interfaces/msg/Azimuth",
    include_str!("../definitions/compass_interfaces/Azimuth.msg"),
    "RIHS01_eb531e001d9507f4eca3a77bb81352c0c73006dce58be716080fcc739d0e8fbc",
    [Header]
);
