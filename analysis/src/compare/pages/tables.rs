//! The tables: at the end of a calibration, consistency, position errors.

use report::{Cell, Table};
use sins::{
    estimation::state::StateValues,
    studies::monte_carlo::{Point, mean_nees_bounds},
    studies::paper::CALIBRATED,
    units::NAUTICAL_MILE_M,
};

use crate::{
    compare::{
        CONFIDENCE,
        campaign::{Campaign, CaseResult},
        figures,
        summary::settled_h,
        voyages::{TURNS_DEG, VOYAGE_H},
    },
    words::{capital, significant},
};

/// Errors and sigmas of one case at the end.
pub fn end_table(result: &CaseResult, campaign: &Campaign) -> Table {
    let mut table = Table::new(
        format!(
            "{} after {} h: {}",
            capital(&figures::title(result.case)),
            campaign.plan.hours,
            figures::setting_line(result.case, campaign)
        ),
        [
            "state",
            "unit",
            "rms error",
            "sigma",
            "rms / sigma",
            "found after, h",
        ],
    );
    let Some(end) = result.statistics.end() else {
        return table;
    };
    let settled = settled_h(result);
    let [rms, sigma, ratio] = [end.rms(), end.sigma(), end.rms_over_sigma()];
    for (k, label) in CALIBRATED.iter().enumerate() {
        let state = label.name;
        let of = |values: &StateValues| values.value(state).unwrap_or(f64::NAN);
        let threshold = figures::GROUPS
            .iter()
            .any(|g| g.states.contains(&state) && figures::threshold_applies(g, state));
        let found = match settled[k] {
            Some(hours) => Cell::number(format!("{hours:.2}")),
            None if threshold => Cell::Warn("not".to_owned()),
            None => Cell::text(""),
        };
        table = table.row([
            Cell::text(format!("{} {}", label.symbol, label.words)),
            Cell::text(label.unit),
            Cell::number(significant(of(&rms) / label.scale)),
            Cell::number(significant(of(&sigma) / label.scale)),
            Cell::number(format!("{:.2}", of(&ratio))),
            found,
        ]);
    }
    table
}

/// Mean NEES of every case at the quarters of the run.
pub fn nees_table(campaign: &Campaign) -> Table {
    let [low, high] = mean_nees_bounds(campaign.plan.runs, CONFIDENCE);
    let whole: Vec<f64> = (1..=4)
        .map(|k| campaign.plan.hours * f64::from(k) / 4.0)
        .collect();
    let mut header = vec!["case".to_owned()];
    header.extend(whole.iter().map(|h| format!("at {h} h")));
    let mut table = Table::new(
        format!(
            "Mean NEES of {} runs; {:.0} % of consistent filters lie within {low:.2} .. {high:.2}.",
            campaign.plan.runs,
            CONFIDENCE * 100.0
        ),
        header,
    );
    for result in &campaign.cases {
        let mut row = vec![Cell::text(capital(&result.case.name()))];
        for hours in &whole {
            let nees = result
                .statistics
                .points
                .iter()
                .rfind(|p| p.time_s <= hours * 3600.0 + 1.0)
                .and_then(Point::mean_nees);
            row.push(match nees {
                Some(nees) if (low..=high).contains(&nees) => Cell::Good(format!("{nees:.2}")),
                Some(nees) => Cell::Warn(format!("{nees:.2}")),
                None => Cell::text(""),
            });
        }
        table = table.row(row);
    }
    table
}

/// Position errors of Table 1's IMU.
pub fn voyage_table(campaign: &Campaign) -> Table {
    let mut table = Table::new(
        "Greatest position error (nmi) of an IMU with the errors of Table 1: median over the runs, and the worst run.",
        [
            "case",
            "turn, deg",
            "length, h",
            "median with",
            "worst with",
            "median without",
            "worst without",
        ],
    );
    for result in &campaign.cases {
        for (voyages, turn) in result.voyages.iter().zip(TURNS_DEG) {
            for (length, hours) in VOYAGE_H.into_iter().enumerate() {
                let cell = |metres: f64| Cell::number(format!("{:.2}", metres / NAUTICAL_MILE_M));
                table = table.row([
                    Cell::text(capital(&result.case.name())),
                    Cell::number(format!("{turn:.0}")),
                    Cell::number(format!("{hours:.0}")),
                    cell(voyages.median_greatest(length, 0)),
                    cell(voyages.worst(length, 0)),
                    cell(voyages.median_greatest(length, 1)),
                    cell(voyages.worst(length, 1)),
                ]);
            }
        }
    }
    table
}

/// Position errors of IMUs with drawn errors.
pub fn drawn_voyage_table(campaign: &Campaign) -> Table {
    let mut table = Table::new(
        format!(
            "Greatest position error (nmi) within {:.0} h of IMUs with errors drawn from P0: rms over the runs, and the worst run.",
            VOYAGE_H[0]
        ),
        [
            "case",
            "turn, deg",
            "rms with",
            "worst with",
            "rms without",
            "worst without",
        ],
    );
    for result in &campaign.cases {
        for (voyages, turn) in result.drawn_voyages.iter().zip(TURNS_DEG) {
            let cell = |metres: f64| Cell::number(format!("{:.2}", metres / NAUTICAL_MILE_M));
            table = table.row([
                Cell::text(capital(&result.case.name())),
                Cell::number(format!("{turn:.0}")),
                cell(voyages.rms_greatest(0, 0)),
                cell(voyages.worst(0, 0)),
                cell(voyages.rms_greatest(0, 1)),
                cell(voyages.worst(0, 1)),
            ]);
        }
    }
    table
}
