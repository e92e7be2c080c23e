//! `rotary-sins design-scheme`: rotation schemes found by search.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use analysis::design::{self, Judged, Plan, Report};
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use sins::estimation::grade::GroupPriors;
use sins::machines::self_calibration::ModelChoice;
use sins::studies::design::{CHAINS, Criterion, Progress, Search};
use sins::studies::stretch::{Measurements, Physics, States};
use sins::table::scheme::{CableLimits, Scheme};
use sins::table::{Axis, Turntable};
use sins::units::ARC_SECOND;

use crate::{
    Outcome, output,
    progress::CountBar,
    scheme_options::{self, Reading},
};

/// A state of a search is shorter \[bytes\].
const LONGEST_STATE: u64 = 64 << 20;

/// How goals become one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CriterionChoice {
    /// The worst goal
    Minimax,
    /// Root of the weighted mean square
    A,
    /// The largest eigenvalue
    E,
}

/// Options of `design-scheme`.
#[derive(Args)]
pub struct Options {
    /// Decides the search
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Ends the search with the round in which so much time is over
    #[arg(long, default_value_t = 10.0, value_name = "M")]
    minutes: f64,
    /// Ends it after so many rounds: the same result on any machine
    #[arg(long, value_name = "N")]
    rounds: Option<u64>,
    /// What is asked: STATES=VALUE or STATES<LIMIT@HOURS, with *WEIGHT (default: the paper's constraints, bettered)
    #[arg(long = "goal", value_name = "GOAL")]
    goals: Vec<String>,
    /// How the goals of a heading become one number
    #[arg(long, value_enum, default_value = "minimax")]
    criterion: CriterionChoice,
    /// Rotations are multiples of this: 45 or 90
    #[arg(long, default_value_t = 90, value_name = "DEG")]
    step_deg: u16,
    /// Dwells to choose from, whole seconds
    #[arg(
        long,
        default_value = "500",
        value_delimiter = ',',
        value_name = "S,S,…"
    )]
    dwells_s: Vec<u32>,
    /// Fewest and most rotations of a cycle
    #[arg(
        long,
        default_value = "4,14",
        value_delimiter = ',',
        num_args = 1,
        value_name = "FEWEST,MOST"
    )]
    rotations: Vec<usize>,
    /// The cycle need not come back: the table rests in its last position
    #[arg(long)]
    open: bool,
    /// Cable of the outer joint
    #[arg(
        long,
        default_value = "-360,360",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_name = "MIN,MAX"
    )]
    outer_limits_deg: Vec<i32>,
    /// Cable of the inner joint
    #[arg(
        long,
        default_value = "-360,360",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_name = "MIN,MAX"
    )]
    inner_limits_deg: Vec<i32>,
    /// Rate of the table
    #[arg(long, default_value_t = 5.0)]
    rate_deg_per_s: f64,
    /// Its acceleration
    #[arg(long, default_value_t = 2.5)]
    acceleration_deg_per_s2: f64,
    /// Axis of the block that the outer joint turns about
    #[arg(long, default_value = "x", value_name = "x|y|z")]
    outer_axis: Axis,
    /// Axis of the block that the inner joint turns about
    #[arg(long, default_value = "y", value_name = "x|y|z")]
    inner_axis: Axis,
    /// Length of the run
    #[arg(long, default_value_t = 4.0)]
    hours: f64,
    /// Headings that the search looks at, round the compass (the result is held at 24)
    #[arg(long, value_name = "N")]
    headings: Option<usize>,
    /// Where the ship lies
    #[arg(long, default_value_t = 45.78)]
    latitude_deg: f64,
    /// White noise of the sensors
    #[arg(long, value_enum, default_value = "D")]
    noise: Reading,
    /// Which errors are estimated: paper (thirteen states) or whole (every group of a ring laser and its table)
    #[arg(long, default_value_t = ModelChoice::Paper)]
    model: ModelChoice,
    /// A group of the whole model that is left out, by the name of its prior
    #[arg(long = "without", value_name = "PRIOR")]
    without: Vec<String>,
    /// Sigma of a velocity measurement, one a second
    #[arg(long, default_value_t = 0.01)]
    velocity_sigma_m_s: f64,
    /// Measure position with this sigma
    #[arg(long, value_name = "M")]
    position_sigma_m: Option<f64>,
    /// Sigma of the mean heave's velocity (whole model; 0: not measured)
    #[arg(long, default_value_t = 0.01)]
    vertical_sigma_m_s: f64,
    /// Sigma of the encoders (whole model; 0: not measured)
    #[arg(long, default_value_t = 3.0)]
    encoder_sigma_arcsec: f64,
    /// Compare with this scheme as well
    #[arg(long = "compare", value_name = "NAME|FILE")]
    compare: Vec<String>,
    /// Write the best scheme to this file
    #[arg(long, value_name = "FILE.yaml")]
    output: Option<PathBuf>,
    /// Write a page with tables and pictures
    #[arg(long, value_name = "FILE.html")]
    page: Option<PathBuf>,
    /// Keep the search in this file after every round, and go on from there
    #[arg(long, value_name = "FILE.json")]
    resume: Option<PathBuf>,
    /// Write over the scheme file
    #[arg(long)]
    force: bool,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

