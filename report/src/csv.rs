//! The data of a figure as a table.

use std::borrow::Cow;
use std::fmt::Write;

use crate::Figure;

/// One row a point: panels and series need not share their x.
pub(crate) fn long_form(figure: &Figure) -> String {
    let mut out = String::new();
    let x = figure.x.title();
    row(
        &mut out,
        &[
            "panel", "kind", "series", &x, "value", "lower", "upper", "unit",
        ],
    );
    for panel in &figure.panels {
        let (name, unit) = (
            panel_name(&panel.title, &panel.y.label),
            panel.y.unit.as_str(),
        );
        for series in &panel.series {
            for &(x, y) in &series.points {
                row(
                    &mut out,
                    &[
                        name,
                        "series",
                        &series.name,
                        &number(x),
                        &number(y),
                        "",
                        "",
                        unit,
                    ],
                );
            }
        }
        for band in &panel.bands {
            for &(x, lower, upper) in &band.points {
                row(
                    &mut out,
                    &[
                        name,
                        "band",
                        &band.name,
                        &number(x),
                        "",
                        &number(lower),
                        &number(upper),
                        unit,
                    ],
                );
            }
        }
        for mark in &panel.vertical {
            row(
                &mut out,
                &[
                    name,
                    "vertical",
                    &mark.label,
                    &number(mark.at),
                    "",
                    "",
                    "",
                    unit,
                ],
            );
        }
        for mark in &panel.horizontal {
            row(
                &mut out,
                &[
                    name,
                    "horizontal",
                    &mark.label,
                    "",
                    &number(mark.at),
                    "",
                    "",
                    unit,
                ],
            );
        }
    }
    out
}

fn panel_name<'a>(title: &'a str, label: &'a str) -> &'a str {
    if title.is_empty() { label } else { title }
}

/// The shortest digits that give the same value again.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn row(out: &mut String, fields: &[&str]) {
    for (i, field) in fields.iter().enumerate() {
        let separator = if i == 0 { "" } else { "," };
        // Writing to a String cannot fail.
        let _ = write!(out, "{separator}{}", quoted(field));
    }
    out.push('\n');
}

/// RFC 4180.
fn quoted(field: &str) -> Cow<'_, str> {
    if field.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\"")).into()
    } else {
        field.into()
    }
}
