//! The node: joint states in, joint trajectories and status out, four services.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Result;
use ros_node::{InputWatch, Level, Node, Publisher, Qos, Report};
use rotary_sins_msgs::SchemeStatus;
use rotary_sins_msgs::sensor_msgs::JointState;
use rotary_sins_msgs::std_srvs::{TriggerRequest, TriggerResponse};
use rotary_sins_msgs::trajectory_msgs::JointTrajectory;
use sins::scheme::Sequencer;
use sins::scheme::sequencer::{Command, Refused, State, Status};
use sins::turntable::JointSample;

use crate::parameters;

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
    trajectories: Publisher<JointTrajectory>,
    statuses: Publisher<SchemeStatus>,
}

struct Machine {
    sequencer: Sequencer,
    watch: InputWatch,
    published: Option<Status>,
}

impl Shared {
    // Every change under the lock is a whole one, so a panic elsewhere leaves the machine usable.
    fn machine(&self) -> MutexGuard<'_, Machine> {
        self.machine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ingest(&self, message: &JointState) {
        let mut machine = self.machine();
        // A motion commanded before the table listens would be lost, so the scheme begins when it does.
        if machine.sequencer.state() == State::WaitingForTable
            && self.trajectories.subscriber_count() == 0
        {
            return;
        }
        match JointSample::try_from(message) {
            Ok(sample) => {
                let command = machine.sequencer.ingest(&sample);
                self.tell(&mut machine, command.as_ref());
            }
            Err(error) => machine.watch.refuse("cannot be read", error),
        }
    }

    /// Sends a command, logs what a person should know, publishes the status where it is news.
    fn tell(&self, machine: &mut Machine, command: Option<&Command>) {
        if let Some(command) = command {
            self.trajectories.publish(command.into());
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
            self.statuses.publish((&status).into());
            machine.published = Some(status);
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
        let mut report = Report::ok(state.name()).with("gaps in the joint states", gaps);
        if gaps > 0 {
            report = report.worsened(
                Level::Warn,
                &format!("{}, {gaps} gaps in the joint states", state.name()),
            );
        }
        if self.trajectories.subscriber_count() == 0 {
            report = report.worsened(
                Level::Warn,
                &format!("{}, and no table listens", state.name()),
            );
        }
        if state == State::Fault {
            report = report.worsened(Level::Error, &machine.sequencer.status().message);
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
    let (program, settings) = parameters::program(&node)?;
    let (name, table) = (program.name.clone(), program.table);
    let mut joint_states = node.subscription::<JointState>(JOINT_STATES, Qos::sensor())?;
    let shared = Shared {
        machine: Arc::new(Mutex::new(Machine {
            sequencer: Sequencer::new(program, settings)?,
            watch: InputWatch::required(JOINT_STATES, PATIENCE),
            published: None,
        })),
        trajectories: node.publisher("turntable/joint_trajectory", Qos::reliable(100))?,
        statuses: node.publisher("scheme/status", Qos::latched(100))?,
    };
    serve(&node, &shared)?;
    let (of_scheme, of_joints) = (shared.clone(), shared.clone());
    node.diagnostics().add("scheme", move || of_scheme.report());
    node.diagnostics()
        .add("joint states", move || of_joints.machine().watch.report());
    node.set_ready();
    tracing::info!(
        "scheme {name}, outer joint about {}, inner joint about {}",
        table.outer,
        table.inner
    );
    if node.parameter("autostart")? {
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
        node.serve(name, "std_srvs/srv/Trigger", move |_: TriggerRequest| {
            shared.request(done, ask)
        })?;
    }
    Ok(())
}
