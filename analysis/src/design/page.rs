//! The search as a page: what each goal costs in the others, and the schemes side by side.

use report::{Axis, Cell, Figure, Line, Page, Panel, Series, Table};

use super::Report;
use crate::Error;
use crate::words::{significant, slug};

/// The search as a page.
///
/// # Errors
/// Where a figure cannot be drawn.
pub fn page(report: &Report) -> Result<Page, Error> {
    let mut page = Page::new("Rotary SINS: schemes by search");
    page.subtitle(format!(
        "{} schemes, seed {}",
        report.evaluations, report.seed
    ));
    page.meta("command", &report.command)
        .meta("version", env!("CARGO_PKG_VERSION"));
    page.section(2, "Schemes");
    let header = ["scheme".to_owned(), "heading [deg]".to_owned()].into_iter();
    let goals = report
        .goals
        .iter()
        .map(|goal| format!("{} [{}]", goal.name, goal.unit));
    let mut table = Table::new(
        "Goals by heading, and each at its worst heading.",
        header.chain(goals).collect::<Vec<_>>(),
    );
    for scheme in &report.schemes {
        let rows = scheme
            .headings
            .iter()
            .map(|row| (format!("{:.0}", row.heading_deg), &row.values))
            .chain([("worst".to_owned(), &scheme.worst)]);
        for (heading, values) in rows {
            let cells = values.iter().map(|value| Cell::number(significant(*value)));
            let first = [Cell::text(&scheme.name), Cell::number(heading)];
            table = table.row(first.into_iter().chain(cells));
        }
    }
    page.table(table);
    page.section(2, "Rotations");
    page.list(
        report
            .schemes
            .iter()
            .map(|scheme| format!("{}: {}", scheme.name, scheme.rotations)),
    );
    page.section(2, "What one goal costs in another");
    page.note("Every point is a scheme at its worst heading that no other scheme of the search betters in every goal.");
    let is_time = |goal: usize| report.goals[goal].unit == "h";
    let (times, sigmas): (Vec<usize>, Vec<usize>) =
        (0..report.goals.len()).partition(|g| is_time(*g));
    for time in times {
        for sigma in &sigmas {
            page.figure(&front(report, time, *sigma))?;
        }
    }
    Ok(page)
}

/// The front of two goals as steps, and the compared schemes as points.
pub fn front(report: &Report, x: usize, y: usize) -> Figure {
    let mut points: Vec<(f64, f64)> = report
        .front
        .iter()
        .map(|one| (one.values[x], one.values[y]))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut lowest = f64::INFINITY;
    points.retain(|point| {
        let better = point.1 < lowest;
        lowest = lowest.min(point.1);
        better
    });
    let goal = |number: usize| &report.goals[number];
    let mut panel = Panel::new("", Axis::new(&goal(y).name, goal(y).unit))
        .series(Series::new("front of the search", points));
    for (number, scheme) in report.schemes.iter().enumerate() {
        let point = vec![(scheme.worst[x], scheme.worst[y])];
        panel = panel.series(
            Series::new(&scheme.name, point)
                .line(Line::Points)
                .colour(number + 1),
        );
    }
    let title = format!("{} against {}", goal(y).name, goal(x).name);
    Figure::new(slug(&title), title, Axis::new(&goal(x).name, goal(x).unit)).panel(panel)
}
