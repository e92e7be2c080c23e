//! Numbers as people read them.

/// Three significant digits, without an exponent where it can be helped.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let before = value.abs().log10().floor() as i32;
    if (-5..6).contains(&before) {
        format!("{value:.*}", (2 - before).max(0) as usize)
    } else {
        format!("{value:.2e}")
    }
}
