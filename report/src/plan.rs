//! Everything about a picture that is decided before the first line is drawn.

use crate::frame::{Frame, Window, px};
use crate::legend::{self, Entry, Rows};
use crate::marks::{self, Flag};
use crate::text::{self, FONT, ROW, clean};
use crate::ticks::{self, Ruler, is_drawable, scaled};
use crate::{Axis, Figure, Line, Panel, Scale};

/// Width of every picture.
pub(crate) const WIDTH: f64 = 1000.0;
/// Least distance of anything from the edge.
pub(crate) const EDGE: f64 = 6.0;
/// From one line of a y axis' title to the next.
pub(crate) const LINE: f64 = FONT + 3.0;
/// Height of the numbers below the last panel.
pub(crate) const NUMBERS: f64 = 32.0;
/// Between two panels.
const BETWEEN: f64 = 17.0;
/// The right margin, where no number needs more.
const RIGHT: f64 = 20.0;

/// A panel's place and axes.
pub(crate) struct PanelPlan {
    pub ruler: Ruler,
    pub frame: Frame,
    /// Title and legend begin here.
    pub head: f64,
    pub legend: Rows,
    /// The left upper corner of the legend.
    pub legend_at: (f64, f64),
    pub flags: Vec<Flag>,
    /// The title of the y axis, in lines.
    pub title: Vec<String>,
    /// What the panel says instead of data.
    pub empty: Option<&'static str>,
}

/// A figure's places and axes.
pub(crate) struct Plan {
    pub height: f64,
    pub left: f64,
    pub x: Ruler,
    pub legend: Rows,
    pub panels: Vec<PanelPlan>,
}

impl Plan {
    pub fn new(figure: &Figure) -> Self {
        let height = match figure.panels.len() {
            1 => 430.0,
            2 => 290.0,
            3 | 4 => 220.0,
            _ => 170.0,
        };
        let x_range = x_range(figure);
        let rulers: Vec<_> = figure
            .panels
            .iter()
            .map(|panel| y_ruler(panel, x_range, height))
            .collect();
        let title = |ruler: &Ruler| text::lines(&ruler.title, height + ROW);
        let lines = rulers.iter().map(|(ruler, _)| title(ruler).len());
        let numbers = rulers.iter().map(|(ruler, _)| widest(ruler));
        let numbers = numbers.fold(0.0, f64::max).ceil();
        let left = EDGE + lines.max().unwrap_or(1) as f64 * LINE + 8.0 + numbers + 10.0;
        let (x, right) = x_ruler(&figure.x, figure.x_scale, x_range, left);

        let legends: Vec<_> = figure.panels.iter().map(legend::legend).collect();
        let shared = legend::shared(&legends);
        let legend = Rows::new(shared.unwrap_or_default(), right - left);
        let mut y = match legend.len() {
            0 => 7.0,
            rows => 13.0 + rows as f64 * ROW,
        };
        let mut panels: Vec<PanelPlan> = Vec::new();
        for (i, (panel, (ruler, empty))) in figure.panels.iter().zip(rulers).enumerate() {
            let own = if shared.is_some() {
                &[]
            } else {
                &legends[i][..]
            };
            let head = Head::new(&panel.title, own, left, right);
            // What the panel above has marked is not labelled again.
            let above = &figure.panels[i.saturating_sub(1)..i];
            let window = Window {
                x: (x.low, x.high),
                y: (ruler.low, ruler.high),
            };
            let frame = |top| Frame {
                window,
                left,
                right,
                top,
                bottom: top + height,
            };
            let new = |at: f64, label: &str| {
                !above
                    .iter()
                    .flat_map(|panel| &panel.vertical)
                    .any(|mark| mark.at == at && mark.label == label)
            };
            let marks = panel.vertical.iter();
            let marks = marks.filter(|mark| is_drawable(mark.at) && new(mark.at, &mark.label));
            let marks = marks.map(|mark| (frame(y).x(mark.at), clean(&mark.label)));
            let flags = marks::flags(marks, (left, right));
            let top = y + (head.rows + marks::rows(&flags)) as f64 * ROW + 5.0;
            panels.push(PanelPlan {
                title: title(&ruler),
                ruler,
                frame: frame(top),
                head: y,
                legend: head.legend,
                legend_at: (head.legend_left, y + head.legend_row as f64 * ROW),
                flags,
                empty,
            });
            y = top + height + BETWEEN;
        }
        Self {
            height: y - BETWEEN + NUMBERS + ROW,
            left,
            x,
            legend,
            panels,
        }
    }
}

/// Title and legend of a panel: beside each other if they fit into one row, else below each other.
struct Head {
    legend: Rows,
    legend_left: f64,
    legend_row: usize,
    /// Rows that they take together.
    rows: usize,
}

