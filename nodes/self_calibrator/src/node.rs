//! The node's task: takes messages from DDS as they come and publishes what they give.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use checkpoint::Keeper;
use node_parameters::CheckpointParameters;
use ros_node::{Node, Published, Publisher, Purpose, Report, SENSOR_DEPTH, Subscription};
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::std_srvs::{TRIGGER, TriggerRequest, TriggerResponse};
use rotary_sins_msgs::interfaces::{services, topics};
use rotary_sins_msgs::{Calibration, CalibrationOutlook, SelfCalibrationEstimate};
use sins::machines::self_calibration::Reference;
use tokio::task::JoinHandle;

use crate::action::SelfCalibrate;
use crate::calibrator::{Calibrator, Output};
use crate::kept::{self, Kept};
use crate::parameters;
use crate::storage::{self, Errand};

/// How often samples are taken. Nothing that leaves here is in a hurry, and waking up for every sample costs several times as
/// much as the sample; the reader's cache holds `queue_depth` of them meanwhile.
const TICK: Duration = Duration::from_millis(10);
/// Samples taken in one go, so that other inputs get their turn.
const BATCH: usize = 2000;

/// Time to end a goal: it needs none.
const ENDING: Duration = Duration::from_secs(3);

/// The calibrator, shared by the task, the services and the diagnostics.
#[derive(Clone)]
struct Shared(Arc<Mutex<Calibrator>>);

impl Shared {
    // A panic ends the node, so that a poisoned lock is never worked with for long.
    fn lock(&self) -> MutexGuard<'_, Calibrator> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[derive(Clone)]
struct Publishers {
    estimate: Publisher<SelfCalibrationEstimate>,
    calibration: Publisher<Calibration>,
    outlook: Publisher<CalibrationOutlook>,
}

impl Publishers {
    fn publish(&self, output: Output) {
        if let Some(estimate) = output.estimate {
            self.estimate.publish(estimate).left_to_diagnostics();
        }
        self.publish_calibration(output.calibration);
    }

    fn publish_calibration(&self, calibration: Option<Calibration>) {
        if let Some(calibration) = calibration {
            self.calibration.publish(calibration).left_to_diagnostics();
        }
    }

