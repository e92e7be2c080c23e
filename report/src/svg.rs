//! From a figure to its picture. How things look stands in `figure.css`; here is where they are.

use std::fmt::Write;

use maud::{Markup, PreEscaped, html};

use crate::curve::{self, between};
use crate::frame::{Frame, Point, px};
use crate::plan::{EDGE, LINE, NUMBERS, PanelPlan, Plan, WIDTH};
use crate::text::{self, BASELINE, FONT, ROW, clean};
use crate::ticks::{Ruler, is_drawable, scaled};
use crate::{Band, Error, Figure, Line, Panel, Scale, Series, legend, marks, palette};

/// The look of all pictures.
pub(crate) const STYLE: &str = include_str!("figure.css");

/// Columns of the window a curve is thinned to, and a curve that is one of many.
const COLUMNS: usize = 1000;
const COLUMNS_THIN: usize = 400;
/// How far from a line a point may be that is left out: what rounding costs in any case.
const TOLERANCE: f64 = 0.1;
/// Distance of the markers of a curve.
const MARKERS_EVERY: f64 = 110.0;

/// The picture of a figure, with `style` where it stands alone.
pub(crate) fn svg(figure: &Figure, style: Option<&str>) -> Result<Markup, Error> {
    let Some(last) = figure.panels.len().checked_sub(1) else {
        return Err(Error::NoPanels {
            figure: figure.id.clone(),
        });
    };
    let drawn = figure.on_drawn_x();
    let figure = drawn.as_ref();
    let plan = Plan::new(figure);
    let name = if figure.title.is_empty() {
        &figure.id
    } else {
        &figure.title
    };
    let [name, caption] = [name, &figure.caption].map(|text| clean(text));
    let panels = figure.panels.iter().zip(&plan.panels).enumerate();
    Ok(html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (WIDTH) " " (plan.height) } role="img" aria-label=(name) class={ "chart" @if plan.height > WIDTH { " tall" } } {
            title { (name) }
            @if !caption.is_empty() { desc { (caption) } }
            @if let Some(style) = style { style { (PreEscaped(style)) } }
            rect class="paper" width=(WIDTH) height=(plan.height) {}
            (plan.legend.markup((plan.left, EDGE)))
            @for (i, (panel, place)) in panels {
                g { (panel_markup(panel, place, &plan.x, i == last)) }
            }
        }
    })
}

fn panel_markup(panel: &Panel, place: &PanelPlan, x: &Ruler, last: bool) -> Markup {
    let frame = &place.frame;
    let log = panel.scale == Scale::Log;
    let mut drawn = Vec::new();
    let series = panel.series.iter().zip(legend::marked(panel));
    // One of many stands behind the others.
    let (behind, front): (Vec<_>, Vec<_>) =
        series.partition(|(series, _)| series.line == Line::Thin);
    html! {
        @if !panel.title.is_empty() {
            text class="bold" x=(frame.left) y=(px(place.head + ROW / 2.0 + BASELINE)) { (clean(&panel.title)) }
        }
        (place.legend.markup(place.legend_at))
        (grid(place, x))
        (y_numbers(place))
        @if last { (x_numbers(frame, x)) }
        @if let Some(reason) = place.empty {
            @let (x, y) = frame.middle();
            text class="grey middle" x=(x) y=(px(y + BASELINE)) { (reason) }
        }
        @for band in &panel.bands { (band_markup(band, frame, log)) }
        (marks::verticals(panel, place))
        @for (series, marked) in behind.into_iter().chain(front) {
            (series_markup(series, marked, frame, log, &mut drawn))
        }
        (marks::horizontals(panel, place, drawn))
        rect class="frame" x=(frame.left) y=(frame.top) width=(px(frame.right - frame.left)) height=(px(frame.bottom - frame.top)) {}
    }
}

/// Lines behind the data, and the small lines outside of the frame that the numbers belong to.
fn grid(place: &PanelPlan, x: &Ruler) -> Markup {
    let frame = &place.frame;
    let y = &place.ruler;
    let inside = ((frame.left, frame.right), (frame.top, frame.bottom));
    let left = (px(frame.left - 5.0), frame.left);
    let below = (frame.bottom, px(frame.bottom + 5.0));
    let ticks = |ruler: &Ruler| -> Vec<_> { ruler.ticks.iter().map(|tick| tick.at).collect() };
    let (xs, ys) = (ticks(x), ticks(y));
    let minor = lines(frame, (&x.minor, &y.minor), inside);
    html! {
        @if !minor.is_empty() { path class="minor" d=(minor) {} }
        path class="grid" d=(lines(frame, (&xs, &ys), inside)) {}
        path class="ticks" d=(lines(frame, (&xs, &ys), (left, below))) {}
    }
}

/// Lines at some values of both axes: across `from_x`, and up and down `from_y`.
fn lines(frame: &Frame, (xs, ys): (&[f64], &[f64]), (from_x, from_y): (Point, Point)) -> String {
    let mut path = String::new();
    // Writing to a String cannot fail.
    for at in xs {
        let _ = write!(path, "M{} {}V{}", frame.x(*at), from_y.0, from_y.1);
    }
    for at in ys {
        let _ = write!(path, "M{} {}H{}", from_x.0, frame.y(*at), from_x.1);
    }
    path
}

