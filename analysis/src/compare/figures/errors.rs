//! Errors of the runs, and one sigma of the three simulations, against time.

use report::{Axis, Band, Figure, Line, Panel, Series};
use sins::{
    estimation::state::StateValues, simulation::NoiseReading,
    studies::observability::bound::settled_s,
};

use super::{
    default_cases,
    groups::{Group, threshold_applies, threshold_state, threshold_text},
    hours, setting_line, title,
};
use crate::{
    compare::campaign::{Campaign, CaseResult},
    words::slug,
};

/// Errors of one group against time, with three sigma bands and the times of convergence.
pub fn errors(result: &CaseResult, group: &Group, campaign: &Campaign) -> Figure {
    let case = result.case;
    let mut figure = Figure::new(
        format!("{}-{}", group.id, slug(&case.name())),
        format!("{}, {}", group.name, title(case)),
        hours(),
    )
    .x_range(0.0, campaign.plan.hours)
    .caption(format!(
        "Errors of {} runs ({} drawn), their root mean square, and ±3σ of the filter. {} A mark stands where {} of the bound falls below {} for good.",
        result.statistics.runs,
        result.statistics.traces.len(),
        setting_line(case, campaign),
        threshold_state(group),
        threshold_text(group),
    ));
    for label in group.labels() {
        let state = label.name;
        let of = |values: &StateValues| values.value(state).unwrap_or(f64::NAN) / label.scale;
        let points = &result.statistics.points;
        let at = |time_s: f64| time_s / 3600.0;
        let band: Vec<_> = points
            .iter()
            .map(|p| {
                let three = 3.0 * of(&p.sigma());
                (at(p.time_s), -three, three)
            })
            .collect();
        let rms: Vec<_> = points
            .iter()
            .map(|p| (at(p.time_s), of(&p.rms())))
            .collect();
        let mut panel = Panel::new("", Axis::new(label.symbol, label.unit))
            .band(Band::new("±3σ of the filter", band).colour(0));
        for trace in &result.statistics.traces {
            let errors = points
                .iter()
                .zip(&trace.errors)
                .map(|(p, e)| (at(p.time_s), of(e)))
                .collect();
            panel = panel.series(
                Series::new("single runs", errors)
                    .line(Line::Thin)
                    .colour(1),
            );
        }
        panel = panel.series(Series::new("rms of all runs", rms).colour(2));
        if threshold_applies(group, state)
            && let Some(settled) = settled_s(&result.bound, |s| {
                s.value(state).is_some_and(|sigma| sigma < group.threshold)
            })
        {
            panel = panel.vertical(at(settled), format!("{:.2} h", at(settled)));
        }
        figure = figure.panel(panel);
    }
    figure
}

/// One sigma of the three simulations side by side, for a group of states.
pub fn sigmas(campaign: &Campaign, reading: NoiseReading, group: &Group) -> Figure {
    let mut figure = Figure::new(
        format!("sigma-{}-{}", group.id, reading.letter().to_lowercase()),
        format!("{}: one sigma of the three simulations, noise {}", group.name, reading.letter()),
        hours(),
    )
    .x_range(0.0, campaign.plan.hours)
    .caption(format!(
        "Covariance bound at heading {:.0} deg, default tables, noise {}. The dashed line is the threshold of convergence.",
        campaign.plan.ship.heading_rad.to_degrees(),
        reading.letter()
    ));
    for label in group.labels() {
        let state = label.name;
        let of = |values: &StateValues| values.value(state).unwrap_or(f64::NAN) / label.scale;
        let mut panel = Panel::new("", Axis::new(format!("σ {}", label.symbol), label.unit)).log();
        for (colour, result) in default_cases(campaign, reading).enumerate() {
            let points = result
                .bound
                .iter()
                .step_by(6)
                .map(|p| (p.time_s / 3600.0, of(&p.sigma)))
                .collect();
            panel = panel.series(Series::new(result.case.simulation.name(), points).colour(colour));
        }
        if threshold_applies(group, state) {
            panel = panel.horizontal(group.threshold / label.scale, "");
        }
        figure = figure.panel(panel);
    }
    figure
}
