//! `rotary-sins assurance`: how often a verdict is wrong, over drawn worlds inside the model and outside.

use std::path::PathBuf;

use analysis::assurance::{self, Plan};
use anyhow::ensure;
use clap::Args;
use sins::machines::self_calibration::ModelChoice;

use crate::{Outcome, output, progress::CountBar};

/// Options of `assurance`.
#[derive(Args)]
pub struct Options {
    /// Number of worlds; all kinds come in turn
    #[arg(long, default_value_t = 200, value_name = "N")]
    worlds: u64,
    /// Decides every world
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Model of the filter that is judged: whole or paper
    #[arg(long, default_value_t = ModelChoice::Whole)]
    model: ModelChoice,
    /// Page with the figures by kind and a picture
    #[arg(long, value_name = "FILE.html")]
    output: Option<PathBuf>,
    /// Replace what is there already under the name of the page
    #[arg(long)]
    force: bool,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

/// Runs the study. Reached where both rates are at most 1 %.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    ensure!(
        (1..=100_000).contains(&options.worlds),
        "--worlds is {}, expected 1 to 100000",
        options.worlds
    );
    if let Some(path) = &options.output {
        output::check(path, None, options.force)?;
    }
    let plan = Plan {
        worlds: options.worlds,
        seed: options.seed,
        model: options.model,
    };
    let command = format!(
        "rotary-sins assurance --worlds {} --seed {} --model {}",
        plan.worlds, plan.seed, plan.model
    );
    let bar = CountBar::new(
        "assurance {bar:32} {pos}/{len} worlds, {eta} left",
        plan.worlds,
    );
    let trials = assurance::run(&plan, &bar);
    drop(bar);
    let report = assurance::summarize(&plan, &trials, &command);
    if let Some(path) = &options.output {
        let page = assurance::page(&report, &trials)?;
        output::file(path, &page.to_html(), None)?;
    }
    if options.json {
        output::json(&report)?;
    } else {
        output::text_line(&assurance::text(&report))?;
    }
    let good = [report.false_assurance, report.false_alarm]
        .iter()
        .all(|rate| rate.fraction <= assurance::AT_MOST);
    Ok(if good {
        Outcome::Reached
    } else {
        Outcome::Missed
    })
}
