//! A short run of the four nodes, and what a tool sees of it that knows nothing of this suite.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use bags::{Bag, Selection, cdr};
use ros_node::Qos;
use ros2_interfaces::RosMessage;
use ros2_interfaces::diagnostic_msgs::DiagnosticArray;
use ros2_interfaces::geometry_msgs::TransformStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::tf2_msgs::TFMessage;
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate, with_known_types};
use serde_json::Value;

use crate::bag_cache::{made_once, part_of};
use crate::executables::EXECUTABLES;
use crate::isolation::{is_inside, isolated};
use crate::listener::Listener;
use crate::process::Program;
use crate::recording::messages;
use crate::scene::Scene;

/// Both joints turn, to different angles, after a rest that is long enough to align.
const SCHEME: &str = "
dwell_s: 330
rate_deg_per_s: 5
acceleration_deg_per_s2: 2.5
cycles: 1
rotations:
  - {axis: x, angle_deg: 90, dwell_s: 30}
  - {axis: y, angle_deg: -60, dwell_s: 60}
";
/// Simulated time: rests and rotations of the scheme, and what it takes until it begins \[s\].
const DURATION_S: f64 = 540.0;
const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// A recording of every topic of a run, by what is in it.
#[derive(Debug)]
pub struct RecordedRun {
    /// Type and newest message of every topic; `Null` where there was none, or of a type that is none of ours.
    pub topics: BTreeMap<String, (String, Value)>,
    /// The newest transform to each frame.
    pub transforms: BTreeMap<String, TransformStamped>,
    /// Every name of a status on `/diagnostics`, with its newest level.
    pub statuses: BTreeMap<String, u8>,
}

impl RecordedRun {
    /// The run, made by the first test that needs it, in a network of its own, and kept as long as the executables stay the same.
    pub fn of_the_nodes() -> Self {
        const NAME: &str = "recorded_run";
        if is_inside() {
            let part = part_of(NAME, &EXECUTABLES);
            run_the_nodes(&part);
            return Self::read(&part);
        }
        // This very test, started again within the namespace, comes by the lines above.
        let bag = made_once(NAME, &EXECUTABLES, |_| isolated(|| ()));
        Self::read(&bag)
    }

    fn read(bag: &Path) -> Self {
        let open = Bag::open(bag).unwrap();
        let mut newest = vec![Value::Null; open.topics().len()];
        let mut reader = open.messages(&Selection::default());
        let mut last: Vec<Option<Vec<u8>>> = vec![None; open.topics().len()];
        while let Some(message) = reader.next() {
            last[message.topic] = Some(message.data.to_owned());
        }
        for (number, payload) in last.iter().enumerate() {
            if let Some(payload) = payload {
                newest[number] = value_of(&open.topics()[number].type_name, payload);
            }
        }
        let topics = open.topics().iter().zip(newest);
        let mut transforms = BTreeMap::new();
        for topic in ["/tf_static", "/tf"] {
            for message in messages::<TFMessage>(bag, topic) {
                for transform in message.transforms {
                    transforms.insert(transform.child_frame_id.clone(), transform);
                }
            }
        }
        let statuses = messages::<DiagnosticArray>(bag, "/diagnostics");
        Self {
            topics: topics
                .map(|(topic, value)| (topic.name.clone(), (topic.type_name.clone(), value)))
                .collect(),
            transforms,
            statuses: statuses
                .into_iter()
                .flat_map(|array| array.status)
                .map(|status| (status.name, status.level))
                .collect(),
        }
    }
}

/// The truth stands in for the calibration, so that navigation begins after two minutes of simulated time; sentences go to nobody.
fn run_the_nodes(recording: &Path) {
    let mut scene = Scene::new("recorded_run");
    let scheme = scene.folder().join("two-turns.yaml");
    fs::write(&scheme, SCHEME).unwrap();
    scene.record_to(recording, &[]);
    let listener = Listener::new();
    let truth = listener.hear::<Calibration>("/ground_truth/calibration", Qos::latched(1));
    let estimates =
        listener.hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(1));
    let solutions = listener.hear::<Odometry>("/uncompensated/odometry", Qos::sensor());
    scene.start(
        &Program::new("navigation_compensator")
            .parameter("use_sim_time", "true")
            .parameter("alignment_s", "120.0")
            .parameter("coarse_alignment_s", "60.0")
            .parameter("nmea_udp", "127.0.0.1:10110")
            .remap("self_calibration/calibration", "ground_truth/calibration"),
    );
    scene.start(&Program::new("self_calibrator").parameter("use_sim_time", "true"));
    scene.start(
        &Program::sequencer()
            .parameter("use_sim_time", "true")
            .parameter("scheme", scheme.to_str().unwrap()),
    );
    let mut simulator = scene.start_apart(
        &Program::new("imu_simulator")
            .parameter("imu_rate_hz", "20.0")
            .parameter("speed", "60.0")
            .parameter("duration_s", &format!("{DURATION_S:?}")),
    );
    assert!(simulator.wait().success());
    let start = truth.wait_for("the truth", |_| true).header.stamp.nanos();
    let end = start + (DURATION_S * 1e9) as i64 - NANOS_PER_SECOND;
    estimates.wait_for("the last estimate", |e| e.header.stamp.nanos() >= end);
    solutions.wait_for("the last solution", |s| s.header.stamp.nanos() >= end);
    scene.end();
}

type Decode = fn(&[u8]) -> Value;

/// A message of one of our types, as JSON.
fn value_of(type_name: &str, payload: &[u8]) -> Value {
    fn decode<M: RosMessage>(payload: &[u8]) -> Value {
        serde_json::to_value(cdr::decode::<M>(payload).unwrap()).unwrap()
    }
    macro_rules! decoders {
        ($($type:ty),* $(,)?) => { [$((<$type>::TYPE_NAME, decode::<$type> as Decode)),*] };
    }
    let known = with_known_types!(decoders);
    known
        .iter()
        .find(|(name, _)| *name == type_name)
        .map_or(Value::Null, |(_, decode)| decode(payload))
}
