//! Other tools read what is written: the `rosbags` library, and the reference library of MCAP.

use std::path::Path;

use bags::{BagWriter, NewTopic, Qos, WriteOptions};
use ros2_interfaces::{
    RosMessage,
    diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue},
    geometry_msgs::{TransformStamped, TwistWithCovarianceStamped},
    nav_msgs::Odometry,
    rosgraph_msgs::Clock,
    sensor_msgs::Imu,
    tf2_msgs::TFMessage,
    trajectory_msgs::{JointTrajectory, JointTrajectoryPoint},
};
use rotary_sins_msgs::{
    Calibration, KNOWN_TYPES, SchemeStatus, SelfCalibrationEstimate, known_type,
};
use suite_tests::{
    Answer, GOOD_SAMPLES, Program, mcap_of, messages, peer_python, repository, sample, scratch,
    truth_of_sample,
};

fn add<M: RosMessage>(bag: &mut BagWriter, name: &str, message: &M) {
    let topic = bag
        .add_topic(NewTopic::of::<M>(name, Qos::latched(1)))
        .unwrap();
    bag.write(topic, 1_000_000_000, message).unwrap();
}

fn run(python: &Path, script: &str, path: &Path) -> String {
    let program = Program::at("python", python.to_owned())
        .arg("-c")
        .arg(script)
        .arg(path);
    Answer::from(program.command().output().unwrap())
        .expect_status(0)
        .stdout
}

const READ: &str = r"
import sys
from pathlib import Path
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
with AnyReader([Path(sys.argv[1])]) as reader:
    for connection, time, data in reader.messages():
        message = reader.deserialize(data, connection.msgtype)
        print(connection.topic, time, connection.msgcount, message)
";

/// A directory bag: metadata, quality of service, and a message of every kind of field, all read with the schema in
/// the bag.
#[test]
fn rosbags_reads_every_type() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let path = scratch("every_type").join("run");
    let mut bag = BagWriter::create(&path, WriteOptions::default()).unwrap();
    let status = SchemeStatus {
        scheme: "eight-position".into(),
        step: 7,
        target: [1.5, -2.5],
        remaining: -1.0,
        message: "ninety".into(),
        ..SchemeStatus::default()
    };
    add(&mut bag, "/scheme/status", &status);
    let estimate = SelfCalibrationEstimate {
        state_names: vec!["phi_e".into(), "phi_n".into()],
        covariance: vec![0.25; 4],
        heading: 1.25,
        lost_samples: 77,
        message: "fine".into(),
        ..SelfCalibrationEstimate::default()
    };
    add(&mut bag, "/self_calibration/estimate", &estimate);
    let calibration = Calibration {
        converged: true,
        gyroscope_matrix: [0.5; 9],
        latitude_deg: 45.75,
        source: "here".into(),
        ..Calibration::default()
    };
    add(&mut bag, "/self_calibration/calibration", &calibration);
    let mut odometry = Odometry::default();
    odometry.twist.covariance[35] = 35.5;
    add(&mut bag, "/odometry", &odometry);
    let values = vec![KeyValue {
        key: "gaps".into(),
        value: "0".into(),
    }];
    let part = DiagnosticStatus {
        level: 2,
        name: "imu".into(),
        values,
        ..DiagnosticStatus::default()
    };
    add(
        &mut bag,
        "/diagnostics",
        &DiagnosticArray {
            status: vec![part],
            ..DiagnosticArray::default()
        },
    );
    let point = JointTrajectoryPoint {
        positions: vec![1.0, 2.0],
        ..JointTrajectoryPoint::default()
    };
    add(
        &mut bag,
        "/trajectory",
        &JointTrajectory {
            joint_names: vec!["a".into()],
            points: vec![point],
            ..JointTrajectory::default()
        },
    );
    add(
        &mut bag,
        "/tf",
        &TFMessage {
            transforms: vec![TransformStamped {
                child_frame_id: "imu_link".into(),
                ..TransformStamped::default()
            }],
        },
    );
    add(&mut bag, "/clock", &Clock::default());
    let mut velocity = TwistWithCovarianceStamped::default();
    velocity.twist.twist.angular.z = 12.5;
    add(&mut bag, "/aiding/velocity", &velocity);
    bag.finish().unwrap();

    let text = run(&python, READ, &path);
    assert_eq!(text.matches(" 1000000000 1 ").count(), 9, "{text}");
    for expected in [
        "ninety",
        "-2.5",
        "lost_samples=77",
        "message='fine'",
        "source='here'",
        "45.75",
        "35.5",
        "value='0'",
        "imu_link",
        "z=12.5",
    ] {
        assert!(text.contains(expected), "{expected} is not in {text}");
    }
}

/// A bag that ships, with its metadata, and the numbers of every Imu.
#[test]
fn rosbags_reads_a_sample() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let bag = sample("elsewhere");
    let text = run(&python, READ, &bag);
    let lines: Vec<&str> = text
        .lines()
        .filter(|line| line.starts_with("/imu/data_raw"))
        .collect();
    let ours: Vec<Imu> = messages(&bag, "/imu/data_raw");
    assert_eq!(lines.len(), ours.len());
    for (line, imu) in lines.iter().zip(&ours) {
        let x = format!("x={:?},", imu.angular_velocity.x);
        // Python writes an exponent of one digit with two.
        let python = x.replace("e-", "e-0");
        assert!(
            line.contains(&x) || line.contains(&python),
            "{x} is not in {line}"
        );
    }
}

const INFO: &str = r"
import sys
from mcap.reader import make_reader
with open(sys.argv[1], 'rb') as stream:
    reader = make_reader(stream, validate_crcs=True)
    print(reader.get_header().profile, sum(1 for _ in reader.iter_messages()))
    print([(m.name, sorted(m.metadata)) for m in reader.iter_metadata()])
";

/// The reference library of MCAP agrees with profile, CRCs and the rosbag2 record of the bags that ship.
#[test]
fn mcap_reads_the_samples() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    for name in GOOD_SAMPLES {
        let bag = sample(name);
        let text = run(&python, INFO, &mcap_of(&bag));
        let counts = truth_of_sample(name)["messages"]
            .as_array()
            .unwrap()
            .clone();
        let count: u64 = counts.iter().map(|topic| topic[1].as_u64().unwrap()).sum();
        assert!(text.starts_with(&format!("ros2 {count}\n")), "{text}");
        assert!(
            text.contains("('rosbag2', ['ROS_DISTRO', 'serialized_metadata'])"),
            "{text}"
        );
    }
}

/// The hash of every type is the one that another implementation computes from its definition, and the standard
/// definitions are those of ROS 2 Jazzy.
#[test]
fn type_hashes_are_those_of_rosbags() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let script = repository().join("tests/ros2_peers/type_hashes.py");
    let program = Program::at("python", python).arg(script);
    let answer = Answer::from(program.command().output().unwrap()).expect_status(0);
    assert_eq!(answer.stdout.lines().count(), KNOWN_TYPES.len());
    for line in answer.stdout.lines() {
        let (name, hash) = line.split_once(' ').unwrap();
        assert_eq!(known_type(name).unwrap().hash, hash, "{name}");
    }
}
