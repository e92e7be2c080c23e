//! The legend: which names it has, how they stand in rows, how they are drawn.

use std::collections::HashMap;

use maud::{Markup, html};

use crate::palette;
use crate::text::{self, BASELINE, ROW};
use crate::{Line, Panel};

/// Length of a sample.
const SAMPLE: f64 = 42.0;
const GAP: f64 = 8.0;
const BETWEEN: f64 = 24.0;

/// What is shown beside a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sample {
    Line { line: Line, marked: bool },
    Band,
}

/// A name with its sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Entry {
    name: String,
    colour: usize,
    sample: Sample,
}

impl Entry {
    fn width(&self) -> f64 {
        SAMPLE + GAP + text::width(&self.name)
    }
}

/// The class of a curve.
pub(crate) fn class(line: Line) -> &'static str {
    match line {
        Line::Solid | Line::Steps | Line::LinePoints | Line::Points => "curve",
        Line::Dashed => "curve dashed",
        Line::Dotted => "curve dotted",
        Line::Thin => "curve thin",
    }
}

/// Whether each series carries a few markers: of those in the legend, all but the first name of a kind of line do.
pub(crate) fn marked(panel: &Panel) -> Vec<bool> {
    let mut first: HashMap<&str, &str> = HashMap::new();
    let marked = panel.series.iter().map(|series| {
        let plain = matches!(
            series.line,
            Line::Solid | Line::Dashed | Line::Dotted | Line::Steps
        );
        plain
            && series.in_legend
            && *first.entry(class(series.line)).or_insert(&series.name) != series.name
    });
    marked.collect()
}

/// The names of a panel, each once.
pub(crate) fn legend(panel: &Panel) -> Vec<Entry> {
    let series = panel.series.iter().zip(marked(panel));
    let series = series
        .filter(|(series, _)| series.in_legend)
        .map(|(series, marked)| {
            let line = series.line;
            (&series.name, series.colour, Sample::Line { line, marked })
        });
    let bands = panel.bands.iter();
    let bands = bands.map(|band| (&band.name, band.colour, Sample::Band));
    let mut entries: Vec<Entry> = Vec::new();
    for (name, colour, sample) in series.chain(bands) {
        let name = text::clean(name);
        if !name.is_empty() && entries.iter().all(|entry| entry.name != name) {
            entries.push(Entry {
                name,
                colour,
                sample,
            });
        }
    }
    entries
}

/// The one legend that serves all panels, if the panels agree.
pub(crate) fn shared(legends: &[Vec<Entry>]) -> Option<&[Entry]> {
    let largest = legends.iter().max_by_key(|legend| legend.len())?;
    let mut entries = legends.iter().flatten();
    (legends.len() > 1 && entries.all(|entry| largest.contains(entry))).then_some(largest)
}

/// Entries in rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows(Vec<Vec<(f64, Entry)>>);

impl Rows {
    /// Rows no wider than `room`, where an entry is not wider itself.
    pub fn new(entries: &[Entry], room: f64) -> Self {
        let mut rows: Vec<Vec<(f64, Entry)>> = Vec::new();
        let mut x = 0.0;
        for entry in entries {
            match rows.last_mut() {
                Some(row) if x + entry.width() <= room => row.push((x, entry.clone())),
                _ => {
                    x = 0.0;
                    rows.push(vec![(x, entry.clone())]);
                }
            }
            x += entry.width() + BETWEEN;
        }
        Self(rows)
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The width of the widest.
    pub fn width(&self) -> f64 {
        let ends = self.0.iter().filter_map(|row| row.last());
        ends.map(|(x, entry)| x + entry.width()).fold(0.0, f64::max)
    }

    /// The legend with its left upper corner at a place.
    pub fn markup(&self, (left, top): (f64, f64)) -> Markup {
        html! {
            @for (i, row) in self.0.iter().enumerate() {
                @for (x, entry) in row {
                    (entry_markup(entry, (left + x).round(), top + (i as f64 + 0.5) * ROW))
                }
            }
        }
    }
}

fn entry_markup(entry: &Entry, x: f64, y: f64) -> Markup {
    let markers = |wanted: bool| {
        let places: &[_] = if wanted {
            &[(x + SAMPLE / 2.0, y)]
        } else {
            &[]
        };
        palette::markers(entry.colour, places)
    };
    html! {
        g class=(palette::class(entry.colour)) {
            @match entry.sample {
                Sample::Band => rect class="band" x=(x) y=(y - 7.5) width=(SAMPLE) height="15" {},
                Sample::Line { line: Line::Points, .. } => (markers(true)),
                Sample::Line { line, marked } => {
                    line class={ (class(line)) " sample" } x1=(x) y1=(y) x2=(x + SAMPLE) y2=(y) {}
                    (markers(marked || line == Line::LinePoints))
                },
            }
            text x=(x + SAMPLE + GAP) y=(y + BASELINE) { (entry.name) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Band, Series};

    fn panel(names: &[&str]) -> Panel {
        names
            .iter()
            .fold(Panel::new("", Axis::new("v", "m")), |panel, name| {
                panel.series(Series::new(*name, Vec::new()))
            })
    }

    /// A name stands once, and from the second name on markers tell them apart.
    #[test]
    fn runs_of_one_name_share_an_entry() {
        let panel = panel(&["run", "run", "mean"]).band(Band::new("±3σ", Vec::new()));
        let names: Vec<_> = legend(&panel).into_iter().map(|entry| entry.name).collect();
        assert_eq!(names, ["run", "mean", "±3σ"]);
        assert_eq!(marked(&panel), [false, false, true]);
    }

    /// The largest legend serves all, unless a panel has a name of its own.
    #[test]
    fn panels_that_agree_share_a_legend() {
        let [a, b, c] = [&["x", "y"][..], &["x"], &["z"]].map(|names| legend(&panel(names)));
        assert_eq!(shared(&[a.clone(), b]), Some(&a[..]));
        assert_eq!(shared(&[a.clone(), c]), None);
        assert_eq!(shared(&[a]), None);
    }

    /// No row is wider than its room, and no entry is lost.
    #[test]
    fn long_legends_wrap() {
        let names = [
            "first series",
            "second series",
            "third series",
            "fourth series",
        ];
        let rows = Rows::new(&legend(&panel(&names)), 400.0);
        assert_eq!(rows.0.iter().map(Vec::len).sum::<usize>(), 4);
        assert!(rows.len() > 1 && rows.width() <= 400.0);
    }
}
