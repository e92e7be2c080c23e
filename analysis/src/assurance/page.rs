//! The study as a page.

use report::{Axis, Cell, Figure, Line, Page, Panel, Series, Table, Verdict};
use sins::studies::assurance::{FALSE_BEYOND_SIGMA, OTHERS_FALSE_BEYOND_SIGMA};

use super::summary::{Rate, other_words};
use super::{AT_MOST, Report, Trial};
use crate::Error;
use crate::words::significant;

/// Errors beyond this are drawn at the edge, in sigmas.
const FARTHEST: f64 = 15.0;

/// The study as a page.
///
/// # Errors
/// Where a figure cannot be drawn.
pub fn page(report: &Report, trials: &[Trial]) -> Result<Page, Error> {
    let mut page = Page::new("Rotary SINS: is the verdict to be believed?");
    page.subtitle(format!(
        "{} drawn worlds, model {}, seed {}",
        report.worlds, report.model, report.seed
    ));
    page.meta("command", &report.command)
        .meta("version", env!("CARGO_PKG_VERSION"));
    page.section(2, "Result");
    for (what, rate) in [
        ("false assurance", report.false_assurance),
        ("false alarm", report.false_alarm),
    ] {
        page.badge(verdict(rate), format!("{what}: {}", words(rate)));
    }
    page.note(format!(
        "False assurance: converged and consistent, and one of misalignment, biases and drifts is off by more than \
         {FALSE_BEYOND_SIGMA} sigma, or another state that was learned by more than {OTHERS_FALSE_BEYOND_SIGMA}. False alarm: a world that the \
         model holds and whose sigmas are all reached, and that is refused, or that ends without an estimate."
    ));
    page.figure(&figure(trials))?;
    page.section(2, "By kind");
    let mut table = Table::new(
        "Worst z: the greatest error of the nine over its sigma, among the accepted worlds and among all. Of other states: the \
         same of what else was learned, among the accepted.",
        [
            "kind",
            "model holds it",
            "worlds",
            "accepted",
            "falsely assured",
            "false alarms",
            "worst z accepted",
            "of other states",
            "worst z",
            "tests that failed",
        ],
    );
    for kind in &report.kinds {
        let failed: Vec<String> = kind
            .failed_tests
            .iter()
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        let mistakes = kind.false_assurance + kind.false_alarm;
        table = table.row([
            Cell::verdict(
                if mistakes == 0 {
                    Verdict::Good
                } else {
                    Verdict::Bad
                },
                kind.name,
            ),
            Cell::text(if kind.inside { "yes" } else { "no" }),
            Cell::number(kind.worlds.to_string()),
            Cell::number(kind.accepted.to_string()),
            Cell::number(kind.false_assurance.to_string()),
            Cell::number(kind.false_alarm.to_string()),
            Cell::number(significant(kind.worst_accepted_z)),
            Cell::text(other_words(kind)),
            Cell::number(significant(kind.worst_z)),
            Cell::text(failed.join(", ")),
        ]);
    }
    page.table(table);
    Ok(page)
}

fn verdict(rate: Rate) -> Verdict {
    if rate.fraction <= AT_MOST {
        Verdict::Good
    } else {
        Verdict::Bad
    }
}

fn words(rate: Rate) -> String {
    format!(
        "{} of {} ({:.1} %)",
        rate.count,
        rate.of,
        100.0 * rate.fraction
    )
}

/// How far worlds are off, those that were accepted and those that were not.
fn figure(trials: &[Trial]) -> Figure {
    let share = |accepted: bool| {
        let mut worst: Vec<f64> = trials
            .iter()
            .filter_map(|trial| trial.outcome.as_ref().ok())
            .filter(|outcome| outcome.is_accepted() == accepted)
            .map(|outcome| outcome.worst().1)
            .map(|z| {
                if z.is_nan() {
                    FARTHEST
                } else {
                    z.min(FARTHEST)
                }
            })
            .collect();
        worst.sort_by(f64::total_cmp);
        let of = worst.len().max(1) as f64;
        worst
            .iter()
            .enumerate()
            .map(|(k, z)| (*z, 100.0 * (of - k as f64) / of))
            .collect::<Vec<_>>()
    };
    let x = Axis::new("worst of the nine, error over sigma", "");
    Figure::new("worst", "How far accepted and refused worlds are off", x)
        .x_range(0.0, FARTHEST)
        .caption("Share of the worlds whose worst error is at least so many sigmas; what is farther off is drawn at the edge.")
        .panel(
            Panel::new("", Axis::new("worlds beyond", "%"))
                .log()
                .series(Series::new("accepted", share(true)).colour(2))
                .series(Series::new("refused", share(false)).line(Line::Dashed))
                .vertical(FALSE_BEYOND_SIGMA, "falsely assured beyond"),
        )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use sins::machines::self_calibration::ModelChoice;

    use super::super::{Plan, run, summarize};

    /// The page names every kind that was drawn, and the command.
    #[test]
    fn the_page_has_every_kind() {
        let plan = Plan {
            worlds: 2,
            seed: 4,
            model: ModelChoice::Paper,
        };
        let trials = run(&plan, &());
        let report = summarize(&plan, &trials, "rotary-sins assurance");
        let html = super::page(&report, &trials).unwrap().to_html();
        for kind in &report.kinds {
            assert!(html.contains(kind.name), "{}", kind.name);
        }
        assert_eq!(report.kinds.len(), 2);
        assert!(html.contains("rotary-sins assurance"));
    }
}
