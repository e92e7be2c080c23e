//! What the filter assumes: the parameters of the node `self_calibrator` as options.

use node_parameters::{FilterParameters, ThresholdParameters};
use ros_node::ParameterSet;
use sins::machines::self_calibration::{Settings, Thresholds};
use sins::table::Turntable;

use crate::parameter_options::{Given, Group};

/// Parameters of the filter; the axes of the table belong to the input.
#[derive(Clone, Debug)]
pub struct Filter;

impl Group for Filter {
    type Settings = FilterParameters;
    const HEADING: &'static str = "Filter";

    fn set() -> ParameterSet<FilterParameters> {
        node_parameters::filter().without(&["outer_axis", "inner_axis"])
    }
}

/// The same where the paper's thirteen states are the default.
#[derive(Clone, Debug)]
pub struct PaperFilter;

impl Group for PaperFilter {
    type Settings = FilterParameters;
    const HEADING: &'static str = "Filter";

    fn set() -> ParameterSet<FilterParameters> {
        node_parameters::filter_of(Settings::default()).without(&["outer_axis", "inner_axis"])
    }
}

/// Options of an alignment.
pub type AlignmentOptions = Given<PaperFilter>;

impl AlignmentOptions {
    /// The settings they amount to.
    pub fn machine(&self, turntable: Turntable) -> anyhow::Result<Settings> {
        self.settings()?.with_turntable(turntable).settings()
    }
}

/// Options of the filter.
pub type FilterOptions = Given<Filter>;

impl FilterOptions {
    /// The settings they amount to.
    pub fn machine(&self, turntable: Turntable) -> anyhow::Result<Settings> {
        self.settings()?.with_turntable(turntable).settings()
    }
}

/// Parameters of the thresholds.
#[derive(Clone, Debug)]
pub struct Convergence;

impl Group for Convergence {
    type Settings = ThresholdParameters;
    const HEADING: &'static str = "Converged below";

    fn set() -> ParameterSet<ThresholdParameters> {
        node_parameters::thresholds()
    }
}

/// When the estimate counts as found. Zero asks nothing.
pub type ThresholdOptions = Given<Convergence>;

impl ThresholdOptions {
    /// The thresholds they amount to.
    pub fn thresholds(&self) -> anyhow::Result<Thresholds> {
        Ok(self.settings()?.into())
    }
}
