//! Numbers and names as people read them.

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

/// With a capital at its start.
pub fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars
        .next()
        .map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// A name that can stand in a file name and an anchor.
pub fn slug(text: &str) -> String {
    let mut slug: String = text
        .to_lowercase()
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    while slug.contains("--") {
        slug = slug.replace("--", "-");
    }
    slug.trim_matches('-').to_owned()
}

/// Digits behind the point that an estimate in a field unit is shown with.
pub fn decimals(unit: &str) -> usize {
    match unit {
        "deg/h" | "deg/h/g" => 5,
        _ => 2,
    }
}
