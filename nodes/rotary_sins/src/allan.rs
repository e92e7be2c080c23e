//! `rotary-sins allan`: the noise of the sensors from a bag at rest.

use std::ops::ControlFlow;
use std::path::PathBuf;

use analysis::allan::{self, Allan, AllanSettings};
use anyhow::Context;
use clap::Args;

use crate::{Outcome, output, sensor_input::SensorInput};

/// Options of `allan`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    /// Probability that the true deviation lies within a band
    #[arg(long, default_value_t = AllanSettings::default().confidence, value_name = "0..1")]
    confidence: f64,
    /// Write a page with pictures to this file
    #[arg(long, value_name = "FILE.html")]
    output: Option<PathBuf>,
    /// Also write every figure as SVG, and its data as CSV, into this folder
    #[arg(long, value_name = "DIRECTORY")]
    figures: Option<PathBuf>,
    /// Write the noise as parameters of `self_calibrator` and `navigation_compensator`
    #[arg(long, value_name = "FILE.yaml")]
    parameters: Option<PathBuf>,
    /// Replace what is there already under the name of the page or the parameters
    #[arg(long)]
    force: bool,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

/// Runs the whole bag through the analysis.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let bag = options.input.open()?;
    for file in [&options.output, &options.parameters].into_iter().flatten() {
        output::check(file, Some(bag.path()), options.force)?;
    }
    let settings = AllanSettings {
        confidence: options.confidence,
        ..AllanSettings::default()
    };
    let mut machine = Allan::new(settings)?;
    let notes = options.input.feed(&bag, "averaging", |sample, told| {
        if let Some(reading) = sample.reading() {
            machine.push(&reading)?;
        }
        while let Some(refused) = machine.poll_refused() {
            told.notes.refused(told.progress, told.topic, &refused);
        }
        Ok(ControlFlow::Continue(()))
    })?;
    let path = bag.path();
    let name = path.display().to_string();
    let result = machine.finish().with_context(|| name.clone())?;
    let said = notes.lines.len();
    let report = allan::report(&result, &settings, name, output::command(), notes.lines);
    for line in &report.warnings[said..] {
        output::note(line);
    }
    if let Some(file) = &options.output {
        output::file(file, &allan::page(&report)?.to_html(), Some(path))?;
    }
    if let Some(folder) = &options.figures {
        output::figures(&allan::figures(&report), folder)
            .with_context(|| folder.display().to_string())?;
    }
    if let Some(file) = &options.parameters {
        output::file(file, &allan::parameter_file(&report), Some(path))?;
    }
    if options.json {
        output::json(&report)?;
    } else {
        output::text_line(&allan::text(&report))?;
    }
    Ok(Outcome::Reached)
}
