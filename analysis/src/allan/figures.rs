//! The curves as pictures.

use report::{Axis, Band, Figure, Line, Panel, Series};

use super::{AxisReport, Report, deviation_unit};

/// Deviations of gyroscopes and accelerometers against the averaging time, each axis with its band and the fitted noises.
pub fn figures(report: &Report) -> Vec<Figure> {
    [
        (0..3, "allan-gyroscopes", "Allan deviation of the gyroscopes"),
        (
            3..6,
            "allan-accelerometers",
            "Allan deviation of the accelerometers",
        ),
    ]
    .into_iter()
    .map(|(axes, id, title)| {
        let figure = Figure::new(id, title, Axis::new("averaging time", "s"))
            .log_x()
            .caption(format!(
                "Overlapping Allan deviation with its {:.0} % band, and the fitted noises together.",
                100.0 * report.confidence
            ));
        axes.fold(figure, |figure, k| {
            figure.panel(panel(report, k, &report.axes[k]))
        })
    })
    .collect()
}

fn panel(report: &Report, k: usize, axis: &AxisReport) -> Panel {
    let unit = deviation_unit(k);
    let points = |values: &[f64]| -> Vec<(f64, f64)> {
        let values = values.iter().map(|value| value / unit.in_si);
        report.tau_s.iter().copied().zip(values).collect()
    };
    let band = report
        .tau_s
        .iter()
        .zip(axis.lower.iter().zip(&axis.upper))
        .map(|(tau_s, (lower, upper))| (*tau_s, lower / unit.in_si, upper / unit.in_si))
        .collect();
    let name = axis.name.replace('_', " ");
    Panel::new(name, Axis::new("Allan deviation", unit.name))
        .log()
        .band(Band::new("band", band))
        .series(Series::new("measured", points(&axis.deviation)).line(Line::LinePoints))
        .series(
            Series::new("fitted", points(&axis.fitted))
                .line(Line::Dashed)
                .colour(1),
        )
}
