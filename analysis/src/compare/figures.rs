//! The pictures of `compare`.

use std::ops::Range;

use report::{Axis, Band, Figure, Line, Panel, Series};
use sins::{
    estimation::error_state::{BIAS, DRIFT, MISALIGNMENT, STATE_LABELS},
    simulation::NoiseReading,
    studies::monte_carlo::mean_nees_bounds,
    studies::observability::bound::settled_s,
    table::scheme::Program,
    units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G, NAUTICAL_MILE_M},
};

use super::{
    campaign::{Campaign, Case, CaseResult, SWEEP_DEG, Simulation, VoyageStatistics},
    claims::{BIAS_FOUND_UG, DRIFT_FOUND_DEG_H},
};

/// Confidence of the bounds on NEES.
pub const CONFIDENCE: f64 = 0.95;

/// A group of three states that share a picture.
pub struct Group {
    /// Its name.
    pub name: &'static str,
    /// For files and anchors.
    pub id: &'static str,
    /// Its states.
    pub states: Range<usize>,
    /// Sigma below which a state counts as found, SI; azimuth only where the group is misalignment.
    pub threshold: f64,
}

/// Misalignment, drifts, biases.
pub const GROUPS: [Group; 3] = [
    Group {
        name: "Misalignment",
        id: "misalignment",
        states: MISALIGNMENT..BIAS,
        threshold: 60.0 * ARC_SECOND,
    },
    Group {
        name: "Gyroscope drift",
        id: "drift",
        states: DRIFT..DRIFT + 3,
        threshold: DRIFT_FOUND_DEG_H * DEG_PER_HOUR,
    },
    Group {
        name: "Accelerometer bias",
        id: "bias",
        states: BIAS..DRIFT,
        threshold: BIAS_FOUND_UG * MICRO_G,
    },
];

fn hours() -> Axis {
    Axis::new("time", "h")
}

/// A name that can stand in a file name and an anchor.
pub fn slug(text: &str) -> String {
    let mut slug: String = text
        .to_lowercase()
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    while slug.contains("--") {
        slug = slug.replace("--", "-");
    }
    slug.trim_matches('-').to_owned()
}

/// A case without its noise, e.g. `x-y, outer x inner y`.
fn setting(case: Case) -> String {
    let name = case.name();
    name.split_once(' ')
        .map_or(name.as_str(), |(_, rest)| rest)
        .to_owned()
}

/// A case as headings have it, e.g. `x-y, outer x inner y, noise D`.
pub fn title(case: Case) -> String {
    format!("{}, noise {}", setting(case), case.reading.letter())
}

/// Joint angles of a program against time (the paper's Figure 3).
pub fn joint_angles(program: &Program, hours_long: f64) -> Figure {
    let mut points: [Vec<(f64, f64)>; 2] = [vec![(0.0, 0.0)], vec![(0.0, 0.0)]];
    for segment in program.segments() {
        let target = program.target(segment.cycle, segment.step);
        let end_h = segment.end_nanos as f64 / 3.6e12;
        for (joint, points) in points.iter_mut().enumerate() {
            // Half a minute in a picture of hours: the trapezoid is a straight line.
            points.push((end_h.min(hours_long), target[joint].to_degrees()));
        }
        if end_h >= hours_long {
            break;
        }
    }
    let [outer, inner] = points;
    Figure::new(
        format!("joint-angles-{}", slug(&program.name)),
        format!("Joint angles, {}", program.name),
        hours(),
    )
    .x_range(0.0, hours_long)
    .caption(format!(
        "Joint angles of {} with the dwell, rate and acceleration of Table 1; the outer joint turns about {}, the inner about {}.",
        program.name, program.table.outer, program.table.inner
    ))
    .panel(
        Panel::new("", Axis::new("outer joint", "deg"))
            .series(Series::new("outer joint", outer).unlisted()),
    )
    .panel(
        Panel::new("", Axis::new("inner joint", "deg"))
            .series(Series::new("inner joint", inner).colour(1).unlisted()),
    )
}

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
    for state in group.states.clone() {
        let label = &STATE_LABELS[state];
        let k = state - MISALIGNMENT;
        let points = &result.statistics.points;
        let at = |time_s: f64| time_s / 3600.0;
        let band: Vec<_> = points
            .iter()
            .map(|p| {
                let three = 3.0 * p.sigma()[k] / label.scale;
                (at(p.time_s), -three, three)
            })
            .collect();
        let rms: Vec<_> = points
            .iter()
            .map(|p| (at(p.time_s), p.rms()[k] / label.scale))
            .collect();
        let mut panel = Panel::new("", Axis::new(label.symbol, label.unit))
            .band(Band::new("±3σ of the filter", band).colour(0));
        for trace in &result.statistics.traces {
            let errors = points
                .iter()
                .zip(&trace.errors)
                .map(|(p, e)| (at(p.time_s), e[k] / label.scale))
                .collect();
            panel = panel.series(
                Series::new("single runs", errors)
                    .line(Line::Thin)
                    .colour(1),
            );
        }
        panel = panel.series(Series::new("rms of all runs", rms).colour(2));
        if threshold_applies(group, state)
            && let Some(settled) = settled_s(&result.bound, |s| s[state] < group.threshold)
        {
            panel = panel.vertical(at(settled), format!("{:.2} h", at(settled)));
        }
        figure = figure.panel(panel);
    }
    figure
}

