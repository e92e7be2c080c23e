//! What a search found, as text and JSON.

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;
use sins::studies::design::{Goal, Measure, Progress};
use sins::table::scheme::{About, Scheme};

use super::{Judged, Plan, in_words};
use crate::{Error, significant};

/// Headings of the short table, by their number among [`super::HELD_AT`]: 0, 45 and 90 deg.
const SHOWN: [usize; 3] = [0, 3, 6];

/// The result.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The command that gives it again.
    pub command: String,
    /// What decided the search.
    pub seed: u64,
    /// Rounds done.
    pub rounds: u64,
    /// Schemes looked at.
    pub evaluations: u64,
    /// Schemes a second, of this run alone; not part of what a seed decides.
    pub evaluations_per_s: f64,
    /// Whether every goal is met at every heading.
    pub reached: bool,
    /// What was asked.
    pub goals: Vec<GoalRow>,
    /// States of the model, as `sigma` has them.
    pub state_names: Vec<&'static str>,
    /// The best scheme, then those it is compared with.
    pub schemes: Vec<SchemeRow>,
    /// What one goal costs in another: schemes that no other betters in all, as values at their worst headings.
    pub front: Vec<FrontRow>,
}

/// One goal.
#[derive(Clone, Debug, Serialize)]
pub struct GoalRow {
    /// In words.
    pub name: String,
    /// Its states.
    pub states: Vec<String>,
    /// What was asked, in the unit.
    pub asked: f64,
    /// Field unit.
    pub unit: &'static str,
    /// How much it counts.
    pub weight: f64,
}

/// One scheme.
#[derive(Clone, Debug, Serialize)]
pub struct SchemeRow {
    /// Its name.
    pub name: String,
    /// Its rotations, short.
    pub rotations: String,
    /// Score of its worst heading; less is better.
    pub score: f64,
    /// Each goal at its worst heading, in the unit of the goal.
    pub worst: Vec<f64>,
    /// By heading.
    pub headings: Vec<HeadingRow>,
}

/// One scheme at one heading.
#[derive(Clone, Debug, Serialize)]
pub struct HeadingRow {
    /// The heading.
    pub heading_deg: f64,
    /// Each goal, in its unit.
    pub values: Vec<f64>,
    /// One-sigma at the end, SI.
    pub sigma: Vec<f64>,
}

/// One of the front.
#[derive(Clone, Debug, Serialize)]
pub struct FrontRow {
    /// Each goal at its worst heading, in its unit.
    pub values: Vec<f64>,
    /// Its rotations, short.
    pub rotations: String,
}

impl Report {
    /// Puts it together; `judged` has the best first. `seconds` is what this run took.
    ///
    /// # Errors
    /// Where the plan means nothing.
    pub fn new(
        plan: &Plan,
        progress: &Progress,
        judged: &[Judged],
        command: String,
        evaluations_per_s: f64,
    ) -> Result<Self, Error> {
        let search = plan.search()?;
        let labels = plan.physics.labels()?;
        let goals = plan.goals()?;
        let values = |values: &[f64]| -> Vec<f64> {
            let one = |(goal, value): (&Goal, &f64)| in_words(goal, *value, &labels).0;
            goals.iter().zip(values).map(one).collect()
        };
        let scheme = |judged: &Judged| SchemeRow {
            name: judged.scheme.name.clone(),
            rotations: rotations(&judged.scheme),
            score: judged.score(),
            worst: values(&judged.worst()),
            headings: judged
                .standings
                .iter()
                .map(|standing| HeadingRow {
                    heading_deg: standing.heading_rad.to_degrees(),
                    values: values(&standing.values),
                    sigma: standing.sigma.clone(),
                })
                .collect(),
        };
        Ok(Self {
            command,
            seed: plan.seed,
            rounds: progress.rounds,
            evaluations: progress.evaluations,
            evaluations_per_s,
            reached: judged
                .first()
                .is_some_and(|best| best.worst().iter().all(|value| *value <= 1.0)),
            goals: goals
                .iter()
                .map(|goal| {
                    let (asked, unit) = in_words(goal, 1.0, &labels);
                    GoalRow {
                        name: name(goal, &labels),
                        states: goal.states.clone(),
                        asked,
                        unit,
                        weight: goal.weight,
                    }
                })
                .collect(),
            state_names: labels.iter().map(|label| label.name).collect(),
            schemes: judged.iter().map(scheme).collect(),
            front: progress
                .front
                .iter()
                .map(|one| FrontRow {
                    values: values(&one.values),
                    rotations: rotations(&one.sequence.scheme(
                        "",
                        search.catalogue(),
                        search.rules(),
                    )),
                })
                .collect(),
        })
    }
}

