//! Joint angles of a program, and position errors after calibration, against time.

use report::{Axis, Figure, Line, Panel, Series};
use sins::{table::scheme::Program, units::NAUTICAL_MILE_M};

use super::{hours, title};
use crate::{
    compare::{
        campaign::{Campaign, CaseResult},
        cases::Simulation,
        voyages::VoyageStatistics,
    },
    words::slug,
};

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
