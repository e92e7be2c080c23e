//! What a scheme can show of the errors, before anything is measured.

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;
use sins::{
    estimation::error_state::{MISALIGNMENT, STATE_LABELS, STATE_NAMES, STATES},
    simulation::NoiseReading,
    studies::observability::{
        Setting,
        bound::{self, BoundPoint},
        degree::{self, Degrees},
        global::{GlobalConditions, Spread},
        stripped::{self, RANK_TOLERANCE, RankAfterDwell},
    },
    table::scheme::Program,
};

use crate::significant;

/// Everything that is known of a scheme on one table and one ship.
pub struct Analysis {
    /// Name of the scheme and its table.
    pub name: String,
    /// The paper's section 2.
    pub global: GlobalConditions,
    /// After every dwell of the first cycle.
    pub ranks: Vec<RankAfterDwell>,
    /// From the whole run.
    pub degrees: Degrees,
    /// Every minute.
    pub bound: Vec<BoundPoint>,
}

impl Analysis {
    /// Works all four parts.
    ///
    /// # Errors
    /// Where the setting is refused.
    pub fn of(program: &Program, setting: &Setting) -> Result<Self, sins::Error> {
        Ok(Self {
            name: format!(
                "{}, outer {} inner {}",
                program.name, program.table.outer, program.table.inner
            ),
            global: GlobalConditions::of(program, &setting.ship)?,
            ranks: stripped::ranks(program, &setting.ship, 1)?,
            degrees: degree::degrees(program, setting)?,
            bound: bound::bound(program, setting, 60)?,
        })
    }
}