/// What `--resume` keeps: a search goes on only with the plan that it began with.
#[derive(Serialize, Deserialize)]
struct Kept {
    plan: String,
    progress: Progress,
}

fn pair<T: Copy>(option: &str, values: &[T]) -> anyhow::Result<(T, T)> {
    match values {
        [first, second] => Ok((*first, *second)),
        _ => anyhow::bail!(
            "--{option} has {} numbers, expected two: MIN,MAX",
            values.len()
        ),
    }
}

impl Options {
    fn states(&self) -> anyhow::Result<States> {
        if self.model == ModelChoice::Paper {
            ensure!(self.without.is_empty(), "--without is for --model whole");
            return Ok(States::Paper);
        }
        let mut priors = serde_json::to_value(GroupPriors::default())?;
        for name in &self.without {
            let known: Vec<String> = GroupPriors::default()
                .named()
                .iter()
                .map(|(name, _)| (*name).to_owned())
                .collect();
            let prior = priors.get_mut(name).with_context(|| {
                format!("--without {name}: expected one of {}", known.join(", "))
            })?;
            *prior = 0.0.into();
        }
        Ok(States::Groups(serde_json::from_value(priors)?))
    }

    fn plan(&self) -> anyhow::Result<Plan> {
        ensure!(
            self.hours > 0.0 && self.hours <= 48.0,
            "--hours is {}, expected more than 0 and at most 48",
            self.hours
        );
        ensure!(
            self.minutes >= 0.0 && self.minutes <= 1e5,
            "--minutes is {}, expected 0 to 100000",
            self.minutes
        );
        let whole = self.model == ModelChoice::Whole;
        let measured = |sigma: f64| (whole && sigma != 0.0).then_some(sigma);
        Ok(Plan {
            physics: Physics {
                states: self.states()?,
                measurements: Measurements {
                    velocity_m_s: self.velocity_sigma_m_s,
                    velocity_up_m_s: measured(self.vertical_sigma_m_s),
                    position_m: self.position_sigma_m,
                    encoder_rad: measured(self.encoder_sigma_arcsec * ARC_SECOND),
                },
                noise: self.noise.reading().density(),
                latitude_rad: self.latitude_deg.to_radians(),
                table: Turntable::new(self.outer_axis, self.inner_axis)?,
                rate_rad_s: self.rate_deg_per_s.to_radians(),
                acceleration_rad_s2: self.acceleration_deg_per_s2.to_radians(),
            },
            step_deg: self.step_deg,
            limits_deg: [
                pair("outer-limits-deg", &self.outer_limits_deg)?,
                pair("inner-limits-deg", &self.inner_limits_deg)?,
            ],
            dwells_s: self.dwells_s.clone(),
            closed: !self.open,
            rotations: pair("rotations", &self.rotations)?,
            duration_s: self.hours * 3600.0,
            headings: self.headings.unwrap_or(if whole { 2 } else { 12 }),
            goals: self.goals.clone(),
            criterion: match self.criterion {
                CriterionChoice::Minimax => Criterion::Minimax,
                CriterionChoice::A => Criterion::A,
                CriterionChoice::E => Criterion::E,
            },
            seed: self.seed,
        })
    }
}

