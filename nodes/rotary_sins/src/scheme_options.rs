//! Options that name a scheme, a table and a ship, as several commands take them.

use anyhow::Context;
use clap::{Args, ValueEnum};
use ros_node::ParameterSet;
use sins::{
    simulation::{NoiseReading, Ship},
    table::scheme::{BUILTIN_NAMES, Scheme},
    table::{Axis, Turntable},
};

use crate::parameter_options::{Given, Group};

/// A scheme of ten thousand rotations is shorter \[bytes\].
const LONGEST_SCHEME: u64 = 4 << 20;

/// A scheme by its name, or from a file.
pub fn scheme(name: &str) -> anyhow::Result<Scheme> {
    if let Some(scheme) = Scheme::builtin(name) {
        return Ok(scheme);
    }
    let text = files::read_text(std::path::Path::new(name), LONGEST_SCHEME).with_context(|| {
        format!(
            "scheme {name}: neither one of {} nor a file",
            BUILTIN_NAMES.join(", ")
        )
    })?;
    Ok(Scheme::from_yaml(name, &text)?)
}

/// Axes of the table.
#[derive(Args, Clone, Copy)]
pub struct TableOptions {
    /// Axis of the block that the outer joint turns about (default: as the scheme needs it, x first)
    #[arg(long, value_name = "x|y|z", requires = "inner_axis")]
    outer_axis: Option<Axis>,
    /// Axis of the block that the inner joint turns about
    #[arg(long, value_name = "x|y|z", requires = "outer_axis")]
    inner_axis: Option<Axis>,
}

impl TableOptions {
    /// The table that was asked for, or the scheme's own.
    pub fn table(self, scheme: &Scheme) -> anyhow::Result<Turntable> {
        Ok(match self.outer_axis.zip(self.inner_axis) {
            Some((outer, inner)) => Turntable::new(outer, inner)?,
            None => scheme.default_table(),
        })
    }
}

/// Parameters of the ship, as the node `imu_simulator` has them.
#[derive(Clone, Debug)]
pub struct ShipGroup;

impl Group for ShipGroup {
    type Settings = Ship;
    const HEADING: &'static str = "Ship";

    fn set() -> ParameterSet<Ship> {
        imu_simulator::parameters::ship()
    }
}

/// Where the ship lies and how.
pub type ShipOptions = Given<ShipGroup>;

/// White noise of the sensors, by the two readings of the paper's '0.001 deg/h'.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Reading {
    /// 0.001 deg/√h and 10 ug/√Hz
    #[value(name = "D")]
    D,
    /// 0.001 deg/h/√Hz and 10 ug/√Hz
    #[value(name = "H")]
    H,
}

impl Reading {
    /// As the mathematics has it.
    pub fn reading(self) -> NoiseReading {
        match self {
            Self::D => NoiseReading::D,
            Self::H => NoiseReading::H,
        }
    }
}
