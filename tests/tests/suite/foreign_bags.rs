//! Bags of ours in the hands of other libraries, and theirs in ours.

use std::fs;
use std::path::{Path, PathBuf};

use ros2_interfaces::RosMessage;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use rotary_sins_msgs::Calibration;
use serde_json::{Value, json};
use suite_tests::{
    Peer, Simulation, calibrate, messages, number, peer_python, rotary_sins, scratch,
};

/// Messages of each topic that are compared field by field.
const COMPARED: usize = 200;

fn at_rest() -> PathBuf {
    Simulation::at_rest().bag()
}

fn assert_same_messages<M: RosMessage>(bag: &Path, topic: &str, read: &Value) {
    let ours: Vec<M> = messages(bag, topic);
    let theirs = &read[topic];
    assert_eq!(theirs["type"], M::TYPE_NAME);
    assert_eq!(theirs["count"], ours.len(), "{topic}");
    let theirs = theirs["messages"].as_array().unwrap();
    assert_eq!(theirs.len(), ours.len().min(COMPARED));
    for (at, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        assert_eq!(
            &serde_json::to_value(ours).unwrap(),
            theirs,
            "{topic}, message {at}"
        );
    }
}

/// `rosbags` and `mcap-ros2-support` read a bag of ours, metadata.yaml included, and find every field as we wrote it.
#[test]
fn other_libraries_read_our_bags() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let bag = at_rest();
    let read = Peer::new(&python, "read_bag.py")
        .arg(&bag)
        .arg(COMPARED.to_string())
        .ask();
    assert_same_messages::<Imu>(&bag, "/imu/data_raw", &read);
    assert_same_messages::<JointState>(&bag, "/turntable/joint_states", &read);
    assert_same_messages::<NavSatFix>(&bag, "/fix", &read);
    assert_same_messages::<Calibration>(&bag, "/ground_truth/calibration", &read);
    assert_eq!(
        read["/imu/data_raw"]["qos"],
        json!([{"reliability": "RELIABLE", "durability": "VOLATILE"}])
    );
}

/// A bag that `rosbags` wrote, with the same samples, gives the same calibration to the last digit.
#[test]
fn bag_of_another_library_is_calibrated_alike() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let ours = at_rest();
    let theirs = scratch("foreign_bag").join("bag");
    let written = Peer::new(&python, "write_bag.py")
        .arg(&ours)
        .arg(&theirs)
        .ask();
    assert!(written.as_u64().unwrap() > 7200, "{written} messages");
    assert_same_calibration("rosbags", &calibrated(&ours), &calibrated(&theirs));
}

/// A bag at rest is calibrated, but cannot converge.
fn calibrated(bag: &Path) -> Value {
    calibrate(bag).expect_status(1).json()
}

fn assert_same_calibration(what: &str, ours: &Value, theirs: &Value) {
    for key in [
        "state",
        "covariance",
        "attitude_xyzw",
        "samples",
        "gaps",
        "phase",
        "warnings",
    ] {
        assert_eq!(ours[key], theirs[key], "{what}: {key}");
    }
}

/// A bag in another shape, written by the reference library of MCAP.
fn shaped(python: &Path, bag: &Path, name: &str, shape: &Value) -> PathBuf {
    let to = scratch(&format!("shape_{name}")).join("bag");
    let written = Peer::new(python, "shape_bag.py")
        .arg(bag)
        .arg(&to)
        .arg(shape.to_string())
        .ask();
    assert!(written.as_u64().unwrap() > 7000, "{written} messages");
    to
}

/// However the same messages are packed and divided into files, the calibration is the same to the last digit, without a warning.
#[test]
fn packing_makes_no_difference() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let bag = at_rest();
    let ours = calibrated(&bag);
    for (name, shape) in [
        ("unchunked", json!({"compression": "unchunked"})),
        ("none", json!({"compression": "none"})),
        ("lz4", json!({"compression": "lz4"})),
        ("zstd", json!({"compression": "zstd"})),
        ("split", json!({"parts": 3})),
        (
            "split_unchunked",
            json!({"parts": 2, "compression": "unchunked"}),
        ),
        (
            "overlapping",
            json!({"parts": 4, "overlap_s": 20, "compression": "lz4"}),
        ),
        (
            "shuffled",
            json!({"parts": 5, "overlap_s": 5, "shuffled": true}),
        ),
    ] {
        let theirs = shaped(&python, &bag, name, &shape);
        assert_same_calibration(name, &ours, &calibrated(&theirs));
    }
}

/// A split bag that lacks a part is refused by the name of the part.
#[test]
fn missing_part_is_named() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let bag = shaped(&python, &at_rest(), "part_gone", &json!({"parts": 3}));
    fs::remove_file(bag.join("bag_1.mcap")).unwrap();
    for command in ["calibrate", "align", "info", "play", "report"] {
        let answer = rotary_sins(&[command, bag.to_str().unwrap()]);
        answer.expect_refusal(&["bag_1.mcap", "not there", "metadata.yaml"]);
    }
}

/// The other storage of rosbag2 is refused with the way to convert it, folder and file.
#[test]
fn sqlite_is_refused_with_the_way_out() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let bag = shaped(&python, &at_rest(), "sqlite", &json!({"sqlite": true}));
    calibrate(&bag).expect_refusal(&["sqlite3", "expected mcap", "ros2 bag convert"]);
    let file = bag.join("bag.db3");
    calibrate(&file).expect_refusal(&["bag.db3", "SQLite", "ros2 bag convert"]);
}

/// The same stream from another driver: another name, other topics beside, stamps that are off by up to a fifth of an interval, a
/// second of it missing. Topic and rate are found out; the gap is counted; and the result is that of the good bag within what the
/// faults can do: at rest, weights of single samples that are off by up to 20 % (12 % rms) move the mean by that part of its own
/// noise, and the missing second is one of hundreds; half a sigma is four times as much.
#[test]
fn another_driver_gives_the_same_result() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    for rate in [30.0, 100.0, 400.0] {
        let bag = Simulation::new("static", 0.12, rate, 5).bag();
        let ours = calibrated(&bag);
        let shape = json!({
            "imu_topic": "/phins/imu", "beside": true, "jitter": 0.2, "gap_s": 1, "compression": "lz4", "parts": 2,
        });
        let theirs = shaped(&python, &bag, &format!("driver_{rate}"), &shape);
        let info = rotary_sins(&["info", theirs.to_str().unwrap(), "--json"]);
        let info = info.expect_status(0).stdout;
        for topic in ["/phins/imu", "/engine/temperature", "/never/heard"] {
            assert!(info.contains(topic), "{topic} is not in {info}");
        }
        let theirs = calibrated(&theirs);
        assert_eq!(theirs["gaps"], 1, "{rate} Hz");
        let lost = number(&theirs["lost_samples"]);
        // The interval that it is counted by is known from stamps that are off.
        assert!((lost / rate - 1.0).abs() < 0.1, "{rate} Hz: {lost} lost");
        let samples = number(&ours["samples"]) - number(&theirs["samples"]);
        assert!((samples - rate).abs() <= 1.0, "{rate} Hz: {samples} fewer");
        for angle in ["heading_deg", "roll_deg", "pitch_deg"] {
            let off = (number(&theirs[angle]) - number(&ours[angle]))
                / number(&ours[format!("{angle}_std")]);
            println!("{rate} Hz: {angle} is off by {off:.4} sigma");
            assert!(off.abs() < 0.5, "{rate} Hz: {angle} is off by {off} sigma");
        }
    }
}
