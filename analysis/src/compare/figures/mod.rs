//! The pictures of `compare`.

mod consistency;
mod errors;
mod groups;
mod motion;

use report::Axis;
use sins::simulation::NoiseReading;

use super::{
    campaign::{Campaign, CaseResult},
    cases::Case,
};

pub use consistency::{heading_sweep, nees};
pub use errors::{errors, sigmas};
pub use groups::{GROUPS, threshold_applies};
pub use motion::{has_position_figure, joint_angles, position_error};

fn hours() -> Axis {
    Axis::new("time", "h")
}

/// A case without its noise, e.g. `x-y, outer x inner y`.
fn setting(case: Case) -> String {
    let name = case.name();
    name.split_once(' ')
        .map_or(name.as_str(), |(_, rest)| rest)
        .to_owned()
}

/// A case as headings have it, e.g. `x-y, outer x inner y, noise D`.
pub fn title(case: Case) -> String {
    format!("{}, noise {}", setting(case), case.reading.letter())
}

/// Seed, rate, heading, command: what makes a picture repeatable.
pub fn setting_line(case: Case, campaign: &Campaign) -> String {
    let plan = &campaign.plan;
    let reading = match case.reading {
        NoiseReading::D => "0.001 deg/√h",
        NoiseReading::H => "0.001 deg/h/√Hz",
    };
    format!(
        "Noise {} ({reading}, 10 ug/√Hz), heading {:.0} deg, {} Hz, seed {}.",
        case.reading.letter(),
        plan.ship.heading_rad.to_degrees(),
        plan.rate_hz,
        plan.seed
    )
}

/// Cases on their default tables.
pub fn default_cases(
    campaign: &Campaign,
    reading: NoiseReading,
) -> impl Iterator<Item = &CaseResult> {
    campaign
        .cases
        .iter()
        .filter(move |r| r.case.reading == reading && r.case.has_default_table())
}