    /// Publishes what a service was asked for, and says in its answer what became of it.
    fn answer(&self, answer: (TriggerResponse, Option<Calibration>)) -> TriggerResponse {
        let (response, calibration) = answer;
        match calibration {
            Some(calibration) => told(&response, self.calibration.publish(calibration)),
            None => response,
        }
    }
}

/// Runs until the node is to end.
///
/// # Errors
/// What the parameters or the middleware refuse.
pub async fn main(node: Node) -> anyhow::Result<()> {
    let given = parameters::settings(node.parameters())?;
    let settings = given.machine()?;
    let mut calibrator = Calibrator::new(&settings, &node.fully_qualified_name(), given.silence())?;
    calibrator.listen_as(&node)?;
    let shared = Shared(Arc::new(Mutex::new(calibrator)));
    let publishers = Publishers {
        estimate: node.publish_on(&topics::ESTIMATE)?,
        calibration: node.publish_on(&topics::CALIBRATION)?,
        outlook: node.publish_on(&topics::OUTLOOK)?,
    };
    // Positions are measurements as samples are: none may be lost where time runs fast.
    let mut fixes = node.subscribe_on(&topics::FIX)?;
    let depth = given.queue_depth();
    let mut joints = node.subscribe_on(&topics::JOINT_STATES.with_depth(depth))?;
    let mut scheme = node.subscribe_on(&topics::SCHEME_STATUS.with_depth(10))?;
    let mut scheme_files = node.subscribe_on(&topics::SCHEME_FILE)?;
    let mut velocities = match settings.reference {
        Reference::Measured { .. } => {
            Some(node.subscribe_on(&topics::AIDING_VELOCITY.with_depth(SENSOR_DEPTH))?)
        }
        _ => None,
    };
    let mut samples = node.subscribe_on(&topics::IMU_DATA_RAW.with_depth(depth))?;
    serve(&node, &shared, &publishers, &given.calibration_file)?;
    watch(&node, &shared);
    let mut keeper = keep(&given.checkpoint, &shared).await;
    let mut action = SelfCalibrate::new(&node)?;
    let mut endings = node.endings(ENDING);
    let mut changes = node.parameters().changes();
    node.set_ready();
    let mut looking_ahead: Option<JoinHandle<()>> = None;
    let mut ticks = tokio::time::interval(TICK);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        // What the samples need comes first; the samples themselves wait in the reader's cache meanwhile.
        tokio::select! {
            biased;
            ending = endings.next() => {
                action.shut_down(&mut shared.lock(), ending.purpose());
                // Who is cleaned up begins anew.
                if let (Purpose::CleanUp, Some(keeper)) = (ending.purpose(), &mut keeper) {
                    keeper.forget().await;
                }
                ending.done();
            }
            () = node.shutdown() => {
                // No lock is held while the file is written.
                let kept = shared.lock().keep();
                if let (Some(keeper), Some(kept)) = (&mut keeper, kept) {
                    keeper.keep_last(kept).await;
                }
                return Ok(());
            }
            changed = changes.changed() => {
                if changed.is_ok() {
                    let given = parameters::settings(node.parameters())?;
                    let goal = action.is_under_way();
                    shared.lock().change(given.thresholds(), given.silence(), goal);
                }
            }
            fix = fixes.recv() => shared.lock().fix(&fix),
            velocity = next(&mut velocities) => shared.lock().velocity(&velocity),
            status = scheme.recv() => {
                let calibration = shared.lock().scheme(&status);
                publishers.publish_calibration(calibration);
            }
            file = scheme_files.recv() => shared.lock().scheme.take_file(&file.data),
            _ = ticks.tick() => {
                {
                    let mut calibrator = shared.lock();
                    calibrator.publishers(samples.publishers());
                    action.take_requests(&mut calibrator);
                    while let Some(message) = joints.try_recv() {
                        calibrator.joints(&message);
                    }
                    let mut tell = |calibrator: &mut Calibrator, outputs: Vec<Output>| {
                        for output in outputs {
                            action.follow(calibrator, &output);
                            publishers.publish(output);
                        }
                    };
                    let outputs = calibrator.outputs();
                    tell(&mut calibrator, outputs);
                    for message in std::iter::from_fn(|| samples.try_recv()).take(BATCH) {
                        let outputs = calibrator.imu(&message);
                        tell(&mut calibrator, outputs);
                    }
                    publishers.publish_calibration(calibrator.tick());
                }
                look_ahead(&mut looking_ahead, &shared, &publishers);
                if let Some(keeper) = &mut keeper {
                    keep_when_due(keeper, &shared).await;
                }
            }
        }
    }
}

/// Has it worked out what the scheme will still bring, where that is due, beside this task: samples do not wait for it.
fn look_ahead(under_way: &mut Option<JoinHandle<()>>, shared: &Shared, publishers: &Publishers) {
    if under_way.as_ref().is_some_and(|work| !work.is_finished()) {
        return;
    }
    let asked = shared.lock().ask_ahead();
    *under_way = asked.map(|asked| {
        let outlook = publishers.outlook.clone();
        tokio::task::spawn_blocking(move || outlook.publish(asked.answer()).left_to_diagnostics())
    });
}

/// Goes on from the checkpoint, where there is one, and keeps the state from now on, where that is asked for.
async fn keep(parameters: &CheckpointParameters, shared: &Shared) -> Option<Keeper> {
    let path = parameters.path()?;
    if let Some(found) = checkpoint::find::<Kept>(kept::KIND, &path).await {
        shared.lock().wake_from(found, &path, parameters.oldest_s);
    }
    Some(Keeper::new(kept::KIND, &path, parameters.period()))
}

async fn keep_when_due(keeper: &mut Keeper, shared: &Shared) {
    let hurries = shared.lock().hurries;
    if !keeper.is_due(hurries).await {
        return;
    }
    let kept = {
        let mut calibrator = shared.lock();
        calibrator.kept = Some((keeper.written(), keeper.problem().map(str::to_owned)));
        let kept = calibrator.keep();
        calibrator.hurries &= kept.is_none();
        kept
    };
    if let Some(kept) = kept {
        keeper.keep(kept);
    }
}

