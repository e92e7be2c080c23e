//! Units of parameters: what people write, and what the program works with.

/// A unit, and how much one of it is in the unit that the program works with (SI).
///
/// ```
/// use ros_node::Unit;
/// const DEG: Unit = Unit::new("deg", std::f64::consts::PI / 180.0);
/// assert_eq!(DEG.to_si(180.0), std::f64::consts::PI);
/// assert_eq!(DEG.from_si(0.3_f64.to_radians()), 0.3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    symbol: &'static str,
    in_si: f64,
}

impl Unit {
    /// No unit: a ratio or a count.
    pub const NONE: Self = Self::si("");
    /// Seconds.
    pub const SECOND: Self = Self::si("s");
    /// Hertz.
    pub const HERTZ: Self = Self::si("Hz");
    /// Metres.
    pub const METRE: Self = Self::si("m");
    /// Metres a second.
    pub const METRE_PER_SECOND: Self = Self::si("m/s");
    /// Metres a second, a second.
    pub const METRE_PER_SECOND2: Self = Self::si("m/s^2");
    /// Radians a second.
    pub const RADIAN_PER_SECOND: Self = Self::si("rad/s");

    /// A unit with its symbol, of which one is `in_si`.
    pub const fn new(symbol: &'static str, in_si: f64) -> Self {
        Self { symbol, in_si }
    }

    /// A unit that the program works with itself.
    pub const fn si(symbol: &'static str) -> Self {
        Self::new(symbol, 1.0)
    }

    /// Its symbol, e.g. `deg/h`.
    pub const fn symbol(self) -> &'static str {
        self.symbol
    }

    /// A number of this unit in SI.
    pub fn to_si(self, value: f64) -> f64 {
        value * self.in_si
    }

    /// A number in SI in this unit: the shortest decimal that stands for it but for rounding.
    pub fn from_si(self, si: f64) -> f64 {
        let exact = si / self.in_si;
        (0..15)
            .filter_map(|digits| format!("{exact:.digits$e}").parse::<f64>().ok())
            .find(|short| (short * self.in_si - si).abs() <= 4.0 * f64::EPSILON * si.abs())
            .unwrap_or(exact)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number that was written in the unit is written the same again, however its conversion was rounded.
    #[test]
    fn what_was_written_comes_back() {
        let degree = Unit::new("deg", std::f64::consts::PI / 180.0);
        let per_hour = Unit::new("deg/h", std::f64::consts::PI / 180.0 / 3600.0);
        for number in [
            0.0, 0.002, 0.01, 0.1, 1.0, 2.5, 45.78, 126.67, 3600.0, -7.3e-5,
        ] {
            for unit in [degree, per_hour, Unit::SECOND] {
                assert_eq!(unit.from_si(unit.to_si(number)), number);
            }
        }
        assert_eq!(degree.from_si(10.0 * std::f64::consts::PI / 180.0), 10.0);
        assert_eq!(Unit::SECOND.from_si(1.0 / 3.0), 1.0 / 3.0);
        assert_eq!(Unit::SECOND.from_si(f64::INFINITY), f64::INFINITY);
    }
}
