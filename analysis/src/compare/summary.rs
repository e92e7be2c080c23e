//! The results of `compare` as JSON.

use serde::Serialize;
use sins::{
    estimation::state::StateValues,
    studies::monte_carlo::{Point, mean_nees_bounds},
    studies::observability::bound::settled_s,
    studies::paper::{CALIBRATED, CALIBRATED_STATES},
};

use super::{
    CONFIDENCE,
    campaign::{Campaign, CaseResult},
    claims::Claim,
    figures::{GROUPS, threshold_applies},
    voyages::{TURNS_DEG, VOYAGE_H},
};

/// Everything in SI.
#[derive(Serialize)]
pub struct Results {
    command: String,
    runs: u64,
    hours: f64,
    rate_hz: f64,
    seed: u64,
    state_names: Vec<&'static str>,
    nees_bounds: [f64; 2],
    cases: Vec<CaseReport>,
    heading_sweep: Vec<SweepReport>,
    claims: Vec<Claim>,
}

#[derive(Serialize)]
struct CaseReport {
    name: String,
    scheme: &'static str,
    reading: &'static str,
    outer_axis: String,
    inner_axis: String,
    /// At the end, nine values each.
    rms_error: Vec<f64>,
    sigma: Vec<f64>,
    rms_over_sigma: Vec<f64>,
    mean_nees: Option<f64>,
    /// Every minute.
    time_s: Vec<f64>,
    mean_nees_over_time: Vec<Option<f64>>,
    /// Time until sigma stays below the threshold, by state \[h\].
    settled_h: Vec<Option<f64>>,
    voyages: Vec<VoyageReport>,
    drawn_voyages: Vec<DrawnVoyageReport>,
}

/// Of IMUs with drawn errors, within the first of the voyages' lengths.
#[derive(Serialize)]
struct DrawnVoyageReport {
    turn_deg: f64,
    rms_greatest_m: f64,
    rms_greatest_uncompensated_m: f64,
}

#[derive(Serialize)]
struct VoyageReport {
    turn_deg: f64,
    hours: f64,
    median_greatest_m: f64,
    median_greatest_uncompensated_m: f64,
    worst_m: f64,
    worst_uncompensated_m: f64,
}

#[derive(Serialize)]
struct SweepReport {
    case: String,
    heading_deg: f64,
    sigma: Vec<f64>,
}

/// When σ of each of the nine stays below its threshold \[h\].
pub fn settled_h(result: &CaseResult) -> [Option<f64>; CALIBRATED_STATES] {
    std::array::from_fn(|k| {
        let state = CALIBRATED[k].name;
        let group = GROUPS
            .iter()
            .find(|g| g.states.contains(&state) && threshold_applies(g, state))?;
        let is_found = |sigmas: &StateValues| {
            let sigma = sigmas.value(state);
            sigma.is_some_and(|sigma| sigma < group.threshold)
        };
        settled_s(&result.bound, is_found).map(|s| s / 3600.0)
    })
}

/// The results.
pub fn results(campaign: &Campaign, claims: &[Claim], command: &str) -> Results {
    let plan = &campaign.plan;
    Results {
        command: command.to_owned(),
        runs: plan.runs,
        hours: plan.hours,
        rate_hz: plan.rate_hz,
        seed: plan.seed,
        state_names: CALIBRATED.map(|label| label.name).to_vec(),
        nees_bounds: mean_nees_bounds(plan.runs, CONFIDENCE),
        cases: campaign.cases.iter().map(case).collect(),
        heading_sweep: campaign
            .sweep
            .iter()
            .map(|point| SweepReport {
                case: point.case.name(),
                heading_deg: point.heading_deg,
                sigma: point.bound.last().map_or_else(Vec::new, |end| {
                    let sigma = |name| end.sigma.value(name).unwrap_or(f64::NAN);
                    CALIBRATED.iter().map(|label| sigma(label.name)).collect()
                }),
            })
            .collect(),
        claims: claims.to_vec(),
    }
}

fn case(result: &CaseResult) -> CaseReport {
    let of = |values: Option<StateValues>| values.map_or_else(Vec::new, |v| v.as_slice().to_vec());
    let end = result.statistics.end();
    CaseReport {
        name: result.case.name(),
        scheme: result.case.simulation.name(),
        reading: result.case.reading.letter(),
        outer_axis: result.case.table.outer.to_string(),
        inner_axis: result.case.table.inner.to_string(),
        rms_error: of(end.map(Point::rms)),
        sigma: of(end.map(Point::sigma)),
        rms_over_sigma: of(end.map(Point::rms_over_sigma)),
        mean_nees: end.and_then(Point::mean_nees),
        time_s: result.statistics.points.iter().map(|p| p.time_s).collect(),
        mean_nees_over_time: result
            .statistics
            .points
            .iter()
            .map(Point::mean_nees)
            .collect(),
        settled_h: settled_h(result).to_vec(),
        voyages: result
            .voyages
            .iter()
            .zip(TURNS_DEG)
            .flat_map(|(voyages, turn_deg)| {
                VOYAGE_H
                    .into_iter()
                    .enumerate()
                    .map(move |(length, hours)| VoyageReport {
                        turn_deg,
                        hours,
                        median_greatest_m: voyages.median_greatest(length, 0),
                        median_greatest_uncompensated_m: voyages.median_greatest(length, 1),
                        worst_m: voyages.worst(length, 0),
                        worst_uncompensated_m: voyages.worst(length, 1),
                    })
            })
            .collect(),
        drawn_voyages: result
            .drawn_voyages
            .iter()
            .zip(TURNS_DEG)
            .map(|(voyages, turn_deg)| DrawnVoyageReport {
                turn_deg,
                rms_greatest_m: voyages.rms_greatest(0, 0),
                rms_greatest_uncompensated_m: voyages.rms_greatest(0, 1),
            })
            .collect(),
    }
}
