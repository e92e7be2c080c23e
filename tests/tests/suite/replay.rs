//! Bags of our own simulator, replayed over DDS through the nodes in processes of their own.

use ros_node::Qos;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::rosgraph_msgs::Clock;
use ros2_interfaces::sensor_msgs::Imu;
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate};
use serde_json::Value;
use suite_tests::{
    Heard, Listener, Program, Scene, Simulation, assert_within_sigmas, calibrate, isolated,
    messages, sample, truth_of_sample, vector,
};

/// Multiple of real time: 1200 samples of the IMU a second and half as many joint states, 4 h in 24 s. A reader keeps 4000, so its
/// process may stand still for three seconds before it loses one.
const RATE: f64 = 600.0;

const ESTIMATE: &str = "/self_calibration/estimate";
const CALIBRATION: &str = "/self_calibration/calibration";

fn calibrator() -> Program {
    // At this rate what comes a second apart on a busy machine is ten minutes apart by the stamps.
    Program::new("self_calibrator")
        .parameter("joint_patience_s", "600.0")
        .parameter("velocity_patience_s", "600.0")
}

fn compensator() -> Program {
    Program::new("navigation_compensator").parameter("output_rate_hz", "1.0")
}

fn hear_estimates(listener: &Listener) -> Heard<SelfCalibrationEstimate> {
    listener.hear(ESTIMATE, Qos::latched(1000))
}

/// What `calibrate` makes of a bag that converges.
fn by_command_line(bag: &std::path::Path) -> Value {
    calibrate(bag).expect_status(0).json()
}

fn wait_for_the_last(
    estimates: &Heard<SelfCalibrationEstimate>,
    json: &Value,
) -> SelfCalibrationEstimate {
    estimates.wait_for("the last estimate of calibrate", |estimate| {
        json["stamp_ns"] == estimate.header.stamp.nanos()
    })
}

/// A replay that is ended by Ctrl-C says what was sent until then, and ends well.
#[test]
fn a_replay_that_is_ended_says_what_was_sent() {
    let bag = sample("eight_position");
    isolated(|| {
        let scene = Scene::new("play_ended");
        let listener = Listener::new();
        let samples = listener.hear::<Imu>("/imu/data_raw", Qos::sensor());
        let mut player = scene.play(&bag, 1.0, 1);
        samples.wait_for("a sample", |_| true);
        player.interrupt();
        let log = player.log();
        let sent = log.lines().find_map(|line| {
            let words = line.strip_suffix(" messages sent")?;
            words.rsplit(' ').next()?.parse::<usize>().ok()
        });
        assert!(sent.is_some_and(|sent| sent > 0), "{log}");
        assert!(log.contains("ended before the end of the bag"), "{log}");
    });
}

