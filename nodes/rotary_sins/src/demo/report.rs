//! The result of the demo as text.

use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

use analysis::decimals;
use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use sins::units::NAUTICAL_MILE_M;

use super::fleet::Ended;
use super::outcome::{DemoResult, LIMIT_SIGMA};

/// How the run went besides its result.
pub struct DemoRun<'a> {
    /// From the start of the first node to the last sample.
    pub wall: Duration,
    /// The processes.
    pub processes: &'a [Ended],
    /// Where the bag is, if there is one.
    pub bag: Option<&'a Path>,
}

/// Tables and verdict.
pub fn text(outcome: &DemoResult, run: &DemoRun<'_>) -> String {
    let estimate = &outcome.estimate;
    let mut text = format!(
        "Self-calibration after {:.0} s of simulated time, phase {}, {:.1} s from the start of the nodes\n{}\n",
        estimate.duration,
        estimate.phase_name,
        run.wall.as_secs_f64(),
        estimates(outcome)
    );
    let [with, without] = outcome.navigation;
    let describe = |error: Option<super::watch::PositionError>| {
        error.map_or_else(
            || "no solution".to_owned(),
            |error| {
                format!(
                    "{:.3} nmi at most, {:.3} nmi at the end",
                    error.largest_m / NAUTICAL_MILE_M,
                    error.last_m / NAUTICAL_MILE_M
                )
            },
        )
    };
    let lines = [
        format!(
            "Position error of free-inertial navigation since convergence, with compensation: {}",
            describe(with)
        ),
        format!(
            "                                                         without compensation: {}",
            describe(without)
        ),
        format!(
            "Mean NIS of the last window {:.2}, bound {:.2}",
            estimate.nis_window_mean, estimate.nis_upper_bound
        ),
        format!("Samples sent: {}", outcome.sent),
    ];
    for line in lines {
        writeln!(text, "{line}").ok();
    }
    for consumer in &outcome.consumers {
        let counts = consumer.counts;
        writeln!(
            text,
            "  {}: {} used, {} lost, {} refused",
            consumer.name, counts.samples, counts.lost, counts.refused
        )
        .ok();
    }
    let cpu: Vec<_> = run
        .processes
        .iter()
        .map(|process| format!("{} {:.1} s", process.name, process.cpu_s))
        .collect();
    writeln!(text, "Processor time: {}", cpu.join(", ")).ok();
    if let Some(bag) = run.bag {
        writeln!(text, "Bag: {}", bag.display()).ok();
    }
    for fault in outcome.faults() {
        writeln!(text, "FAULT: {fault}").ok();
    }
    if outcome.is_good() {
        writeln!(
            text,
            "GOOD: every estimate within {LIMIT_SIGMA} sigma of the truth, no sample lost"
        )
        .ok();
    }
    text
}

fn estimates(outcome: &DemoResult) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header([
        "quantity",
        "unit",
        "truth",
        "estimate",
        "error",
        "1 sigma",
        "error / sigma",
    ]);
    for row in &outcome.rows {
        let digits = decimals(row.unit);
        table.add_row([
            row.name.clone(),
            row.unit.to_owned(),
            format!("{:.digits$}", row.truth),
            format!("{:.digits$}", row.estimate),
            format!("{:+.digits$}", row.error()),
            format!("{:.digits$}", row.sigma),
            format!("{:+.2}", row.sigmas()),
        ]);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
