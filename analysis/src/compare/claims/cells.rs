//! A claim, its cells and its verdict.

use serde::Serialize;

use crate::words::significant;

/// One cell.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// D or H.
    pub reading: &'static str,
    /// Gimbal order, or the voyage.
    pub setting: String,
    /// Heading \[deg\].
    pub heading_deg: f64,
    /// Whether the claim holds here.
    pub holds: bool,
    /// What was measured, in the claim's unit.
    pub measured: f64,
}

/// A claim with its cells.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// What the paper says.
    pub text: String,
    /// What is measured and when it holds.
    pub criterion: String,
    /// Unit of the measured figure.
    pub unit: &'static str,
    /// Every cell.
    pub cells: Vec<Cell>,
    /// Holds, holds in part, does not hold.
    pub verdict: &'static str,
    /// For every reading and setting: what was measured, over which range, and where it holds.
    pub findings: Vec<Finding>,
}

/// The cells of one reading and setting, over all headings.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// D or H.
    pub reading: &'static str,
    /// Gimbal order, or the voyage.
    pub setting: String,
    /// At the heading that comes first (0 in the sweep).
    pub first: String,
    /// From the least to the greatest over all headings; empty where there is one heading.
    pub range: String,
    /// Where it holds, in words.
    pub holds: String,
    /// Whether it holds in all cells, and in none.
    pub everywhere: bool,
    /// Whether it holds in no cell.
    pub nowhere: bool,
}

impl Claim {
    /// A claim with its cells, judged.
    pub fn new(text: &str, criterion: String, unit: &'static str, cells: Vec<Cell>) -> Self {
        let holding = cells.iter().filter(|c| c.holds).count();
        let verdict = match holding {
            0 => "does not hold",
            n if n == cells.len() => "holds",
            _ => "holds in part",
        };
        let findings = findings(&cells);
        Self {
            text: text.to_owned(),
            criterion,
            unit,
            cells,
            verdict,
            findings,
        }
    }
}

fn findings(cells: &[Cell]) -> Vec<Finding> {
    let mut keys: Vec<(&'static str, &str)> = Vec::new();
    for cell in cells {
        let key = (cell.reading, cell.setting.as_str());
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    keys.into_iter()
        .map(|(reading, setting)| {
            let group: Vec<&Cell> = cells
                .iter()
                .filter(|c| c.reading == reading && c.setting == setting)
                .collect();
            finding(reading, setting, &group)
        })
        .collect()
}

fn finding(reading: &'static str, setting: &str, group: &[&Cell]) -> Finding {
    let value = |v: f64| {
        if v.is_nan() {
            "never".to_owned()
        } else {
            significant(v)
        }
    };
    let finite: Vec<f64> = group
        .iter()
        .map(|c| c.measured)
        .filter(|v| !v.is_nan())
        .collect();
    let holding: Vec<String> = group
        .iter()
        .filter(|c| c.holds)
        .map(|c| format!("{:.0}", c.heading_deg))
        .collect();
    let mut range = String::new();
    if group.len() > 1 && !finite.is_empty() {
        let low = finite.iter().copied().fold(f64::INFINITY, f64::min);
        let high = finite.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        range = format!("{} .. {}", value(low), value(high));
        if finite.len() < group.len() {
            range += ", or never";
        }
    }
    let (everywhere, nowhere) = (holding.len() == group.len(), holding.is_empty());
    Finding {
        reading,
        setting: setting.to_owned(),
        first: value(group[0].measured),
        range,
        holds: match (everywhere, nowhere, group.len()) {
            (true, _, 1) => "yes".to_owned(),
            (_, true, 1) => "no".to_owned(),
            (true, ..) => "at every heading".to_owned(),
            (_, true, _) => "at no heading".to_owned(),
            _ => format!("at {} deg", holding.join(", ")),
        },
        everywhere,
        nowhere,
    }
}
