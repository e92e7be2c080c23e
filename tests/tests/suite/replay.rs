//! Bags of our own simulator, replayed over DDS through the nodes in processes of their own.
#![allow(clippy::unwrap_used)]

use std::time::Duration;

use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::Imu;
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate};
use serde_json::Value;
use suite_tests::{
    Program, Scene, Simulation, assert_within_sigmas, estimates, isolated, messages, rotary_sins,
    vector,
};

/// 4 h of the eight-position scheme, reading D, 10 Hz: 144 000 samples.
fn four_hours() -> Simulation {
    Simulation::new("eight-position", 4.0, 10.0, 20)
}

/// Multiple of real time: 3000 samples of the IMU a second, 4 h in 48 s. A reader whose process does not run for more
/// than a second loses samples; on a busy machine that must not happen.
const RATE: f64 = 300.0;
const PATIENCE: Duration = Duration::from_secs(120);

const ESTIMATE: &str = "/self_calibration/estimate";
const CALIBRATION: &str = "/self_calibration/calibration";
const TRUTH: &str = "/ground_truth/calibration";

fn calibrator() -> Program {
    Program::new("self_calibrator")
}

fn compensator() -> Program {
    Program::new("navigation_compensator").parameter("output_rate_hz", "1.0")
}

/// Every drift and bias within 3.5 of its own sigmas of the truth that the simulator wrote into the bag.
fn assert_converged(estimate: &SelfCalibrationEstimate, truth: &Calibration) {
    assert_eq!(estimate.phase_name, "converged");
    assert_within_sigmas(
        "gyroscope drift [rad/s]",
        &estimate.gyroscope_drift,
        &truth.gyroscope_drift,
        &estimate.gyroscope_drift_std,
        3.5,
    );
    assert_within_sigmas(
        "accelerometer bias [m/s^2]",
        &estimate.accelerometer_bias,
        &truth.accelerometer_bias,
        &estimate.accelerometer_bias_std,
        3.5,
    );
}

/// Bit by bit, so that -0.0 and 0.0 differ too.
fn assert_same_bits(what: &str, node: &[f64], json: &Value, key: &str) {
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(
        bits(node),
        bits(&vector(json, key)),
        "{what}: node {node:?}, command line {}",
        json[key]
    );
}

/// A whole scheme replayed through both nodes: the estimate converges to the truth, no sample is lost, and it is, to the
/// last bit, what `calibrate` makes of the same bag.
#[test]
fn replay_converges_and_equals_the_command_line() {
    isolated(|| {
        let bag = four_hours().bag();
        let mut scene = Scene::new("replay_equals");
        scene.start(&calibrator());
        let mut compensator = scene.start_apart(&compensator());
        let recording = scene.record("recording", &[ESTIMATE, CALIBRATION, "/odometry"]);
        scene.finish(scene.play(&bag, RATE));
        compensator.interrupt();
        scene.end();

        let all = estimates(&recording);
        let last = all.last().unwrap();
        let truth: Vec<Calibration> = messages(&bag, TRUTH);
        assert_eq!((last.gaps, last.lost_samples), (0, 0), "{}", last.message);
        assert_converged(last, &truth[0]);
        let calibrations: Vec<Calibration> = messages(&recording, CALIBRATION);
        assert!(calibrations[0].converged && calibrations[0].valid);
        assert!(!compensator.log().contains("samples lost"));
        let odometry: Vec<Odometry> = messages(&recording, "/odometry");
        assert!(
            odometry.len() > 1000,
            "{} odometry messages",
            odometry.len()
        );

        let json = rotary_sins(&["calibrate", bag.to_str().unwrap(), "--json"])
            .expect_status(0)
            .json();
        let stamp = &last.header.stamp;
        let stamp_ns = i64::from(stamp.sec) * 1_000_000_000 + i64::from(stamp.nanosec);
        assert_eq!(json["stamp_ns"], stamp_ns);
        assert_eq!(json["phase"], "converged");
        assert_same_bits("state", &last.state, &json, "state");
        assert_same_bits("covariance", &last.covariance, &json, "covariance");
        let drift = "gyroscope_drift_rad_s";
        assert_same_bits(drift, &last.gyroscope_drift, &json, drift);
        let bias = "accelerometer_bias_m_s2";
        assert_same_bits(bias, &last.accelerometer_bias, &json, bias);
        let q = &last.attitude;
        assert_same_bits("attitude", &[q.x, q.y, q.z, q.w], &json, "attitude_xyzw");
    });
}

