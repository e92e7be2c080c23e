//! Findings of an analysis in a few words, as text and page both say them.

use sins::studies::observability::global::{GlobalConditions, Spread};

/// One line on whether four centres lie out of one plane.
pub fn spread_line(spread: &Spread) -> String {
    if spread.out_of_plane() {
        format!(
            "met, margin {:.3} by {}",
            spread.margin,
            spread.best.join(", ")
        )
    } else if spread.best.len() < 4 {
        format!("not met: {} of four positions", spread.best.len())
    } else {
        format!(
            "not met: all centres in one plane, margin {:.1e}",
            spread.margin
        )
    }
}

/// One line on the axes that the rotations turn about.
pub fn rotations_line(global: &GlobalConditions) -> String {
    let horizontal = global
        .rotations
        .iter()
        .filter(|r| r.is_horizontal())
        .count();
    format!(
        "{horizontal} of {}; {}",
        global.rotations.len(),
        if global.has_two_horizontal_axes() {
            "two horizontal axes alternate"
        } else {
            "no two horizontal axes"
        }
    )
}

/// A singular value that does not count; what is rounding is called so, for its digits mean nothing.
pub fn dropped(value: f64) -> String {
    if value < 1e-14 {
        "< 1e-14".to_owned()
    } else {
        format!("{value:.1e}")
    }
}
