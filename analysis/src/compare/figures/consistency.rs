//! Mean NEES against time, and final sigmas against heading.

use report::{Axis, Figure, Line, Panel, Series};
use sins::{
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    estimation::groups::navigation::MISALIGNMENT,
    simulation::NoiseReading,
    studies::monte_carlo::mean_nees_bounds,
    units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G},
};

use super::{hours, setting};
use crate::compare::{
    CONFIDENCE,
    campaign::{Campaign, CaseResult, SWEEP_DEG},
};

/// Mean NEES against time, with the bounds within which consistent filters lie; every case in its own panel.
pub fn nees(campaign: &Campaign, reading: NoiseReading) -> Figure {
    let [low, high] = mean_nees_bounds(campaign.plan.runs, CONFIDENCE);
    let mut figure = Figure::new(
        format!("nees-{}", reading.letter().to_lowercase()),
        format!("Consistency: mean NEES, noise {}", reading.letter()),
        hours(),
    )
    .x_range(0.0, campaign.plan.hours)
    .caption(format!(
        "Mean over {} runs of the normalized estimation error squared of misalignment, biases and drifts. Consistent filters stand at 9, \
         at any one time between the two marks, {low:.2} and {high:.2}, with {:.0} % probability. Seed {}.",
        campaign.plan.runs,
        CONFIDENCE * 100.0,
        campaign.plan.seed
    ));
    let cases: Vec<_> = campaign
        .cases
        .iter()
        .filter(|r| r.case.reading == reading)
        .collect();
    let values = |result: &CaseResult| -> Vec<(f64, f64)> {
        let points = result.statistics.points.iter();
        points
            .map(|p| (p.time_s / 3600.0, p.mean_nees().unwrap_or(f64::NAN)))
            .collect()
    };
    // One scale for all, so that they can be compared.
    let all = || cases.iter().flat_map(|r| values(r)).map(|point| point.1);
    let floor = all().fold(low, f64::min) - 0.5;
    let ceiling = all().fold(high, f64::max) + 0.5;
    for (colour, result) in cases.iter().enumerate() {
        figure = figure.panel(
            Panel::new(setting(result.case), Axis::new("mean NEES", ""))
                .range(floor, ceiling)
                .horizontal(low, "")
                .horizontal(high, "")
                .series(
                    Series::new("mean NEES", values(result))
                        .colour(colour)
                        .unlisted(),
                ),
        );
    }
    figure
}

/// Final sigma against heading, every scheme and gimbal order.
pub fn heading_sweep(campaign: &Campaign, reading: NoiseReading) -> Figure {
    let worst = |name: &str, unit: &str, states: &[&str], scale: f64| {
        let mut panel = Panel::new("", Axis::new(name, unit)).log();
        let cases = campaign
            .cases
            .iter()
            .map(|r| r.case)
            .filter(|case| case.reading == reading);
        for (colour, case) in cases.enumerate() {
            let points = campaign
                .sweep
                .iter()
                .filter(|p| p.case == case)
                .map(|p| {
                    let end = p.bound.last().map_or(f64::NAN, |end| {
                        let sigmas = states.iter().filter_map(|state| end.sigma.value(state));
                        sigmas.fold(0.0, f64::max)
                    });
                    (p.heading_deg, end / scale)
                })
                .collect();
            panel = panel.series(
                Series::new(setting(case), points)
                    .line(Line::LinePoints)
                    .colour(colour),
            );
        }
        panel
    };
    Figure::new(
        format!("heading-{}", reading.letter().to_lowercase()),
        format!(
            "One sigma after {} h against heading, noise {}",
            campaign.plan.hours,
            reading.letter()
        ),
        Axis::new("heading", "deg"),
    )
    .x_range(0.0, SWEEP_DEG[SWEEP_DEG.len() - 1])
    .caption(format!(
        "Covariance bound after {} h; of biases and drifts the worst of the three axes. Noise {}.",
        campaign.plan.hours,
        reading.letter()
    ))
    .panel(worst("σ φU", "arcsec", &MISALIGNMENT[2..], ARC_SECOND))
    .panel(worst(
        "worst σ of ε",
        "deg/h",
        &GYROSCOPE_DRIFT,
        DEG_PER_HOUR,
    ))
    .panel(worst("worst σ of ∇", "ug", &ACCELEROMETER_BIAS, MICRO_G))
}
