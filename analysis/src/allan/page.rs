//! The result as a page.

use report::{Cell, Page, Table};

use super::text::{extent, rows};
use super::{Report, figures, parameter_file};
use crate::Error;

/// The result as a page.
///
/// # Errors
/// Where a figure cannot be drawn.
pub fn page(report: &Report) -> Result<Page, Error> {
    let mut page = Page::new("Rotary SINS: noise of the sensors");
    page.subtitle(extent(report));
    page.meta("bag", &report.bag)
        .meta("command", &report.command)
        .meta("version", env!("CARGO_PKG_VERSION"));
    for warning in &report.warnings {
        page.note(warning);
    }
    page.section(2, "Noises");
    let mut table = Table::new(
        "Coefficients of IEEE 952. At most: value and two sigmas, or what would have been seen.",
        ["axis", "noise", "value", "1 sigma", "at most", "unit"],
    );
    for [axis, noise, value, std, upper, unit] in rows(report) {
        table = table.row([
            Cell::text(axis),
            Cell::text(noise),
            Cell::number(value),
            Cell::number(std),
            Cell::number(upper),
            Cell::text(unit),
        ]);
    }
    page.table(table);
    page.section(2, "Allan deviations");
    for figure in figures(report) {
        page.figure(&figure)?;
    }
    page.section(2, "Parameters of the nodes")
        .preformatted(parameter_file(report));
    Ok(page)
}
