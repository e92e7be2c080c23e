//! Names of the colours, and the marker that goes with each.
//!
//! Colour-blind readers tell them apart (Okabe and Ito, 2008). Their values, for light and for dark paper, stand in `figure.css`.

use std::fmt::Write;

use maud::{Markup, html};

use crate::frame::Point;

/// Number of colours; a greater index starts again.
pub const COUNT: usize = 8;
/// Index of blue.
pub const BLUE: usize = 0;
/// Index of vermilion.
pub const VERMILION: usize = 1;
/// Index of bluish green.
pub const GREEN: usize = 2;
/// Index of reddish purple.
pub const PURPLE: usize = 3;
/// Index of orange.
pub const ORANGE: usize = 4;
/// Index of sky blue.
pub const SKY: usize = 5;
/// Index of black; white on dark paper.
pub const BLACK: usize = 6;
/// Index of yellow; faint on white, for bands.
pub const YELLOW: usize = 7;

/// Markers by colour: how they are painted, and their outline around the point.
const MARKERS: [(&str, &str); COUNT] = [
    ("point", "m-6 0a6 6 0 1 0 12 0a6 6 0 1 0-12 0z"),
    ("point", "m-5.5-5.5h11v11h-11z"),
    ("point", "m0-7.5l7 13h-14z"),
    ("point", "m0-8l7 8l-7 8l-7-8z"),
    ("point", "m0 7.5l7-13h-14z"),
    ("open", "m-6-6l12 12m0-12l-12 12"),
    ("open", "m-7 0h14m-7-7v14"),
    ("open", "m-6 0a6 6 0 1 0 12 0a6 6 0 1 0-12 0z"),
];

/// The class of a colour.
pub(crate) fn class(index: usize) -> String {
    format!("c{}", index % COUNT)
}

/// The markers of a colour at some places.
pub(crate) fn markers(index: usize, places: &[Point]) -> Markup {
    let (class, outline) = MARKERS[index % COUNT];
    let path = places.iter().fold(String::new(), |mut path, (x, y)| {
        // Writing to a String cannot fail.
        let _ = write!(path, "M{x} {y}{outline}");
        path
    });
    html! { @if !places.is_empty() { path class=(class) d=(path) {} } }
}