impl Head {
    fn new(title: &str, entries: &[Entry], left: f64, right: f64) -> Self {
        let legend = Rows::new(entries, right - left);
        let beside = px(left + text::width(title) * 1.1 + 30.0);
        let fits = legend.len() <= 1 && beside + legend.width() <= right;
        let (legend_left, legend_row) = match (title.is_empty(), fits) {
            (true, _) => (left, 0),
            (false, true) => (beside, 0),
            (false, false) => (left, 1),
        };
        let rows = (legend_row + legend.len()).max(usize::from(!title.is_empty()));
        Self {
            legend,
            legend_left,
            legend_row,
            rows,
        }
    }
}

/// The width of an axis' numbers.
fn widest(ruler: &Ruler) -> f64 {
    text::widest(ruler.ticks.iter().map(|tick| tick.text.as_str()))
}

fn x_range(figure: &Figure) -> Option<(f64, f64)> {
    if let Some(range) = ticks::fixed(figure.x_range) {
        return Some(range);
    }
    let panels = || figure.panels.iter();
    let curves = panels()
        .flat_map(|panel| &panel.series)
        .flat_map(|series| &series.points);
    let curves = curves.filter(|(_, y)| is_drawable(*y)).map(|point| point.0);
    let bands = panels()
        .flat_map(|panel| &panel.bands)
        .flat_map(|band| band.points.iter().map(|span| span.0));
    let markers = panels()
        .flat_map(|panel| &panel.series)
        .any(|s| matches!(s.line, Line::Points | Line::LinePoints));
    let margin = if markers { 0.02 } else { 0.0 };
    ticks::extent(curves.chain(bands)).map(|range| ticks::widened(range, margin))
}

/// The x axis with as many numbers as have room, and where it ends.
fn x_ruler(axis: &Axis, scale: Scale, range: Option<(f64, f64)>, left: f64) -> (Ruler, f64) {
    let axis = cleaned(axis);
    let Some(range) = range else {
        return (Ruler::blank(&axis), WIDTH - RIGHT);
    };
    let ruler = |target| {
        let ruler = Ruler::new(&axis, scale, range, target);
        let right = (WIDTH - (widest(&ruler) / 2.0 + EDGE).max(RIGHT)).floor();
        (ruler, right)
    };
    let fits = |(ruler, right): &(Ruler, f64)| {
        (widest(ruler) + FONT) * ruler.ticks.len() as f64 <= right - left
    };
    let wanted = (3..=9).rev().map(ruler).find(fits);
    wanted.unwrap_or_else(|| ruler(2))
}

fn cleaned(axis: &Axis) -> Axis {
    Axis::new(clean(&axis.label), clean(&axis.unit))
}

/// The y axis of a panel, and what to say if nothing is to be seen.
fn y_ruler(
    panel: &Panel,
    x_range: Option<(f64, f64)>,
    height: f64,
) -> (Ruler, Option<&'static str>) {
    let axis = cleaned(&panel.y);
    let log = panel.scale == Scale::Log;
    let drawn = |y: f64| scaled(y, log);
    let (from, to) = x_range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let seen = |x: f64| is_drawable(x) && (from..=to).contains(&x);
    let curves = panel
        .series
        .iter()
        .flat_map(|series| &series.points)
        .filter(|(x, _)| seen(*x))
        .map(|point| point.1);
    let bands = panel
        .bands
        .iter()
        .flat_map(|band| &band.points)
        .filter(|(x, ..)| seen(*x));
    let bands = bands
        .filter(|(_, l, u)| is_drawable(*l) && is_drawable(*u))
        .flat_map(|&(_, l, u)| [l, u]);
    let data = ticks::extent(curves.chain(bands).map(drawn));
    let marks = panel.horizontal.iter().map(|mark| drawn(mark.at));
    let all = ticks::extent(
        data.into_iter()
            .flat_map(|(low, high)| [low, high])
            .chain(marks),
    );
    let some_values = panel
        .series
        .iter()
        .any(|s| s.points.iter().any(|(x, y)| seen(*x) && is_drawable(*y)));
    let empty = match data {
        Some(_) => None,
        None if log && some_values => Some("no positive values"),
        None => Some("no data"),
    };
    let given = panel.range.map(|(a, b)| (drawn(a), drawn(b)));
    let Some(range) = ticks::fixed(given).or_else(|| all.map(|range| padded(range, log))) else {
        return (Ruler::blank(&axis), empty);
    };
    let target = (height / 37.5).clamp(3.0, 8.0) as usize;
    (Ruler::new(&axis, panel.scale, range, target), empty)
}

fn padded(range: (f64, f64), log: bool) -> (f64, f64) {
    if log && range.1 - range.0 < 0.02 {
        (range.0 - 0.3, range.1 + 0.3)
    } else {
        ticks::widened(range, 0.05)
    }
}
