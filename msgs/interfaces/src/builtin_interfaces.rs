//! Points in time and spans of time.

use serde::{Deserialize, Serialize};

use crate::ros_message;

/// A point in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Time {
    /// Whole seconds since the epoch.
    pub sec: i32,
    /// The rest, 0..1e9 \[ns\].
    pub nanosec: u32,
}

/// A span of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Duration {
    /// Whole seconds, rounded down.
    pub sec: i32,
    /// The rest, 0..1e9 \[ns\].
    pub nanosec: u32,
}

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// Both are the same two numbers.
macro_rules! in_nanoseconds {
    ($($type:ty),*) => { $(
        impl $type {
            /// From nanoseconds.
            pub const fn from_nanos(nanos: i64) -> Self {
                Self {
                    sec: nanos.div_euclid(NANOS_PER_SECOND) as i32,
                    nanosec: nanos.rem_euclid(NANOS_PER_SECOND) as u32,
                }
            }

            /// In nanoseconds.
            pub const fn nanos(self) -> i64 {
                self.sec as i64 * NANOS_PER_SECOND + self.nanosec as i64
            }
        }
    )* };
}

in_nanoseconds!(Time, Duration);

ros_message!(
    Time,
    "builtin_interfaces/msg/Time",
    include_str!("../definitions/builtin_interfaces/Time.msg"),
    "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
    []
);
ros_message!(
    Duration,
    "builtin_interfaces/msg/Duration",
    include_str!("../definitions/builtin_interfaces/Duration.msg"),
    "RIHS01_e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b",
    []
);
