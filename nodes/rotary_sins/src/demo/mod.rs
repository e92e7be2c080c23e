//! `rotary-sins demo`: the whole suite at work. Starts the four nodes and a recorder as processes, runs a rotation scheme in
//! accelerated simulated time, shows where it stands, and holds the result against the truth.

mod fleet;
mod outcome;
mod progress;
mod report;
mod watch;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use ros2_interfaces::Interface;
use rotary_sins_msgs::interfaces::topics;
use sins::machines::self_calibration::ModelChoice;
use sins::simulation::SensorGrade;
use sins::table::scheme::Scheme;

use fleet::{Fleet, Program};
use outcome::DemoResult;
use progress::DemoBar;
use watch::Watch;

/// Simulated time after the end of the scheme, so that its end is seen by all \[s\].
const MARGIN_S: f64 = 2.0;
/// Time in which every node must have started and found the others.
const START: Duration = Duration::from_secs(60);
/// Time for the last samples to arrive everywhere after the simulator has ended.
const SETTLE: Duration = Duration::from_secs(10);
/// Samples that the middleware keeps for a process that the system does not let run: 4 s at 100 times real time.
const QUEUE_DEPTH: &str = "40000";
/// How often the state is looked at and shown.
const PERIOD: Duration = Duration::from_millis(100);

/// Options of the demo.
#[derive(Clone, Debug, clap::Args)]
pub struct Options {
    /// Length of the run in hours of simulated time
    #[arg(long, default_value_t = 4.0, value_name = "H")]
    hours: f64,
    /// Samples of the IMU in a second of simulated time
    #[arg(long, default_value_t = 100.0, value_name = "HZ")]
    rate: f64,
    /// Rotation scheme: a built-in name or a YAML file
    #[arg(long, default_value = "eight-position", value_name = "NAME|FILE")]
    scheme: String,
    /// Seed of the simulated noise
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u32,
    /// Sensor and table that are simulated: ideal, table-1, ring-laser, fibre-optic or mems
    #[arg(long, default_value = "ring-laser", value_name = "KIND")]
    sensor: String,
    /// Errors that are estimated: whole or paper
    #[arg(long, default_value = "whole", value_name = "MODEL")]
    model: ModelChoice,
    /// Multiple of real time
    #[arg(long, default_value_t = 100.0, value_name = "X")]
    speed: f64,
    /// Folder for bag, logs and report; made anew inside for every run
    #[arg(long, default_value = "target/demo", value_name = "DIR")]
    output: PathBuf,
    /// Record no bag
    #[arg(long)]
    no_record: bool,
}

impl Options {
    fn check(&self) -> Result<()> {
        ensure!(
            self.hours > 0.0 && self.hours <= 1000.0,
            "--hours is {}, expected more than 0 and at most 1000",
            self.hours
        );
        ensure!(
            (1.0..=1000.0).contains(&self.rate),
            "--rate is {}, expected 1 to 1000",
            self.rate
        );
        ensure!(
            self.speed > 0.0 && self.speed.is_finite(),
            "--speed is {}, expected more than 0",
            self.speed
        );
        SensorGrade::named(&self.sensor).context("--sensor")?;
        ensure!(
            Scheme::builtin(&self.scheme).is_some() || Path::new(&self.scheme).is_file(),
            "--scheme is {}, expected a file or one of {}",
            self.scheme,
            sins::table::scheme::BUILTIN_NAMES.join(", ")
        );
        Ok(())
    }

    fn duration_s(&self) -> f64 {
        self.hours * 3600.0
    }

    /// Samples that the simulator sends in all.
    fn samples(&self) -> u64 {
        ((self.duration_s() + MARGIN_S) * self.rate).round() as u64
    }
}

/// Runs the demo: reached where every estimate is within 4 sigma of the truth and nothing was lost; missed where it is not, and
/// after Ctrl-C.
///
/// # Errors
/// Arguments that make no sense, programs that are missing or end too early.
pub fn run(args: &Options) -> Result<crate::Outcome> {
    args.check()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("starting the runtime")?;
    let outcome = runtime.block_on(supervise(args));
    runtime.shutdown_timeout(Duration::from_millis(100));
    outcome
}

