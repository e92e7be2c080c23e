//! The page about one run: what it says of whole bags, of damaged ones, of those without estimates and of live recordings.

use std::fs;
use std::path::{Path, PathBuf};

use ros_node::Qos;
use ros2_interfaces::sensor_msgs::{JointState, NavSatFix};
use rotary_sins_msgs::SelfCalibrationEstimate;
use serde_json::Value;
use suite_tests::{
    Answer, Listener, Program, Scene, Simulation, alter_imu, calibrate, copy_bag, data_file,
    estimates, isolated, rotary_sins, scratch, text, vector, within_namespace, without_topic,
};

const IMU: &str = "/imu/data_raw";
const NANOS_PER_SECOND: i64 = 1_000_000_000;
const DEG_PER_HOUR: f64 = std::f64::consts::PI / 648_000.0;

fn converging() -> PathBuf {
    Simulation::converging().bag()
}

/// Runs the command on a bag; the page goes into the folder.
fn report(bag: &Path, folder: &Path) -> (Answer, String) {
    let page = folder.join("page.html");
    let arguments = ["report", text(bag), "--json", "--output", text(&page)];
    // The folder of a scene has the page of an earlier run of its test.
    let answer = rotary_sins(&[&arguments[..], &["--force"]].concat());
    (answer, fs::read_to_string(page).unwrap_or_default())
}

fn finding<'a>(json: &'a Value, name: &str) -> &'a Value {
    let findings = json["findings"].as_array().unwrap();
    let found = findings.iter().find(|finding| finding["name"] == name);
    &found.unwrap_or_else(|| panic!("no finding '{name}' in {json}"))["verdict"]
}

/// Without recorded estimates the page has those of `calibrate`, to the last bit, and holds them against the truth.
#[test]
fn a_run_without_estimates_is_calibrated() {
    let bag = converging();
    let (answer, html) = report(&bag, &scratch("report_of_samples"));
    let json = answer.expect_status(0).json();
    let calibrated = calibrate(&bag).expect_status(0).json();
    assert_eq!(json["verdict"], "converged");
    assert_eq!(json["estimates"], "made_from_samples");
    for key in [
        "gyroscope_drift_rad_s",
        "gyroscope_drift_std_rad_s",
        "accelerometer_bias_m_s2",
        "accelerometer_bias_std_m_s2",
        "misalignment_std_rad",
        "nis_window_mean",
        "samples",
        "gaps",
        "phase",
    ] {
        assert_eq!(json[key], calibrated[key], "{key}");
    }
    assert_eq!(json["estimate_stamp_ns"], calibrated["stamp_ns"]);
    let sigmas = json["largest_error_sigmas"].as_f64().unwrap();
    assert!(sigmas > 0.0 && sigmas < 3.5, "{sigmas}");
    let truth = vector(&json, "gyroscope_drift_truth_rad_s");
    assert!(
        truth
            .iter()
            .all(|drift| (drift / DEG_PER_HOUR - 0.01).abs() < 1e-12)
    );
    let steps = json["steps"].as_array().unwrap();
    let positions: String = steps
        .iter()
        .map(|s| s["position"].as_str().unwrap())
        .collect();
    assert_eq!(positions, "ABCDAEFGHEA");
    let figures = json["figures"].as_array().unwrap();
    assert_eq!(html.matches("<svg").count(), figures.len());
    assert!(figures.contains(&"misalignment".into()));
    assert!(html.contains("The bag has no estimates"));
}

/// Unasked, the page stands beside the bag under its name, and what is printed is the verdict and the path.
#[test]
fn the_page_stands_beside_the_bag() {
    let folder = scratch("report_beside");
    let bag = folder.join("run.of.today.mcap");
    copy_bag(&converging(), &bag, |_| {});
    let answer = rotary_sins(&["report", text(&bag)]).expect_status(0);
    let page = folder.join("run.of.today.html");
    let lines: Vec<&str> = answer.stdout.lines().collect();
    assert!(
        lines[0].starts_with("converged; consistent; within "),
        "{lines:?}"
    );
    assert_eq!(lines[1], text(&page));
    assert!(
        fs::read_to_string(page)
            .unwrap()
            .contains("run.of.today.mcap")
    );
}

/// Of a bag that was cut off there is a page as far as it goes, which says so.
#[test]
fn truncated_bag_is_reported_as_far_as_it_goes() {
    let folder = scratch("report_truncated");
    let bag = folder.join("truncated.mcap");
    copy_bag(&converging(), &bag, |bytes| {
        bytes.truncate(bytes.len() / 3);
    });
    let (answer, html) = report(&bag, &folder);
    let answer = answer.expect_status(1);
    answer.expect_words(&["truncated.mcap", "ends at byte"]);
    let json = answer.json();
    assert_eq!(finding(&json, "damaged"), "bad");
    assert_eq!(json["phase"], "calibrating");
    assert!(html.contains("ends at byte") && html.contains("bag damaged"));
}

/// A hole in the samples is counted, listed with its time, and no run with one passes.
#[test]
fn a_gap_is_listed_with_its_time() {
    let folder = scratch("report_gap");
    let bag = folder.join("gap.mcap");
    alter_imu(&converging(), &bag, |index, imu| {
        if index >= 30_000 {
            imu.header.stamp.sec += 2;
        }
    });
    let (answer, html) = report(&bag, &folder);
    let json = answer.expect_status(1).json();
    assert_eq!(json["verdict"], "gaps");
    assert_eq!(
        (&json["gaps"], &json["lost_samples"]),
        (&1.into(), &20.into())
    );
    let faults = json["faults"].as_array().unwrap();
    let gap = faults.iter().find(|fault| fault["place"] == IMU).unwrap();
    assert_eq!(gap["text"], "gap of 2.100 s, 20 missing");
    let after_start = gap["stamp_ns"].as_i64().unwrap() - json["start_ns"].as_i64().unwrap();
    assert_eq!(after_start, 2_999_900_000_000);
    assert!(html.contains("gap of 2.100 s, 20 missing"));
}

