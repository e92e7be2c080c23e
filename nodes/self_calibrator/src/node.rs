//! The node's task: takes messages from DDS as they come and publishes what they give.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ros_node::{Node, Publisher, Qos, Report, Subscription};
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use sins::machines::self_calibration::Reference;

use crate::action::SelfCalibrate;
use crate::calibrator::{Calibrator, Output, topic};
use crate::parameters;
use crate::storage;

/// How often samples are taken. Nothing that leaves here is in a hurry, and waking up for every sample costs several times as
/// much as the sample; the reader's cache holds `queue_depth` of them meanwhile.
const TICK: Duration = Duration::from_millis(10);
/// Samples taken in one go, so that other inputs get their turn.
const BATCH: usize = 2000;

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
}

impl Publishers {
    fn publish(&self, output: Output) {
        if let Some(estimate) = output.estimate {
            self.estimate.publish(estimate);
        }
        self.publish_calibration(output.calibration);
    }

    fn publish_calibration(&self, calibration: Option<Calibration>) {
        if let Some(calibration) = calibration {
            self.calibration.publish(calibration);
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
    let calibrator = Calibrator::new(&settings, &node.fully_qualified_name(), given.silence())?;
    let shared = Shared(Arc::new(Mutex::new(calibrator)));
    let publishers = Publishers {
        estimate: node.publisher(topic::ESTIMATE, Qos::latched(100))?,
        calibration: node.publisher(topic::CALIBRATION, Qos::latched(1))?,
    };
    let mut fixes: Subscription<NavSatFix> = node.subscription(topic::FIX, Qos::reliable(10))?;
    let depth = given.queue_depth();
    let mut joints: Subscription<JointState> =
        node.subscription(topic::JOINTS, Qos::reliable(depth))?;
    let mut scheme: Subscription<SchemeStatus> =
        node.subscription(topic::SCHEME, Qos::latched(10))?;
    let mut velocities: Option<Subscription<TwistWithCovarianceStamped>> = match settings.reference
    {
        Reference::Measured { .. } => Some(node.subscription(topic::VELOCITY, Qos::sensor())?),
        Reference::Moored { .. } => None,
    };
    let mut samples: Subscription<Imu> = node.subscription(topic::IMU, Qos::reliable(depth))?;
    serve(&node, &shared, &publishers, &given.calibration_file)?;
    watch(&node, &shared);
    let mut action = SelfCalibrate::new(&node)?;
    node.set_ready();
    let mut ticks = tokio::time::interval(TICK);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        // What the samples need comes first; the samples themselves wait in the reader's cache meanwhile.
        tokio::select! {
            biased;
            () = node.shutdown() => {
                action.shut_down(&mut shared.lock());
                return Ok(());
            }
            fix = fixes.recv() => shared.lock().fix(&fix),
            velocity = next(&mut velocities) => shared.lock().velocity(&velocity),
            status = scheme.recv() => {
                let calibration = shared.lock().scheme(&status);
                publishers.publish_calibration(calibration);
            }
            _ = ticks.tick() => {
                let mut calibrator = shared.lock();
                action.take_requests(&mut calibrator);
                while let Some(message) = joints.try_recv() {
                    calibrator.joints(&message);
                }
                for _ in 0..BATCH {
                    let Some(message) = samples.try_recv() else { break };
                    if let Some(output) = calibrator.imu(&message) {
                        action.follow(&mut calibrator, &output);
                        publishers.publish(output);
                    }
                }
                publishers.publish_calibration(calibrator.tick());
            }
        }
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
    let path = storage::path(calibration_file);
    let (calibrator, to) = (shared.clone(), path.clone());
    node.serve_trigger("~/save", move || calibrator.lock().save(&to))?;
    let (calibrator, outputs) = (shared.clone(), publishers.clone());
    node.serve_trigger_while_active("~/load", move || {
        let (response, calibration) = calibrator.lock().load(&path);
        outputs.publish_calibration(calibration);
        response
    })?;
    let (calibrator, outputs) = (shared.clone(), publishers.clone());
    node.serve_trigger_while_active("~/publish_calibration", move || {
        let (response, calibration) = calibrator.lock().publish_request();
        outputs.publish_calibration(calibration);
        response
    })?;
    let calibrator = shared.clone();
    node.serve_trigger("~/reset", move || calibrator.lock().reset())
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
}