/// Where a run puts its files.
struct Folder {
    root: PathBuf,
    bag: Option<PathBuf>,
}

impl Folder {
    /// A new folder, named by the time.
    fn new(args: &Options) -> Result<Self> {
        let seconds = std::time::SystemTime::now()
            .duration_since(std::time::UNIX_EPOCH)
            .unwrap_or_default()
            .as_secs();
        let root = args
            .output
            .join(format!("{}-{seconds}", name_of(&args.scheme)));
        std::fs::create_dir_all(&root).with_context(|| format!("making {}", root.display()))?;
        let bag = (!args.no_record).then(|| root.join("bag"));
        Ok(Self { root, bag })
    }
}

/// The scheme's name without folder and ending.
fn name_of(scheme: &str) -> String {
    Path::new(scheme).file_stem().map_or_else(
        || scheme.to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    )
}

async fn supervise(args: &Options) -> Result<crate::Outcome> {
    let folder = Folder::new(args)?;
    let mut interrupt = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::interrupt())?;
    let mut terminate = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?;
    let mut fleet = Fleet::new(&folder.root);
    let outcome = tokio::select! {
        outcome = work(args, &folder, &mut fleet) => outcome.map(Some),
        _ = interrupt.recv() => Ok(None),
        _ = terminate.recv() => Ok(None),
    };
    // Whatever happened, nothing stays behind.
    let insisted = async {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    };
    let ended = fleet.end(insisted).await;
    let Some(work) = outcome? else {
        eprintln!(
            "interrupted; every process has been ended, logs are in {}",
            folder.root.display()
        );
        return Ok(crate::Outcome::Missed);
    };
    let processes = ended?;
    let outcome = DemoResult::new(args, work.seen, folder.bag.as_deref(), &processes)?;
    let text = report::text(
        &outcome,
        &report::DemoRun {
            wall: work.wall,
            processes: &processes,
            bag: folder.bag.as_deref(),
        },
    );
    println!("{text}");
    let path = folder.root.join("report.txt");
    crate::output::file(&path, &text, None)?;
    Ok(if outcome.is_good() {
        crate::Outcome::Reached
    } else {
        crate::Outcome::Missed
    })
}

/// What the run gave.
struct Work {
    seen: watch::Seen,
    wall: Duration,
}

async fn work(args: &Options, folder: &Folder, fleet: &mut Fleet) -> Result<Work> {
    let began = Instant::now();
    let watch = Watch::start()?;
    for program in programs(args, folder.bag.as_deref()) {
        fleet.start(&program)?;
    }
    let mut progress = DemoBar::new(args.duration_s());
    let mut period = tokio::time::interval(PERIOD);
    period.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        period.tick().await;
        let seen = watch.seen();
        progress.show(&seen, args, began.elapsed());
        if seen.scheme.is_none() && began.elapsed() > START {
            bail!(
                "nothing was heard of {} within {} s; logs are in {}",
                topics::SCHEME_STATUS.name,
                START.as_secs(),
                folder.root.display()
            );
        }
        if fleet.check()? {
            break;
        }
    }
    settle(&watch, args).await;
    progress.show(&watch.seen(), args, began.elapsed());
    progress.finish();
    let wall = began.elapsed();
    // Whoever still listens gets the end; the recorder ends last.
    let seen = watch.seen();
    watch.end().await;
    Ok(Work { seen, wall })
}

/// Waits until every consumer has told that it has all samples, and the calibration at the end has come.
async fn settle(watch: &Watch, args: &Options) {
    let deadline = Instant::now() + SETTLE;
    while Instant::now() < deadline && !watch.seen().is_complete(args.samples(), args.duration_s())
    {
        tokio::time::sleep(PERIOD).await;
    }
}

