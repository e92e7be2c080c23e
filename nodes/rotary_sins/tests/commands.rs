//! The commands as scripts see them: exit status, JSON on standard output, one line on standard error.
#![allow(clippy::unwrap_used)]

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::LazyLock,
};

use bags::{Bag, Selection};
use ros2_interfaces::nav_msgs::Odometry;
use serde_json::Value;

/// Kept until the process ends; the bags in it are read by several tests.
static DIRECTORY: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotary-sins"))
        .args(arguments)
        .output()
        .unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// One line that names what is wrong, and status 2.
fn assert_refused(arguments: &[&str], words: &[&str]) {
    let output = run(arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(words.iter().all(|word| text.contains(word)), "{text}");
    assert!(output.stdout.is_empty());
}

/// An hour and a half at 10 Hz: the first eleven dwells.
static BAG: LazyLock<PathBuf> = LazyLock::new(|| {
    let path = DIRECTORY.path().join("run.mcap");
    let text = path.to_str().unwrap();
    let output = run(&[
        "simulate",
        "--hours",
        "1.5",
        "--rate",
        "10",
        "--heading-deg",
        "70",
        "--output",
        text,
        "--json",
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(json(&output)["duration_s"], 5400.0);
    path
});

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// What was simulated is in the bag, whole.
#[test]
fn info_of_a_simulation() {
    let output = run(&["info", text(&BAG), "--json"]);
    let info = json(&output);
    assert_eq!(info["warnings"], Value::Array(vec![]));
    let topics = info["topics"].as_array().unwrap();
    let imu = topics
        .iter()
        .find(|topic| topic["name"] == "/imu/data_raw")
        .unwrap();
    assert_eq!(imu["messages"], 54_000);
    assert!((imu["rate_hz"].as_f64().unwrap() - 10.0).abs() < 1e-9);
    assert!(
        topics
            .iter()
            .any(|topic| topic["name"] == "/ground_truth/calibration")
    );
}

/// The alignment ends where the table begins to turn and covers the heading with its sigma.
#[test]
fn align_finds_the_heading() {
    let output = run(&["align", text(&BAG), "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let result = json(&output);
    let number = |key: &str| result[key].as_f64().unwrap();
    assert!(number("duration_s") < 505.0);
    assert!(
        (number("heading_deg") - 70.0).abs() < 4.0 * number("heading_deg_std"),
        "{result}"
    );
    for key in ["roll_deg", "pitch_deg"] {
        assert!(
            number(key).abs() < 4.0 * number(&format!("{key}_std")),
            "{result}"
        );
    }
}

/// The smoothed record is a bag beside the bag: a pose for every second and the first sample, the last one that of the
/// calibration to the last bit, the first one nearer the truth than its sigmas say. What is printed is as without it. A record that is there is not
/// written over, and the bag that is read never.
#[test]
fn calibrate_smooths_the_record() {
    let plain = json(&run(&["calibrate", text(&BAG), "--json"]));
    let output = run(&["calibrate", text(&BAG), "--smooth", "--json"]);
    let mut result = json(&output);
    let smoothed = result.as_object_mut().unwrap().remove("smoothed").unwrap();
    assert_eq!(result, plain);
    assert_eq!(result["passes"], 1);
    let path = DIRECTORY.path().join("run-smoothed.mcap");
    assert_eq!(smoothed["bag"], text(&path));
    let bag = Bag::open(&path).unwrap();
    let topic = bag.topic("/smoothed/odometry").unwrap();
    let mut messages = bag.messages(&Selection::topics([topic]));
    let mut poses: Vec<Odometry> = Vec::new();
    while let Some(message) = messages.next() {
        poses.push(bags::cdr::decode(message.data).unwrap());
    }
    assert_eq!(smoothed["epochs"], poses.len());
    assert_eq!(poses.len(), 5400);
    let (first, last) = (
        &poses[0].pose,
        &poses[poses.len() - 1].pose.pose.orientation,
    );
    let calibrated: Vec<f64> = serde_json::from_value(plain["attitude_xyzw"].clone()).unwrap();
    assert_eq!(calibrated, [last.x, last.y, last.z, last.w]);
    // At 70 deg of heading and level: a turn by −70 deg about Up.
    let q = &first.pose.orientation;
    let half = 35.0_f64.to_radians();
    let up = 2.0 * (q.z * half.cos() + q.w * half.sin());
    for (axis, error) in [2.0 * q.x, 2.0 * q.y, up].into_iter().enumerate() {
        let sigma = first.covariance[21 + 7 * axis].sqrt();
        assert!(error.abs() < 4.0 * sigma && sigma < 3e-4, "{error} {sigma}");
    }
    assert_refused(
        &["calibrate", text(&BAG), "--smooth"],
        &["run-smoothed.mcap", "--force"],
    );
    assert_refused(
        &["calibrate", text(&BAG), "--force", "--smoothed", text(&BAG)],
        &["run.mcap", "what is read"],
    );
    let forced = run(&[
        "calibrate",
        text(&BAG),
        "--smooth",
        "--force",
        "--passes",
        "2",
        "--json",
    ]);
    let forced = json(&forced);
    assert_eq!(forced["passes"], 2);
    let difference =
        forced["heading_deg"].as_f64().unwrap() - plain["heading_deg"].as_f64().unwrap();
    assert!(
        difference.abs() < plain["heading_deg_std"].as_f64().unwrap(),
        "{difference}"
    );
}

/// A calibration that is not there yet is status 1 with the whole result.
#[test]
fn calibrate_before_it_has_converged() {
    let output = run(&["calibrate", text(&BAG), "--duration", "2400", "--json"]);
    let result = json(&output);
    assert_eq!(output.status.code(), Some(1), "{result}");
    assert_eq!(
        (&result["phase"], &result["gaps"]),
        (&"calibrating".into(), &0.into())
    );
}

/// The result has what scripts rely on; its file serves `navigate`.
#[test]
fn calibrate_then_navigate() {
    let file = DIRECTORY.path().join("calibration.yaml");
    let output = run(&[
        "calibrate",
        text(&BAG),
        "--model",
        "paper",
        "--output",
        text(&file),
        "--json",
    ]);
    let result = json(&output);
    assert_eq!(output.status.code(), Some(0), "{result}");
    for key in [
        "gyroscope_drift_rad_s",
        "accelerometer_bias_m_s2",
        "misalignment_std_rad",
    ] {
        assert_eq!(result[key].as_array().unwrap().len(), 3, "{key}");
    }
    assert_eq!(result["covariance"].as_array().unwrap().len(), 13 * 13);
    assert_eq!(
        (&result["gaps"], &result["samples"]),
        (&0.into(), &54_000.into())
    );
    let still = DIRECTORY.path().join("still.mcap");
    let simulated = run(&[
        "simulate",
        "--scheme",
        "static",
        "--hours",
        "1",
        "--rate",
        "10",
        "--output",
        text(&still),
    ]);
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    let output = run(&[
        "navigate",
        text(&still),
        "--calibration",
        text(&file),
        "--json",
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    let result = json(&output);
    let number = |key: &str| result[key].as_f64().unwrap();
    assert!(
        number("max_position_error_nmi") < number("max_position_error_uncompensated_nmi"),
        "{result}"
    );
    assert!((number("navigation_s") - 2700.0).abs() < 5.0, "{result}");
}

/// Thresholds decide what counts as converged.
#[test]
fn thresholds_decide() {
    let lenient = [
        "--gyroscope-drift-threshold-deg-per-hour=1",
        "--accelerometer-bias-threshold-ug=1000",
        "--azimuth-threshold-arcmin=100",
    ];
    let output = run(&[&["calibrate", text(&BAG), "--json"], &lenient[..]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(json(&output)["phase"], "converged");
}

/// A part of the bag that has no position of its own takes the last one before it.
#[test]
fn a_part_of_the_bag() {
    let output = run(&[
        "align",
        text(&BAG),
        "--start-offset",
        "100",
        "--duration",
        "300",
        "--json",
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    let result = json(&output);
    assert!(
        (result["duration_s"].as_f64().unwrap() - 299.9).abs() < 1.1,
        "{result}"
    );
}

/// Arguments that mean nothing are refused in one line.
#[test]
fn refusals() {
    let bag = text(&BAG);
    assert_refused(&["calibrate", "/nowhere.mcap"], &["/nowhere.mcap"]);
    assert_refused(&["align", bag, "--duration=-1"], &["--duration", "-1"]);
    assert_refused(
        &["align", bag, "--imu-topic", "/imu2"],
        &["/imu2", "/imu/data_raw"],
    );
    assert_refused(&["align", bag, "--inner-axis", "x"], &["inner"]);
    assert_refused(
        &[
            "calibrate",
            bag,
            "--latitude-deg",
            "91",
            "--longitude-deg",
            "0",
        ],
        &["latitude", "91"],
    );
    assert_refused(
        &[
            "simulate",
            "--scheme",
            "/no.yaml",
            "--output",
            "/tmp/never.mcap",
        ],
        &["/no.yaml", "eight-position"],
    );
    assert_refused(
        &["navigate", bag, "--calibration", "/no.yaml"],
        &["/no.yaml"],
    );
    assert_refused(&["play", bag, "--loop"], &["--loop", "/clock"]);
    assert_refused(&["info", bag, "--ros-args"], &["--ros-args"]);
}
