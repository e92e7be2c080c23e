//! `rotary-sins report`: one page about one recorded run.

mod diagnostics;
mod estimates;
mod faults;
mod figures;
mod gather;
mod page;
mod scheme;
mod streams;
mod summary;
mod thin;
mod topics;
mod truth;
mod verdict;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;
use report::Verdict;

use crate::{
    Outcome,
    calibrate::Calibrator,
    filter_options::{FilterOptions, ThresholdOptions},
    output,
    sensor_input::SensorInput,
};
use figures::{Clock, Drawing};
use page::Head;
use verdict::End;

/// Options of `report`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    /// Page to write (default: beside the bag, with its name)
    #[arg(long, value_name = "FILE.html")]
    output: Option<PathBuf>,
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
    let bag = options.input.open()?;
    let path = match &options.output {
        Some(path) => path.clone(),
        None => beside(bag.path())?,
    };
    let mut settings = options.filter.settings(options.input.turntable()?)?;
    settings.thresholds = options.thresholds.thresholds();
    let mut run = gather::gather(&options.input, &bag, Calibrator::new(&settings)?)?;

    let (points, singles) = run.history.take_series();
    let joints = std::mem::take(&mut run.joints).finish();
    let (start, end_stamp) = run.span();
    let clock = Clock::new(start, end_stamp);
    let end = End::new(points.last(), &run);
    let findings = verdict::findings(&run, &end);
    let positions = run.tracks().each_ref().map(|track| track.points.points());
    let figures = Drawing {
        run: &run,
        thresholds: settings.thresholds,
        clock,
        points: &points,
        singles: &singles,
        joints: &joints,
        positions: &positions,
    }
    .figures();
    let head = Head {
        bag: &bag,
        command: &command(),
        clock,
        end: end_stamp,
    };
    let page = page::page(&head, &run, &end, &findings, &figures)?;
    fs::write(&path, page.to_html()).with_context(|| {
        format!(
            "{}: the page cannot be written (--output names another place)",
            path.display()
        )
    })?;
    if options.json {
        output::json(&summary::summary(
            &head,
            &run,
            &end,
            &findings,
            &figures,
            points.last(),
            &path,
        ))?;
    } else {
        let texts: Vec<_> = findings.iter().map(|f| f.text.as_str()).collect();
        output::text_line(&format!("{}\n{}", texts.join("; "), path.display()))?;
    }
    let is_good = findings.iter().all(|f| f.verdict != Verdict::Bad);
    Ok(if is_good {
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

/// The command line, so that a shell takes it again.
fn command() -> String {
    let quoted = |argument: String| {
        let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
        if !argument.is_empty() && argument.chars().all(plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', r"'\''"))
        }
    };
    std::iter::once("rotary-sins".to_owned())
        .chain(std::env::args().skip(1).map(quoted))
        .collect::<Vec<_>>()
        .join(" ")
}
