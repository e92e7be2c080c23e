//! Field units of parameters; what SI has itself is in [`Unit`].

use ros_node::Unit;
use sins::units;

/// √3600 s.
const SQRT_HOUR: f64 = 60.0;

/// Degrees.
pub const DEGREE: Unit = Unit::new("deg", units::ARC_MINUTE * 60.0);
/// Degrees a second.
pub const DEGREE_PER_SECOND: Unit = Unit::new("deg/s", units::ARC_MINUTE * 60.0);
/// Degrees a second, a second.
pub const DEGREE_PER_SECOND2: Unit = Unit::new("deg/s^2", units::ARC_MINUTE * 60.0);
/// Degrees an hour.
pub const DEGREE_PER_HOUR: Unit = Unit::new("deg/h", units::DEG_PER_HOUR);
/// Degrees a square root of an hour: white noise of a gyroscope.
pub const DEGREE_PER_SQRT_HOUR: Unit = Unit::new("deg/sqrt(h)", units::DEG_PER_SQRT_HOUR);
/// Degrees an hour, a square root of an hour: walk of a drift.
pub const DEGREE_PER_HOUR_SQRT_HOUR: Unit =
    Unit::new("deg/h/sqrt(h)", units::DEG_PER_HOUR / SQRT_HOUR);
/// Minutes of arc.
pub const ARC_MINUTE: Unit = Unit::new("arcmin", units::ARC_MINUTE);
/// Seconds of arc.
pub const ARC_SECOND: Unit = Unit::new("arcsec", units::ARC_SECOND);
/// Micro-g.
pub const MICRO_G: Unit = Unit::new("ug", units::MICRO_G);
/// Micro-g a square root of a hertz: white noise of an accelerometer.
pub const MICRO_G_PER_SQRT_HERTZ: Unit = Unit::new("ug/sqrt(Hz)", units::MICRO_G);
/// Micro-g a square root of an hour: walk of a bias.
pub const MICRO_G_PER_SQRT_HOUR: Unit = Unit::new("ug/sqrt(h)", units::MICRO_G / SQRT_HOUR);
/// Parts per million.
pub const PPM: Unit = Unit::new("ppm", units::PPM);
/// Micro-g a squared g.
pub const MICRO_G_PER_G2: Unit = Unit::new("ug/g^2", units::MICRO_G_PER_G2);
/// Degrees an hour, a g.
pub const DEGREE_PER_HOUR_PER_G: Unit = Unit::new("deg/h/g", units::DEG_PER_HOUR_PER_G);
/// Millimetres.
pub const MILLIMETRE: Unit = Unit::new("mm", 1e-3);
/// Milliseconds.
pub const MILLISECOND: Unit = Unit::new("ms", 1e-3);
