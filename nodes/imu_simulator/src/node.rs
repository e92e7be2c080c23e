//! The loop of the node: motions in, samples out, at the chosen speed.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;
use ros_node::{Endings, Level, Node, Report, Subscription};
use ros2_interfaces::trajectory_msgs::JointTrajectory;
use rotary_sins_msgs::convert::{FromMessage, stamp_from_time};
use rotary_sins_msgs::interfaces::topics::JOINT_TRAJECTORY;
use sins::simulation::{Simulator, Wandering};
use sins::table::Waypoints;
use sins::time::{Stamp, seconds_to_nanos};

use crate::follow::Follower;
use crate::outputs::{Outputs, TOPICS};
use crate::pacing::Pacer;
use crate::parameters::{Settings, settings};
use crate::wait_list::{self, Wait};

/// The topic by which the table is moved, as it is waited for.
const TRAJECTORY: &str = JOINT_TRAJECTORY.name;
/// Samples between two looks at the clock and at the trajectories.
const BATCH: u32 = 200;
/// Wall time between two ticks of `/clock`, at most.
const CLOCK_PERIOD: Duration = Duration::from_millis(20);
/// A subscriber that is matched on our side may still have to match us on its own.
const MATCH_SETTLE: Duration = Duration::from_millis(500);
/// Time to give a goal up: it needs none.
const ENDING: Duration = Duration::from_secs(3);

/// What moves the table and what ends it.
struct Inputs {
    trajectories: Subscription<JointTrajectory>,
    follower: Follower,
    endings: Endings,
}

/// What the diagnostics tell.
#[derive(Debug, Default)]
struct SimulatedTime {
    simulated_nanos: AtomicI64,
    started: AtomicU64,
    refused: AtomicU64,
    late: AtomicU64,
}

/// Runs the node until it is told to end or the simulated time is over.
///
/// # Errors
/// Parameters that mean nothing, endpoints that cannot be created, subscribers that do not come.
pub async fn main(node: Node) -> Result<()> {
    let settings = settings(node.parameters())?;
    let waits = wait_list::parse(&settings.wait_for, &TOPICS)?;
    let wait_timeout = settings.wait_timeout_s.map(Duration::from_secs_f64);
    let mut simulator = Simulator::new(settings.simulator)?;
    let mut outputs = Outputs::new(&node, &settings)?;
    let trajectories = node.subscribe_on(&JOINT_TRAJECTORY)?;
    let follower = Follower::new(&node)?;
    let progress = Arc::new(SimulatedTime::default());
    diagnose(&node, &progress, &settings);
    let mut endings = node.endings(ENDING);
    tokio::select! {
        outcome = wait_for_all(&waits, wait_timeout, &outputs, &trajectories) => outcome?,
        () = nothing_under_way(&mut endings) => {}
        () = node.shutdown() => return Ok(()),
    }
    node.set_ready();
    let mut inputs = Inputs {
        trajectories,
        follower,
        endings,
    };
    tokio::select! {
        () = simulate(&node, &mut simulator, &mut outputs, &mut inputs, &settings, &progress) => {}
        () = node.shutdown() => {}
    }
    Ok(())
}

/// Who asks for an end before anything moves finds everything in order. Never completes.
async fn nothing_under_way(endings: &mut Endings) {
    loop {
        endings.next().await.done();
    }
}

async fn wait_for_all(
    waits: &[Wait],
    timeout: Option<Duration>,
    outputs: &Outputs,
    trajectories: &Subscription<JointTrajectory>,
) -> Result<()> {
    if waits.is_empty() {
        return Ok(());
    }
    let forever = Duration::from_secs(1_000_000_000);
    let deadline = Instant::now() + timeout.unwrap_or(forever);
    for wait in waits {
        tracing::info!("waiting for {} other ends of {}", wait.count, wait.topic);
        let left = deadline.saturating_duration_since(Instant::now());
        if wait.topic == TRAJECTORY {
            let there = trajectories.wait_for_publishers(wait.count, left).await;
            anyhow::ensure!(
                there,
                "{TRAJECTORY} has not had {} publishers in time",
                wait.count
            );
        } else {
            outputs.wait_for(wait, left).await?;
        }
    }
    tokio::time::sleep(MATCH_SETTLE).await;
    Ok(())
}

