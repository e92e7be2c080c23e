//! How much the middleware carries on this machine: one writer process, several reader processes, nothing lost?
//!
//! The experiment behind `THROUGHPUT.md`; it uses ros2-client directly, so that it measures the ground `ros_node`
//! stands on. Run it in a network namespace with loopback only (see `THROUGHPUT.md` for the command):
//! `throughput run SAMPLES IMU_PER_SECOND JOINT_EVERY READERS DEPTH TICK_MS WAIT_MS`.
#![allow(clippy::unwrap_used)]

use futures::{FutureExt, StreamExt};
use ros2_client::qos::{History, Reliability, WhenFull};
use ros2_client::{
    Context, Message, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile,
};
use rustdds::{DomainParticipantBuilder, Topic};
use serde::{Deserialize, Serialize};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

#[derive(Clone, Serialize, Deserialize)]
struct Header {
    sec: i32,
    nanosec: u32,
    frame_id: String,
}

/// As large as `sensor_msgs/Imu`.
#[derive(Clone, Serialize, Deserialize)]
struct ImuLike {
    header: Header,
    orientation: [f64; 4],
    orientation_covariance: [f64; 9],
    angular_velocity: [f64; 3],
    angular_velocity_covariance: [f64; 9],
    linear_acceleration: [f64; 3],
    linear_acceleration_covariance: [f64; 9],
}
impl Message for ImuLike {}

/// As large as `sensor_msgs/JointState` of two joints.
#[derive(Clone, Serialize, Deserialize)]
struct JointLike {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}
impl Message for JointLike {}

/// Settings of one run, the same for writer and readers.
#[derive(Clone)]
struct Settings {
    samples: u64,
    imu_per_second: f64,
    joint_every: u64,
    readers: usize,
    depth: usize,
    tick: Duration,
    wait: Duration,
}

impl Settings {
    fn from_args(args: &[String]) -> Self {
        let number = |i: usize, default: f64| args.get(i).map_or(default, |s| s.parse().unwrap());
        Self {
            samples: number(0, 100_000.0) as u64,
            imu_per_second: number(1, 10_000.0),
            joint_every: number(2, 1.0) as u64,
            readers: number(3, 4.0) as usize,
            depth: number(4, 4000.0) as usize,
            tick: Duration::from_secs_f64(number(5, 1.0) * 1e-3),
            wait: Duration::from_secs_f64(number(6, 1000.0) * 1e-3),
        }
    }

    fn joint_samples(&self) -> u64 {
        if self.joint_every == 0 {
            0
        } else {
            self.samples.div_ceil(self.joint_every)
        }
    }

    fn qos(&self) -> QosProfile {
        QosProfile::publisher_default()
            .history(History::KeepLast { depth: self.depth })
            .reliability(Reliability::Reliable {
                when_full: WhenFull::Wait(self.wait),
            })
    }
}

fn node(name: &str) -> Node {
    let participant = DomainParticipantBuilder::new(0)
        .with_only_networks(["127.0.0.1".parse::<std::net::IpAddr>().unwrap()])
        .build()
        .unwrap();
    Context::from_domain_participant(participant)
        .unwrap()
        .new_node(
            NodeName::new("/", name).unwrap(),
            NodeOptions::new().enable_rosout(false),
        )
        .unwrap()
}

fn topics(node: &Node, qos: &QosProfile) -> (Topic, Topic) {
    let topic = |name, package, kind| {
        node.create_topic(
            &Name::new("/", name).unwrap(),
            MessageTypeName::new(package, kind),
            qos,
        )
        .unwrap()
    };
    (
        topic("imu", "sensor_msgs", "Imu"),
        topic("joints", "sensor_msgs", "JointState"),
    )
}

/// Seconds of processor time and megabytes of memory this process has used.
fn usage() -> (f64, f64) {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap()
        .split_whitespace()
        .collect();
    let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let kib = status
        .lines()
        .find_map(|l| l.strip_prefix("VmHWM:"))
        .unwrap();
    (
        ticks / 100.0,
        kib.trim().trim_end_matches(" kB").parse::<f64>().unwrap() / 1024.0,
    )
}

