//! Ranges of settings: each check once, with the words that a person reads.

use crate::error::Error;

/// A finite number.
///
/// # Errors
/// [`Error::Setting`] with `name`, which carries the unit.
pub fn finite(name: &str, value: f64) -> Result<f64, Error> {
    check(name, value, value.is_finite(), "a finite number")
}

/// A finite number above zero.
///
/// # Errors
/// As [`finite`].
pub fn positive(name: &str, value: f64) -> Result<f64, Error> {
    check(
        name,
        value,
        value.is_finite() && value > 0.0,
        "a positive number",
    )
}

/// A finite number that is zero or more.
///
/// # Errors
/// As [`finite`].
pub fn not_negative(name: &str, value: f64) -> Result<f64, Error> {
    check(
        name,
        value,
        value.is_finite() && value >= 0.0,
        "0 or a positive number",
    )
}

/// A number from `-limit` to `limit`, give or take rounding.
///
/// # Errors
/// As [`finite`].
pub fn within(name: &str, value: f64, limit: f64) -> Result<f64, Error> {
    let good = value.abs() <= limit * (1.0 + 1e-12);
    check(name, value, good, &format!("-{limit} to {limit}"))
}

fn check(name: &str, value: f64, good: bool, expected: &str) -> Result<f64, Error> {
    if good {
        Ok(value)
    } else {
        Err(Error::setting(name, value, expected))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NaN and infinity are in no range, zero is in that of what is not negative, and the line names value and range.
    #[test]
    fn ranges_are_what_their_names_say() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for range in [finite, positive, not_negative] {
                assert!(range("x", value).is_err(), "{value}");
            }
            assert!(within("x", value, 1.0).is_err(), "{value}");
        }
        assert!(positive("x", 0.0).is_err() && not_negative("x", 0.0) == Ok(0.0));
        assert!(not_negative("x", -1e-300).is_err() && finite("x", -1.0) == Ok(-1.0));
        assert!(within("x", -90.0, 90.0).is_ok() && within("x", 90.1, 90.0).is_err());
        let line = positive("dwell_s", -3.0).map_err(|error| error.to_string());
        assert_eq!(
            line,
            Err("dwell_s is -3, expected a positive number".to_owned())
        );
    }
}