/// Where the gyroscope drifts by more than the recorded truth says, the estimate is not within its sigmas of it.
#[test]
fn an_estimate_beside_the_truth_is_a_fault() {
    let folder = scratch("report_truth");
    let bag = folder.join("other.mcap");
    alter_imu(&converging(), &bag, |_, imu| {
        imu.angular_velocity.x += 0.02 * DEG_PER_HOUR;
    });
    let (answer, html) = report(&bag, &folder);
    let json = answer.expect_status(1).json();
    assert_eq!(json["verdict"], "outside_truth");
    assert!(json["largest_error_sigmas"].as_f64().unwrap() > 8.0);
    assert!(html.contains("gyroscope drift x"));
}

/// The run of a ship in a namespace is found by the ends of its names.
#[test]
fn topics_are_found_within_a_namespace() {
    let folder = scratch("report_namespace");
    let bag = folder.join("ship.mcap");
    within_namespace(&converging(), &bag, "/ship_2");
    let (answer, _) = report(&bag, &folder);
    let json = answer.expect_status(0).json();
    assert_eq!(json["steps"].as_array().unwrap().len(), 11);
    assert!(json["largest_error_sigmas"].is_f64());
}

/// A bag with neither estimates nor samples is refused with what it has.
#[test]
fn a_bag_without_samples_is_refused() {
    let folder = scratch("report_no_imu");
    let bag = folder.join("no_imu.mcap");
    without_topic(&converging(), &bag, IMU);
    let (answer, html) = report(&bag, &folder);
    answer.expect_refusal(&["no_imu.mcap", IMU, "/scheme/status"]);
    assert_eq!(html, "", "no page");
    rotary_sins(&["report", "/nowhere/at/all"]).expect_refusal(&["/nowhere/at/all"]);
}

/// The independent simulation, which has no truth inside and no status of a scheme.
#[test]
fn independent_eight_position_bag_has_its_page() {
    let Some(bag) = data_file("eight_position.mcap") else {
        return;
    };
    let (answer, html) = report(&bag, &scratch("report_independent"));
    let json = answer.expect_status(0).json();
    let calibrated = calibrate(&bag).expect_status(0).json();
    for key in [
        "gyroscope_drift_rad_s",
        "accelerometer_bias_m_s2",
        "samples",
    ] {
        assert_eq!(json[key], calibrated[key], "{key}");
    }
    assert_eq!(json["largest_error_sigmas"], Value::Null);
    assert_eq!(json["steps"], Value::Array(Vec::new()));
    assert!(html.contains("The bag has no status of a scheme"));
}

/// A live recording: the page has what the calibrator published, to the last bit, and the errors of both navigations.
#[test]
fn a_live_recording_has_the_estimates_of_the_run() {
    isolated(|| {
        let mut scene = Scene::new("report_live");
        scene.start(&Program::new("self_calibrator"));
        scene.start(&Program::new("navigation_compensator").parameter("output_rate_hz", "1.0"));
        let recording = scene.record(
            "recording",
            &[
                IMU,
                "/turntable/joint_states",
                "/scheme/status",
                "/fix",
                "/self_calibration/estimate",
                "/ground_truth/calibration",
                "/fix_ins",
                "/uncompensated/fix_ins",
                "/diagnostics",
            ],
        );
        let listener = Listener::new();
        let heard = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(10));
        let solutions = listener.hear::<NavSatFix>("/uncompensated/fix_ins", Qos::reliable(100));
        let joints = listener.hear::<JointState>("/turntable/joint_states", Qos::sensor());
        let end = calibrate(&converging()).expect_status(0).json()["stamp_ns"]
            .as_i64()
            .unwrap();
        // Calibrator, compensator and recorder.
        // The joints have this test as well.
        let everybody = [(IMU, 3), ("/turntable/joint_states", 4)];
        scene.finish(scene.play_to(&converging(), 300.0, &everybody));
        heard.wait_for("the last estimate", |e| e.header.stamp.nanos() >= end);
        solutions.wait_for("the last solution", |s| {
            s.header.stamp.nanos() >= end - NANOS_PER_SECOND
        });
        // The truth at the time of the last estimate needs the joints of that time.
        joints.wait_for("the last joint state", |joints| {
            joints.header.stamp.nanos() >= end
        });
        scene.end();

        let folder = scene.folder().to_owned();
        let (answer, html) = report(&recording, &folder);
        let json = answer.expect_status(0).json();
        assert_eq!(json["estimates"], "recorded");
        assert_eq!(json["verdict"], "converged");
        let all = estimates(&recording);
        let last = all.last().unwrap();
        assert_eq!(vector(&json, "gyroscope_drift_rad_s"), last.gyroscope_drift);
        assert_eq!(vector(&json, "misalignment_std_rad"), last.misalignment_std);
        assert_eq!(json["samples"], last.samples);
        assert!(json["misalignment_error_rad"].is_array(), "{json}");
        let largest = |which: &str| {
            let error = &json["position_error"][which]["max_nmi"];
            error
                .as_f64()
                .unwrap_or_else(|| panic!("{which} in {json}"))
        };
        let (with, without) = (largest("compensated"), largest("uncompensated"));
        assert!(with < without && without < 3.0, "{with} nmi, {without} nmi");
        let figures = json["figures"].as_array().unwrap();
        assert!(figures.contains(&"position".into()), "{figures:?}");
        assert!(html.contains("as the bag has them"));
    });
}
