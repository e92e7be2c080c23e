//! Field units, for the places where a person reads or writes them; everything else is SI.

use std::f64::consts::PI;

use crate::earth::STANDARD_GRAVITY_M_S2;

/// One degree per hour \[rad/s\].
pub const DEG_PER_HOUR: f64 = PI / 180.0 / 3600.0;
/// One degree per square root of an hour \[rad/√s\].
pub const DEG_PER_SQRT_HOUR: f64 = PI / 180.0 / 60.0;
/// One micro-g \[m/s²\]; as a density, one ug/√Hz \[m/s/√s\].
pub const MICRO_G: f64 = STANDARD_GRAVITY_M_S2 * 1e-6;
/// One arc-minute \[rad\].
pub const ARC_MINUTE: f64 = PI / 180.0 / 60.0;
/// One arc-second \[rad\].
pub const ARC_SECOND: f64 = ARC_MINUTE / 60.0;
/// One nautical mile \[m\].
pub const NAUTICAL_MILE_M: f64 = 1852.0;
/// One part per million.
pub const PPM: f64 = 1e-6;
/// One ug/g² \[1/(m/s²)\].
pub const MICRO_G_PER_G2: f64 = MICRO_G / (STANDARD_GRAVITY_M_S2 * STANDARD_GRAVITY_M_S2);
/// One deg/h/g \[rad/s per m/s²\].
pub const DEG_PER_HOUR_PER_G: f64 = DEG_PER_HOUR / STANDARD_GRAVITY_M_S2;
