//! The claims of the paper's text, each held against what was worked out.
//!
//! A claim is judged in cells: one for every reading of the noise, gimbal order and heading (or voyage) that it speaks of. It
//! holds where it holds in every cell, does not where it holds in none, and holds in part otherwise; the page says where.
//! What 'estimated' and 'found' mean is fixed here, before any result: a drift is found where its sigma is below 0.002 deg/h, a bias below 10 ug
//! (the project's thresholds for convergence), and a state is not estimated where more than half of its first sigma is left.

mod cells;

use sins::{
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    estimation::groups::navigation::MISALIGNMENT,
    studies::observability::bound::BoundPoint,
    units::{DEG_PER_HOUR, MICRO_G, NAUTICAL_MILE_M},
};

use super::{
    campaign::{Campaign, SweepPoint},
    cases::{Case, Simulation},
    voyages::{TURNS_DEG, VOYAGE_H},
};

pub use cells::{Cell, Claim};

/// Sigma of a drift that is found \[deg/h\].
pub const DRIFT_FOUND_DEG_H: f64 = 0.002;

/// Sigma of a bias that is found \[ug\].
pub const BIAS_FOUND_UG: f64 = 10.0;

/// More than this part of the first sigma left: not estimated.
const NOT_ESTIMATED: f64 = 0.5;

/// How near a figure of the paper counts as reproduced.
const NEAR: f64 = 0.2;

/// The paper's position errors without and with compensation \[nmi\].
pub const PAPER_NMI: [f64; 2] = [7.0, 3.0];

/// Sweep points of one simulation.
fn sweep(campaign: &Campaign, simulation: Simulation) -> impl Iterator<Item = &SweepPoint> {
    campaign
        .sweep
        .iter()
        .filter(move |p| p.case.simulation == simulation)
}

fn order(case: Case) -> String {
    match case.simulation {
        Simulation::Static => "at rest".to_owned(),
        _ => format!("outer {} inner {}", case.table.outer, case.table.inner),
    }
}

fn cells(
    campaign: &Campaign,
    simulation: Simulation,
    judge: impl Fn(&[BoundPoint]) -> (f64, bool),
) -> Vec<Cell> {
    sweep(campaign, simulation)
        .map(|point| {
            let (measured, holds) = judge(&point.bound);
            Cell {
                reading: point.case.reading.letter(),
                setting: order(point.case),
                heading_deg: point.heading_deg,
                holds,
                measured,
            }
        })
        .collect()
}

/// Sigma of a state at the end, in SI.
fn end(bound: &[BoundPoint], state: &str) -> f64 {
    let end = bound.last().and_then(|point| point.sigma.value(state));
    end.unwrap_or(f64::NAN)
}

/// The part of the first sigma of a state that is left at the end.
fn left(bound: &[BoundPoint], state: &str) -> f64 {
    end(bound, state) / end(&bound[..1], state)
}

/// When all of `states` stay below `limit` \[h\]; NaN where never.
fn settled_h(bound: &[BoundPoint], states: &[&str], limit: f64) -> f64 {
    sins::studies::observability::bound::settled_s(bound, |sigma| {
        let below = |state: &&str| sigma.value(state).is_some_and(|sigma| sigma < limit);
        states.iter().all(below)
    })
    .map_or(f64::NAN, |s| s / 3600.0)
}

/// All claims.
pub fn claims(campaign: &Campaign) -> Vec<Claim> {
    let drift = DRIFT_FOUND_DEG_H * DEG_PER_HOUR;
    let bias = BIAS_FOUND_UG * MICRO_G;
    let at_rest =
        |judge: &dyn Fn(&[BoundPoint]) -> (f64, bool)| cells(campaign, Simulation::Static, judge);
    let within = |states: &[&str], limit: f64, hours: f64| {
        cells(campaign, Simulation::Xy, |b| {
            let t = settled_h(b, states, limit);
            (t, t <= hours)
        })
    };
    let hours = campaign.plan.hours;
    let [ex, ey, ez] = GYROSCOPE_DRIFT;
    let mut claims = vec![
        Claim::new(
            "Static: of the drifts only εy is estimated, to about 0.002 deg/h",
            format!("sigma of εy after {hours} h in deg/h; holds up to {DRIFT_FOUND_DEG_H}"),
            "deg/h",
            at_rest(&|b| (end(b, ey) / DEG_PER_HOUR, end(b, ey) <= drift)),
        ),
        Claim::new(
            "Static: εz is not restrained in 4 h",
            format!(
                "part of the first sigma of εz left after {hours} h; holds above {NOT_ESTIMATED}"
            ),
            "of the first sigma",
            at_rest(&|b| (left(b, ez), left(b, ez) > NOT_ESTIMATED)),
        ),
        Claim::new(
            "Static: εx is not estimated",
            format!(
                "part of the first sigma of εx left after {hours} h; holds above {NOT_ESTIMATED}"
            ),
            "of the first sigma",
            at_rest(&|b| (left(b, ex), left(b, ex) > NOT_ESTIMATED)),
        ),
        Claim::new(
            "Static: the accelerometer biases are not estimated",
            format!(
                "smallest part of the first sigma of ∇x, ∇y, ∇z left after {hours} h; holds above {NOT_ESTIMATED}"
            ),
            "of the first sigma",
            at_rest(&|b| {
                let least = ACCELEROMETER_BIAS
                    .map(|state| left(b, state))
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                (least, least > NOT_ESTIMATED)
            }),
        ),
        Claim::new(
            "Eight positions x-y: the horizontal drifts εx, εy are found within 1 h",
            format!("time until both sigmas stay below {DRIFT_FOUND_DEG_H} deg/h; holds up to 1 h"),
            "h",
            within(&GYROSCOPE_DRIFT[..2], drift, 1.0),
        ),
        Claim::new(
            "Eight positions x-y: the azimuth drift εz is found within 1.5 h",
            format!(
                "time until its sigma stays below {DRIFT_FOUND_DEG_H} deg/h; holds up to 1.5 h"
            ),
            "h",
            within(&GYROSCOPE_DRIFT[2..], drift, 1.5),
        ),
        Claim::new(
            "Eight positions x-y: the accelerometer biases are found within 1 h",
            format!("time until all three sigmas stay below {BIAS_FOUND_UG} ug; holds up to 1 h"),
            "h",
            within(&ACCELEROMETER_BIAS, bias, 1.0),
        ),
    ];
    claims.extend(better_than_yz(campaign));
    claims.extend(position_error(campaign));
    claims
}

