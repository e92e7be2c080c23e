//! What the nodes cost and how long a sample takes through them, in real time. Not a test: it prints figures.
//!
//! `cargo build --release --workspace --bins && launch-scripts/isolated.sh cargo bench -p suite_tests --bench node_figures`
//!
//! `ROTARY_SINS_FIGURES_RATE_HZ` (200 unless given) is the rate of the samples, `ROTARY_SINS_FIGURES_S` (20) how long each is measured.
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use ros_node::{Node, NodeBuilder, Publisher, Qos};
use ros2_interfaces::RosMessage;
use ros2_interfaces::builtin_interfaces::Time;
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use rotary_sins_msgs::Calibration;
use rustix::process::{Pid, Signal, kill_process};
use tokio::sync::mpsc::UnboundedSender;
use tokio::task::JoinHandle;

const WARM_UP: Duration = Duration::from_secs(8);
/// Coarse alignment of the nodes that are to be measured behind it \[s\].
const ALIGNMENT_S: u64 = 20;

/// What is measured.
#[derive(Clone, Copy)]
struct Measurement {
    rate_hz: f64,
    time: Duration,
}

impl Measurement {
    fn asked() -> Self {
        let number = |name: &str, default: f64| {
            std::env::var(name).map_or(default, |value| value.parse().unwrap())
        };
        Self {
            rate_hz: number("ROTARY_SINS_FIGURES_RATE_HZ", 200.0),
            time: Duration::from_secs_f64(number("ROTARY_SINS_FIGURES_S", 20.0)),
        }
    }
}

fn main() -> ExitCode {
    ros_node::run(
        NodeBuilder::new("node_figures").accept_arguments("--bench"),
        |node| async move {
            let measurement = Measurement::asked();
            resources(measurement).await;
            latency(&node, measurement, false).await;
            latency(&node, measurement, true).await;
            Ok::<(), ros_node::Error>(())
        },
    )
}

/// The executables stand beside the folder of this benchmark.
fn executable(name: &str) -> PathBuf {
    let path = std::env::current_exe()
        .unwrap()
        .ancestors()
        .nth(2)
        .unwrap()
        .join(name);
    assert!(
        path.exists(),
        "{} is missing: cargo build --release --workspace --bins",
        path.display()
    );
    path
}

/// A node that ends with the benchmark.
struct Running(Child);

impl Running {
    fn start(name: &str, parameters: &str) -> Self {
        let mut command = Command::new(executable(name));
        command
            .arg("--ros-args")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        for parameter in parameters.split_whitespace() {
            command.args(["-p", parameter]);
        }
        Self(command.spawn().unwrap())
    }

    /// User and system time \[s\] and resident memory \[MiB\], from /proc.
    fn cost(&self) -> (f64, f64) {
        let folder = Path::new("/proc").join(self.0.id().to_string());
        let stat = std::fs::read_to_string(folder.join("stat")).unwrap();
        let fields: Vec<&str> = stat
            .rsplit_once(')')
            .unwrap()
            .1
            .split_whitespace()
            .collect();
        // Clock ticks are hundredths of a second on every Linux that runs ROS 2.
        let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
        let status = std::fs::read_to_string(folder.join("status")).unwrap();
        let resident = status
            .lines()
            .find_map(|line| line.strip_prefix("VmRSS:"))
            .unwrap();
        let kib: f64 = resident.split_whitespace().next().unwrap().parse().unwrap();
        (ticks / 100.0, kib / 1024.0)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // SIGINT, so that it leaves the graph: a reader that just vanishes holds its writers up until its lease ends.
        // By no process of its own: the SIGCHLD of one could end the event loop of our own middleware.
        let pid = Pid::from_child(&self.0);
        kill_process(pid, Signal::INT).unwrap();
        let _ = self.0.wait();
    }
}

