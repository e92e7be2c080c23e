//! The node: joint states in, motions and status out, four services.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Result;
use checkpoint::Keeper;
use node_parameters::CheckpointParameters;
use ros_node::{Ending, InputWatch, Level, Node, Publisher, Purpose, Report};
use ros2_interfaces::sensor_msgs::JointState;
use ros2_interfaces::std_msgs;
use ros2_interfaces::std_srvs::{TriggerRequest, TriggerResponse};
use rotary_sins_msgs::SchemeStatus;
use rotary_sins_msgs::convert::{FromMessage, ToMessage};
use rotary_sins_msgs::interfaces::services;
use rotary_sins_msgs::interfaces::topics::{JOINT_STATES, SCHEME_FILE, SCHEME_STATUS};
use sins::table::JointSample;
use sins::table::scheme::sequencer::{
    Command, Refused, SequencerSettings, Snapshot, State, Status,
};
use sins::table::scheme::{Program, Sequencer};
use sins::time::Stamp;

use crate::kept::{self, Waking, Woken};
use crate::parameters;
use crate::stopping::{self, Stopping};
use crate::table::{Motion, News, Table};

/// Joint states taken at once.
const BATCH: usize = 256;
/// Time between two statuses where nothing changes \[s of the joint states' time\].
const STATUS_PERIOD_S: f64 = 1.0;
/// How often a table that is being stopped is looked at where it tells nothing.
const LOOK: Duration = Duration::from_millis(100);
/// Joint states that stay away longer are told in the diagnostics.
const PATIENCE: Duration = Duration::from_secs(2);

/// What loop, services and diagnostics share.
#[derive(Clone)]
struct Shared {
    machine: Arc<Mutex<Machine>>,
    table: Table,
    settings: SequencerSettings,
    statuses: Publisher<SchemeStatus>,
    file: Publisher<std_msgs::String>,
    /// The scheme with what the parameters have instead of its own, as the text of a file.
    text: Arc<str>,
}

struct Machine {
    sequencer: Sequencer,
    watch: InputWatch,
    published: Option<Status>,
    /// The scheme has been told.
    is_told: bool,
    goal: GoalWatch,
    /// A sequencer that waits for the first joint states.
    waking: Option<Waking>,
    /// Start with the first joint state that says that there is nothing to go on with.
    starts: bool,
    /// The state has changed so that it should be kept now.
    hurries: bool,
    /// How often the state has been kept, and why it could not be the last time; none where nobody keeps it.
    kept: Option<(u64, Option<String>)>,
}

/// The motion that was commanded last, where motions are goals.
#[derive(Default)]
struct GoalWatch {
    number: u64,
    /// By when, by the stamps of the joint states, the table must have told its result.
    due: Option<Stamp>,
    tracking_error_rad: f64,
}

impl Shared {
    // Every change under the lock is a whole one, so a panic elsewhere leaves the machine usable.
    fn machine(&self) -> MutexGuard<'_, Machine> {
        self.machine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands back what was read.
    fn ingest(&self, message: &JointState) -> Option<JointSample> {
        let mut machine = self.machine();
        if machine.waking.is_some()
            && let Ok(sample) = JointSample::from_message(message)
        {
            self.wake(&mut machine, &sample);
            // Until then nothing is said of where the scheme stands.
            if machine.waking.is_some() {
                return Some(sample);
            }
        }
        // A motion commanded before the table listens would be lost, so the scheme begins when it does.
        if machine.sequencer.state() == State::WaitingForTable && !self.table.listens() {
            return None;
        }
        match JointSample::from_message(message) {
            Ok(sample) => {
                self.miss_result(&mut machine, &sample);
                let command = machine.sequencer.ingest(&sample);
                self.tell_or_log(&mut machine, command.as_ref());
                Some(sample)
            }
            Err(error) => {
                machine.watch.refuse("cannot be read", error);
                None
            }
        }
    }

    /// Looks whether the sequencer that was kept goes on; where it does not, the scheme starts as the parameters say.
    fn wake(&self, machine: &mut Machine, sample: &JointSample) {
        let Some(waking) = &mut machine.waking else {
            return;
        };
        match waking.look(sample) {
            Woken::Waiting => return,
            Woken::GoesOn(sequencer, seconds) => {
                machine.sequencer = *sequencer;
                tracing::info!("goes on from the checkpoint after {seconds:.1} s");
            }
            Woken::Refused(path, why) => {
                checkpoint::put_aside(&path, &why);
                self.start(machine);
            }
        }
        machine.waking = None;
    }

