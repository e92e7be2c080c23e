//! The data of a figure as a table.

use std::io;

use csv::{IntoInnerError, Writer, WriterBuilder};

use crate::{Error, Figure};

/// What a row has of value, lower, upper.
type Values = [Option<f64>; 3];

/// One row a point: panels and series need not share their x.
pub(crate) fn long_form(figure: &Figure) -> Result<String, Error> {
    let mut out = WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    let x = figure.x.title();
    out.write_record([
        "panel", "kind", "series", &x, "value", "lower", "upper", "unit",
    ])?;
    for panel in &figure.panels {
        let name = if panel.title.is_empty() {
            &panel.y.label
        } else {
            &panel.title
        };
        let unit = &panel.y.unit;
        let mut row = |kind: &str, series: &str, x: Option<f64>, [value, lower, upper]: Values| {
            out.serialize((name, kind, series, x, value, lower, upper, unit))
        };
        for series in &panel.series {
            for &(x, y) in &series.points {
                row("series", &series.name, Some(x), [Some(y), None, None])?;
            }
        }
        for band in &panel.bands {
            for &(x, lower, upper) in &band.points {
                let edges = [None, Some(lower), Some(upper)];
                row("band", &band.name, Some(x), edges)?;
            }
        }
        for mark in &panel.vertical {
            row("vertical", &mark.label, Some(mark.at), [None; 3])?;
        }
        for mark in &panel.horizontal {
            row("horizontal", &mark.label, None, [Some(mark.at), None, None])?;
        }
    }
    finished(out)
}

fn finished(out: Writer<Vec<u8>>) -> Result<String, Error> {
    let bytes = out.into_inner().map_err(IntoInnerError::into_error)?;
    let text = String::from_utf8(bytes).map_err(io::Error::other)?;
    Ok(text)
}
