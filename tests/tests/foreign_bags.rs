//! Bags of ours in the hands of other libraries, and theirs in ours.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use rotary_sins_msgs::sensor_msgs::{Imu, JointState, NavSatFix};
use rotary_sins_msgs::{Calibration, RosMessage};
use serde_json::{Value, json};
use suite_tests::{Peer, Simulation, messages, peer_python, rotary_sins, scratch};

/// Messages of each topic that are compared field by field.
const COMPARED: usize = 200;

fn at_rest() -> PathBuf {
    Simulation::new("static", 0.2, 10.0, 3).bag()
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
    let calibrate = |bag: &Path| {
        let answer = rotary_sins(&["calibrate", bag.to_str().unwrap(), "--json"]);
        answer.expect_status(1).json()
    };
    let (ours, theirs) = (calibrate(&ours), calibrate(&theirs));
    for key in [
        "state",
        "covariance",
        "attitude_xyzw",
        "samples",
        "gaps",
        "phase",
    ] {
        assert_eq!(ours[key], theirs[key], "{key}");
    }
}
