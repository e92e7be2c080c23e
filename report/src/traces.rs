//! Curves and bands within their axes.

use plotters::prelude::*;

use crate::chart::Chart;
use crate::curve::{self, Point};
use crate::pen::{self, Sheet, words};
use crate::plan::PanelPlan;
use crate::ticks::{is_drawable, scaled};
use crate::{Line, Panel, Series};

/// Columns of the window a curve is thinned to, and a curve that is one of many.
const COLUMNS: usize = 1000;
const COLUMNS_THIN: usize = 400;
/// A curve with markers has one in so many pixels.
const MARKERS_EVERY: i32 = 220;

/// Shaded areas.
pub(crate) fn draw_bands(
    chart: &mut Chart,
    panel: &Panel,
    place: &PanelPlan,
    log: bool,
) -> Result<(), String> {
    let bottom = place.window.y.0;
    for band in &panel.bands {
        // On a logarithmic axis a lower edge at or below zero is below every window.
        let lower = |y: f64| {
            if log && y <= 0.0 {
                bottom
            } else {
                scaled(y, log)
            }
        };
        let spans: Vec<_> = band
            .points
            .iter()
            .map(|&(x, l, u)| (x, lower(l), scaled(u, log)))
            .collect();
        let drawable = |&(x, l, u): &curve::Span| [x, l, u].into_iter().all(is_drawable);
        for run in curve::runs(&spans, drawable) {
            if let Some(outline) = curve::outline(&run, &place.window, COLUMNS) {
                let style = pen::colour(band.colour).mix(0.2).filled();
                chart
                    .draw_series([Polygon::new(outline, style)])
                    .map_err(words)?;
            }
        }
    }
    Ok(())
}

/// Pieces of a series that are seen.
fn pieces(series: &Series, place: &PanelPlan, log: bool) -> Vec<Vec<Point>> {
    let points: Vec<_> = series
        .points
        .iter()
        .map(|&(x, y)| (x, scaled(y, log)))
        .collect();
    let columns = if series.line == Line::Thin {
        COLUMNS_THIN
    } else {
        COLUMNS
    };
    curve::runs(&points, |&(x, y)| is_drawable(x) && is_drawable(y))
        .into_iter()
        .map(|run| {
            if series.line == Line::Steps {
                curve::stairs(&run)
            } else {
                run
            }
        })
        .flat_map(|run| match series.line {
            Line::Points => run
                .into_iter()
                .flat_map(|point| curve::cut(&[point], &place.window))
                .collect(),
            _ => curve::cut(&run, &place.window),
        })
        .map(|piece| curve::thinned(&piece, &place.window, columns))
        .collect()
}

/// One series; the pixels it goes through are added to `drawn`.
pub(crate) fn draw_series(
    sheet: &Sheet,
    chart: &mut Chart,
    series: &Series,
    marked: bool,
    place: &PanelPlan,
    log: bool,
    drawn: &mut Vec<(i32, i32)>,
) -> Result<(), String> {
    for piece in pieces(series, place, log) {
        let pixels: Vec<_> = piece
            .iter()
            .map(|point| chart.backend_coord(point))
            .collect();
        match (series.line, pixels.as_slice()) {
            (Line::Points, _) | (Line::LinePoints, [_]) => {}
            (line, [only]) => {
                let style = pen::curve(line, series.colour).filled();
                sheet.draw(&Circle::new(*only, 6, style)).map_err(words)?;
            }
            (line, _) => {
                let path = PathElement::new(piece.clone(), pen::curve(line, series.colour));
                chart.draw_series([path]).map_err(words)?;
            }
        }
        drawn.extend(
            pixels
                .windows(2)
                .flat_map(|pair| between(pair[0], pair[1], 24)),
        );
        drawn.extend(&pixels);
        if marked {
            for at in spread(&pixels, series.colour) {
                pen::marker(sheet, at, series.colour)?;
            }
        }
    }
    if matches!(series.line, Line::Points | Line::LinePoints) {
        for &(x, y) in &series.points {
            let point = (x, scaled(y, log));
            if is_drawable(x)
                && is_drawable(point.1)
                && !curve::cut(&[point], &place.window).is_empty()
            {
                pen::marker(sheet, chart.backend_coord(&point), series.colour)?;
            }
        }
    }
    Ok(())
}

/// Points of a segment, one in so many pixels.
pub(crate) fn between(
    a: (i32, i32),
    b: (i32, i32),
    every: i32,
) -> impl Iterator<Item = (i32, i32)> {
    let n = (b.0 - a.0).abs().max((b.1 - a.1).abs()) / every;
    (1..=n).map(move |k| {
        (
            a.0 + (b.0 - a.0) * k / (n + 1),
            a.1 + (b.1 - a.1) * k / (n + 1),
        )
    })
}

/// Places for a few markers on a curve; curves of different colours have theirs at different x.
fn spread(pixels: &[(i32, i32)], colour: usize) -> Vec<(i32, i32)> {
    let phase = (colour as i32 * 3 % 8) * MARKERS_EVERY / 8 + MARKERS_EVERY / 16;
    let slot = |x: i32| (x - phase).div_euclid(MARKERS_EVERY);
    let ends = |pair: &[(i32, i32)]| (pair[0], pair[1]);
    let mut places = Vec::new();
    for (a, b) in pixels.windows(2).map(ends) {
        let (from, to) = (slot(a.0.min(b.0)), slot(a.0.max(b.0)));
        places.extend((from + 1..=to).map(|k| {
            let x = k * MARKERS_EVERY + phase;
            let share = f64::from(x - a.0) / f64::from(b.0 - a.0);
            (
                x,
                (f64::from(a.1) + share * f64::from(b.1 - a.1)).round() as i32,
            )
        }));
    }
    match (places.is_empty(), pixels) {
        (true, [_, ..]) => vec![pixels[pixels.len() / 2]],
        _ => places,
    }
}
