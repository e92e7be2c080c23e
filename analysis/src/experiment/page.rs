//! The experiment as a page.

use report::{Axis, Band, Figure, Line, Page, Panel, Series};
use sins::units::NAUTICAL_MILE_M;

use super::{HOURS, Kept, Report, SENSOR_STATES, Trial, sensor_states, text, true_errors};
use crate::Error;

/// The experiment as a page.
///
/// # Errors
/// Where a figure cannot be drawn.
pub fn page(report: &Report, trials: &[Trial]) -> Result<Page, Error> {
    let mut page = Page::new("Rotary SINS: the paper's experiment");
    page.subtitle("Sensors 2015, 15, 3154, section 5, on simulated IMUs");
    page.meta("command", &report.command)
        .meta("version", env!("CARGO_PKG_VERSION"));
    page.section(2, "Result").preformatted(text(report));
    page.note(
        "The paper's figures are those of its own ship, sensors and hours, which it does not give in full; ours are those of Table 1's errors at rest.",
    );
    page.section(2, "Estimates of the first IMU");
    for (id, title, states) in [
        ("biases", "Accelerometer biases", 0..3),
        ("drifts", "Gyroscope drifts", 3..SENSOR_STATES),
    ] {
        let mut figure = Figure::new(id, title, Axis::new("time", "h"))
            .x_range(0.0, HOURS)
            .caption("Estimate with ±3σ; the table turns from 0.7 h on.");
        for k in states {
            let label = &sensor_states()[k];
            let points = |of: &dyn Fn(&Kept) -> f64| {
                trials[0]
                    .history
                    .iter()
                    .map(|kept| (kept.time_s / 3600.0, of(kept) / label.scale))
                    .collect::<Vec<_>>()
            };
            let band = trials[0]
                .history
                .iter()
                .map(|kept| {
                    let three = 3.0 * kept.sigma[k];
                    (
                        kept.time_s / 3600.0,
                        (kept.value[k] - three) / label.scale,
                        (kept.value[k] + three) / label.scale,
                    )
                })
                .collect();
            figure = figure.panel(
                Panel::new("", Axis::new(label.symbol, label.unit))
                    .band(Band::new("±3σ", band))
                    .series(Series::new("estimate", points(&|kept| kept.value[k])).colour(2))
                    .horizontal(true_errors()[k] / label.scale, "truth")
                    .vertical(0.7, "rotation begins"),
            );
        }
        page.figure(&figure)?;
    }
    page.section(2, "Position error");
    let curves = |which: usize| {
        let tracks = trials.iter().map(|t| &t.track);
        tracks
            .map(|t| {
                let errors = [&t.compensated_m, &t.uncompensated_m][which];
                t.times_s
                    .iter()
                    .zip(errors)
                    .map(|(s, m)| (s / 3600.0, m / NAUTICAL_MILE_M))
                    .collect::<Vec<_>>()
            })
            .take(20)
            .collect::<Vec<_>>()
    };
    let mut figure = Figure::new(
        "position",
        "Position error after calibration",
        Axis::new("time", "h"),
    )
    .caption("Every line one IMU (the first twenty), at rest after calibration.");
    for (which, title) in [(0, "with compensation"), (1, "without compensation")] {
        let mut panel = Panel::new(title, Axis::new("position error", "nmi"));
        for points in curves(which) {
            panel = panel.series(
                Series::new("single IMUs", points)
                    .line(Line::Thin)
                    .colour(which),
            );
        }
        figure = figure.panel(panel);
    }
    page.figure(&figure)?;
    Ok(page)
}
