//! The node's task: takes messages from DDS as they come and publishes what they give.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ros_node::{Node, Publisher, Report, SENSOR_DEPTH, Subscription};
use ros2_interfaces::compass_interfaces::Azimuth;
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, NavSatFix};
use rotary_sins_msgs::interfaces::topics;

use crate::compensator::{Compensator, Output, SolutionMessages};
use crate::instruments::Instruments;
use crate::parameters;
use sins::machines::self_calibration::Reference;

/// How often the inputs are looked at where no sample comes.
const TICK: Duration = Duration::from_millis(500);
/// Messages of a topic taken in one go, so that other inputs get their turn.
const BATCH: usize = 512;
/// Time for the samples that wait for their joint states: they go on without.
const ENDING: Duration = Duration::from_secs(3);

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
    fn compensated(node: &Node) -> ros_node::Result<Self> {
        Ok(Self {
            imu: node.publish_on(&topics::IMU_DATA)?,
            odometry: node.publish_on(&topics::ODOMETRY)?,
            fix: node.publish_on(&topics::FIX_INS)?,
            velocity: node.publish_on(&topics::VELOCITY)?,
        })
    }

    fn uncompensated(node: &Node) -> ros_node::Result<Self> {
        Ok(Self {
            imu: node.publish_on(&topics::UNCOMPENSATED_IMU_DATA)?,
            odometry: node.publish_on(&topics::UNCOMPENSATED_ODOMETRY)?,
            fix: node.publish_on(&topics::UNCOMPENSATED_FIX_INS)?,
            velocity: node.publish_on(&topics::UNCOMPENSATED_VELOCITY)?,
        })
    }

    // Eight topics at the rate of the IMU: publishing what nobody hears would be most of the node's work.
    fn publish(&self, messages: SolutionMessages) {
        if let Some(imu) = messages.imu {
            self.imu.publish_if_heard(|| imu).left_to_diagnostics();
        }
        if let Some((odometry, fix, velocity)) = messages.navigation {
            self.odometry
                .publish_if_heard(|| odometry)
                .left_to_diagnostics();
            self.fix.publish_if_heard(|| fix).left_to_diagnostics();
            self.velocity
                .publish_if_heard(|| velocity)
                .left_to_diagnostics();
        }
    }
}

/// Runs until the node is to end.
///
/// # Errors
/// What the parameters or the middleware refuse.
pub async fn main(node: Node) -> anyhow::Result<()> {
    let given = parameters::settings(node.parameters())?;
    let settings = given.node()?;
    let reference = settings.navigator.alignment.reference;
    let azimuth_topics = settings.azimuth_topics;
    let mut compensator = Compensator::new(settings)?;
    compensator.listen_as(&node)?;
    let shared = Shared(Arc::new(Mutex::new(compensator)));
    let compensated = SolutionPublishers::compensated(&node)?;
    let uncompensated = SolutionPublishers::uncompensated(&node)?;
    let azimuths = azimuth_publishers(&node, azimuth_topics)?;
    let (frames, fixed_frames) = (
        node.publish_on(&topics::TF)?,
        node.publish_on(&topics::TF_STATIC)?,
    );
    let instruments = Instruments::open(&given.instruments, clock_of(&node))?
        .map(|instruments| Arc::new(Mutex::new(instruments)));
    if let Some(instruments) = &instruments {
        attend(&node, instruments);
    }
    let mut publish = |output: Output| {
        compensated.publish(output.compensated);
        uncompensated.publish(output.uncompensated);
        let headings = output.azimuths.into_iter().flatten();
        for (publisher, azimuth) in azimuths.iter().zip(headings) {
            publisher.publish_if_heard(|| azimuth).left_to_diagnostics();
        }
        if let Some(transforms) = output.fixed_transforms {
            fixed_frames.publish(transforms).left_to_diagnostics();
        }
        if let Some(transforms) = output.transforms {
            frames.publish_if_heard(|| transforms).left_to_diagnostics();
        }
        if let Some((instruments, motion)) = instruments.as_ref().zip(output.motion) {
            locked(instruments).send(motion);
        }
    };
    let mut fixes = node.subscribe_on(&topics::FIX.with_depth(10))?;
    let depth = given.queue_depth();
    let mut joints = node.subscribe_on(&topics::JOINT_STATES.with_depth(depth))?;
    let mut calibrations = node.subscribe_on(&topics::CALIBRATION)?;
    let mut velocities = velocities_of_ship(&node, reference)?;
    let mut samples = node.subscribe_on(&topics::IMU_DATA_RAW.with_depth(depth))?;
    watch(&node, &shared);
    let mut changes = node.parameters().changes();
    node.set_ready();
    let mut endings = node.endings(ENDING);
    let mut ticks = tokio::time::interval(TICK);
    loop {
        // A joint state is worth waking up for only where a sample waits for it.
        let is_waiting = shared.lock().is_waiting();
        let (joint, sample) = tokio::select! {
            biased;
            ending = endings.next() => {
                shared.lock().flush(&mut publish);
                ending.done();
                continue;
            }
            () = node.shutdown() => return Ok(()),
            changed = changes.changed() => {
                if changed.is_ok() {
                    let given = parameters::settings(node.parameters())?.node()?;
                    shared.lock().change(&given);
                }
                continue;
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
            compensator.publishers(samples.publishers());
            let velocities = velocities.iter_mut();
            for velocity in velocities.flat_map(|v| std::iter::from_fn(|| v.try_recv())) {
                compensator.velocity(&velocity, &mut publish);
            }
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

/// Publishers of the heading from East and from North, where they are asked for.
fn azimuth_publishers(node: &Node, asked: bool) -> ros_node::Result<Vec<Publisher<Azimuth>>> {
    if !asked {
        return Ok(Vec::new());
    }
    [topics::AZIMUTH_ENU, topics::AZIMUTH_NED]
        .iter()
        .map(|topic| node.publish_on(topic))
        .collect()
}

/// The measured velocities, where the alignment takes them.
fn velocities_of_ship(
    node: &Node,
    reference: Reference,
) -> ros_node::Result<Option<Subscription<TwistWithCovarianceStamped>>> {
    let Reference::Measured { .. } = reference else {
        return Ok(None);
    };
    let topic = topics::AIDING_VELOCITY.with_depth(SENSOR_DEPTH);
    node.subscribe_on(&topic).map(Some)
}

/// Whether the node lives in simulated time, now and whenever it is asked.
fn clock_of(node: &Node) -> impl Fn() -> bool + Send + 'static {
    let clock = node.clock().clone();
    move || clock.is_simulated()
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