async fn measure(running: &[(&str, Running)], warm_up: Duration, time: Duration) {
    tokio::time::sleep(warm_up).await;
    let before: Vec<f64> = running.iter().map(|(_, r)| r.cost().0).collect();
    let start = Instant::now();
    tokio::time::sleep(time).await;
    let seconds = start.elapsed().as_secs_f64();
    for ((name, running), before) in running.iter().zip(before) {
        let (cpu, resident) = running.cost();
        println!(
            "{name:24} {:5.1} % of a core {resident:6.1} MiB",
            100.0 * (cpu - before) / seconds
        );
    }
}

/// The four nodes on the simulator's samples, behind coarse alignment: the calibrator's whole model and its judge work, the compensator
/// navigates from an alignment of its own.
async fn resources(measurement: Measurement) {
    let Measurement { rate_hz, time } = measurement;
    println!("\nthe four nodes at {rate_hz} Hz, calibrating and navigating");
    let rate = format!("imu_rate_hz:={rate_hz:?}");
    let calibrator =
        format!("coarse_alignment_s:={ALIGNMENT_S}.0 coarse_alignment_min_s:={ALIGNMENT_S}.0");
    let compensator = format!("alignment_s:={ALIGNMENT_S}.0");
    let nodes = [
        ("imu_simulator", Running::start("imu_simulator", &rate)),
        (
            "scheme_sequencer",
            Running::start("scheme_sequencer", "autostart:=true"),
        ),
        (
            "self_calibrator",
            Running::start("self_calibrator", &calibrator),
        ),
        (
            "navigation_compensator",
            Running::start("navigation_compensator", &compensator),
        ),
    ];
    let warm_up = WARM_UP + Duration::from_secs(ALIGNMENT_S);
    measure(&nodes, warm_up, time).await;
}

/// Takes everything that comes, and leaves it at that.
fn hear<M: RosMessage + ros_node::Message + Send>(node: &Node, topic: &str) -> JoinHandle<()> {
    let mut subscription = node.subscription::<M>(topic, Qos::reliable(1000)).unwrap();
    tokio::spawn(async move {
        loop {
            subscription.recv().await;
        }
    })
}

/// The compensator's topics beside `odometry`.
fn hear_all(node: &Node) -> Vec<JoinHandle<()>> {
    let mut listeners = vec![hear::<Odometry>(node, "uncompensated/odometry")];
    for prefix in ["", "uncompensated/"] {
        let name = |topic: &str| format!("{prefix}{topic}");
        listeners.push(hear::<Imu>(node, &name("imu/data")));
        listeners.push(hear::<NavSatFix>(node, &name("fix_ins")));
        listeners.push(hear::<TwistWithCovarianceStamped>(node, &name("velocity")));
    }
    listeners
}

/// Joint states and samples at the rate, a calibration after two seconds; tells the time that each sample leaves.
async fn send(
    rate_hz: f64,
    imu: Publisher<Imu>,
    joints: Publisher<JointState>,
    calibration: Publisher<Calibration>,
    departures: UnboundedSender<(i64, Instant)>,
) {
    let mut tick = tokio::time::interval(Duration::from_secs_f64(1.0 / rate_hz));
    let interval_nanos = (1e9 / rate_hz) as i64;
    let calibration_due = (2.0 * rate_hz) as i64;
    let mut earlier = Time::default();
    for count in 0_i64.. {
        tick.tick().await;
        let nanos = 1_760_000_000_000_000_000 + count * interval_nanos;
        let stamp = Time {
            sec: (nanos / 1_000_000_000) as i32,
            nanosec: (nanos % 1_000_000_000) as u32,
        };
        let mut state = JointState::default();
        state.header.stamp = stamp;
        state.name = vec!["outer_joint".into(), "inner_joint".into()];
        state.position = vec![0.0; 2];
        state.velocity = vec![0.0; 2];
        joints.publish(state).left_to_diagnostics();
        let mut sample = Imu::default();
        sample.header.stamp = stamp;
        sample.header.frame_id = "imu_link".into();
        sample.angular_velocity.z = 5.2e-5;
        sample.linear_acceleration.z = 9.806;
        sample.angular_velocity_covariance = [1e-12, 0.0, 0.0, 0.0, 1e-12, 0.0, 0.0, 0.0, 1e-12];
        sample.linear_acceleration_covariance = [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-6];
        let _ = departures.send((nanos, Instant::now()));
        imu.publish(sample).left_to_diagnostics();
        if count == 10 {
            earlier = stamp;
        }
        if count == calibration_due {
            // Of a sample that has certainly arrived: navigation starts from it at once.
            let mut message = Calibration::default();
            message.header.stamp = earlier;
            message.valid = true;
            message.converged = true;
            message.attitude.w = 1.0;
            message.latitude_deg = 45.78;
            message.longitude_deg = 126.67;
            calibration.publish(message).left_to_diagnostics();
        }
    }
}