/// The command as it was given, for the report.
fn command() -> String {
    let own: Vec<String> = std::env::args().skip(1).collect();
    format!("rotary-sins {}", own.join(" "))
}

fn resumed(path: Option<&Path>, plan: &str) -> anyhow::Result<Progress> {
    let Some(path) = path.filter(|path| path.exists()) else {
        return Ok(Progress::default());
    };
    let name = || path.display().to_string();
    let text = files::read_text(path, LONGEST_STATE).with_context(name)?;
    let kept: Kept = serde_json::from_str(&text)
        .with_context(|| format!("{}: expected the state of a search", path.display()))?;
    ensure!(
        kept.plan == plan,
        "{}: it is the state of a search with other options, expected the same ones",
        path.display()
    );
    Ok(kept.progress)
}

/// The best scheme of a search, with its name.
fn best(search: &Search, progress: &Progress, plan: &Plan) -> anyhow::Result<Scheme> {
    let best = progress.best.first().context(
        "no scheme was found that keeps to the limits: give the cables more room, or more rotations",
    )?;
    let name = format!("designed-{}", plan.seed);
    let mut scheme = best
        .sequence
        .scheme(&name, search.catalogue(), search.rules());
    let [outer, inner] = plan
        .limits_deg
        .map(|(min, max)| (f64::from(min).to_radians(), f64::from(max).to_radians()));
    scheme.limits = CableLimits { outer, inner };
    Ok(scheme)
}

/// Searches, says what it found and writes it. Reached where every goal is met at every heading.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let plan = options.plan()?;
    if let Some(path) = &options.output {
        ensure!(
            options.force || !path.exists(),
            "{}: it is there already, and is replaced with --force alone",
            path.display()
        );
    }
    let compared: Vec<Scheme> = ["eight-position".to_owned()]
        .iter()
        .chain(&options.compare)
        .map(|name| scheme_options::scheme(name))
        .collect::<Result<_, _>>()?;
    let search = plan.search()?;
    // The whole plan, so that nothing of it is forgotten here.
    let words = format!("{plan:?}");
    let mut progress = resumed(options.resume.as_deref(), &words)?;
    let length = options.rounds.map_or(0, |rounds| rounds * CHAINS as u64);
    let bar = CountBar::new(
        "search {bar:32} {pos} chains of {len}, {elapsed}  {wide_msg}",
        length,
    );
    let start = Instant::now();
    let before = progress.evaluations;
    let budget = Duration::from_secs_f64(options.minutes * 60.0);
    let mut failed = None;
    let mut done = progress.rounds;
    design::run(&search, &mut progress, &bar, |progress| {
        if progress.rounds > done {
            done = progress.rounds;
            if let Some(path) = &options.resume {
                failed = keep(path, &words, progress).err();
            }
        }
        failed.is_none()
            && options.rounds.is_none_or(|rounds| progress.rounds < rounds)
            && (progress.rounds == 0 || start.elapsed() < budget)
    });
    drop(bar);
    if let Some(error) = failed {
        return Err(error);
    }
    let per_s = (progress.evaluations - before) as f64 / start.elapsed().as_secs_f64().max(1e-3);
    let found = best(&search, &progress, &plan)?;
    let judged: Vec<Judged> = std::iter::once(&found)
        .chain(&compared)
        .map(|scheme| plan.judge(scheme).map_err(anyhow::Error::from))
        .collect::<Result<_, _>>()?;
    let report = Report::new(&plan, &progress, &judged, command(), per_s)?;
    if let Some(path) = &options.output {
        let text = format!("# {}\n{}", report.command, found.to_yaml());
        output::file(path, &text, options.resume.as_deref())?;
    }
    if let Some(path) = &options.page {
        output::file(path, &design::page(&report)?.to_html(), None)?;
    }
    if options.json {
        output::json(&report)?;
    } else {
        output::text_line(&design::text(&report))?;
    }
    Ok(if report.reached {
        Outcome::Reached
    } else {
        Outcome::Missed
    })
}

fn keep(path: &Path, plan: &str, progress: &Progress) -> anyhow::Result<()> {
    let kept = Kept {
        plan: plan.to_owned(),
        progress: progress.clone(),
    };
    output::file(path, &serde_json::to_string(&kept)?, None)
}
