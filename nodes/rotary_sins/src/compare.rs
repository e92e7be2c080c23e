//! `rotary-sins compare`: the paper's simulations, reproduced and judged.

use std::{fs, path::PathBuf, time::Instant};

use analysis::compare::{self, Plan};
use anyhow::{Context, ensure};
use clap::Args;

use crate::{Outcome, output, progress::CountBar, scheme_options::ShipOptions};

/// Options of `compare`.
#[derive(Args)]
pub struct Options {
    /// Runs of every case of the Monte Carlo
    #[arg(long, default_value_t = 40, value_name = "N")]
    runs: u64,
    /// Length of every run
    #[arg(long, default_value_t = 4.0)]
    hours: f64,
    /// Samples of the IMU a second
    #[arg(long, default_value_t = 100.0, value_name = "HZ")]
    rate: f64,
    /// Decides all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    ship: ShipOptions,
    /// Leave out the navigation after calibration
    #[arg(long)]
    no_voyages: bool,
    /// Directory for report.html, figures.json, figures/*.csv, results.json and summary.txt
    #[arg(long, default_value = "target/compare", value_name = "DIR")]
    output: PathBuf,
    /// Write the results as JSON to standard output, instead of the summary
    #[arg(long)]
    json: bool,
}

impl Options {
    /// The command that gives the same again.
    fn command(&self) -> String {
        let mut command = format!(
            "rotary-sins compare --runs {} --hours {} --rate {} --seed {}",
            self.runs, self.hours, self.rate, self.seed
        );
        command += &self.ship.arguments();
        if self.no_voyages {
            command += " --no-voyages";
        }
        command
    }

    fn plan(&self) -> anyhow::Result<Plan> {
        ensure!(
            (1..=1_000_000).contains(&self.runs),
            "--runs is {}, expected 1 to 1000000",
            self.runs
        );
        ensure!(
            self.hours >= 0.1 && self.hours <= 100.0,
            "--hours is {}, expected 0.1 to 100",
            self.hours
        );
        ensure!(
            (1.0..=1000.0).contains(&self.rate),
            "--rate is {}, expected 1 to 1000",
            self.rate
        );
        let ship = self.ship.settings()?;
        ship.validate()?;
        Ok(Plan {
            runs: self.runs,
            hours: self.hours,
            rate_hz: self.rate,
            seed: self.seed,
            ship,
            voyages: !self.no_voyages,
        })
    }
}

/// Runs everything and writes the report.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let plan = options.plan()?;
    let directory = &options.output;
    let pictures = directory.join("figures");
    fs::create_dir_all(&pictures)
        .with_context(|| format!("output directory {}", pictures.display()))?;
    let template = "comparing {bar:32} {pos}/{len} runs, {eta} left  {wide_msg}";
    let bar = CountBar::new(template, plan.work());
    let started = Instant::now();
    let campaign = plan.run(&bar)?;
    drop(bar);
    let took = started.elapsed();
    let claims = compare::claims(&campaign);
    let command = options.command();
    let (page, figures) = compare::page(&campaign, &claims, &command)?;
    let write = |name: &str, text: String| {
        let path = directory.join(name);
        output::file(&path, &text, None)
    };
    write("report.html", page.to_html())?;
    for figure in &figures {
        write(&format!("figures/{}.csv", figure.id), figure.to_csv()?)?;
    }
    write("figures.json", serde_json::to_string(&figures)?)?;
    let results = compare::results(&campaign, &claims, &command);
    write("results.json", serde_json::to_string_pretty(&results)?)?;
    let text = compare::text(&campaign, &claims, &command);
    write("summary.txt", text.clone())?;
    if options.json {
        output::json(&results)?;
    } else {
        output::text_line(&text)?;
    }
    output::note(format!(
        "{} runs of {} h at {} Hz{} in {:.1} s; report {}",
        plan.runs * campaign.cases.len() as u64,
        plan.hours,
        plan.rate_hz,
        if plan.voyages {
            " and their voyages"
        } else {
            ""
        },
        took.as_secs_f64(),
        directory.join("report.html").display()
    ));
    Ok(Outcome::Reached)
}
