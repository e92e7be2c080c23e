//! The analysis of a scheme as text.

use comfy_table::{CellAlignment, Table, presets};
use sins::{
    simulation::NoiseReading,
    studies::{observability::stripped::RANK_TOLERANCE, paper::CALIBRATED},
};

use super::{
    Analysis,
    words::{dropped, rotations_line, spread_line},
};
use crate::significant;

/// The analysis as text.
pub fn text(analysis: &Analysis, noise: NoiseReading) -> String {
    let global = &analysis.global;
    let mut lines = vec![
        analysis.name.clone(),
        String::new(),
        "Global conditions".to_owned(),
        format!(
            "  distinct positions           {}: {}",
            global.positions.len(),
            global
                .positions
                .iter()
                .map(|p| p.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        ),
        format!(
            "  gyroscopes, four out of one plane      {}",
            spread_line(&global.gyroscopes)
        ),
        format!(
            "  accelerometers, four out of one plane  {}",
            spread_line(&global.accelerometers)
        ),
        format!(
            "  rotations about a horizontal axis      {}",
            rotations_line(global)
        ),
        String::new(),
        table_of_rotations(analysis).to_string(),
        String::new(),
        format!(
            "Stripped observability matrix, after every dwell of one cycle (a singular value counts above {RANK_TOLERANCE:e} of the largest)"
        ),
        table_of_ranks(analysis).to_string(),
        String::new(),
        "Degree of observability over the whole run: how many times better the measurements alone know a state than it was known before"
            .to_owned(),
        table_of_degrees(analysis).to_string(),
        String::new(),
        format!("Covariance bound, 1 sigma, noise {}", noise.letter()),
        table_of_bound(analysis).to_string(),
    ];
    if let Some(hidden) = analysis.ranks.last().filter(|r| !r.hidden.is_empty()) {
        let names = hidden.hidden.iter().map(|h| format!("  {}", h.words));
        let at = lines
            .iter()
            .position(|l| l.starts_with("Degree of"))
            .unwrap_or(lines.len());
        let mut block = vec!["Hidden to the end".to_owned()];
        block.extend(names);
        block.push(String::new());
        lines.splice(at..at, block);
    }
    lines.join("\n")
}

fn plain(header: &[&str], right_from: usize) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(right_from) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn table_of_rotations(analysis: &Analysis) -> Table {
    let mut table = plain(
        &["", "rotation", "about", "angle", "axis above the horizon"],
        3,
    );
    for rotation in &analysis.global.rotations {
        table.add_row([
            rotation.step.to_string(),
            format!("{} → {}", rotation.from, rotation.to),
            rotation.axis.to_string(),
            format!("{:+.1} deg", rotation.angle_rad.to_degrees()),
            format!("{:.1} deg", rotation.elevation_rad.to_degrees()),
        ]);
    }
    table
}

fn table_of_ranks(analysis: &Analysis) -> Table {
    let mut table = plain(
        &[
            "dwell",
            "position",
            "rank",
            "smallest kept",
            "largest dropped",
            "hidden",
        ],
        2,
    );
    for rank in &analysis.ranks {
        table.add_row([
            rank.dwell.to_string(),
            rank.position.clone(),
            format!("{} of {}", rank.rank, analysis.degrees.states.len()),
            format!("{:.1e}", rank.smallest_kept),
            dropped(rank.largest_dropped),
            rank.hidden.len().to_string(),
        ]);
    }
    table
}

fn table_of_degrees(analysis: &Analysis) -> Table {
    let mut table = plain(
        &[
            "state",
            "degree",
            "signal",
            "singular value",
            "sigma at the end",
            "unit",
        ],
        1,
    );
    let end = analysis.bound.last();
    for degree in &analysis.degrees.states {
        let label = degree.state;
        let singular = analysis.degrees.singular_value(label.name);
        let end = end.and_then(|point| point.sigma.value(label.name));
        table.add_row([
            format!("{} {}", label.symbol, label.words),
            format!("{:.3}", degree.degree),
            format!("{:.3e}", degree.signal),
            singular.map_or_else(String::new, |value| format!("{value:.3e}")),
            end.map_or_else(String::new, |sigma| significant(sigma / label.scale)),
            label.unit.to_owned(),
        ]);
    }
    table
}

fn table_of_bound(analysis: &Analysis) -> Table {
    let mut header = vec!["h".to_owned()];
    header.extend(
        CALIBRATED
            .iter()
            .map(|l| format!("{} {}", l.symbol, l.unit)),
    );
    let names: Vec<&str> = header.iter().map(String::as_str).collect();
    let mut table = plain(&names, 0);
    let half_hours = analysis.bound.iter().filter(|p| {
        p.time_s % 1800.0 == 0.0 || p.time_s == analysis.bound[analysis.bound.len() - 1].time_s
    });
    for point in half_hours {
        let mut row = vec![format!("{:.1}", point.time_s / 3600.0)];
        row.extend(CALIBRATED.iter().map(|label| {
            let sigma = point.sigma.value(label.name).unwrap_or(f64::NAN);
            significant(sigma / label.scale)
        }));
        table.add_row(row);
    }
    table
}