    /// Starts, where the parameters say so. Else it says what it waits for: nothing moves because a process came up.
    fn start(&self, machine: &mut Machine) {
        if !machine.starts {
            tracing::info!("the scheme waits for a call of {}", services::START.name);
            self.tell_or_log(machine, None);
            return;
        }
        if let Err(refused) = machine.sequencer.start() {
            tracing::warn!("{refused}");
        }
        self.tell_or_log(machine, None);
    }

    /// Sends a command, logs what a person should know, publishes the status where it is news.
    ///
    /// # Errors
    /// Why the table does not hear of the command.
    fn tell(&self, machine: &mut Machine, command: Option<&Command>) -> Result<(), String> {
        let heard = command.map_or(Ok(()), |command| self.send(machine, command));
        let faulty = machine.sequencer.state() == State::Fault;
        for note in machine.sequencer.take_notes() {
            if faulty {
                tracing::error!("{note}");
            } else {
                tracing::info!("{note}");
            }
        }
        if !machine.is_told {
            let data = self.text.to_string();
            machine.is_told = self.file.publish(std_msgs::String { data }).is_on_its_way();
        }
        let status = machine.sequencer.status();
        if machine
            .published
            .as_ref()
            .is_none_or(|last| is_news(last, &status))
        {
            self.statuses
                .publish(status.to_message())
                .left_to_diagnostics();
            machine.hurries |= machine
                .published
                .as_ref()
                .is_none_or(|last| is_change(last, &status));
            machine.published = Some(status);
        }
        heard
    }

    /// As [`Self::tell`], where nobody waits for an answer: a command that the table does not hear of is in the log.
    fn tell_or_log(&self, machine: &mut Machine, command: Option<&Command>) {
        if let Err(reason) = self.tell(machine, command) {
            tracing::error!("the table does not hear of its motion: {reason}");
        }
    }

    fn send(&self, machine: &mut Machine, command: &Command) -> Result<(), String> {
        let goal = &mut machine.goal;
        goal.number += 1;
        goal.tracking_error_rad = 0.0;
        let is_motion = !command.trajectory.points.is_empty() && self.table.action().is_some();
        goal.due = is_motion.then(|| {
            let start = command.start.unwrap_or(machine.sequencer.status().stamp);
            let end = start.plus_nanos(command.trajectory.duration_nanos());
            end.plus_seconds(self.settings.arrival_timeout_s)
        });
        self.table.send(Motion {
            number: goal.number,
            command: command.clone(),
        })
    }

    /// A fault where the table has not told in time how the motion ended.
    fn miss_result(&self, machine: &mut Machine, sample: &JointSample) {
        let (Some(due), Some(action)) = (machine.goal.due, self.table.action()) else {
            return;
        };
        if sample.stamp > due {
            machine.goal.due = None;
            let target = machine.sequencer.status().target.map(f64::to_degrees);
            let actual = sample.position.map(f64::to_degrees);
            let reason = format!(
                "action {action}: no result {:.1} s after the end of the motion: target {:.4}, {:.4} deg, actual {:.4}, {:.4} deg",
                self.settings.arrival_timeout_s, target[0], target[1], actual[0], actual[1]
            );
            let command = machine.sequencer.table_failed(reason);
            self.tell_or_log(machine, command.as_ref());
        }
    }

    /// What the table tells of a motion; of one that another has replaced it does not matter.
    fn hear(&self, number: u64, news: News) {
        let mut machine = self.machine();
        if machine.goal.number != number {
            return;
        }
        match news {
            News::TrackingError(error_rad) => machine.goal.tracking_error_rad = error_rad,
            News::Arrived => machine.goal.due = None,
            News::Failed(reason) => {
                machine.goal.due = None;
                let command = machine.sequencer.table_failed(reason);
                self.tell_or_log(&mut machine, command.as_ref());
            }
        }
    }

    /// Answers a request.
    fn request(
        &self,
        done: &str,
        request: impl FnOnce(&mut Sequencer) -> Result<Option<Command>, Refused>,
    ) -> TriggerResponse {
        let mut machine = self.machine();
        // Who asks for something decides instead of the checkpoint.
        if let Some(waking) = machine.waking.take() {
            waking.put_aside("asked for something else before the first joint states");
        }
        match request(&mut machine.sequencer) {
            Ok(command) => match self.tell(&mut machine, command.as_ref()) {
                Ok(()) => TriggerResponse {
                    success: true,
                    message: done.to_owned(),
                },
                Err(reason) => {
                    tracing::error!("{done}, but the table does not hear of it: {reason}");
                    TriggerResponse {
                        success: false,
                        message: format!("{done}, but the table does not hear of it: {reason}"),
                    }
                }
            },
            Err(refused) => {
                tracing::warn!("{refused}");
                TriggerResponse {
                    success: false,
                    message: refused.to_string(),
                }
            }
        }
    }

