//! Where text goes: legends above a panel, labels of marks, long titles.

use std::collections::HashMap;

use crate::{Line, Panel};

/// Font size of all text, chosen for a phone: 11 px where 2000 pixels are shown as 624.
pub(crate) const FONT: i32 = 36;
/// Height of a row of text.
pub(crate) const ROW: i32 = 50;
/// Length of a sample in a legend.
pub(crate) const SAMPLE: i32 = 84;
const GAP: i32 = 16;
const BETWEEN: i32 = 48;

/// The width of a text, a little on the safe side: no font is asked.
pub(crate) fn text_width(text: &str, size: i32) -> i32 {
    let em: f64 =
        text.chars()
            .map(|c| match c {
                'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '|' | '!' | '\'' => 0.28,
                'f' | 't' | 'r' | ' ' | '(' | ')' | '[' | ']' | '-' | '/' | '⁻' | '¹' | '²'
                | '³' => 0.36,
                'm' | 'w' | 'M' | 'W' | '@' | '%' | '—' => 0.9,
                '0'..='9' => 0.58,
                c if c.is_uppercase() => 0.72,
                c if c as u32 > 0x2E80 => 1.0,
                _ => 0.57,
            })
            .sum();
    (em * f64::from(size)).ceil() as i32
}

/// What a legend shows beside a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sample {
    Line {
        line: Line,
        colour: usize,
        marked: bool,
    },
    Band {
        colour: usize,
    },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Entry {
    pub name: String,
    pub sample: Sample,
}

impl Entry {
    fn width(&self) -> i32 {
        SAMPLE + GAP + text_width(&self.name, FONT)
    }
}

/// Whether each series carries a few markers: of those in the legend, all but the first name of a kind of line do.
pub(crate) fn marked(panel: &Panel) -> Vec<bool> {
    let mut first: HashMap<Line, &str> = HashMap::new();
    panel
        .series
        .iter()
        .map(|series| match series.line {
            Line::Solid | Line::Dashed | Line::Dotted | Line::Steps if series.in_legend => {
                let kind = if series.line == Line::Steps {
                    Line::Solid
                } else {
                    series.line
                };
                *first.entry(kind).or_insert(&series.name) != series.name
            }
            _ => false,
        })
        .collect()
}

/// The names of a panel, each once.
pub(crate) fn legend(panel: &Panel) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let series = panel
        .series
        .iter()
        .zip(marked(panel))
        .filter(|(series, _)| series.in_legend)
        .map(|(series, marked)| {
            (
                &series.name,
                Sample::Line {
                    line: series.line,
                    colour: series.colour,
                    marked,
                },
            )
        });
    let bands = panel.bands.iter().map(|band| {
        (
            &band.name,
            Sample::Band {
                colour: band.colour,
            },
        )
    });
    for (name, sample) in series.chain(bands) {
        if !name.is_empty() && entries.iter().all(|entry| entry.name != *name) {
            entries.push(Entry {
                name: name.clone(),
                sample,
            });
        }
    }
    entries
}

/// The one legend that serves all panels, if the panels agree.
pub(crate) fn shared(legends: &[Vec<Entry>]) -> Option<Vec<Entry>> {
    let largest = legends.iter().max_by_key(|legend| legend.len())?;
    let serves = legends.len() > 1
        && legends
            .iter()
            .flatten()
            .all(|entry| largest.contains(entry));
    serves.then(|| largest.clone())
}

/// Entries in rows, each with its place from the left.
pub(crate) fn rows(entries: &[Entry], width: i32) -> Vec<Vec<(i32, Entry)>> {
    let mut rows: Vec<Vec<(i32, Entry)>> = Vec::new();
    let mut x = 0;
    for entry in entries {
        if x > 0 && x + entry.width() > width {
            x = 0;
        }
        if x == 0 {
            rows.push(Vec::new());
        }
        if let Some(row) = rows.last_mut() {
            row.push((x, entry.clone()));
        }
        x += entry.width() + BETWEEN;
    }
    rows
}

/// The width of a row of a legend.
pub(crate) fn row_width(row: &[(i32, Entry)]) -> i32 {
    row.last().map_or(0, |(x, entry)| x + entry.width())
}

/// The label of a vertical mark, above the panel: it stands beside its line like a flag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Flag {
    pub x: i32,
    pub text: String,
    /// Whether the text is left of the line.
    pub left: bool,
    /// Rows above the panel; 0 is the lowest.
    pub row: usize,
}