fn publish(settings: &Settings) {
    let mut node = node("writer");
    let (imu_topic, joint_topic) = topics(&node, &settings.qos());
    let imu = node.create_publisher::<ImuLike>(&imu_topic, None).unwrap();
    let joints = node
        .create_publisher::<JointLike>(&joint_topic, None)
        .unwrap();
    while node.subscription_count("/imu") < settings.readers
        || node.subscription_count("/joints") < settings.readers
    {
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
    let (cpu0, start) = (usage().0, Instant::now());
    let (mut failed, mut slowest, mut k) = (0_u64, Duration::ZERO, 0_u64);
    while k < settings.samples {
        let due = (start.elapsed().as_secs_f64() * settings.imu_per_second) as u64;
        while k < due.min(settings.samples) {
            let header = Header {
                sec: k as i32,
                nanosec: 0,
                frame_id: "imu_link".into(),
            };
            let before = Instant::now();
            if settings.joint_every > 0 && k % settings.joint_every == 0 {
                let message = JointLike {
                    header: header.clone(),
                    name: vec!["outer_joint".into(), "inner_joint".into()],
                    position: vec![0.0; 2],
                    velocity: vec![0.0; 2],
                    effort: vec![],
                };
                failed += u64::from(joints.publish(message).is_err());
            }
            let message = ImuLike {
                header,
                orientation: [0.0; 4],
                orientation_covariance: [0.0; 9],
                angular_velocity: [0.0; 3],
                angular_velocity_covariance: [0.0; 9],
                linear_acceleration: [0.0; 3],
                linear_acceleration_covariance: [0.0; 9],
            };
            failed += u64::from(imu.publish(message).is_err());
            slowest = slowest.max(before.elapsed());
            k += 1;
        }
        std::thread::sleep(settings.tick);
    }
    let wall = start.elapsed().as_secs_f64();
    let (cpu, mib) = usage();
    println!(
        "writer: {} imu in {wall:.1} s = {:.0}/s, {failed} refused, slowest publish {:.1} ms, cpu {:.0} %, {mib:.0} MiB",
        settings.samples,
        settings.samples as f64 / wall,
        slowest.as_secs_f64() * 1e3,
        100.0 * (cpu - cpu0) / wall
    );
    std::thread::sleep(Duration::from_secs(3));
}

async fn read(settings: Settings, label: &str) {
    let mut node = node(&format!("reader_{label}"));
    let (imu_topic, joint_topic) = topics(&node, &settings.qos());
    let imu = node
        .create_subscription::<ImuLike>(&imu_topic, Some(settings.qos()))
        .unwrap();
    let joints = node
        .create_subscription::<JointLike>(&joint_topic, Some(settings.qos()))
        .unwrap();
    let (mut imu, mut joints) = (
        std::pin::pin!(imu.async_stream()),
        std::pin::pin!(joints.async_stream()),
    );
    let (mut imu_count, mut joint_count, mut gaps, mut wakeups) = (0_u64, 0_u64, 0_u64, 0_u64);
    let mut next = 0_i32;
    let mut begun: Option<(Instant, f64)> = None;
    let mut last = Instant::now();
    while imu_count < settings.samples || joint_count < settings.joint_samples() {
        let idle = tokio::time::sleep(Duration::from_secs(if begun.is_some() { 5 } else { 30 }));
        tokio::select! {
            Some(Ok((message, _))) = imu.next() => {
                let mut one = Some(message);
                while let Some(message) = one {
                    gaps += u64::from(message.header.sec != next);
                    next = message.header.sec + 1;
                    imu_count += 1;
                    one = imu.next().now_or_never().flatten().and_then(Result::ok).map(|(m, _)| m);
                }
            }
            Some(Ok(_)) = joints.next() => {
                joint_count += 1;
                while let Some(Some(Ok(_))) = joints.next().now_or_never() { joint_count += 1; }
            }
            () = idle => break,
        }
        wakeups += 1;
        begun.get_or_insert_with(|| (Instant::now(), usage().0));
        last = Instant::now();
    }
    let (begun, cpu0) = begun.unwrap_or((Instant::now(), 0.0));
    let wall = (last - begun).as_secs_f64();
    let (cpu, mib) = usage();
    println!(
        "reader {label}: imu {imu_count} (lost {}, gaps {gaps}), joints {joint_count} (lost {}), {wakeups} wake-ups in {wall:.1} s, cpu {:.0} %, {mib:.0} MiB",
        settings.samples - imu_count,
        settings.joint_samples() - joint_count,
        100.0 * (cpu - cpu0) / wall
    );
}

fn run(args: &[String]) {
    let settings = Settings::from_args(args);
    let me = std::env::current_exe().unwrap();
    let spawn = |mode: &str| -> Child { Command::new(&me).arg(mode).args(args).spawn().unwrap() };
    let mut children: Vec<Child> = (0..settings.readers)
        .map(|i| spawn(&format!("read{i}")))
        .collect();
    children.push(spawn("publish"));
    for child in &mut children {
        child.wait().unwrap();
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.first().map(String::as_str) {
        Some("run") => run(&args[1..]),
        Some("publish") => publish(&Settings::from_args(&args[1..])),
        Some(reader) if reader.starts_with("read") => {
            read(Settings::from_args(&args[1..]), &reader[4..]).await;
        }
        _ => println!(
            "throughput run SAMPLES IMU_PER_SECOND JOINT_EVERY READERS DEPTH TICK_MS WAIT_MS"
        ),
    }
}