    /// Stops the table, and lets the scheme wait for `~/resume` where the node may become active again. Where there is
    /// nothing to be stopped the ending has its answer at once.
    fn stop(&self, ending: Ending) -> Option<Stopping> {
        let mut machine = self.machine();
        let is_pause = ending.purpose() == Purpose::Deactivate;
        let stopped = if is_pause {
            machine.sequencer.pause()
        } else {
            machine.sequencer.abort().map(Some)
        };
        // Refused where nothing runs.
        let Ok(command) = stopped else {
            ending.done();
            return None;
        };
        let what = if is_pause {
            format!("paused until {}", services::RESUME.name)
        } else {
            "aborted".to_owned()
        };
        tracing::info!("the node {}: the scheme is {what}", ending.purpose().verb());
        let heard = self.tell(&mut machine, command.as_ref());
        // Before the first joint state nothing was commanded.
        let is_known = machine.sequencer.status().stamp != Stamp::default();
        if command.is_none() || !is_known || !self.table.listens() {
            ending.done();
            return None;
        }
        if let Err(reason) = heard {
            ending.failed(format!("the table cannot be told to stop: {reason}"));
            return None;
        }
        Some(Stopping::new(
            ending,
            self.settings.rate_tolerance_rad_s,
            self.settings.settling_s,
        ))
    }

    fn report(&self) -> Report {
        let machine = self.machine();
        let (state, gaps) = (machine.sequencer.state(), machine.sequencer.gaps());
        let status = machine.sequencer.status();
        let mut report = Report::ok(state.name())
            .with("scheme", &status.scheme)
            .with("cycle", status.cycle)
            .with(
                "step",
                format!("{} of {}", status.step, status.steps_per_cycle),
            )
            .with("position", &status.position)
            .with("gaps in the joint states", gaps);
        report = report.counted(
            Level::Warn,
            "gaps",
            gaps,
            &format!("{}, {gaps} gaps in the joint states", state.name()),
        );
        if let Some(action) = self.table.action() {
            let error = machine.goal.tracking_error_rad.to_degrees();
            report = report
                .with("action", action)
                .with("goal under way", machine.goal.due.is_some())
                .with("tracking error [deg]", format!("{error:.4}"));
        }
        if !self.table.listens() {
            report = report.worsened(
                Level::Warn,
                &format!("{}, and no table listens", state.name()),
            );
        }
        if let Some((written, problem)) = &machine.kept {
            report = report.with("checkpoints written", written);
            if let Some(problem) = problem {
                report = report.worsened(Level::Error, &format!("checkpoint: {problem}"));
            }
        }
        if state == State::Fault {
            report = report.worsened(Level::Error, &status.message);
        }
        report
    }
}

fn is_change(last: &Status, status: &Status) -> bool {
    let what = |s: &Status| (s.state, s.cycle, s.step);
    what(last) != what(status) || last.message != status.message
}

fn is_news(last: &Status, status: &Status) -> bool {
    is_change(last, status) || status.stamp.seconds_since(last.stamp).abs() >= STATUS_PERIOD_S
}

