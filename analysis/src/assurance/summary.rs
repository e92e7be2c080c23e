//! The judge's errors in figures: as JSON and as text.

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;
use sins::studies::assurance::{
    FALSE_BEYOND_SIGMA, KINDS, OTHERS_FALSE_BEYOND_SIGMA, is_false_alarm, is_false_assurance,
};

use super::{Plan, Trial};
use crate::significant;

/// A number of worlds among others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Rate {
    /// So many.
    pub count: u64,
    /// Of so many worlds.
    pub of: u64,
    /// Their share.
    pub fraction: f64,
}

impl Rate {
    fn new(count: usize, of: usize) -> Self {
        Self {
            count: count as u64,
            of: of as u64,
            fraction: if of == 0 {
                0.0
            } else {
                count as f64 / of as f64
            },
        }
    }
}

/// A kind of worlds.
#[derive(Debug, Serialize)]
pub struct KindRow {
    /// Its name.
    pub name: &'static str,
    /// Whether the model holds it.
    pub inside: bool,
    /// Worlds.
    pub worlds: u64,
    /// With exit status 0.
    pub accepted: u64,
    /// Accepted, and one of the nine beyond 4 sigma, or another state that was learned beyond 5.
    pub false_assurance: u64,
    /// Inside the model, and refused though every sigma asked for was reached, or without an estimate.
    pub false_alarm: u64,
    /// The greatest error over sigma of an accepted world.
    pub worst_accepted_z: f64,
    /// The same of what was learned beyond the nine, with the state; none where the model has no more.
    pub worst_accepted_other: Option<(&'static str, f64)>,
    /// The greatest error over sigma of any world that had an estimate.
    pub worst_z: f64,
    /// Mean NEES of the nine over the accepted ones.
    pub mean_nees_accepted: f64,
    /// Tests that failed, with the number of worlds in which they did, the most frequent first.
    pub failed_tests: Vec<(String, u64)>,
}

/// The study as JSON.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The command that gives the same again.
    pub command: String,
    /// Model of the filter that is judged.
    pub model: &'static str,
    /// Seed.
    pub seed: u64,
    /// Worlds.
    pub worlds: u64,
    /// Accepted ones that were wrong, among all worlds.
    pub false_assurance: Rate,
    /// Refused ones that the model holds, among those that it holds.
    pub false_alarm: Rate,
    /// By kind.
    pub kinds: Vec<KindRow>,
}

fn row(plan: &Plan, name: &'static str, of_kind: &[&Trial]) -> Option<KindRow> {
    let kind = of_kind.first()?.kind;
    let outcomes = || {
        of_kind
            .iter()
            .filter_map(|trial| trial.outcome.as_ref().ok())
    };
    let accepted = || outcomes().filter(|outcome| outcome.is_accepted());
    let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let mut failed: Vec<(String, u64)> = Vec::new();
    for test in outcomes().flat_map(|outcome| &outcome.verdict.tests) {
        if !test.passed {
            match failed.iter_mut().find(|(name, _)| name == test.name) {
                Some((_, count)) => *count += 1,
                None => failed.push((test.name.to_owned(), 1)),
            }
        }
    }
    failed.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let good = accepted().count();
    Some(KindRow {
        name,
        inside: kind.inside.holds(plan.model),
        worlds: of_kind.len() as u64,
        accepted: good as u64,
        false_assurance: outcomes().filter(|o| is_false_assurance(o)).count() as u64,
        false_alarm: of_kind
            .iter()
            .filter(|trial| is_false_alarm(kind, plan.model, trial.outcome.as_ref()))
            .count() as u64,
        worst_accepted_z: worst(&mut accepted().map(|o| o.worst().1)),
        worst_accepted_other: accepted()
            .filter_map(sins::studies::assurance::Outcome::worst_other)
            .max_by(|a, b| a.1.total_cmp(&b.1)),
        worst_z: worst(&mut outcomes().map(|o| o.worst().1)),
        mean_nees_accepted: accepted().map(|o| o.nees).sum::<f64>() / good.max(1) as f64,
        failed_tests: failed,
    })
}

/// Sums the worlds up.
pub fn summarize(plan: &Plan, trials: &[Trial], command: &str) -> Report {
    let kinds: Vec<KindRow> = KINDS
        .iter()
        .filter_map(|kind| {
            let of_kind: Vec<&Trial> = trials
                .iter()
                .filter(|trial| trial.kind.name == kind.name)
                .collect();
            row(plan, kind.name, &of_kind)
        })
        .collect();
    let sum = |of: fn(&KindRow) -> u64| kinds.iter().map(of).sum::<u64>() as usize;
    let inside = kinds.iter().filter(|kind| kind.inside);
    Report {
        command: command.to_owned(),
        model: plan.model.name(),
        seed: plan.seed,
        worlds: plan.worlds,
        false_assurance: Rate::new(sum(|kind| kind.false_assurance), trials.len()),
        false_alarm: Rate::new(
            sum(|kind| kind.false_alarm),
            inside.map(|kind| kind.worlds).sum::<u64>() as usize,
        ),
        kinds,
    }
}

/// The greatest error over sigma among the states beyond the nine, and which.
pub(super) fn other_words(kind: &KindRow) -> String {
    kind.worst_accepted_other
        .map_or_else(String::new, |(state, z)| {
            format!("{} {state}", significant(z))
        })
}

/// The study as text.
pub fn text(report: &Report) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header([
        "kind",
        "inside",
        "worlds",
        "accepted",
        "false assurance",
        "false alarm",
        "worst z accepted",
        "of others",
        "worst z",
        "failed tests",
    ]);
    for kind in &report.kinds {
        let failed: Vec<String> = kind
            .failed_tests
            .iter()
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        table.add_row([
            kind.name.to_owned(),
            (if kind.inside { "yes" } else { "no" }).to_owned(),
            kind.worlds.to_string(),
            kind.accepted.to_string(),
            kind.false_assurance.to_string(),
            kind.false_alarm.to_string(),
            significant(kind.worst_accepted_z),
            other_words(kind),
            significant(kind.worst_z),
            failed.join(", "),
        ]);
    }
    for column in table.column_iter_mut().skip(2).take(7) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let rate = |rate: &Rate| {
        format!(
            "{} of {} ({:.1} %)",
            rate.count,
            rate.of,
            100.0 * rate.fraction
        )
    };
    format!(
        "{}\n{table}\n\nmodel {}: falsely assured (status 0, and one of the nine beyond {FALSE_BEYOND_SIGMA} sigma or another learned state beyond \
         {OTHERS_FALSE_BEYOND_SIGMA}) {}; \
         false alarms among the worlds that it holds {}",
        report.command,
        report.model,
        rate(&report.false_assurance),
        rate(&report.false_alarm)
    )
}