/// Whether the group's threshold is meant for this state: of the misalignments only the azimuth.
pub fn threshold_applies(group: &Group, state: usize) -> bool {
    group.states.start != MISALIGNMENT || state == MISALIGNMENT + 2
}

/// What the group's threshold is asked of.
fn threshold_state(group: &Group) -> &'static str {
    if group.states.start == MISALIGNMENT {
        "σ of φU"
    } else {
        "σ"
    }
}

fn threshold_text(group: &Group) -> String {
    let label = &STATE_LABELS[group.states.start];
    format!("{} {}", group.threshold / label.scale, label.unit)
}

/// Seed, rate, heading, command: what makes a picture repeatable.
pub fn setting_line(case: Case, campaign: &Campaign) -> String {
    let plan = &campaign.plan;
    let reading = match case.reading {
        NoiseReading::D => "0.001 deg/√h",
        NoiseReading::H => "0.001 deg/h/√Hz",
    };
    format!(
        "Noise {} ({reading}, 10 ug/√Hz), heading {:.0} deg, {} Hz, seed {}.",
        case.reading.letter(),
        plan.ship.heading_rad.to_degrees(),
        plan.rate_hz,
        plan.seed
    )
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
    for state in group.states.clone() {
        let label = &STATE_LABELS[state];
        let mut panel = Panel::new("", Axis::new(format!("σ {}", label.symbol), label.unit)).log();
        for (colour, result) in default_cases(campaign, reading).enumerate() {
            let points = result
                .bound
                .iter()
                .step_by(6)
                .map(|p| (p.time_s / 3600.0, p.sigma[state] / label.scale))
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

/// Cases on their default tables.
pub fn default_cases(
    campaign: &Campaign,
    reading: NoiseReading,
) -> impl Iterator<Item = &CaseResult> {
    campaign
        .cases
        .iter()
        .filter(move |r| r.case.reading == reading && r.case.has_default_table())
}

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
    let worst = |name: &str, unit: &str, states: Range<usize>, scale: f64| {
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
                        states.clone().map(|i| end.sigma[i]).fold(0.0, f64::max)
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
    .panel(worst("σ φU", "arcsec", MISALIGNMENT + 2..BIAS, ARC_SECOND))
    .panel(worst(
        "worst σ of ε",
        "deg/h",
        DRIFT..DRIFT + 3,
        DEG_PER_HOUR,
    ))
    .panel(worst("worst σ of ∇", "ug", BIAS..DRIFT, MICRO_G))
}

/// Position error with and without compensation (the paper's Figure 14).
pub fn position_error(
    result: &CaseResult,
    turn: usize,
    turn_deg: f64,
    long_h: f64,
    campaign: &Campaign,
) -> Figure {
    let voyages: &VoyageStatistics = &result.voyages[turn];
    let curve = |values: Vec<f64>| {
        voyages
            .times_s
            .iter()
            .zip(values)
            .map(|(t, v)| (t / 3600.0, v / NAUTICAL_MILE_M))
            .take_while(|(h, _)| *h <= long_h)
            .collect::<Vec<_>>()
    };
    let panel = |title: &str, which: usize, colour: usize| {
        Panel::new(title, Axis::new("position error", "nmi"))
            .series(Series::new("rms of all runs", curve(voyages.rms(which))).colour(colour))
            .series(
                Series::new(
                    "the greatest of all runs",
                    curve(voyages.greatest[which].clone()),
                )
                .line(Line::Dashed)
                .colour(colour),
            )
    };
    let turned = if turn_deg == 0.0 {
        "the ship lying as she was calibrated".to_owned()
    } else {
        format!("the ship turned by {turn_deg:.0} deg after calibration")
    };
    Figure::new(
        format!("position-{}-turn-{turn_deg:.0}-{long_h:.0}h", slug(&result.case.name())),
        format!("Position error in {long_h:.0} h, {}, {turned}", title(result.case)),
        hours(),
    )
    .x_range(0.0, long_h)
    .caption(format!(
        "Free-inertial navigation of {} IMUs with the errors of Table 1 after {} h of calibration, {turned}. Noise {}, seed {}.",
        voyages.runs.len(),
        campaign.plan.hours,
        result.case.reading.letter(),
        campaign.plan.seed
    ))
    .panel(panel("with compensation", 0, 0))
    .panel(panel("without compensation", 1, 1))
}

/// Whether a voyage figure is drawn for this simulation.
pub fn has_position_figure(simulation: Simulation) -> bool {
    matches!(simulation, Simulation::Static | Simulation::Xy)
}
