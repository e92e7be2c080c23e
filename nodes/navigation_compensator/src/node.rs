//! The node's task: takes messages from DDS as they come and publishes what they give.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ros_node::{Node, Publisher, Qos, Report, Subscription};
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use ros2_interfaces::tf2_msgs::TFMessage;
use rotary_sins_msgs::Calibration;

use crate::compensator::{Compensator, Output, SolutionMessages, topic};
use crate::instruments::Instruments;
use crate::parameters;

/// How often the inputs are looked at where no sample comes.
const TICK: Duration = Duration::from_millis(500);
/// Messages of a topic taken in one go, so that other inputs get their turn.
const BATCH: usize = 512;
/// Acknowledged messages that a writer keeps; what is not acknowledged yet it keeps anyway. Nobody gets them again, and at the rate
/// of the IMU they would be most of the node's memory.
const OUTPUT_DEPTH: usize = 100;
/// The same for the samples, for which the project promises as much.
const IMU_DEPTH: usize = 1000;

/// The compensator, shared by the task and the diagnostics.
#[derive(Clone)]
struct Shared(Arc<Mutex<Compensator>>);

impl Shared {
    // A panic ends the node, so that a poisoned lock is never worked with for long.
    fn lock(&self) -> MutexGuard<'_, Compensator> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Publishers of one solution.
struct SolutionPublishers {
    imu: Publisher<Imu>,
    odometry: Publisher<Odometry>,
    fix: Publisher<NavSatFix>,
    velocity: Publisher<TwistWithCovarianceStamped>,
}

impl SolutionPublishers {
    fn new(node: &Node, prefix: &str) -> ros_node::Result<Self> {
        Ok(Self {
            imu: node.publisher(&format!("{prefix}imu/data"), Qos::reliable(IMU_DEPTH))?,
            odometry: node.publisher(&format!("{prefix}odometry"), Qos::reliable(OUTPUT_DEPTH))?,
            fix: node.publisher(&format!("{prefix}fix_ins"), Qos::reliable(OUTPUT_DEPTH))?,
            velocity: node.publisher(&format!("{prefix}velocity"), Qos::reliable(OUTPUT_DEPTH))?,
        })
    }

    // Eight topics at the rate of the IMU: publishing what nobody hears would be most of the node's work.
    fn publish(&self, messages: SolutionMessages) {
        if let Some(imu) = messages.imu {
            self.imu.publish_if_heard(|| imu);
        }
        if let Some((odometry, fix, velocity)) = messages.navigation {
            self.odometry.publish_if_heard(|| odometry);
            self.fix.publish_if_heard(|| fix);
            self.velocity.publish_if_heard(|| velocity);
        }
    }
}

/// Runs until the node is to end.
///
/// # Errors
/// What the parameters or the middleware refuse.
pub async fn main(node: Node) -> anyhow::Result<()> {
    let given = parameters::settings(node.parameters())?;
    let shared = Shared(Arc::new(Mutex::new(Compensator::new(given.node()?)?)));
    let compensated = SolutionPublishers::new(&node, "")?;
    let uncompensated = SolutionPublishers::new(&node, "uncompensated/")?;
    let (frames, fixed_frames) = (
        node.publisher::<TFMessage>("/tf", Qos::reliable(OUTPUT_DEPTH))?,
        node.publisher::<TFMessage>("/tf_static", Qos::latched(1))?,
    );
    let instruments = Instruments::open(&given.instruments, node.clock().is_simulated())?
        .map(|instruments| Arc::new(Mutex::new(instruments)));
    if let Some(instruments) = &instruments {
        attend(&node, instruments);
    }
    let mut publish = |output: Output| {
        compensated.publish(output.compensated);
        uncompensated.publish(output.uncompensated);
        if let Some(transforms) = output.fixed_transforms {
            fixed_frames.publish(transforms);
        }
        if let Some(transforms) = output.transforms {
            frames.publish_if_heard(|| transforms);
        }
        if let Some((instruments, motion)) = instruments.as_ref().zip(output.motion) {
            locked(instruments).send(motion);
        }
    };
    let mut fixes: Subscription<NavSatFix> = node.subscription(topic::FIX, Qos::reliable(10))?;
    let depth = given.queue_depth();
    let mut joints: Subscription<JointState> =
        node.subscription(topic::JOINTS, Qos::reliable(depth))?;
    let mut calibrations: Subscription<Calibration> =
        node.subscription(topic::CALIBRATION, Qos::latched(1))?;
    let mut samples: Subscription<Imu> = node.subscription(topic::IMU, Qos::reliable(depth))?;
    watch(&node, &shared);
    node.set_ready();
    let mut ticks = tokio::time::interval(TICK);
    loop {
        // A joint state is worth waking up for only where a sample waits for it.
        let is_waiting = shared.lock().is_waiting();
        let (joint, sample) = tokio::select! {
            biased;
            () = node.shutdown() => {
                shared.lock().flush(&mut publish);
                return Ok(());
            }
            fix = fixes.recv() => {
                shared.lock().fix(&fix);
                continue;
            }
            calibration = calibrations.recv() => {
                shared.lock().calibration(&calibration);
                continue;
            }
            joint = joints.recv(), if is_waiting => (Some(joint), None),
            sample = samples.recv() => (None, Some(sample)),
            // Without samples, joint states are still to be seen.
            _ = ticks.tick() => (None, None),
        };
        {
            // Everything that is there at each wake-up; what the samples need comes first.
            let mut compensator = shared.lock();
            let rest = std::iter::from_fn(|| joints.try_recv()).take(BATCH);
            for message in joint.into_iter().chain(rest) {
                compensator.joints(&message, &mut publish);
            }
            let rest = std::iter::from_fn(|| samples.try_recv()).take(BATCH);
            for message in sample.into_iter().chain(rest) {
                compensator.imu(&message, &mut publish);
            }
        }
        // Where samples are always there, nobody else on this thread would get a turn.
        tokio::task::consume_budget().await;
    }
}

fn locked(instruments: &Mutex<Instruments>) -> MutexGuard<'_, Instruments> {
    instruments.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says void where solutions stay away, and reports on the outputs.
fn attend(node: &Node, instruments: &Arc<Mutex<Instruments>>) {
    let reported = instruments.clone();
    node.diagnostics()
        .add("nmea 0183", move || locked(&reported).report());
    let (clock, ticked) = (node.clock().clone(), instruments.clone());
    node.spawn(async move {
        let mut seconds = tokio::time::interval(Duration::from_secs(1));
        loop {
            seconds.tick().await;
            locked(&ticked).second(clock.now_nanos());
        }
    });
}

fn watch(node: &Node, shared: &Shared) {
    let add = |name: &str, report: fn(&Compensator) -> Report| {
        let shared = shared.clone();
        node.diagnostics().add(name, move || report(&shared.lock()));
    };
    add("imu samples", Compensator::imu_report);
    add("joint states", Compensator::joints_report);
    add("navigation", Compensator::navigation_report);
}