/// Every drift and bias within 3.5 of its own sigmas of the truth beside the bag.
fn assert_converged(estimate: &SelfCalibrationEstimate, truth: &Value) {
    assert_eq!(estimate.phase_name, "converged");
    assert_within_sigmas(
        "gyroscope drift [rad/s]",
        &estimate.gyroscope_drift,
        &vector(truth, "gyroscope_drift_rad_s"),
        &estimate.gyroscope_drift_std,
        3.5,
    );
    assert_within_sigmas(
        "accelerometer bias [m/s^2]",
        &estimate.accelerometer_bias,
        &vector(truth, "accelerometer_bias_m_s2"),
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

/// A bag that ships, replayed through both nodes: the estimate converges to the truth, no sample is lost, and it is, to the
/// last bit, what `calibrate` makes of the same bag.
fn replay_converges_and_equals_the_command_line(name: &str) {
    let bag = sample(name);
    let json = by_command_line(&bag);
    let mut scene = Scene::new("replay_equals");
    let listener = Listener::new();
    let estimates = hear_estimates(&listener);
    let calibrations = listener.hear::<Calibration>(CALIBRATION, Qos::latched(10));
    let odometry = listener.hear::<Odometry>("/odometry", Qos::sensor());
    scene.start(&calibrator());
    let mut compensator = scene.start_apart(&compensator());
    scene.finish(scene.play(&bag, RATE, 2));
    let last = wait_for_the_last(&estimates, &json);
    let end = last.header.stamp.nanos();
    odometry.wait_for("the last solution", |solution| {
        end - solution.header.stamp.nanos() < 2_000_000_000
    });
    compensator.interrupt();
    scene.end();

    assert_eq!((last.gaps, last.lost_samples), (0, 0), "{}", last.message);
    assert_converged(&last, &truth_of_sample(name));
    let first = calibrations.wait_for("a calibration", |_| true);
    assert!(first.converged && first.valid);
    assert!(!compensator.log().contains("samples lost"));
    let solutions = odometry.all().len();
    assert!(solutions > 1000, "{solutions} odometry messages");

    assert_eq!(json["phase"], "converged");
    assert_same_bits("state", &last.state, &json, "state");
    assert_same_bits("covariance", &last.covariance, &json, "covariance");
    let drift = "gyroscope_drift_rad_s";
    assert_same_bits(drift, &last.gyroscope_drift, &json, drift);
    let bias = "accelerometer_bias_m_s2";
    assert_same_bits(bias, &last.accelerometer_bias, &json, bias);
    let q = &last.attitude;
    assert_same_bits("attitude", &[q.x, q.y, q.z, q.w], &json, "attitude_xyzw");
}

/// The eight positions.
#[test]
fn eight_positions_converge() {
    isolated(|| replay_converges_and_equals_the_command_line("eight_position"));
}

/// The paper's experiment: at rest for 0.7 h, then the scheme.
#[test]
fn the_papers_experiment_converges() {
    isolated(|| replay_converges_and_equals_the_command_line("paper_experiment"));
}

/// Another place, another heading, a ship that does not lie level, other errors.
#[test]
fn a_ship_elsewhere_converges() {
    isolated(|| replay_converges_and_equals_the_command_line("elsewhere"));
}

/// A ring laser with all its residuals on a table with its own: the whole model, with encoders.
#[test]
fn a_real_sensor_converges() {
    isolated(|| replay_converges_and_equals_the_command_line("real_sensor"));
}

/// A ship that rolls at her mooring: positions are what she is calibrated by.
#[test]
fn a_ship_in_a_sea_converges() {
    isolated(|| replay_converges_and_equals_the_command_line("moored_sea"));
}

/// 10 000 samples of the IMU a second through the calibrator, and every one of them is used.
#[test]
fn ten_thousand_samples_a_second_lose_nothing() {
    isolated(|| {
        let bag = Simulation::new("eight-position", 0.5, 100.0, 21).bag();
        let samples = messages::<Imu>(&bag, "/imu/data_raw");
        let end = samples.last().unwrap().header.stamp.nanos();
        let mut scene = Scene::new("ten_thousand");
        let listener = Listener::new();
        let estimates = hear_estimates(&listener);
        // As deep as the queue has to be where the machine does something else for seconds.
        scene.start(&calibrator().parameter("queue_depth", "50000"));
        scene.finish(scene.play(&bag, 100.0, 1));
        let last = estimates.wait_for("the last estimate", |estimate| {
            end - estimate.header.stamp.nanos() < 1_000_000_000
        });
        scene.end();
        assert_eq!((last.gaps, last.lost_samples), (0, 0), "{}", last.message);
        // The first ones may be sent before the calibrator has been found.
        let samples = samples.len() as u64;
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
        let name = "eight_position";
        let json = by_command_line(&sample(name));
        let mut scene = Scene::new("killed_calibrator");
        let listener = Listener::new();
        let estimates = hear_estimates(&listener);
        let odometry = listener.hear::<Odometry>("/odometry", Qos::sensor());
        let mut first = scene.start_apart(&calibrator());
        let mut compensator = scene.start_apart(&compensator());
        let player = scene.play(&sample(name), RATE, 2);
        first.wait_for_line("-> calibrating");
        first.kill();
        let mut second = scene.start_apart(&calibrator().label("self_calibrator_again"));
        second.wait_for_line("-> calibrating");
        assert!(compensator.is_running());
        scene.finish(player);
        // The second one counts its seconds from its own first sample.
        let end = json["stamp_ns"].as_i64().unwrap() - 1_000_000_000;
        let last = estimates.wait_for("an estimate of the last second", |estimate| {
            estimate.header.stamp.nanos() > end
        });
        odometry.wait_for("the last solution", |solution| {
            last.header.stamp.nanos() - solution.header.stamp.nanos() < 5_000_000_000
        });
        second.interrupt();
        compensator.interrupt();
        scene.end();

        // The time that an alignment has lasted falls back once.
        let restarts = estimates
            .all()
            .windows(2)
            .filter(|w| w[1].duration < w[0].duration)
            .count();
        assert_eq!(restarts, 1);
        assert_converged(&last, &truth_of_sample(name));
    });
}

/// A compensator that starts after the calibration was published gets it, and navigates with it.
#[test]
fn late_compensator_gets_the_latched_calibration() {
    isolated(|| {
        let scene = Scene::new("late_compensator");
        let mut calibrator = scene.start_apart(&calibrator());
        let player = scene.play(&sample("eight_position"), RATE, 1);
        calibrator.wait_for_line("-> converged");
        let mut late = scene.start_apart(&compensator());
        late.wait_for_line("calibration from /self_calibrator");
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
        let listener = Listener::new();
        let time = listener.hear::<Clock>("/clock", Qos::best_effort(1));
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
        recorder.wait_for_line("recording /imu/data_raw");
        let from = time.latest().map_or(0, |now| now.clock.nanos());
        time.wait_for("half a minute, with 30 000 samples", |now| {
            now.clock.nanos() > from + 30_000_000_000
        });
        let status = recorder.end();
        simulator.interrupt();
        assert_eq!(status.code(), Some(3), "{}", recorder.log());
        assert!(recorder.log().contains("messages were lost"));
        // What there is, is whole.
        assert!(!messages::<Imu>(&bag, "/imu/data_raw").is_empty());
    });
}