/// x-y against y-z, state group by state group, on the default tables.
fn better_than_yz(campaign: &Campaign) -> Vec<Claim> {
    let groups: [(&str, &[&str]); 3] = [
        ("azimuth misalignment", &MISALIGNMENT[2..]),
        ("drifts", &GYROSCOPE_DRIFT),
        ("accelerometer biases", &ACCELEROMETER_BIAS),
    ];
    groups
        .into_iter()
        .map(|(name, states)| {
            let worst = |point: &SweepPoint| {
                states
                    .iter()
                    .map(|state| end(&point.bound, state))
                    .fold(0.0, f64::max)
            };
            let mut cells = Vec::new();
            for xy in sweep(campaign, Simulation::Xy) {
                // Each gimbal order against the y-z scheme in its own order: default to default, other to other.
                let Some(yz) = sweep(campaign, Simulation::Yz).find(|p| {
                    p.case.reading == xy.case.reading
                        && p.heading_deg == xy.heading_deg
                        && p.case.has_default_table() == xy.case.has_default_table()
                }) else {
                    continue;
                };
                let (ours, theirs) = (worst(xy), worst(yz));
                cells.push(Cell {
                    reading: xy.case.reading.letter(),
                    setting: format!("{} against {}", order(xy.case), order(yz.case)),
                    heading_deg: xy.heading_deg,
                    holds: ours < theirs,
                    measured: ours / theirs,
                });
            }
            Claim::new(
                &format!("x-y is better than y-z: {name}"),
                format!(
                    "largest sigma of the {name} after {} h, x-y over y-z; holds below 1",
                    campaign.plan.hours
                ),
                "times that of y-z",
                cells,
            )
        })
        .collect()
}

/// The position error after calibration.
fn position_error(campaign: &Campaign) -> Vec<Claim> {
    let mut factor = Vec::new();
    let mut without = Vec::new();
    let mut with = Vec::new();
    for result in &campaign.cases {
        if result.case.simulation != Simulation::Xy {
            continue;
        }
        for (voyages, turn) in result.voyages.iter().zip(TURNS_DEG) {
            for (length, hours) in VOYAGE_H.into_iter().enumerate() {
                let [w, wo] = [0, 1].map(|k| voyages.median_greatest(length, k) / NAUTICAL_MILE_M);
                let cell = |measured: f64, holds: bool| Cell {
                    reading: result.case.reading.letter(),
                    setting: format!("{hours:.0} h, ship turned by {turn:.0} deg"),
                    heading_deg: campaign.plan.ship.heading_rad.to_degrees(),
                    holds,
                    measured,
                };
                let near = |value: f64, paper: f64| (value / paper - 1.0).abs() <= NEAR;
                factor.push(cell(wo / w, wo / w >= PAPER_NMI[0] / PAPER_NMI[1]));
                without.push(cell(wo, near(wo, PAPER_NMI[0])));
                with.push(cell(w, near(w, PAPER_NMI[1])));
            }
        }
    }
    if factor.is_empty() {
        return Vec::new();
    }
    let share = NEAR * 100.0;
    vec![
        Claim::new(
            "Compensation shrinks the position error from 7 nmi to 3 nmi: by the factor",
            format!(
                "median of the greatest error without compensation over that with it; holds from {:.2}",
                PAPER_NMI[0] / PAPER_NMI[1]
            ),
            "times smaller",
            factor,
        ),
        Claim::new(
            "The position error without compensation is 7 nmi",
            format!("median of the greatest error of Table 1's IMU; holds within {share:.0} %"),
            "nmi",
            without,
        ),
        Claim::new(
            "The position error with compensation is 3 nmi",
            format!("median of the greatest error of Table 1's IMU; holds within {share:.0} %"),
            "nmi",
            with,
        ),
    ]
}
