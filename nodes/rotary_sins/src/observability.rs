//! `rotary-sins observability`: what a scheme can show of the errors, before anything is measured.

use analysis::observability::{Analysis, report, text};
use anyhow::ensure;
use clap::Args;
use sins::studies::observability::Setting;

use crate::{
    Outcome, output,
    scheme_options::{self, Reading, ShipOptions, TableOptions},
};

/// Options of `observability`.
#[derive(Args)]
pub struct Options {
    /// eight-position, eight-position-yz, static, paper-experiment, designed, or a YAML file
    #[arg(long, default_value = "eight-position", value_name = "NAME|FILE")]
    scheme: String,
    /// Length of the run, for degrees and bound
    #[arg(long, default_value_t = 4.0)]
    hours: f64,
    /// White noise of the sensors, for the bound
    #[arg(long, value_enum, default_value = "D")]
    noise: Reading,
    #[command(flatten)]
    ship: ShipOptions,
    #[command(flatten)]
    table: TableOptions,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

/// Prints the analysis of one scheme.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    ensure!(
        options.hours > 0.0 && options.hours <= 100.0,
        "--hours is {}, expected more than 0 and at most 100",
        options.hours
    );
    let scheme = scheme_options::scheme(&options.scheme)?;
    let program = scheme.program(options.table.table(&scheme)?)?;
    let setting = Setting {
        ship: options.ship.settings()?,
        duration_s: options.hours * 3600.0,
        noise: options.noise.reading().density(),
        ..Setting::default()
    };
    let analysis = Analysis::of(&program, &setting)?;
    if options.json {
        output::json(&report(&analysis))?;
    } else {
        output::text_line(&text(&analysis, options.noise.reading()))?;
    }
    Ok(Outcome::Reached)
}
