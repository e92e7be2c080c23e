//! The experiment in figures: as JSON and as text.

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;
use sins::{
    machines::self_calibration::Phase,
    units::{ARC_SECOND, NAUTICAL_MILE_M},
};

use super::{HOURS, Plan, TOLD_H, Trial, sensor_states, true_errors};
use crate::{compare::PAPER_NMI, significant};

#[derive(Serialize)]
struct StateRow {
    state: &'static str,
    unit: &'static str,
    truth: f64,
    mean_estimate: f64,
    rms_error: f64,
    sigma: f64,
}

#[derive(Serialize)]
struct PositionRow {
    hours: f64,
    median_compensated_nmi: f64,
    worst_compensated_nmi: f64,
    median_uncompensated_nmi: f64,
    worst_uncompensated_nmi: f64,
}

/// The experiment as JSON.
#[derive(Serialize)]
pub struct Report {
    /// The command that gives the same again.
    pub command: String,
    /// How many IMUs converged.
    pub converged: usize,
    runs: u64,
    states: Vec<StateRow>,
    azimuth_rms_arcsec: f64,
    azimuth_sigma_arcsec: f64,
    position: Vec<PositionRow>,
    paper_uncompensated_nmi: f64,
    paper_compensated_nmi: f64,
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / count).sqrt()
}

/// Sums the trials up.
pub fn summarize(plan: &Plan, trials: &[Trial], command: &str) -> Report {
    let states = sensor_states()
        .iter()
        .zip(true_errors())
        .map(|(label, truth)| {
            let estimates = || {
                let values = trials.iter().map(|t| t.estimate.states.value(label.name));
                values.map(|value| value.unwrap_or(f64::NAN))
            };
            let sigmas = trials.iter().map(|t| t.estimate.states.sigma(label.name));
            let mean = estimates().sum::<f64>() / trials.len() as f64;
            StateRow {
                state: label.words,
                unit: label.unit,
                truth: truth / label.scale,
                mean_estimate: mean / label.scale,
                rms_error: rms(estimates().map(|value| value - truth)) / label.scale,
                sigma: rms(sigmas.map(|sigma| sigma.unwrap_or(f64::NAN))) / label.scale,
            }
        })
        .collect();
    let position = TOLD_H
        .into_iter()
        .map(|hours| {
            let of = |which: usize| {
                let mut values: Vec<f64> = trials
                    .iter()
                    .map(|t| t.track.greatest_m(hours * 3600.0)[which] / NAUTICAL_MILE_M)
                    .collect();
                values.sort_by(f64::total_cmp);
                (values[values.len() / 2], values[values.len() - 1])
            };
            let (with, without) = (of(0), of(1));
            PositionRow {
                hours,
                median_compensated_nmi: with.0,
                worst_compensated_nmi: with.1,
                median_uncompensated_nmi: without.0,
                worst_uncompensated_nmi: without.1,
            }
        })
        .collect();
    Report {
        command: command.to_owned(),
        converged: trials
            .iter()
            .filter(|t| t.estimate.phase == Phase::Converged)
            .count(),
        runs: plan.runs,
        states,
        azimuth_rms_arcsec: rms(trials.iter().map(|t| t.azimuth_error_rad)) / ARC_SECOND,
        azimuth_sigma_arcsec: rms(trials.iter().map(|t| t.estimate.misalignment_sigma().z))
            / ARC_SECOND,
        position,
        paper_uncompensated_nmi: PAPER_NMI[0],
        paper_compensated_nmi: PAPER_NMI[1],
    }
}

/// The experiment as text.
pub fn text(report: &Report) -> String {
    let table = |header: &[&str], rows: Vec<Vec<String>>| {
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header(header);
        for row in rows {
            table.add_row(row);
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.to_string()
    };
    let states = report
        .states
        .iter()
        .map(|s| {
            let mut row = vec![s.state.to_owned()];
            row.extend([s.truth, s.mean_estimate, s.rms_error, s.sigma].map(significant));
            row.push(s.unit.to_owned());
            row
        })
        .collect();
    let position = report
        .position
        .iter()
        .map(|p| {
            [
                p.hours,
                p.median_uncompensated_nmi,
                p.worst_uncompensated_nmi,
                p.median_compensated_nmi,
                p.worst_compensated_nmi,
                p.median_uncompensated_nmi / p.median_compensated_nmi,
            ]
            .map(significant)
            .to_vec()
        })
        .collect();
    format!(
        "{}\n{} of {} IMUs converged; 0.7 h at rest, then the eight positions to {HOURS} h\n\n{}\n\nazimuth: rms error {} arcsec, sigma {} arcsec\n\n\
         Greatest position error (nmi) of free-inertial navigation at rest; the paper's ship: {} without compensation, {} with it, {:.2} times smaller\n{}",
        report.command,
        report.converged,
        report.runs,
        table(
            &["", "truth", "mean estimate", "rms error", "sigma", "unit"],
            states
        ),
        significant(report.azimuth_rms_arcsec),
        significant(report.azimuth_sigma_arcsec),
        report.paper_uncompensated_nmi,
        report.paper_compensated_nmi,
        report.paper_uncompensated_nmi / report.paper_compensated_nmi,
        table(
            &[
                "within, h",
                "median without",
                "worst without",
                "median with",
                "worst with",
                "times smaller"
            ],
            position
        ),
    )
}
