//! Parameters that several nodes and the command line share: each is declared here once, in field units, with its place
//! in the settings of `sins`, whose default is its default.
//!
//! A parameter of one node alone stands in that node's `parameters.rs`. To add one is one call of a
//! [`ros_node::ParameterSet`]; `--help`, the parameter file, `docs/parameters.md` and, where the set is an option group of
//! `rotary-sins`, the option follow from it.

mod checkpoint;
mod filter;
mod groups;
mod input;
mod thresholds;
pub mod units;

pub use checkpoint::{CheckpointParameters, checkpoint};
pub use filter::{FilterParameters, VelocityReference, alignment, calibrating, filter, filter_of};
pub use input::{InputParameters, input};
pub use thresholds::{ThresholdParameters, thresholds};

use ros_node::ParameterSet;
use sins::table::Turntable;

/// Axes of the block.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Which axis of the block each joint turns about. That they differ is for [`Turntable::new`] to say.
pub fn axes() -> ParameterSet<Turntable> {
    ParameterSet::new("Table", Turntable::default())
        .choice(
            "outer_axis",
            &AXES,
            |s| &mut s.outer,
            "Axis of the block, at zero joint angles, that the outer joint turns about",
        )
        .choice(
            "inner_axis",
            &AXES,
            |s| &mut s.inner,
            "Axis of the block, at zero joint angles, that the inner joint turns about",
        )
}
