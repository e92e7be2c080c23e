//! The node: joint states in, motions and status out, four services.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Result;
use ros_node::{InputWatch, Level, Node, Publisher, Qos, Report};
use ros2_interfaces::sensor_msgs::JointState;
use ros2_interfaces::std_srvs::TriggerResponse;
use rotary_sins_msgs::SchemeStatus;
use rotary_sins_msgs::convert::{FromMessage, ToMessage};
use sins::table::JointSample;
use sins::table::scheme::Sequencer;
use sins::table::scheme::sequencer::{Command, Refused, State, Status};
use sins::time::Stamp;

use crate::parameters;
use crate::table::{Motion, News, Table};

const JOINT_STATES: &str = "turntable/joint_states";
/// Joint states taken at once.
const BATCH: usize = 256;
/// Time between two statuses where nothing changes \[s of the joint states' time\].
const STATUS_PERIOD_S: f64 = 1.0;
/// Joint states that stay away longer are told in the diagnostics.
const PATIENCE: Duration = Duration::from_secs(2);

/// What loop, services and diagnostics share.
#[derive(Clone)]
struct Shared {
    machine: Arc<Mutex<Machine>>,
    table: Table,
    arrival_timeout_s: f64,
    statuses: Publisher<SchemeStatus>,
}

struct Machine {
    sequencer: Sequencer,
    watch: InputWatch,
    published: Option<Status>,
    goal: GoalWatch,
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

    fn ingest(&self, message: &JointState) {
        let mut machine = self.machine();
        // A motion commanded before the table listens would be lost, so the scheme begins when it does.
        if machine.sequencer.state() == State::WaitingForTable && !self.table.listens() {
            return;
        }
        match JointSample::from_message(message) {
            Ok(sample) => {
                self.miss_result(&mut machine, &sample);
                let command = machine.sequencer.ingest(&sample);
                self.tell(&mut machine, command.as_ref());
            }
            Err(error) => machine.watch.refuse("cannot be read", error),
        }
    }

    /// Sends a command, logs what a person should know, publishes the status where it is news.
    fn tell(&self, machine: &mut Machine, command: Option<&Command>) {
        if let Some(command) = command {
            self.send(machine, command);
        }
        let faulty = machine.sequencer.state() == State::Fault;
        for note in machine.sequencer.take_notes() {
            if faulty {
                tracing::error!("{note}");
            } else {
                tracing::info!("{note}");
            }
        }
        let status = machine.sequencer.status();
        if machine
            .published
            .as_ref()
            .is_none_or(|last| is_news(last, &status))
        {
            self.statuses.publish(status.to_message());
            machine.published = Some(status);
        }
    }

    fn send(&self, machine: &mut Machine, command: &Command) {
        let goal = &mut machine.goal;
        goal.number += 1;
        goal.tracking_error_rad = 0.0;
        let is_motion = !command.trajectory.points.is_empty() && self.table.action().is_some();
        goal.due = is_motion.then(|| {
            let start = command.start.unwrap_or(machine.sequencer.status().stamp);
            let end = start.plus_nanos(command.trajectory.duration_nanos());
            end.plus_seconds(self.arrival_timeout_s)
        });
        self.table.send(Motion {
            number: goal.number,
            command: command.clone(),
        });
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
                self.arrival_timeout_s, target[0], target[1], actual[0], actual[1]
            );
            let command = machine.sequencer.table_failed(reason);
            self.tell(machine, command.as_ref());
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
                self.tell(&mut machine, command.as_ref());
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
        match request(&mut machine.sequencer) {
            Ok(command) => {
                self.tell(&mut machine, command.as_ref());
                TriggerResponse {
                    success: true,
                    message: done.to_owned(),
                }
            }
            Err(refused) => {
                tracing::warn!("{refused}");
                TriggerResponse {
                    success: false,
                    message: refused.to_string(),
                }
            }
        }
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
        if gaps > 0 {
            report = report.worsened(
                Level::Warn,
                &format!("{}, {gaps} gaps in the joint states", state.name()),
            );
        }
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
        if state == State::Fault {
            report = report.worsened(Level::Error, &status.message);
        }
        report
    }
}

fn is_news(last: &Status, status: &Status) -> bool {
    let what = |s: &Status| (s.state, s.cycle, s.step);
    what(last) != what(status)
        || last.message != status.message
        || status.stamp.seconds_since(last.stamp).abs() >= STATUS_PERIOD_S
}

/// Runs the node until it is told to end.
///
/// # Errors
/// A scheme or parameters that mean nothing, endpoints that cannot be created.
pub async fn main(node: Node) -> Result<()> {
    let given = parameters::settings(node.parameters())?;
    let (program, settings) = (given.program()?, given.sequencer);
    let (name, axes) = (program.name.clone(), program.table);
    let (table, driver) = Table::new(&node, &settings, given.uses_action)?;
    let mut joint_states = node.subscription::<JointState>(JOINT_STATES, Qos::sensor())?;
    let shared = Shared {
        machine: Arc::new(Mutex::new(Machine {
            sequencer: Sequencer::new(program, settings)?,
            watch: InputWatch::required(JOINT_STATES, PATIENCE),
            published: None,
            goal: GoalWatch::default(),
        })),
        table,
        arrival_timeout_s: settings.arrival_timeout_s,
        statuses: node.publisher("scheme/status", Qos::latched(100))?,
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
    if given.autostart {
        shared.request("started", |sequencer| sequencer.start().map(|()| None));
    }
    loop {
        let batch = tokio::select! {
            batch = joint_states.recv_batch(BATCH) => batch,
            () = node.shutdown() => return Ok(()),
        };
        shared.machine().watch.arrived(batch.len());
        for message in &batch {
            shared.ingest(message);
        }
    }
}

fn serve(node: &Node, shared: &Shared) -> Result<()> {
    type Ask = fn(&mut Sequencer) -> Result<Option<Command>, Refused>;
    let services: [(&str, &str, Ask); 4] = [
        ("~/start", "started", |sequencer| {
            sequencer.start().map(|()| None)
        }),
        ("~/pause", "paused", Sequencer::pause),
        ("~/resume", "resumed", |sequencer| {
            sequencer.resume().map(|()| None)
        }),
        ("~/abort", "aborted", |sequencer| {
            sequencer.abort().map(Some)
        }),
    ];
    for (name, done, ask) in services {
        let shared = shared.clone();
        node.serve_trigger_while_active(name, move || shared.request(done, ask))?;
    }
    Ok(())
}
