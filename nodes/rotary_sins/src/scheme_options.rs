//! Options that name a scheme, a table and a ship, as several commands take them.

use std::fmt::Write;

use anyhow::Context;
use clap::{Args, ValueEnum};
use sins::{
    simulation::{NoiseReading, Ship},
    table::scheme::{BUILTIN_NAMES, Scheme},
    table::{Axis, Turntable},
};

/// A scheme by its name, or from a file.
pub fn scheme(name: &str) -> anyhow::Result<Scheme> {
    if let Some(scheme) = Scheme::builtin(name) {
        return Ok(scheme);
    }
    let text = std::fs::read_to_string(name).with_context(|| {
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

/// Where the ship lies and how.
#[derive(Args, Clone, Copy)]
pub struct ShipOptions {
    /// Latitude of the ship
    #[arg(
        long,
        default_value_t = 45.78,
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    latitude_deg: f64,
    /// Longitude of the ship
    #[arg(
        long,
        default_value_t = 126.67,
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    longitude_deg: f64,
    /// Height of the ship above the ellipsoid
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "M",
        allow_negative_numbers = true
    )]
    height_m: f64,
    /// Heading of the y axis, clockwise from true north
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    heading_deg: f64,
    /// Roll, starboard down positive
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    roll_deg: f64,
    /// Pitch, bow up positive
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    pitch_deg: f64,
}

impl ShipOptions {
    /// The options that are not as by default, to be given again.
    pub fn arguments(&self) -> String {
        let options = [
            ("--latitude-deg", self.latitude_deg, 45.78),
            ("--longitude-deg", self.longitude_deg, 126.67),
            ("--height-m", self.height_m, 0.0),
            ("--heading-deg", self.heading_deg, 0.0),
            ("--roll-deg", self.roll_deg, 0.0),
            ("--pitch-deg", self.pitch_deg, 0.0),
        ];
        let mut text = String::new();
        for (name, value, default) in options {
            if value != default {
                write!(text, " {name} {value}").ok();
            }
        }
        text
    }

    /// The ship.
    pub fn ship(&self) -> Ship {
        Ship {
            latitude_rad: self.latitude_deg.to_radians(),
            longitude_rad: self.longitude_deg.to_radians(),
            height_m: self.height_m,
            heading_rad: self.heading_deg.to_radians(),
            roll_rad: self.roll_deg.to_radians(),
            pitch_rad: self.pitch_deg.to_radians(),
        }
    }
}

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
