//! What the whole model has beyond drifts, biases and attitude: a table a group, and what stayed hidden.

use report::{Cell, Page, Table};
use rotary_sins_msgs::Calibration;
use sins::estimation::model;
use sins::estimation::state::StateLabel;

use super::estimates::NamedState;
use super::gather::GatheredRun;
use super::verdict::LIMIT_SIGMA;

/// A state whose 1 sigma has shrunk by a smaller share than this stayed hidden.
const HIDDEN: f64 = 0.05;

/// The groups: what they are called, and how the names of their states begin.
const GROUPS: [(&str, &[&str]); 8] = [
    (
        "Gyroscope scale factors and installation",
        &["gyroscope_scale_factor_", "gyroscope_installation_"],
    ),
    (
        "Accelerometer scale factors and installation",
        &["accelerometer_scale_factor_", "accelerometer_installation_"],
    ),
    (
        "Accelerometer quadratic coefficients",
        &["accelerometer_quadratic_"],
    ),
    (
        "Arms of the accelerometers from the table's centre",
        &["accelerometer_arm_"],
    ),
    ("Gyroscope g-sensitivity", &["gyroscope_g_sensitivity_"]),
    ("Delay of the accelerometers", &["accelerometer_delay_"]),
    ("Table and encoders", &["table_", "inner_axis_", "encoder_"]),
    ("Vertical channel", &["height_error_", "velocity_error_up_"]),
];

/// A state of a group at the end, SI.
#[derive(Clone, Debug)]
pub struct GroupState {
    /// Which one.
    pub label: &'static StateLabel,
    /// Estimate, 1 sigma, and 1 sigma before.
    pub state: NamedState,
    /// The truth, where the bag has it.
    pub truth: Option<f64>,
}

impl GroupState {
    /// The share by which the 1 sigma has shrunk.
    fn learned(&self) -> Option<f64> {
        let prior = self.state.prior?;
        Some((1.0 - self.state.sigma / prior).max(0.0))
    }

    /// Whether it kept its prior.
    pub fn is_hidden(&self) -> bool {
        self.learned().is_some_and(|share| share < HIDDEN)
    }

    /// Estimate minus truth.
    fn error(&self) -> Option<f64> {
        Some(self.state.value - self.truth?)
    }
}

/// The groups that the newest estimate has, with their states.
pub fn groups(run: &GatheredRun) -> Vec<(&'static str, Vec<GroupState>)> {
    let truth = run.truth.calibration.as_ref();
    let state = |state: &NamedState| {
        let mut known = truth.into_iter().flat_map(Calibration::named_states);
        Some(GroupState {
            label: model::label(&state.name)?,
            truth: known.find(|(name, _)| *name == state.name).map(|(_, v)| v),
            state: state.clone(),
        })
    };
    GROUPS
        .into_iter()
        .map(|(title, beginnings)| {
            let belongs =
                |of: &&NamedState| beginnings.iter().any(|begins| of.name.starts_with(begins));
            let states = run.history.states.iter().filter(belongs);
            (title, states.filter_map(state).collect::<Vec<_>>())
        })
        .filter(|(_, states)| !states.is_empty())
        .collect()
}

/// Puts a section for every group on the page.
pub fn section(page: &mut Page, groups: &[(&'static str, Vec<GroupState>)]) {
    if groups.is_empty() {
        return;
    }
    page.section(2, "Groups of the whole model");
    for (title, states) in groups {
        page.section(3, *title);
        page.table(table(title, states));
    }
    let states = groups.iter().flat_map(|(_, states)| states);
    let hidden: Vec<&str> = states
        .filter(|state| state.is_hidden())
        .map(|state| state.label.words)
        .collect();
    page.paragraph(if hidden.is_empty() {
        "Every state of these groups was seen by record and scheme.".to_owned()
    } else {
        format!(
            "Neither record nor scheme shows: {}. They kept their prior: their estimates are not found.",
            hidden.join(", ")
        )
    });
}

fn table(title: &str, states: &[GroupState]) -> Table {
    let with_truth = states.iter().any(|state| state.truth.is_some());
    let mut header = vec!["state", "unit", "estimate", "1 sigma", "prior", "learned"];
    if with_truth {
        header.extend(["truth", "error", "error / sigma"]);
    }
    let mut table = Table::new(format!("{title} at the end."), header);
    for state in states {
        let label = state.label;
        let number = |value: Option<f64>| {
            Cell::number(
                value.map_or_else(String::new, |value| format!("{:.4}", value / label.scale)),
            )
        };
        let mut row = vec![
            Cell::text(format!("{} {}", label.symbol, label.words)),
            Cell::text(label.unit),
            number(Some(state.state.value)),
            number(Some(state.state.sigma)),
            number(state.state.prior),
            match state.learned() {
                Some(_) if state.is_hidden() => Cell::text("hidden"),
                Some(share) => Cell::number(format!("{:.0} %", 100.0 * share)),
                None => Cell::text(""),
            },
        ];
        if with_truth {
            let sigmas = state.error().map(|error| error / state.state.sigma);
            row.extend([number(state.truth), number(state.error())]);
            row.push(match sigmas {
                None => Cell::text(""),
                Some(sigmas) if sigmas.abs() <= LIMIT_SIGMA => {
                    Cell::number(format!("{sigmas:+.2}"))
                }
                Some(sigmas) => Cell::Bad(format!("{sigmas:+.2}")),
            });
        }
        table = table.row(row);
    }
    table
}
