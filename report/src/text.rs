//! Text of a picture: how wide it is, where it breaks, what XML does not take.

/// Font size, chosen for a phone: 11 px where 1000 units are shown as 624 px.
pub(crate) const FONT: f64 = 18.0;
/// Height of a row of text.
pub(crate) const ROW: f64 = 25.0;
/// From the middle of a row down to the baseline: half of a capital.
pub(crate) const BASELINE: f64 = 6.5;

/// The width of a text of size [`FONT`], a little on the safe side: no font is asked.
pub(crate) fn width(text: &str) -> f64 {
    let em = |c| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '|' | '!' | '\'' => 0.28,
        'f' | 't' | 'r' | ' ' | '(' | ')' | '[' | ']' | '-' | '/' | '⁻' | '¹' | '²' | '³' => {
            0.36
        }
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '—' => 0.9,
        '0'..='9' => 0.58,
        c if c.is_uppercase() => 0.72,
        c if c > '\u{2E80}' => 1.0,
        _ => 0.57,
    };
    FONT * text.chars().map(em).sum::<f64>()
}

/// The widest of some texts.
pub(crate) fn widest<'a>(texts: impl IntoIterator<Item = &'a str>) -> f64 {
    texts.into_iter().map(width).fold(0.0, f64::max)
}

/// Text without characters that XML does not know.
pub(crate) fn clean(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .filter(|c| !matches!(c, '\u{FFFE}' | '\u{FFFF}'))
        .collect()
}

/// A title in one line, or in two where one is too long: before its unit, or near its middle.
pub(crate) fn lines(title: &str, room: f64) -> Vec<String> {
    if width(title) <= room {
        return vec![title.to_owned()];
    }
    let before_unit = title.rfind(" (").filter(|at| width(&title[..*at]) <= room);
    let middle = || {
        let blanks = title.match_indices(' ').map(|(at, _)| at);
        blanks.min_by_key(|at| at.abs_diff(title.len() / 2))
    };
    match before_unit.or_else(middle) {
        Some(at) => vec![title[..at].to_owned(), title[at + 1..].to_owned()],
        None => vec![title.to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unit goes into a line of its own before a word does.
    #[test]
    fn long_titles_break_before_their_unit() {
        assert_eq!(
            lines("gyroscope drift east (deg/h)", 200.0),
            ["gyroscope drift east", "(deg/h)"]
        );
        assert_eq!(lines("drift (deg/h)", 250.0), ["drift (deg/h)"]);
        assert_eq!(lines("one two", 10.0), ["one", "two"]);
        assert_eq!(lines("unbreakable", 10.0), ["unbreakable"]);
    }
}
