//! Integer-nanosecond time.
//!
//! Stamps turned into `f64` seconds since 1970 lose about 1e-6 of a 100 Hz interval: 1 ppm of gyroscope scale
//! factor and more than 1 ug of accelerometer bias. Only *differences* of stamps ever become `f64` here.

use serde::{Deserialize, Serialize};

/// Nanoseconds in a second.
pub const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// A point in time: nanoseconds since the Unix epoch (or since whatever epoch the bag or `/clock` uses).
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Stamp(i64);

impl Stamp {
    /// From nanoseconds since the epoch.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// From the fields of `builtin_interfaces/Time`.
    pub const fn from_sec_nanosec(sec: i32, nanosec: u32) -> Self {
        Self(sec as i64 * NANOS_PER_SECOND + nanosec as i64)
    }

    /// Nanoseconds since the epoch.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// The fields of `builtin_interfaces/Time` (floor division, so `nanosec` is never negative).
    pub const fn sec_nanosec(self) -> (i32, u32) {
        (
            self.0.div_euclid(NANOS_PER_SECOND) as i32,
            self.0.rem_euclid(NANOS_PER_SECOND) as u32,
        )
    }

    /// Seconds from `earlier` to `self`; exact to the nanosecond for any interval shorter than 100 days.
    #[inline]
    pub fn seconds_since(self, earlier: Self) -> f64 {
        (self.0 - earlier.0) as f64 / 1e9
    }

    /// This stamp moved by `nanos`.
    #[must_use]
    pub const fn plus_nanos(self, nanos: i64) -> Self {
        Self(self.0 + nanos)
    }

    /// This stamp moved by `seconds`, rounded to the nanosecond.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self(self.0 + seconds_to_nanos(seconds))
    }
}

/// Seconds as whole nanoseconds, rounded to the nearest.
pub fn seconds_to_nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stamp before the epoch keeps `nanosec` within 0..1e9, as ROS wants it.
    #[test]
    fn negative_stamps_split_with_floor_division() {
        assert_eq!(Stamp::from_nanos(-1).sec_nanosec(), (-1, 999_999_999));
        assert_eq!(Stamp::from_sec_nanosec(-1, 999_999_999).nanos(), -1);
    }

    /// The interval between two stamps of today is exact, which f64 seconds since 1970 would not be.
    #[test]
    fn differences_are_exact() {
        let t0 = Stamp::from_sec_nanosec(1_760_000_000, 123_456_789);
        assert_eq!(t0.plus_nanos(10_000_001).seconds_since(t0), 0.010_000_001);
    }
}