/// The title and the numbers of the y axis.
fn y_numbers(place: &PanelPlan) -> Markup {
    let frame = &place.frame;
    let room = frame.bottom - frame.top + ROW;
    let title = |i: usize, line: &str| {
        let size = (FONT * room / text::width(line).max(1.0)).clamp(12.0, FONT);
        let x = px(EDGE + FONT / 2.0 + BASELINE + i as f64 * LINE);
        let y = frame.middle().1;
        html! {
            text class="middle" font-size=[(size < FONT).then(|| px(size))] transform={ "translate(" (x) " " (y) ") rotate(-90)" } { (line) }
        }
    };
    html! {
        @for (i, line) in place.title.iter().enumerate() { (title(i, line)) }
        g class="end" {
            @for tick in &place.ruler.ticks {
                text x=(px(frame.left - 10.0)) y=(px(frame.y(tick.at) + BASELINE)) { (tick.text) }
            }
        }
    }
}

/// The numbers and the title of the x axis.
fn x_numbers(frame: &Frame, x: &Ruler) -> Markup {
    html! {
        g class="middle" {
            @for tick in &x.ticks {
                text x=(frame.x(tick.at)) y=(px(frame.bottom + NUMBERS / 2.0 + BASELINE + 2.0)) { (tick.text) }
            }
            text x=(frame.middle().0) y=(px(frame.bottom + NUMBERS + ROW / 2.0 + BASELINE - 2.0)) { (x.title) }
        }
    }
}

/// Points as SVG lists them.
fn list(points: &[Point]) -> String {
    let mut list = String::new();
    for (i, (x, y)) in points.iter().enumerate() {
        let separator = if i == 0 { "" } else { " " };
        // Writing to a String cannot fail.
        let _ = write!(list, "{separator}{x},{y}");
    }
    list
}

fn band_markup(band: &Band, frame: &Frame, log: bool) -> Markup {
    // On a logarithmic axis a lower edge at or below zero is below every window.
    let lower = |y: f64| {
        if log && y <= 0.0 {
            frame.window.y.0
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
    let outlines = curve::runs(&spans, drawable).into_iter();
    let outlines = outlines.filter_map(|run| curve::outline(&run, &frame.window, COLUMNS));
    html! {
        g class=(palette::class(band.colour)) {
            @for outline in outlines {
                polygon class="band" points=(list(&smooth(&outline, frame))) {}
            }
        }
    }
}

/// Places in the picture; what falls on the same place stands once.
fn placed(points: &[Point], frame: &Frame) -> Vec<Point> {
    let mut places: Vec<_> = points.iter().map(|point| frame.at(*point)).collect();
    places.dedup();
    places
}

/// A line in the picture, with no more points than the eye can tell.
fn smooth(line: &[Point], frame: &Frame) -> Vec<Point> {
    curve::simplified(&placed(line, frame), TOLERANCE)
}

/// Pieces of a series that are seen, in the picture.
fn pieces(series: &Series, points: &[Point], frame: &Frame) -> Vec<Vec<Point>> {
    let columns = match series.line {
        Line::Thin => COLUMNS_THIN,
        _ => COLUMNS,
    };
    curve::runs(points, |&(x, y)| is_drawable(x) && is_drawable(y))
        .into_iter()
        .flat_map(|run| match series.line {
            Line::Steps => curve::cut(&curve::stairs(&run), &frame.window),
            _ => curve::cut(&run, &frame.window),
        })
        .map(|piece| smooth(&curve::thinned(&piece, &frame.window, columns), frame))
        .collect()
}

/// One series; the places it goes through are added to `drawn`.
fn series_markup(
    series: &Series,
    marked: bool,
    frame: &Frame,
    log: bool,
    drawn: &mut Vec<Point>,
) -> Markup {
    let points = series.points.iter().map(|&(x, y)| (x, scaled(y, log)));
    let mut points: Vec<_> = points.collect();
    let mut lines = Vec::new();
    let mut markers = Vec::new();
    if series.line != Line::Points {
        lines = pieces(series, &points, frame);
        for line in &lines {
            let segments = line.windows(2).flat_map(|pair| between(pair[0], pair[1]));
            drawn.extend(segments.chain(line.iter().copied()));
            if marked {
                markers.extend(spread(line, series.colour));
            }
        }
    }
    if matches!(series.line, Line::Points | Line::LinePoints) {
        points.retain(|point| frame.window.holds(*point));
        markers = placed(&curve::thinned(&points, &frame.window, COLUMNS), frame);
        drawn.extend(&markers);
    }
    html! {
        g class=(palette::class(series.colour)) {
            @for line in &lines {
                @match line.as_slice() {
                    [_] if series.line == Line::LinePoints => {},
                    [(x, y)] => circle class="dot" cx=(x) cy=(y) r="3" {},
                    line => polyline class=(legend::class(series.line)) points=(list(line)) {},
                }
            }
            (palette::markers(series.colour, &markers))
        }
    }
}

/// Places for a few markers on a curve; curves of different colours have theirs at different x.
fn spread(line: &[Point], colour: usize) -> Vec<Point> {
    let phase = ((colour * 3 % 8) as f64 + 0.5) / 8.0 * MARKERS_EVERY;
    let slot = |x: f64| ((x - phase) / MARKERS_EVERY).floor() as i32;
    let mut places = Vec::new();
    for pair in line.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for k in slot(a.0.min(b.0)) + 1..=slot(a.0.max(b.0)) {
            let x = f64::from(k) * MARKERS_EVERY + phase;
            let share = (x - a.0) / (b.0 - a.0);
            places.push((px(x), px(a.1 + share * (b.1 - a.1))));
        }
    }
    if places.is_empty() {
        places.extend(line.get(line.len() / 2));
    }
    places
}