async fn simulate(
    node: &Node,
    simulator: &mut Simulator,
    outputs: &mut Outputs,
    inputs: &mut Inputs,
    settings: &Settings,
    progress: &SimulatedTime,
) {
    let Inputs {
        trajectories,
        follower,
        endings,
    } = inputs;
    active(node, endings).await;
    let begin = simulator.plant().now();
    let end = settings
        .duration_s
        .map(|duration_s| begin.plus_nanos(seconds_to_nanos(duration_s)));
    let mut pacer = Pacer::new(settings.speed, Instant::now(), begin.nanos());
    let mut next_clock = Instant::now();
    outputs.publish_first(simulator).await;
    tracing::info!(
        "simulating from {} ns, at {} times real time",
        begin.nanos(),
        settings.speed
    );
    loop {
        // Simulated time stands still while the node is not active; the pacer forgives it.
        active(node, endings).await;
        while let Some(message) = trajectories.try_recv() {
            if command(simulator, trajectories.topic(), &message, progress) {
                follower.replaced_by("a trajectory of the topic");
            }
        }
        let (started, refused) = follower.take_requests(simulator);
        progress.started.fetch_add(started, Ordering::Relaxed);
        progress.refused.fetch_add(refused, Ordering::Relaxed);
        for _ in 0..BATCH {
            let now = simulator.plant().now();
            if end.is_some_and(|end| now >= end) {
                outputs.publish_clock(now);
                if simulator.imu_errors().wandering != Wandering::default() {
                    outputs.publish_truth(simulator);
                }
                tracing::info!(
                    "finished after {} s of simulated time",
                    now.seconds_since(begin)
                );
                node.repeat_what_was_missed().await;
                return;
            }
            if pacer
                .due(simulator.next_stamp().nanos())
                .is_some_and(|due| due > Instant::now())
            {
                break;
            }
            let tick = simulator.step();
            outputs.publish(&tick, simulator).await;
            follower.check(simulator);
        }
        let now = simulator.plant().now();
        progress
            .simulated_nanos
            .store(now.nanos() - begin.nanos(), Ordering::Relaxed);
        if Instant::now() >= next_clock {
            outputs.publish_clock(now);
            next_clock = Instant::now() + CLOCK_PERIOD;
        }
        pacer.forgive(Instant::now(), simulator.next_stamp().nanos());
        let ending = if let Some(due) = pacer.due(simulator.next_stamp().nanos()) {
            tokio::select! {
                biased;
                ending = endings.next() => Some(ending),
                () = tokio::time::sleep_until(due.into()) => None,
            }
        } else {
            tokio::task::yield_now().await;
            endings.try_next()
        };
        if let Some(ending) = ending {
            let why = format!("the table's node {}", ending.purpose().verb());
            follower.give_up(simulator, &why);
            ending.done();
            // The gate closes, or the node ends, before another sample.
            tokio::task::yield_now().await;
        }
    }
}

/// Waits until the node is active. Meanwhile nothing moves.
async fn active(node: &Node, endings: &mut Endings) {
    tokio::select! {
        biased;
        () = node.active() => {}
        () = nothing_under_way(endings) => {}
    }
}

/// Hands a trajectory to the table, or says why not. Says whether the table took it.
fn command(
    simulator: &mut Simulator,
    topic: &str,
    message: &JointTrajectory,
    progress: &SimulatedTime,
) -> bool {
    let refuse = |reason: String| {
        progress.refused.fetch_add(1, Ordering::Relaxed);
        tracing::warn!("{topic}: refused: {reason}");
        false
    };
    let trajectory = match Waypoints::from_message(message) {
        Ok(trajectory) => trajectory,
        Err(error) => return refuse(error.to_string()),
    };
    let stamp = stamp_from_time(message.header.stamp);
    let wanted = (stamp != Stamp::default()).then_some(stamp);
    match simulator.follow(wanted, &trajectory) {
        Ok(_) if trajectory.points.is_empty() => tracing::info!("{topic}: stop"),
        Ok(start) => {
            progress.started.fetch_add(1, Ordering::Relaxed);
            let late_s = wanted.map_or(0.0, |wanted| start.seconds_since(wanted));
            if late_s > 0.0 {
                progress.late.fetch_add(1, Ordering::Relaxed);
                tracing::warn!(
                    "{topic}: arrived {late_s:.3} s after its start; the motion begins now"
                );
            }
            tracing::debug!("{topic}: motion from {} ns", start.nanos());
        }
        Err(error) => return refuse(error.to_string()),
    }
    true
}

fn diagnose(node: &Node, progress: &Arc<SimulatedTime>, settings: &Settings) {
    let progress = Arc::clone(progress);
    let wanted = settings.speed;
    let mut last = (Instant::now(), 0_i64);
    node.diagnostics().add("simulation", move || {
        let (now, simulated) = (
            Instant::now(),
            progress.simulated_nanos.load(Ordering::Relaxed),
        );
        let wall_s = now.duration_since(last.0).as_secs_f64().max(1e-6);
        let speed = (simulated - last.1) as f64 * 1e-9 / wall_s;
        last = (now, simulated);
        let (refused, late) = (
            progress.refused.load(Ordering::Relaxed),
            progress.late.load(Ordering::Relaxed),
        );
        let report = Report::ok(format!("{speed:.1} times real time"))
            .with("simulated [s]", format!("{:.3}", simulated as f64 * 1e-9))
            .with("speed wanted", wanted)
            .with("motions", progress.started.load(Ordering::Relaxed))
            .with("trajectories refused", refused)
            .with("trajectories late", late);
        report
            .counted(
                Level::Warn,
                "late",
                late,
                &format!("{late} trajectories arrived after their start"),
            )
            .counted(
                Level::Warn,
                "refused",
                refused,
                &format!("{refused} trajectories refused"),
            )
    });
}