/// The processes: what runs first must hear everything, what sends comes last.
fn programs(args: &Options, bag: Option<&Path>) -> Vec<Program> {
    let parameter = |name: &str, value: String| ["-p".to_owned(), format!("{name}:={value}")];
    let node = |name: &str, parameters: Vec<[String; 2]>| Program {
        name: name.to_owned(),
        executable: name.to_owned(),
        arguments: std::iter::once("--ros-args".to_owned())
            .chain(parameters.into_iter().flatten())
            .collect(),
    };
    let mut programs = Vec::new();
    if let Some(bag) = bag {
        programs.push(Program {
            name: "recorder".to_owned(),
            executable: "rotary-sins".to_owned(),
            arguments: [
                "record",
                "--use-sim-time",
                "--depth",
                QUEUE_DEPTH,
                "--output",
            ]
            .map(str::to_owned)
            .into_iter()
            .chain([bag.display().to_string()])
            .chain(RECORDED.map(|topic| topic.within("")))
            .collect(),
        });
    }
    let recorders = usize::from(bag.is_some());
    let waits = [
        (topics::IMU_DATA_RAW.name, 2 + recorders),
        (topics::JOINT_STATES.name, 3 + recorders),
        (topics::JOINT_TRAJECTORY.name, 1),
        (topics::FIX.name, 2 + recorders),
        // The demo itself.
        (topics::TRUE_CALIBRATION.name, 1 + recorders),
    ]
    .map(|(topic, count)| format!("\"{topic}:{count}\""))
    .join(", ");
    programs.extend([
        node(
            "self_calibrator",
            vec![
                parameter("queue_depth", QUEUE_DEPTH.to_owned()),
                parameter("model", args.model.to_string()),
            ],
        ),
        node(
            "navigation_compensator",
            vec![
                parameter("queue_depth", QUEUE_DEPTH.to_owned()),
                parameter("output_rate_hz", "1.0".to_owned()),
                parameter("imu_output_rate_hz", "1.0".to_owned()),
                // The calibration comes from a node that may be some tens of seconds of simulated time behind.
                parameter("history_s", "300.0".to_owned()),
            ],
        ),
        node(
            "scheme_sequencer",
            vec![
                parameter("scheme", format!("'{}'", args.scheme)),
                parameter("stop_after_s", format!("{:?}", args.duration_s())),
                // The table is simulated.
                parameter("autostart", "true".to_owned()),
            ],
        ),
        node(
            "imu_simulator",
            vec![
                parameter("speed", format!("{:?}", args.speed)),
                parameter("duration_s", format!("{:?}", args.duration_s() + MARGIN_S)),
                parameter("imu_rate_hz", format!("{:?}", args.rate)),
                parameter("seed", args.seed.to_string()),
                parameter("sensor", args.sensor.clone()),
                parameter("velocity_aiding", "false".to_owned()),
                parameter("wait_for_subscribers", format!("[{waits}]")),
                parameter("wait_timeout_s", format!("{:?}", START.as_secs_f64())),
            ],
        ),
    ]);
    programs
}

/// Topics that the bag holds.
const RECORDED: [Interface; 10] = [
    topics::IMU_DATA_RAW.row(),
    topics::JOINT_STATES.row(),
    topics::JOINT_TRAJECTORY.row(),
    topics::FIX.row(),
    topics::SCHEME_STATUS.row(),
    topics::ESTIMATE.row(),
    topics::CALIBRATION.row(),
    topics::FIX_INS.row(),
    topics::UNCOMPENSATED_FIX_INS.row(),
    topics::TRUE_CALIBRATION.row(),
];

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser)]
    struct Alone {
        #[command(flatten)]
        options: Options,
    }

    /// Who says nothing sees a real sensor: a ring laser with errors that the paper's states do not hold, under the whole model.
    #[test]
    fn the_default_is_a_real_sensor_under_the_whole_model() {
        let options = Alone::parse_from(["demo"]).options;
        options.check().unwrap();
        assert_eq!(options.model, ModelChoice::Whole);
        let grade = SensorGrade::named(&options.sensor).unwrap();
        assert_eq!(grade, SensorGrade::RingLaser);
        let drawn = grade.draw(u64::from(options.seed));
        let errors = drawn.imu.errors;
        assert!(errors.gyroscope_matrix.norm() > 0.0);
        assert!(errors.accelerometer_quadratic.norm() > 0.0);
        assert!(drawn.table.nonorthogonality_rad != 0.0);
    }
}
