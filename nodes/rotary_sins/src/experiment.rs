//! `rotary-sins experiment`: the paper's experiment (its section 5) on simulated IMUs, through the machines that a ship would run.

use std::path::PathBuf;

use analysis::experiment::{self, Plan};
use anyhow::ensure;
use clap::Args;

use crate::{
    Outcome, output,
    progress::CountBar,
    scheme_options::{Reading, ShipOptions},
};

/// Options of `experiment`.
#[derive(Args)]
pub struct Options {
    /// Number of IMUs, all with the errors of Table 1, each with its own noise
    #[arg(long, default_value_t = 20, value_name = "N")]
    runs: u64,
    /// Samples of the IMU a second
    #[arg(long, default_value_t = 100.0, value_name = "HZ")]
    rate: f64,
    /// White noise of the sensors
    #[arg(long, value_enum, default_value = "D")]
    noise: Reading,
    /// Decides all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    ship: ShipOptions,
    /// Write a page with pictures to this file
    #[arg(long, value_name = "FILE.html")]
    output: Option<PathBuf>,
    /// Replace what is there already under the name of the page
    #[arg(long)]
    force: bool,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

impl Options {
    /// The command that gives the same again.
    fn command(&self) -> String {
        format!(
            "rotary-sins experiment --runs {} --rate {} --noise {} --seed {}{}",
            self.runs,
            self.rate,
            self.noise.reading().letter(),
            self.seed,
            self.ship.arguments()
        )
    }

    fn plan(&self) -> anyhow::Result<Plan> {
        ensure!(
            (1..=10_000).contains(&self.runs),
            "--runs is {}, expected 1 to 10000",
            self.runs
        );
        ensure!(
            (1.0..=1000.0).contains(&self.rate),
            "--rate is {}, expected 1 to 1000",
            self.rate
        );
        Ok(Plan {
            runs: self.runs,
            rate_hz: self.rate,
            noise: self.noise.reading(),
            seed: self.seed,
            ship: self.ship.settings()?,
        })
    }
}

/// Runs the experiment.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let plan = options.plan()?;
    if let Some(path) = &options.output {
        output::check(path, None, options.force)?;
    }
    let bar = CountBar::new(
        "experiment {bar:32} {pos}/{len} IMUs, {eta} left",
        plan.runs,
    );
    let trials = experiment::run(&plan, &bar)?;
    drop(bar);
    let report = experiment::summarize(&plan, &trials, &options.command());
    if let Some(path) = &options.output {
        let html = experiment::page(&report, &trials)?.to_html();
        output::file(path, &html, None)?;
        output::note(format!("page {}", path.display()));
    }
    if options.json {
        output::json(&report)?;
    } else {
        output::text_line(&experiment::text(&report))?;
    }
    Ok(if report.converged == trials.len() {
        Outcome::Reached
    } else {
        Outcome::Missed
    })
}
