//! `rotary-sins report`: one page about one recorded run.

use std::path::{Path, PathBuf};

use analysis::{
    Error,
    run_report::{Request, RunReport},
};
use anyhow::Context;
use clap::Args;

use crate::{
    Outcome,
    filter_options::{FilterOptions, ThresholdOptions},
    output,
    progress::SecondsBar,
    sensor_input::SensorInput,
};

/// Options of `report`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    /// Page to write (default: beside the bag, with its name)
    #[arg(long, value_name = "FILE.html")]
    output: Option<PathBuf>,
    /// Also write every figure as SVG, and its data as CSV, into this folder
    #[arg(long, value_name = "DIRECTORY")]
    figures: Option<PathBuf>,
    /// Replace what is there already under the name of the page
    #[arg(long)]
    force: bool,
    /// Write the numbers behind the page as JSON to standard output, instead of the verdict
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    filter: FilterOptions,
    #[command(flatten)]
    thresholds: ThresholdOptions,
}

/// Reads the bag and writes the page.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let input = &options.input;
    let bag = input.open()?;
    let path = match &options.output {
        Some(path) => path.clone(),
        None => beside(bag.path())?,
    };
    output::check(&path, Some(bag.path()), options.force)
        .context("the page cannot be written (--output names another place)")?;
    let mut settings = options.filter.machine(input.turntable()?)?;
    settings.thresholds = options.thresholds.thresholds()?;
    let request = Request {
        bag: &bag,
        source: &input.source()?,
        settings: &settings,
        command: &output::command(),
        path: &path,
    };
    let progress = SecondsBar::new("reading", input.length_s(&bag));
    let report = RunReport::of(&request, &progress).map_err(|error| match error {
        // Only here is it known which option helps.
        Error::NoEstimate { source, .. } => {
            anyhow::Error::new(source).context(input.what_is_missing(&bag))
        }
        other => other.into(),
    })?;
    drop(progress);
    output::file(&path, &report.page.to_html(), Some(bag.path()))
        .context("the page cannot be written (--output names another place)")?;
    if let Some(folder) = &options.figures {
        output::figures(&report.figures, folder).with_context(|| folder.display().to_string())?;
    }
    if options.json {
        output::json(&report.summary)?;
    } else {
        output::text_line(&format!("{}\n{}", report.verdict(), path.display()))?;
    }
    Ok(if report.is_good() {
        Outcome::Reached
    } else {
        Outcome::Missed
    })
}

/// The page's place: the name of the bag with another ending.
fn beside(bag: &Path) -> anyhow::Result<PathBuf> {
    // A folder may be given as `.`.
    let whole = bag
        .canonicalize()
        .with_context(|| bag.display().to_string())?;
    let named = if bag.file_name().is_some() {
        bag
    } else {
        &whole
    };
    Ok(if whole.is_dir() {
        let mut name = named.file_name().unwrap_or_default().to_owned();
        name.push(".html");
        named.with_file_name(name)
    } else {
        named.with_extension("html")
    })
}
