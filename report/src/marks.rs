//! Lines that mark a value of an axis, and their labels.

use maud::{Markup, html};

use crate::curve::between;
use crate::frame::{Point, px};
use crate::plan::PanelPlan;
use crate::text::{self, BASELINE, ROW};
use crate::ticks::scaled;
use crate::{Panel, Scale};

/// Least distance of two labels.
const GAP: f64 = 8.0;
/// From a line to its label.
const BESIDE: f64 = 6.0;

/// The label of a vertical mark, above the panel: it stands beside its line like a flag.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Flag {
    x: f64,
    text: String,
    /// Whether the text is left of the line.
    left: bool,
    /// Rows above the panel; 0 is the lowest.
    row: usize,
}

impl Flag {
    /// What the text covers.
    fn reach(&self) -> (f64, f64) {
        let width = text::width(&self.text) + GAP;
        if self.left {
            (self.x - width, self.x)
        } else {
            (self.x, self.x + width)
        }
    }
}

/// Gives every label a row in which it neither meets another label nor, where that can be had, the line of one above it.
pub(crate) fn flags(
    marks: impl IntoIterator<Item = (f64, String)>,
    (from, to): (f64, f64),
) -> Vec<Flag> {
    let (left, row) = (false, 0);
    let mut flags: Vec<Flag> = marks
        .into_iter()
        .filter(|(x, text)| !text.is_empty() && (from..=to).contains(x))
        .map(|(x, text)| Flag { x, text, left, row })
        .collect();
    for flag in &mut flags {
        flag.left = flag.reach().1 > to && flag.x - from > to - flag.x;
    }
    flags.sort_by(|a, b| b.x.total_cmp(&a.x));
    for i in 0..flags.len() {
        let (start, end) = flags[i].reach();
        let meets = |other: &&Flag| {
            let (a, b) = other.reach();
            start < b + GAP && a < end + GAP
        };
        let rows = flags[..i].iter().filter(meets).map(|other| other.row + 1);
        flags[i].row = rows.max().unwrap_or(0);
    }
    flags
}

/// How many rows they take.
pub(crate) fn rows(flags: &[Flag]) -> usize {
    flags.iter().map(|flag| flag.row + 1).max().unwrap_or(0)
}

/// Lines of vertical marks, and their labels above the panel.
pub(crate) fn verticals(panel: &Panel, place: &PanelPlan) -> Markup {
    let frame = &place.frame;
    let (low, high) = frame.window.x;
    let seen = panel.vertical.iter();
    let seen = seen.filter(|mark| (low..=high).contains(&mark.at));
    let flag = |flag: &Flag| {
        let middle = frame.top - (flag.row as f64 + 0.5) * ROW;
        let (class, x) = if flag.left {
            ("over end", flag.x - BESIDE)
        } else {
            ("over start", flag.x + BESIDE)
        };
        html! { text class=(class) x=(px(x)) y=(px(middle + BASELINE)) { (flag.text) } }
    };
    html! {
        @for mark in seen {
            path class="mark" d={ "M" (frame.x(mark.at)) " " (frame.top) "V" (frame.bottom) } {}
        }
        @for flag in &place.flags {
            path class="flag" d={ "M" (flag.x) " " (frame.top) "v" (3.0 - (flag.row as f64 + 1.0) * ROW) } {}
        }
        @for each in &place.flags { (flag(each)) }
    }
}

/// Lines of horizontal marks; each label goes where it hides the least of what is `drawn`.
pub(crate) fn horizontals(panel: &Panel, place: &PanelPlan, mut drawn: Vec<Point>) -> Markup {
    let frame = &place.frame;
    let (low, high) = frame.window.y;
    let marks: Vec<_> = panel
        .horizontal
        .iter()
        .map(|mark| (scaled(mark.at, panel.scale == Scale::Log), &mark.label))
        .filter(|(at, _)| (low..=high).contains(at))
        .map(|(at, label)| (frame.y(at), text::clean(label)))
        .collect();
    for (y, _) in &marks {
        drawn.extend(between((frame.left, *y), (frame.right, *y)));
    }
    let labels = marks.iter().filter(|(_, label)| !label.is_empty());
    let labels = labels.filter_map(|(y, label)| {
        let width = text::width(label);
        let room = frame.right - frame.left - 2.0 * GAP - width;
        let places = [1.0, 0.0, 0.5, 0.75, 0.25].into_iter().flat_map(|share| {
            let x = frame.left + GAP + share * room;
            [(x, y - ROW + 1.0), (x, y + 3.0)]
        });
        let hidden = |&(x, top): &Point| {
            let covers = |&&(px, py): &&Point| {
                (x..=x + width).contains(&px) && (top..=top + ROW - 3.0).contains(&py)
            };
            let outside = top < frame.top || top + ROW > frame.bottom;
            (outside, drawn.iter().filter(covers).count())
        };
        let (x, top) = places.min_by_key(hidden)?;
        let middle = top + ROW / 2.0 - 1.5;
        drawn.extend(between((x, middle), (x + width, middle)));
        Some((px(x), px(middle + BASELINE), label))
    });
    let labels: Vec<_> = labels.collect();
    html! {
        @for (y, _) in &marks {
            path class="mark" d={ "M" (frame.left) " " (y) "H" (frame.right) } {}
        }
        @for (x, y, label) in labels {
            text class="over" x=(x) y=(y) { (label) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Labels of marks that stand close go into rows of their own, all within the panel.
    #[test]
    fn labels_of_near_marks_do_not_meet() {
        let marks = [50.0, 55.0, 65.0, 450.0, 495.0].map(|x| (x, "below threshold".to_owned()));
        let flags = flags(marks, (0.0, 500.0));
        for (i, a) in flags.iter().enumerate() {
            let (start, end) = a.reach();
            assert!(start >= 0.0 && end <= 500.0, "{a:?}");
            let same = flags[..i].iter().filter(|b| b.row == a.row);
            assert!(
                same.map(Flag::reach)
                    .all(|(from, to)| to <= start || end <= from)
            );
        }
    }
}
