//! The analysis of a scheme as JSON.

use serde::Serialize;
use sins::studies::observability::{global::Spread, stripped::RANK_TOLERANCE};

use super::Analysis;

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
    state_names: Vec<&'static str>,
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
        state_names: analysis
            .degrees
            .states
            .iter()
            .map(|degree| degree.state.name)
            .collect(),
        singular_values: analysis
            .degrees
            .directions
            .iter()
            .map(|d| SingularReport {
                value: d.value,
                state: d.state.name,
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
