//! The result as text.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets};
use sins::studies::allan::{confidence::NoiseType, fit::NOISES};

use super::{Report, coefficient_unit, deviation_unit, noise_name};
use crate::significant;

/// One value a noise and axis, in field units: value and sigma, or what it is less than.
pub(super) fn rows(report: &Report) -> Vec<[String; 6]> {
    let mut rows = Vec::new();
    for (k, axis) in report.axes.iter().enumerate() {
        for noise in NOISES {
            let unit = coefficient_unit(k, noise);
            let coefficient = axis.coefficient(noise);
            let number = |value: f64| significant(value / unit.in_si);
            let [value, std] = [coefficient.value, coefficient.std];
            rows.push([
                axis.name.replace('_', " "),
                noise_name(noise).to_owned(),
                value.map_or_else(|| "not seen".to_owned(), number),
                std.map_or_else(String::new, number),
                number(coefficient.upper),
                unit.name.to_owned(),
            ]);
        }
        if let Some(count) = axis.count {
            let unit = coefficient_unit(k, NoiseType::Quantization);
            rows.push([
                axis.name.replace('_', " "),
                "whole counts of".to_owned(),
                significant(count / unit.in_si),
                String::new(),
                String::new(),
                unit.name.to_owned(),
            ]);
        }
        let unit = deviation_unit(k);
        rows.push([
            axis.name.replace('_', " "),
            format!("least deviation, at {} s", significant(axis.least_tau_s)),
            significant(axis.least_deviation / unit.in_si),
            String::new(),
            String::new(),
            unit.name.to_owned(),
        ]);
    }
    rows
}

/// One line on what was looked at.
pub(super) fn extent(report: &Report) -> String {
    let mut line = format!(
        "{} samples at rest, {:.0} s at {:.2} Hz, stretches: {}",
        report.samples,
        report.duration_s,
        1.0 / report.interval_s,
        report.stretches
    );
    if report.turning_samples > 0 {
        let turning = report.turning_samples;
        write!(line, "; {turning} left out while the table turned").ok();
    }
    line
}

/// The result as text.
pub fn text(report: &Report) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(["", "", "value", "1 sigma", "at most", ""]);
    for column in [2, 3, 4] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for row in rows(report) {
        table.add_row(row);
    }
    format!("{table}\n{}", extent(report))
}