/// 10 000 samples of the IMU a second through the calibrator, and every one of them is used.
#[test]
fn ten_thousand_samples_a_second_lose_nothing() {
    isolated(|| {
        let bag = Simulation::new("eight-position", 0.5, 100.0, 21).bag();
        let mut scene = Scene::new("ten_thousand");
        // As deep as the queue has to be where the machine does something else for seconds.
        scene.start(&calibrator().parameter("queue_depth", "50000"));
        let recording = scene.record("recording", &[ESTIMATE]);
        scene.finish(scene.play(&bag, 100.0));
        scene.end();

        let last = estimates(&recording).pop().unwrap();
        let samples = messages::<Imu>(&bag, "/imu/data_raw").len() as u64;
        assert_eq!((last.gaps, last.lost_samples), (0, 0), "{}", last.message);
        // The first ones may be sent before the calibrator has been found.
        assert!(
            last.samples > samples * 9 / 10,
            "{} of {samples}",
            last.samples
        );
    });
}

/// A calibrator that is killed in the middle of a replay and started again aligns anew and converges; the compensator
/// goes on meanwhile.
#[test]
fn killed_calibrator_aligns_anew_and_converges() {
    isolated(|| {
        let bag = four_hours().bag();
        let mut scene = Scene::new("killed_calibrator");
        let mut first = scene.start_apart(&calibrator());
        let mut compensator = scene.start_apart(&compensator());
        let recording = scene.record("recording", &[ESTIMATE, "/odometry"]);
        let player = scene.play(&bag, RATE);
        first.wait_for_line("-> calibrating", PATIENCE);
        first.kill();
        let mut second = scene.start_apart(&calibrator().label("self_calibrator_again"));
        second.wait_for_line("-> calibrating", PATIENCE);
        assert!(compensator.is_running());
        scene.finish(player);
        second.interrupt();
        compensator.interrupt();
        scene.end();

        let all = estimates(&recording);
        // The time that an alignment has lasted falls back once.
        let restarts = all
            .windows(2)
            .filter(|w| w[1].duration < w[0].duration)
            .count();
        assert_eq!(restarts, 1);
        let truth: Vec<Calibration> = messages(&bag, TRUTH);
        assert_converged(all.last().unwrap(), &truth[0]);
        let odometry: Vec<Odometry> = messages(&recording, "/odometry");
        let last = odometry.last().unwrap().header.stamp;
        let end = all.last().unwrap().header.stamp;
        assert!(
            i64::from(end.sec) - i64::from(last.sec) < 5,
            "odometry ends at {last:?}"
        );
    });
}

/// A compensator that starts after the calibration was published gets it, and navigates with it.
#[test]
fn late_compensator_gets_the_latched_calibration() {
    isolated(|| {
        let bag = four_hours().bag();
        let scene = Scene::new("late_compensator");
        let mut calibrator = scene.start_apart(&calibrator());
        let player = scene.play(&bag, RATE);
        calibrator.wait_for_line("-> converged", PATIENCE);
        let mut late = scene.start_apart(&compensator());
        late.wait_for_line("calibration from /self_calibrator", PATIENCE);
        scene.finish(player);
        calibrator.interrupt();
        late.interrupt();
    });
}

/// A recorder that cannot keep up says what it lost, and its exit status says that it lost something.
#[test]
fn losses_of_the_recorder_are_its_exit_status() {
    isolated(|| {
        let scene = Scene::new("recorder_loses");
        let bag = scene.folder().join("recording");
        let mut recorder = scene.start_apart(
            &Program::new("rotary-sins")
                .args("record /imu/data_raw --depth 1 --output")
                .arg(&bag),
        );
        let mut simulator = scene.start_apart(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "1000.0")
                .parameter("speed", "0.0"),
        );
        recorder.wait_for_line("recording /imu/data_raw", Duration::from_secs(20));
        std::thread::sleep(Duration::from_secs(3));
        let status = recorder.end();
        simulator.interrupt();
        assert_eq!(status.code(), Some(3), "{}", recorder.log());
        assert!(recorder.log().contains("messages were lost"));
        // What there is, is whole.
        assert!(!messages::<Imu>(&bag, "/imu/data_raw").is_empty());
    });
}
