//! Other tools read what is written: the `rosbags` library, where Python has it (ROTARY_SINS_PYTHON, else python3).
#![allow(clippy::unwrap_used)]

mod support;

use std::process::Command;

use bags::{BagWriter, Compression, NewTopic, Qos, WriteOptions};
use ros2_interfaces::{
    RosMessage,
    diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue},
    geometry_msgs::{TransformStamped, TwistWithCovarianceStamped},
    nav_msgs::Odometry,
    rosgraph_msgs::Clock,
    tf2_msgs::TFMessage,
    trajectory_msgs::{JointTrajectory, JointTrajectoryPoint},
};
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};

fn python() -> Option<String> {
    let python = std::env::var("ROTARY_SINS_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_rosbags = Command::new(&python)
        .args(["-c", "import rosbags"])
        .output()
        .is_ok_and(|o| o.status.success());
    if has_rosbags {
        Some(python)
    } else {
        println!("skipped: {python} has no rosbags");
        None
    }
}

fn add<M: RosMessage>(bag: &mut BagWriter, name: &str, message: &M) {
    let topic = bag
        .add_topic(NewTopic::of::<M>(name, Qos::latched(1)))
        .unwrap();
    bag.write(topic, 1_000_000_000, message).unwrap();
}

fn run(python: &str, script: &str, path: &std::path::Path) -> String {
    let output = Command::new(python)
        .args(["-c", script])
        .arg(path)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
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
    let Some(python) = python() else { return };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run");
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

/// A single file, and the numbers of an Imu.
#[test]
fn rosbags_reads_a_file() {
    let Some(python) = python() else { return };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    support::write(&path, 300, Compression::Zstd, 10_000);
    let text = run(&python, READ, directory.path());
    assert_eq!(
        text.lines()
            .filter(|line| line.starts_with("/imu/data_raw"))
            .count(),
        300
    );
    assert!(text.contains("x=299.0"));
}

const INFO: &str = r"
import sys
from mcap.reader import make_reader
with open(sys.argv[1], 'rb') as stream:
    reader = make_reader(stream, validate_crcs=True)
    print(reader.get_header().profile, sum(1 for _ in reader.iter_messages()))
    print([(m.name, sorted(m.metadata)) for m in reader.iter_metadata()])
";

/// The reference library of MCAP agrees with profile, CRCs and the rosbag2 record.
#[test]
fn mcap_reads_it() {
    let Some(python) = python() else { return };
    if !Command::new(&python)
        .args(["-c", "import mcap"])
        .output()
        .unwrap()
        .status
        .success()
    {
        println!("skipped: {python} has no mcap");
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    support::write(&path, 300, Compression::Lz4, 10_000);
    let text = run(&python, INFO, &path);
    assert!(text.starts_with("ros2 603\n"), "{text}");
    assert!(
        text.contains("('rosbag2', ['ROS_DISTRO', 'serialized_metadata'])"),
        "{text}"
    );
}
