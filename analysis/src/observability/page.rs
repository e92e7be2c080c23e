//! The analysis of a scheme as a section of a page.

use report::{Cell, Page, Table};
use sins::studies::observability::stripped::RANK_TOLERANCE;

use super::{
    Analysis,
    words::{dropped, rotations_line, spread_line},
};
use crate::words::{capital, significant};

/// What a scheme can show, as a section of a page.
pub fn section(page: &mut Page, level: u8, analysis: &Analysis) {
    page.section(level, capital(&analysis.name));
    let global = &analysis.global;
    let positions: Vec<_> = global.positions.iter().map(|p| p.name.as_str()).collect();
    page.key_values([
        (
            "distinct positions",
            format!("{}: {}", positions.len(), positions.join(", ")),
        ),
        (
            "four centres out of one plane, gyroscopes",
            spread_line(&global.gyroscopes),
        ),
        (
            "four centres out of one plane, accelerometers",
            spread_line(&global.accelerometers),
        ),
        ("rotations about a horizontal axis", rotations_line(global)),
    ]);
    let mut ranks = Table::new(
        format!(
            "Rank of the stripped observability matrix after every dwell of one cycle ({} states); a singular value counts above {RANK_TOLERANCE:e} of the largest.",
            analysis.degrees.states.len()
        ),
        [
            "dwell",
            "position",
            "rank",
            "smallest kept",
            "largest dropped",
            "still hidden",
        ],
    );
    for rank in &analysis.ranks {
        let hidden: Vec<_> = rank.hidden.iter().map(|h| h.words.as_str()).collect();
        ranks = ranks.row([
            Cell::number(rank.dwell.to_string()),
            Cell::text(&rank.position),
            Cell::number(rank.rank.to_string()),
            Cell::number(format!("{:.1e}", rank.smallest_kept)),
            Cell::number(dropped(rank.largest_dropped)),
            Cell::text(hidden.join("; ")),
        ]);
    }
    page.table(ranks);
    let mut degrees = Table::new(
        "Degree of observability over the whole run: how many times better the measurements alone know a state than it was known before (0: hidden).",
        [
            "state",
            "degree",
            "signal",
            "singular value",
            "bound at the end",
            "unit",
        ],
    );
    for degree in &analysis.degrees.states {
        let label = degree.state;
        let singular = analysis.degrees.singular_value(label.name);
        let end = analysis
            .bound
            .last()
            .and_then(|p| p.sigma.value(label.name));
        let end = end.unwrap_or(f64::NAN);
        degrees = degrees.row([
            Cell::text(format!("{} {}", label.symbol, label.words)),
            Cell::number(significant(degree.degree)),
            Cell::number(significant(degree.signal)),
            Cell::number(singular.map_or_else(String::new, significant)),
            Cell::number(significant(end / label.scale)),
            Cell::text(label.unit),
        ]);
    }
    page.table(degrees);
}