impl Flag {
    /// What the text covers.
    pub fn reach(&self) -> (i32, i32) {
        let width = text_width(&self.text, FONT) + GAP;
        if self.left {
            (self.x - width, self.x)
        } else {
            (self.x, self.x + width)
        }
    }
}

/// Gives every label a row in which it neither meets another label nor, where that can be had, the line of one above it.
pub(crate) fn flags(
    marks: impl IntoIterator<Item = (i32, String)>,
    (from, to): (i32, i32),
) -> Vec<Flag> {
    let mut flags: Vec<Flag> = marks
        .into_iter()
        .filter(|(x, text)| !text.is_empty() && (from..=to).contains(x))
        .map(|(x, text)| Flag {
            x,
            text,
            left: false,
            row: 0,
        })
        .collect();
    for flag in &mut flags {
        flag.left = flag.reach().1 > to && flag.x - from > to - flag.x;
    }
    flags.sort_by_key(|flag| -flag.x);
    for i in 0..flags.len() {
        let (start, end) = flags[i].reach();
        let (done, rest) = flags.split_at_mut(i);
        let meets = |other: &Flag| {
            let (a, b) = other.reach();
            start < b + GAP && a < end + GAP
        };
        rest[0].row = done
            .iter()
            .filter(|other| meets(other))
            .map(|other| other.row + 1)
            .max()
            .unwrap_or(0);
    }
    flags
}

/// A title in one line, or in two where one is too long.
pub(crate) fn lines(title: &str, room: i32) -> Vec<String> {
    if text_width(title, FONT) <= room {
        return vec![title.to_owned()];
    }
    let middle = title.len() / 2;
    let best = title
        .match_indices(' ')
        .map(|(i, _)| i)
        .min_by_key(|i| i.abs_diff(middle));
    let at = title
        .rfind(" (")
        .filter(|i| text_width(&title[..*i], FONT) <= room)
        .or(best);
    at.map_or_else(
        || vec![title.to_owned()],
        |at| vec![title[..at].to_owned(), title[at + 1..].to_owned()],
    )
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

    #[test]
    fn runs_of_one_name_share_an_entry() {
        let panel = panel(&["run", "run", "mean"]).band(Band::new("±3σ", Vec::new()));
        assert_eq!(
            legend(&panel)
                .iter()
                .map(|entry| entry.name.as_str())
                .collect::<Vec<_>>(),
            ["run", "mean", "±3σ"]
        );
        assert_eq!(marked(&panel), [false, false, true]);
    }

    #[test]
    fn panels_that_agree_share_a_legend() {
        let (a, b, c) = (
            legend(&panel(&["x", "y"])),
            legend(&panel(&["x"])),
            legend(&panel(&["z"])),
        );
        assert_eq!(shared(&[a.clone(), b]), Some(a.clone()));
        assert_eq!(shared(&[a.clone(), c]), None);
        assert_eq!(shared(&[a]), None);
    }

    #[test]
    fn long_legends_wrap() {
        let entries = legend(&panel(&[
            "first series",
            "second series",
            "third series",
            "fourth series",
        ]));
        let rows = rows(&entries, 800);
        assert_eq!(rows.iter().map(Vec::len).sum::<usize>(), 4);
        assert!(rows.len() > 1 && rows.iter().all(|row| row_width(row) <= 800));
    }

    #[test]
    fn labels_of_near_marks_do_not_meet() {
        let marks = [100, 110, 130, 900, 990].map(|x| (x, "below threshold".to_owned()));
        let flags = flags(marks, (0, 1000));
        for (i, a) in flags.iter().enumerate() {
            let (start, end) = a.reach();
            assert!(start >= 0 && end <= 1000, "{a:?}");
            assert!(
                flags[..i]
                    .iter()
                    .filter(|b| b.row == a.row)
                    .all(|b| b.reach().1 <= start || end <= b.reach().0)
            );
        }
    }

    #[test]
    fn long_titles_break_before_their_unit() {
        assert_eq!(
            lines("gyroscope drift east (deg/h)", 400),
            ["gyroscope drift east", "(deg/h)"]
        );
        assert_eq!(lines("drift (deg/h)", 500), ["drift (deg/h)"]);
    }
}
