//! Lines and markers as they appear on paper.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::Line;
use crate::layout::FONT;
use crate::palette::{self, Shape};

/// What is drawn on.
pub(crate) type Sheet<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Drawing errors, in words.
pub(crate) fn words(error: impl std::error::Error) -> String {
    error.to_string()
}

const FAMILY: &str = "Helvetica, Arial, sans-serif";
pub(crate) const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub(crate) const GREY: RGBColor = RGBColor(0x55, 0x55, 0x55);
/// Plotters divides font sizes by this on their way into SVG.
const FONT_FACTOR: f64 = 1.24;

// The backend writes no dash patterns. A pen is told by its width instead, and `with_dashes` puts pattern and true width into the
// finished picture. Nothing else may use these widths.
const DASHED: u32 = 101;
const DOTTED: u32 = 102;
const MARK: u32 = 103;
const SOLID: u32 = 5;
const THIN: u32 = 3;

/// The finished picture, with dash patterns. Text cannot be mistaken for an attribute: its quotes are escaped.
pub(crate) fn with_dashes(svg: &str) -> String {
    svg.replace(
        "stroke-width=\"101\"",
        "stroke-width=\"5\" stroke-dasharray=\"22 13\"",
    )
    .replace(
        "stroke-width=\"102\"",
        "stroke-width=\"7\" stroke-linecap=\"round\" stroke-dasharray=\"0.1 14\"",
    )
    .replace(
        "stroke-width=\"103\"",
        "stroke-width=\"3\" stroke-dasharray=\"10 8\"",
    )
}

pub(crate) fn colour(index: usize) -> RGBColor {
    let (red, green, blue) = palette::colour(index);
    RGBColor(red, green, blue)
}

/// The style of a curve.
pub(crate) fn curve(line: Line, index: usize) -> ShapeStyle {
    let (width, alpha) = match line {
        Line::Dashed => (DASHED, 1.0),
        Line::Dotted => (DOTTED, 1.0),
        Line::Thin => (THIN, 0.35),
        Line::Solid | Line::Steps | Line::LinePoints | Line::Points => (SOLID, 1.0),
    };
    ShapeStyle {
        color: colour(index).mix(alpha),
        filled: false,
        stroke_width: width,
    }
}

/// The style of the line of a mark.
pub(crate) fn mark() -> ShapeStyle {
    ShapeStyle {
        color: GREY.to_rgba(),
        filled: false,
        stroke_width: MARK,
    }
}

pub(crate) fn stroke(colour: RGBColor, width: u32) -> ShapeStyle {
    ShapeStyle {
        color: colour.to_rgba(),
        filled: false,
        stroke_width: width,
    }
}

/// Text with its anchor.
pub(crate) fn text(horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    sized(FONT, horizontal, vertical)
}

pub(crate) fn sized(size: i32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    let font = (FAMILY, f64::from(size) * FONT_FACTOR).into_font();
    TextStyle::from(font)
        .color(&INK)
        .pos(Pos::new(horizontal, vertical))
}

/// Bold text that begins at its place.
pub(crate) fn bold() -> TextStyle<'static> {
    let font = (FAMILY, f64::from(FONT) * FONT_FACTOR)
        .into_font()
        .style(FontStyle::Bold);
    TextStyle::from(font)
        .color(&INK)
        .pos(Pos::new(HPos::Left, VPos::Center))
}

/// Text that is read from the right.
pub(crate) fn upright(size: i32) -> TextStyle<'static> {
    let font = (FAMILY, f64::from(size) * FONT_FACTOR)
        .into_font()
        .transform(FontTransform::Rotate270);
    TextStyle::from(font)
        .color(&INK)
        .pos(Pos::new(HPos::Center, VPos::Center))
}

/// A marker of a colour. White around it parts it from the lines.
pub(crate) fn marker(sheet: &Sheet, at: (i32, i32), index: usize) -> Result<(), String> {
    let r = 12;
    let (x, y) = at;
    let style = colour(index).filled();
    let polygon = |corners: &[(i32, i32)]| {
        corners
            .iter()
            .map(|(dx, dy)| (x + dx, y + dy))
            .collect::<Vec<_>>()
    };
    let filled = |corners: &[(i32, i32)]| {
        sheet
            .draw(&Polygon::new(polygon(corners), style))
            .map_err(words)
    };
    let line = |corners: &[(i32, i32)]| {
        sheet
            .draw(&PathElement::new(
                polygon(corners),
                stroke(colour(index), 6),
            ))
            .map_err(words)
    };
    match palette::shape(index) {
        Shape::Circle => sheet.draw(&Circle::new(at, r, style)).map_err(words),
        Shape::Ring => sheet
            .draw(&Circle::new(at, r, stroke(colour(index), 5)))
            .map_err(words),
        Shape::Square => filled(&[(-11, -11), (11, -11), (11, 11), (-11, 11)]),
        Shape::Triangle => filled(&[(0, -15), (14, 11), (-14, 11)]),
        Shape::TriangleDown => filled(&[(0, 15), (14, -11), (-14, -11)]),
        Shape::Diamond => filled(&[(0, -16), (14, 0), (0, 16), (-14, 0)]),
        Shape::Cross => line(&[(-r, -r), (r, r)]).and_then(|()| line(&[(-r, r), (r, -r)])),
        Shape::Plus => line(&[(-14, 0), (14, 0)]).and_then(|()| line(&[(0, -14), (0, 14)])),
    }
}