/// What a goal is about, such as "drift below 0.002 deg/h".
fn name(goal: &Goal, labels: &[&'static sins::estimation::state::StateLabel]) -> String {
    let first = goal.states.first().map_or("", String::as_str);
    let label = labels.iter().find(|label| label.name == first);
    let words = label.map_or(first, |label| label.words);
    let words = if goal.states.len() > 1 {
        words
            .trim_end_matches(|c: char| c.is_ascii_lowercase() && "xyz".contains(c))
            .trim_end()
    } else {
        words
    };
    match (goal.measure, label) {
        (Measure::TimeBelow { limit, .. }, Some(label)) => {
            format!(
                "{words} < {} {}",
                significant(limit / label.scale),
                label.unit
            )
        }
        _ => words.to_owned(),
    }
}

/// Rotations in short: `x+180 y-90/60`, a dwell behind the stroke where it is not the scheme's.
pub fn rotations(scheme: &Scheme) -> String {
    let one = |rotation: &sins::table::scheme::Rotation| {
        let about = match rotation.about {
            About::Axis(axis) => axis.to_string(),
            About::Joint(joint) => joint.name().to_owned(),
        };
        let dwell = rotation
            .dwell_s
            .map_or_else(String::new, |dwell| format!("/{dwell}"));
        format!(
            "{about}{:+}{dwell}",
            rotation.angle_rad.to_degrees().round()
        )
    };
    scheme
        .rotations
        .iter()
        .map(one)
        .collect::<Vec<_>>()
        .join(" ")
}

/// The result as text.
pub fn text(report: &Report) -> String {
    let mut header = vec!["scheme".to_owned(), "heading".to_owned()];
    header.extend(
        report
            .goals
            .iter()
            .map(|goal| format!("{}\n[{}]", goal.name, goal.unit)),
    );
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    let asked = report.goals.iter().map(|goal| significant(goal.asked));
    table.add_row(["asked".to_owned(), String::new()].into_iter().chain(asked));
    for scheme in &report.schemes {
        let rows = SHOWN
            .iter()
            .filter_map(|number| scheme.headings.get(*number))
            .map(|row| (format!("{:.0}", row.heading_deg), &row.values))
            .chain([("worst".to_owned(), &scheme.worst)]);
        for (number, (heading, values)) in rows.enumerate() {
            let name = if number == 0 {
                scheme.name.clone()
            } else {
                String::new()
            };
            let values = values.iter().map(|value| significant(*value));
            table.add_row([name, heading].into_iter().chain(values));
        }
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let mut lines = vec![table.to_string(), String::new()];
    for scheme in &report.schemes {
        lines.push(format!("{}: {}", scheme.name, scheme.rotations));
    }
    lines.push(format!(
        "{} schemes looked at in {} rounds, seed {}, {} a second; {} of them are on the front",
        report.evaluations,
        report.rounds,
        report.seed,
        significant(report.evaluations_per_s),
        report.front.len()
    ));
    lines.push(if report.reached {
        "every goal is met at every heading".to_owned()
    } else {
        "not every goal is met at every heading".to_owned()
    });
    lines.join("\n")
}