/// Samples from this process through the compensator and back as odometry, each sample; with all its other topics
/// subscribed too, or with none of them.
async fn latency(node: &Node, measurement: Measurement, all_heard: bool) {
    let Measurement { rate_hz, time } = measurement;
    let imu = node
        .publisher::<Imu>("imu/data_raw", Qos::sensor())
        .unwrap();
    let joints = node
        .publisher::<JointState>("turntable/joint_states", Qos::sensor())
        .unwrap();
    let calibration = node
        .publisher::<Calibration>("self_calibration/calibration", Qos::latched(1))
        .unwrap();
    let mut odometry = node
        .subscription::<Odometry>("odometry", Qos::reliable(1000))
        .unwrap();
    let compensator = [(
        "navigation_compensator",
        Running::start("navigation_compensator", ""),
    )];
    assert!(imu.wait_for_subscribers(1, Duration::from_secs(20)).await);
    assert!(
        joints
            .wait_for_subscribers(1, Duration::from_secs(20))
            .await
    );
    tokio::time::sleep(Duration::from_secs(1)).await;

    let mut tasks = if all_heard {
        hear_all(node)
    } else {
        Vec::new()
    };
    let (sender, mut sent) = tokio::sync::mpsc::unbounded_channel();
    tasks.push(tokio::spawn(send(
        rate_hz,
        imu,
        joints,
        calibration,
        sender,
    )));
    let receiving = async {
        let mut departures = HashMap::new();
        let mut delays = Vec::new();
        loop {
            let message = odometry.recv().await;
            let arrival = Instant::now();
            while let Ok((nanos, at)) = sent.try_recv() {
                departures.insert(nanos, at);
            }
            let stamp = message.header.stamp;
            let nanos = i64::from(stamp.sec) * 1_000_000_000 + i64::from(stamp.nanosec);
            if let Some(departure) = departures.remove(&nanos) {
                delays.push(arrival.duration_since(departure).as_secs_f64() * 1e3);
            }
            if delays.len() as f64 >= rate_hz * time.as_secs_f64() {
                return delays;
            }
        }
    };
    let heard = if all_heard {
        "all eight topics"
    } else {
        "odometry alone"
    };
    println!(
        "\nthe compensator navigating at {rate_hz} Hz, {heard} subscribed, every sample out again"
    );
    let (delays, ()) = tokio::join!(
        tokio::time::timeout(time + Duration::from_secs(60), receiving),
        measure(&compensator, WARM_UP, time)
    );
    let mut delays = delays.expect("odometry of every sample within a minute more");
    delays.sort_by(f64::total_cmp);
    let at = |share: f64| delays[((delays.len() - 1) as f64 * share) as usize];
    println!(
        "sample in to odometry out: median {:.2} ms, 99 % {:.2} ms, 99.9 % {:.2} ms, worst {:.2} ms ({} samples)",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        delays.len()
    );
    tasks.iter().for_each(JoinHandle::abort);
}