/// Runs the node until it is told to end.
///
/// # Errors
/// A scheme or parameters that mean nothing, endpoints that cannot be created.
pub async fn main(node: Node) -> Result<()> {
    let given = parameters::settings(node.parameters())?;
    let (scheme, program) = given.scheme_and_program()?;
    let settings = given.sequencer;
    let (name, axes) = (program.name.clone(), program.table);
    let (table, driver) = Table::new(&node, &settings, given.uses_action)?;
    let mut endings = node.endings(Duration::from_secs_f64(settings.arrival_timeout_s));
    let mut joint_states = node.subscribe_on(&JOINT_STATES)?;
    let shared = Shared {
        machine: Arc::new(Mutex::new(Machine {
            sequencer: Sequencer::new(program.clone(), settings)?,
            watch: InputWatch::required(JOINT_STATES.name, PATIENCE).of(&node)?,
            published: None,
            is_told: false,
            goal: GoalWatch::default(),
            waking: None,
            starts: given.autostart,
            hurries: false,
            kept: None,
        })),
        table,
        settings,
        statuses: node.publish_on(&SCHEME_STATUS)?,
        file: node.publish_on(&SCHEME_FILE)?,
        text: scheme.to_yaml().into(),
    };
    if let Some(driver) = driver {
        let shared = shared.clone();
        node.spawn(driver.run(move |number, news| shared.hear(number, news)));
    }
    serve(&node, &shared)?;
    let (of_scheme, of_joints) = (shared.clone(), shared.clone());
    node.diagnostics().add("scheme", move || of_scheme.report());
    node.diagnostics()
        .add("joint states", move || of_joints.machine().watch.report());
    node.set_ready();
    tracing::info!(
        "scheme {name}, outer joint about {}, inner joint about {}",
        axes.outer,
        axes.inner
    );
    let mut keeper = keep(&given.checkpoint, &shared, &program).await;
    {
        let mut machine = shared.machine();
        if machine.waking.is_none() {
            shared.start(&mut machine);
        }
    }
    let mut looks = tokio::time::interval(LOOK);
    looks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut under_way: Option<Stopping> = None;
    loop {
        let batch = tokio::select! {
            batch = joint_states.recv_batch(BATCH) => batch,
            ending = endings.next() => {
                // The scheme ends here, unless the node may become active again.
                let ends = ending.purpose() != Purpose::Deactivate;
                if let Some(keeper) = keeper.as_mut().filter(|_| ends) {
                    keeper.forget().await;
                }
                if ends {
                    keeper = None;
                }
                under_way = shared.stop(ending);
                continue;
            }
            // A table that is being stopped may fall silent.
            _ = looks.tick(), if under_way.is_some() => Vec::new(),
            () = node.shutdown() => {
                // Who is ended in order keeps nothing; here nothing could be put in order.
                if let Some(keeper) = &mut keeper {
                    keep_last(keeper, &shared).await;
                }
                return Ok(());
            }
        };
        if !batch.is_empty() {
            shared.machine().watch.arrived(batch.len());
        }
        let samples: Vec<JointSample> = batch
            .iter()
            .filter_map(|message| shared.ingest(message))
            .collect();
        if let Some(keeper) = &mut keeper {
            keep_when_due(keeper, &shared).await;
        }
        if let Some(stopping) = under_way.take() {
            under_way = match stopping.look(&samples, shared.table.listens()) {
                stopping::Progress::Waiting(stopping) => Some(stopping),
                stopping::Progress::Over => None,
            };
        }
    }
}

/// Waits to go on from the checkpoint, where there is one, and keeps the state from now on, where that is asked for.
async fn keep(
    parameters: &CheckpointParameters,
    shared: &Shared,
    program: &Program,
) -> Option<Keeper> {
    let path = parameters.path()?;
    if let Some(found) = checkpoint::find::<Snapshot>(kept::KIND, &path).await {
        let settings = shared.settings;
        match Waking::new(found, program, settings, &path, parameters.oldest_s) {
            Ok(waking) => {
                tracing::info!(
                    "checkpoint {}: waits for joint states to go on",
                    path.display()
                );
                shared.machine().waking = Some(waking);
            }
            Err(error) => checkpoint::put_aside(&path, &error.to_string()),
        }
    }
    Some(Keeper::new(kept::KIND, &path, parameters.period()))
}

async fn keep_when_due(keeper: &mut Keeper, shared: &Shared) {
    let hurries = shared.machine().hurries;
    if !keeper.is_due(hurries).await {
        return;
    }
    if let Some(snapshot) = snapshot(keeper, shared) {
        keeper.keep(snapshot);
    }
}

async fn keep_last(keeper: &mut Keeper, shared: &Shared) {
    let last = snapshot(keeper, shared);
    if let Some(last) = last {
        keeper.keep_last(last).await;
    }
}

/// What is to be kept; what waits to be gone on with is not written over.
fn snapshot(keeper: &Keeper, shared: &Shared) -> Option<Snapshot> {
    let mut machine = shared.machine();
    machine.kept = Some((keeper.written(), keeper.problem().map(str::to_owned)));
    if machine.waking.is_some() {
        return None;
    }
    machine.hurries = false;
    Some(machine.sequencer.snapshot())
}

fn serve(node: &Node, shared: &Shared) -> Result<()> {
    type Trigger = ros2_interfaces::Service<TriggerRequest, TriggerResponse>;
    type Ask = fn(&mut Sequencer) -> Result<Option<Command>, Refused>;
    let asks: [(Trigger, &str, Ask); 4] = [
        (services::START, "started", |sequencer| {
            sequencer.start().map(|()| None)
        }),
        (services::PAUSE, "paused", Sequencer::pause),
        (services::RESUME, "resumed", |sequencer| {
            sequencer.resume().map(|()| None)
        }),
        (services::ABORT, "aborted", |sequencer| {
            sequencer.abort().map(Some)
        }),
    ];
    for (service, done, ask) in asks {
        let shared = shared.clone();
        node.serve_trigger_while_active(&service, move || shared.request(done, ask))?;
    }
    Ok(())
}