/// The next message of a subscription that may not be there; never, where it is not.
async fn next(
    subscription: &mut Option<Subscription<TwistWithCovarianceStamped>>,
) -> TwistWithCovarianceStamped {
    match subscription {
        Some(subscription) => subscription.recv().await,
        None => std::future::pending().await,
    }
}

fn serve(
    node: &Node,
    shared: &Shared,
    publishers: &Publishers,
    calibration_file: &str,
) -> ros_node::Result<()> {
    serve_files(node, shared, publishers, &storage::path(calibration_file))?;
    let (calibrator, outputs) = (shared.clone(), publishers.clone());
    node.serve_trigger_while_active(&services::PUBLISH_CALIBRATION, move || {
        let asked = calibrator.lock().publish_request();
        outputs.answer(asked)
    })?;
    let calibrator = shared.clone();
    node.serve_trigger(&services::RESET, move || calibrator.lock().reset())
}

/// `~/save` and `~/load`, each in a task of its own that waits for the disk while everything else goes on.
fn serve_files(
    node: &Node,
    shared: &Shared,
    publishers: &Publishers,
    path: &Path,
) -> ros_node::Result<()> {
    let saving = node.service::<TriggerRequest, TriggerResponse>(services::SAVE.name, TRIGGER)?;
    let (calibrator, path_to) = (shared.clone(), path.to_owned());
    node.spawn(async move {
        let mut errand = Errand::default();
        loop {
            let (id, _) = saving.recv().await;
            let (latest, source) = calibrator.lock().to_save();
            let to = path_to.clone();
            let work = move || storage::save(&to, latest.as_ref(), &source);
            let answer = errand.run(&path_to, work).await;
            saving.respond(id, answer.unwrap_or_else(storage::refused));
        }
    });
    let loading = node.service::<TriggerRequest, TriggerResponse>(services::LOAD.name, TRIGGER)?;
    let (calibrator, outputs, path) = (shared.clone(), publishers.clone(), path.to_owned());
    let gate = node.clone();
    node.spawn(async move {
        let mut errand = Errand::default();
        loop {
            let (id, _) = loading.recv().await;
            if !gate.is_active() {
                loading.respond(id, storage::refused("the node is not active".to_owned()));
                continue;
            }
            let frame_id = calibrator.lock().frame_id().to_owned();
            let from = path.clone();
            let work = move || storage::load(&from, &frame_id);
            let answer = match errand.run(&path, work).await {
                Ok(loaded) => outputs.answer(loaded),
                Err(reason) => storage::refused(reason),
            };
            loading.respond(id, answer);
        }
    });
    Ok(())
}

/// The answer of a service that has something published: done where somebody gets it.
fn told(response: &TriggerResponse, published: Published) -> TriggerResponse {
    let message = format!("{}: {published}", response.message);
    let success = response.success && published.is_on_its_way();
    if !success {
        tracing::error!("{message}");
    }
    TriggerResponse { success, message }
}

fn watch(node: &Node, shared: &Shared) {
    let add = |name: &str, report: fn(&Calibrator) -> Report| {
        let shared = shared.clone();
        node.diagnostics().add(name, move || report(&shared.lock()));
    };
    add("imu samples", Calibrator::imu_report);
    add("self-calibration", Calibrator::estimate_report);
    add("joint states", Calibrator::joints_report);
    add("position", Calibrator::fix_report);
    add("velocity", Calibrator::velocity_report);
    add("checkpoint", Calibrator::checkpoint_report);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No service says that something was published which nobody gets.
    #[test]
    fn services_answer_by_what_was_published() {
        let response = || TriggerResponse {
            success: true,
            message: "calibration, phase converged".to_owned(),
        };
        for (published, success, words) in [
            (Published::Sent, true, ": published"),
            (Published::Kept, true, ": kept for later subscribers"),
            (Published::Unheard, false, "not published: nobody"),
            (Published::Inactive, false, "not published: the node"),
            (
                Published::Refused { dropped: 3 },
                false,
                "not published: the middleware refused it, 3",
            ),
        ] {
            let answer = told(&response(), published);
            assert_eq!(answer.success, success, "{}", answer.message);
            assert!(answer.message.contains(words), "{}", answer.message);
        }
        let refused = TriggerResponse {
            success: false,
            message: "no estimate yet".to_owned(),
        };
        assert!(!told(&refused, Published::Sent).success);
    }
}