/// The analysis as JSON.
#[derive(Serialize)]
pub struct Report {
    scheme: String,
    positions: Vec<PositionReport>,
    gyroscopes: SpreadReport,
    accelerometers: SpreadReport,
    two_horizontal_axes: bool,
    rotations: Vec<RotationReport>,
    rank_tolerance: f64,
    ranks: Vec<RankReport>,
    state_names: [&'static str; STATES],
    singular_values: Vec<SingularReport>,
    degrees: Vec<f64>,
    signals: Vec<f64>,
    bound_time_s: Vec<f64>,
    bound_sigma: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct PositionReport {
    name: String,
    outer_deg: f64,
    inner_deg: f64,
    earth_rate_direction: [f64; 3],
    specific_force_direction: [f64; 3],
}

#[derive(Serialize)]
struct SpreadReport {
    four_out_of_one_plane: bool,
    margin: f64,
    best_four: Vec<String>,
}

#[derive(Serialize)]
struct RotationReport {
    from: String,
    to: String,
    axis: String,
    angle_deg: f64,
    axis_east_north_up: [f64; 3],
    elevation_deg: f64,
    horizontal: bool,
}

#[derive(Serialize)]
struct RankReport {
    dwell: usize,
    position: String,
    rank: usize,
    smallest_kept: f64,
    largest_dropped: f64,
    hidden: Vec<String>,
}

#[derive(Serialize)]
struct SingularReport {
    value: f64,
    state: &'static str,
    direction_in_prior_sigmas: Vec<f64>,
}

/// The analysis as JSON.
pub fn report(analysis: &Analysis) -> Report {
    let spread = |s: &Spread| SpreadReport {
        four_out_of_one_plane: s.out_of_plane(),
        margin: s.margin,
        best_four: s.best.clone(),
    };
    let global = &analysis.global;
    Report {
        scheme: analysis.name.clone(),
        positions: global
            .positions
            .iter()
            .map(|p| PositionReport {
                name: p.name.clone(),
                outer_deg: p.joints[0].to_degrees(),
                inner_deg: p.joints[1].to_degrees(),
                earth_rate_direction: p.earth_rate.into(),
                specific_force_direction: p.specific_force.into(),
            })
            .collect(),
        gyroscopes: spread(&global.gyroscopes),
        accelerometers: spread(&global.accelerometers),
        two_horizontal_axes: global.has_two_horizontal_axes(),
        rotations: global
            .rotations
            .iter()
            .map(|r| RotationReport {
                from: r.from.clone(),
                to: r.to.clone(),
                axis: r.axis.to_string(),
                angle_deg: r.angle_rad.to_degrees(),
                axis_east_north_up: r.direction.into(),
                elevation_deg: r.elevation_rad.to_degrees(),
                horizontal: r.is_horizontal(),
            })
            .collect(),
        rank_tolerance: RANK_TOLERANCE,
        ranks: analysis
            .ranks
            .iter()
            .map(|r| RankReport {
                dwell: r.dwell,
                position: r.position.clone(),
                rank: r.rank,
                smallest_kept: r.smallest_kept,
                largest_dropped: r.largest_dropped,
                hidden: r.hidden.iter().map(|h| h.words.clone()).collect(),
            })
            .collect(),
        state_names: STATE_NAMES,
        singular_values: analysis
            .degrees
            .directions
            .iter()
            .map(|d| SingularReport {
                value: d.value,
                state: STATE_NAMES[d.state],
                direction_in_prior_sigmas: d.vector.as_slice().to_vec(),
            })
            .collect(),
        degrees: analysis.degrees.states.iter().map(|s| s.degree).collect(),
        signals: analysis.degrees.states.iter().map(|s| s.signal).collect(),
        bound_time_s: analysis.bound.iter().map(|p| p.time_s).collect(),
        bound_sigma: analysis
            .bound
            .iter()
            .map(|p| p.sigma.as_slice().to_vec())
            .collect(),
    }
}

/// One line on whether four centres lie out of one plane.
pub fn spread_line(spread: &Spread) -> String {
    if spread.out_of_plane() {
        format!(
            "met, margin {:.3} by {}",
            spread.margin,
            spread.best.join(", ")
        )
    } else if spread.best.len() < 4 {
        format!("not met: {} of four positions", spread.best.len())
    } else {
        format!(
            "not met: all centres in one plane, margin {:.1e}",
            spread.margin
        )
    }
}

/// One line on the axes that the rotations turn about.
pub fn rotations_line(global: &GlobalConditions) -> String {
    let horizontal = global
        .rotations
        .iter()
        .filter(|r| r.is_horizontal())
        .count();
    format!(
        "{horizontal} of {}; {}",
        global.rotations.len(),
        if global.has_two_horizontal_axes() {
            "two horizontal axes alternate"
        } else {
            "no two horizontal axes"
        }
    )
}

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
            format!("{} of {STATES}", rank.rank),
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
    for (state, label) in STATE_LABELS.iter().enumerate() {
        let degree = &analysis.degrees.states[state];
        let singular = analysis
            .degrees
            .directions
            .iter()
            .find(|d| d.state == state);
        table.add_row([
            format!("{} {}", label.symbol, label.words),
            format!("{:.3}", degree.degree),
            format!("{:.3e}", degree.signal),
            singular.map_or_else(String::new, |d| format!("{:.3e}", d.value)),
            end.map_or_else(String::new, |p| significant(p.sigma[state] / label.scale)),
            label.unit.to_owned(),
        ]);
    }
    table
}

fn table_of_bound(analysis: &Analysis) -> Table {
    let mut header = vec!["h".to_owned()];
    header.extend(
        STATE_LABELS[MISALIGNMENT..]
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
        row.extend(
            (MISALIGNMENT..STATES).map(|i| significant(point.sigma[i] / STATE_LABELS[i].scale)),
        );
        table.add_row(row);
    }
    table
}

/// A singular value that does not count; what is rounding is called so, for its digits mean nothing.
pub fn dropped(value: f64) -> String {
    if value < 1e-14 {
        "< 1e-14".to_owned()
    } else {
        format!("{value:.1e}")
    }
}
