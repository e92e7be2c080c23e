//! Everything about a picture that is decided before the first line is drawn.

use crate::curve::Window;
use crate::layout::{self, Entry, FONT, Flag, ROW, text_width};
use crate::ticks::{self, Ruler, is_drawable, scaled};
use crate::{Axis, Figure, Line, Panel, Scale};

/// Width of every picture.
pub(crate) const WIDTH: i32 = 2000;

/// A panel's place and axes.
pub(crate) struct PanelPlan {
    pub ruler: Ruler,
    pub window: Window,
    /// Title and legend begin here.
    pub head: i32,
    /// The legend, and where it begins.
    pub legend: Vec<Vec<(i32, Entry)>>,
    pub legend_at: (i32, i32),
    pub flags: Vec<Flag>,
    pub top: i32,
    pub bottom: i32,
    pub title: Vec<String>,
    /// What the panel says instead of data.
    pub empty: Option<&'static str>,
}

/// A figure's places and axes.
pub(crate) struct Plan {
    pub height: i32,
    pub left: i32,
    pub right: i32,
    pub x: Ruler,
    pub legend: Vec<Vec<(i32, Entry)>>,
    pub panels: Vec<PanelPlan>,
}

impl Plan {
    pub fn new(figure: &Figure) -> Self {
        let heights = match figure.panels.len() {
            1 => 860,
            2 => 580,
            3 | 4 => 440,
            _ => 340,
        };
        let x_range = x_range(figure);
        let rulers: Vec<_> = figure
            .panels
            .iter()
            .map(|panel| y_ruler(panel, x_range, heights))
            .collect();
        let titles: Vec<_> = rulers
            .iter()
            .map(|(ruler, _)| layout::lines(&ruler.title, heights + ROW))
            .collect();
        let widest = |texts: &[ticks::Tick]| {
            texts
                .iter()
                .map(|tick| text_width(&tick.text, FONT))
                .max()
                .unwrap_or(0)
        };
        let numbers = rulers
            .iter()
            .map(|(ruler, _)| widest(&ruler.ticks))
            .max()
            .unwrap_or(0);
        let lines = titles.iter().map(Vec::len).max().unwrap_or(1) as i32;
        let left = 12 + lines * (FONT + 6) + 16 + numbers + 20;
        let (x, right) = x_ruler(&figure.x, x_range, left);
        let window_x = (x.low, x.high);

        let legends: Vec<_> = figure.panels.iter().map(layout::legend).collect();
        let shared = layout::shared(&legends);
        let legend = shared
            .as_ref()
            .map(|entries| layout::rows(entries, right - left))
            .unwrap_or_default();
        let mut y = if legend.is_empty() {
            14
        } else {
            26 + legend.len() as i32 * ROW
        };
        let mut panels = Vec::new();
        for (i, ((panel, (ruler, empty)), title)) in
            figure.panels.iter().zip(rulers).zip(titles).enumerate()
        {
            let head = y;
            let own: &[Entry] = if shared.is_some() { &[] } else { &legends[i] };
            let (legend, legend_x, rows) = own_legend(&panel.title, own, left, right);
            let above = i
                .checked_sub(1)
                .map_or(&[][..], |above| &figure.panels[above].vertical);
            let flags = layout::flags(
                panel
                    .vertical
                    .iter()
                    .filter(|mark| is_drawable(mark.at) && !above.contains(mark))
                    .map(|mark| {
                        let share = (mark.at - x.low) / (x.high - x.low);
                        (
                            left + (share * f64::from(right - left)).clamp(-1e6, 1e6) as i32,
                            clean(&mark.label),
                        )
                    }),
                (left, right),
            );
            let title_rows =
                i32::from(!panel.title.is_empty() && legend_x == left && !legend.is_empty());
            let legend_at = (legend_x, head + title_rows * ROW);
            let flag_rows = flags.iter().map(|flag| flag.row + 1).max().unwrap_or(0) as i32;
            let top = head + rows * ROW + flag_rows * ROW + 10;
            let bottom = top + heights;
            let window = Window {
                x: window_x,
                y: (ruler.low, ruler.high),
            };
            panels.push(PanelPlan {
                ruler,
                window,
                head,
                legend,
                legend_at,
                flags,
                top,
                bottom,
                title,
                empty,
            });
            y = bottom + 34;
        }
        let height = panels.last().map_or(y, |panel| panel.bottom) + 64 + ROW;
        Self {
            height,
            left,
            right,
            x,
            legend,
            panels,
        }
    }
}

/// Text without characters that XML does not know.
pub(crate) fn clean(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .filter(|c| !matches!(c, '\u{FFFE}' | '\u{FFFF}'))
        .collect()
}

/// A panel's own legend: beside the title if it fits in one row, else below it. Also where it begins and how many rows of text
/// the head has.
fn own_legend(
    title: &str,
    entries: &[Entry],
    left: i32,
    right: i32,
) -> (Vec<Vec<(i32, Entry)>>, i32, i32) {
    let rows = layout::rows(entries, right - left);
    let count = rows.len() as i32;
    if title.is_empty() {
        return (rows, left, count);
    }
    let after_title = left + text_width(title, FONT) * 11 / 10 + 60;
    match rows.as_slice() {
        [] => (rows, left, 1),
        [row] if after_title + layout::row_width(row) <= right => (rows, after_title, 1),
        _ => (rows, left, count + 1),
    }
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

fn x_ruler(axis: &Axis, range: Option<(f64, f64)>, left: i32) -> (Ruler, i32) {
    let Some(range) = range else {
        return (Ruler::blank(&cleaned(axis)), WIDTH - 40);
    };
    let (mut ruler, mut right) = (Ruler::blank(axis), WIDTH - 40);
    for target in (2..=9).rev() {
        ruler = Ruler::new(&cleaned(axis), Scale::Linear, range, target);
        let widest = ruler
            .ticks
            .iter()
            .map(|tick| text_width(&tick.text, FONT))
            .max()
            .unwrap_or(0);
        right = WIDTH - (widest / 2 + 12).max(40);
        if (widest + FONT) * ruler.ticks.len() as i32 <= right - left {
            break;
        }
    }
    (ruler, right)
}

fn cleaned(axis: &Axis) -> Axis {
    Axis::new(clean(&axis.label), clean(&axis.unit))
}

/// The y axis of a panel, and what to say if nothing is to be seen.
fn y_ruler(
    panel: &Panel,
    x_range: Option<(f64, f64)>,
    height: i32,
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
    let target = (height / 75).clamp(3, 8) as usize;
    (Ruler::new(&axis, panel.scale, range, target), empty)
}

fn padded(range: (f64, f64), log: bool) -> (f64, f64) {
    if log && range.1 - range.0 < 0.02 {
        (range.0 - 0.3, range.1 + 0.3)
    } else {
        ticks::widened(range, 0.05)
    }
}
