//! Actions against real rclpy, both ways: the simulator as a table, a table in rclpy for the sequencer, and the calibrator;
//! and the suite's nodes among themselves.

use std::path::Path;

use ros_node::Qos;
use ros2_interfaces::control_msgs::FollowJointTrajectoryResult as Outcome;
use rotary_sins_msgs::SchemeStatus;
use serde_json::{Value, json};
use suite_tests::{
    Listener, Peer, Program, Scene, each_distribution, isolated, numbers, wait_until,
};

/// Of action_msgs/msg/GoalStatus.
const UNKNOWN: i64 = 0;
const SUCCEEDED: i64 = 4;
const CANCELED: i64 = 5;
const ABORTED: i64 = 6;
/// Of action_msgs/srv/CancelGoal.
const UNKNOWN_GOAL: i64 = 2;
const TERMINATED: i64 = 3;

each_distribution!(
    rclpy_moves_the_simulated_table,
    tolerances_are_kept_by_the_simulated_table,
    the_sequencer_moves_a_table_in_rclpy,
    rclpy_asks_for_a_calibration,
);

fn simulator(speed: &str) -> Program {
    Program::new("imu_simulator")
        .parameter("imu_rate_hz", "50.0")
        .parameter("speed", speed)
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key]
        .as_str()
        .unwrap_or_else(|| panic!("no text '{key}' in {value}"))
}

/// Status, error code and a part of the text of a motion.
fn assert_end(end: &Value, status: i64, code: i32, part: &str) {
    assert_eq!(end["status"], status, "{end}");
    assert_eq!(end["code"], code, "{end}");
    assert!(text(end, "text").contains(part), "'{part}' in {end}");
}

/// An rclpy ActionClient moves the simulated table: success with feedback, every kind of refusal, cancels, preemption by
/// goal and topic, results that are asked for late, ids that are unknown or used twice.
fn rclpy_moves_the_simulated_table(python: &Path) {
    let mut scene = Scene::new("action_table");
    scene.start(&simulator("4.0"));
    let ends = [
        "reached",
        "invalid",
        "cancelled",
        "preempted",
        "overruled",
        "all_of_them",
        "unknown",
        "twice",
        "positions",
    ]
    .iter()
    .fold(Peer::new(python, "follow.py"), Peer::arg)
    .ask();
    scene.end();

    let reached = &ends["reached"];
    assert_end(reached, SUCCEEDED, Outcome::SUCCESSFUL, "");
    assert_eq!(reached["late"], json!([SUCCEEDED, Outcome::SUCCESSFUL]));
    for (at, target) in numbers(&reached["position"]).iter().zip([0.3, -0.2]) {
        assert!((at - target).abs() < 1e-9, "{reached}");
    }
    // 2 s at ten a second of simulated time.
    let count = reached["feedback"].as_u64().unwrap();
    assert!((15..=21).contains(&count), "{reached}");
    let middle = &reached["middle"];
    let desired = numbers(&middle["desired"]["positions"]);
    assert!(
        desired[0] > 0.0 && desired[0] < 0.3 && desired[1] < 0.0,
        "{middle}"
    );
    assert_eq!(numbers(&middle["actual"]["positions"]), desired);
    assert_eq!(numbers(&middle["error"]["positions"]), [0.0, 0.0]);
    assert_eq!(middle["joint_names"], json!(["outer_joint", "inner_joint"]));

    let positions = &ends["positions"];
    assert_end(positions, SUCCEEDED, Outcome::SUCCESSFUL, "");
    for (at, target) in numbers(&positions["position"]).iter().zip([0.1, 0.2]) {
        assert!((at - target).abs() < 1e-9, "{positions}");
    }

    let invalid = &ends["invalid"];
    assert_end(
        &invalid["joints"],
        ABORTED,
        Outcome::INVALID_JOINTS,
        "elbow",
    );
    assert_end(
        &invalid["times"],
        ABORTED,
        Outcome::INVALID_GOAL,
        "times grow",
    );
    assert_end(&invalid["numbers"], ABORTED, Outcome::INVALID_GOAL, "NaN");
    assert_end(
        &invalid["empty"],
        ABORTED,
        Outcome::INVALID_GOAL,
        "no points",
    );
    assert_end(
        &invalid["old"],
        ABORTED,
        Outcome::OLD_HEADER_TIMESTAMP,
        "over",
    );

    let cancelled = &ends["cancelled"];
    assert_end(cancelled, CANCELED, Outcome::SUCCESSFUL, "cancelled");
    assert_eq!(cancelled["cancels"], json!([0, 1]));
    assert_eq!(cancelled["again"], TERMINATED);
    let at = numbers(&cancelled["position"])[0];
    assert!(at > 0.3 && at < 1.4, "stopped on the way: {cancelled}");

    let preempted = &ends["preempted"];
    assert_end(
        &preempted["first"],
        ABORTED,
        Outcome::INVALID_GOAL,
        "a newer goal",
    );
    assert_end(&preempted["second"], SUCCEEDED, Outcome::SUCCESSFUL, "");
    assert_end(
        &ends["overruled"],
        ABORTED,
        Outcome::INVALID_GOAL,
        "a trajectory of the topic",
    );
    assert_end(
        &ends["all_of_them"],
        CANCELED,
        Outcome::SUCCESSFUL,
        "cancelled",
    );
    assert_eq!(ends["all_of_them"]["cancels"], 1);
    assert_eq!(
        ends["unknown"],
        json!({"status": UNKNOWN, "cancel": UNKNOWN_GOAL})
    );
    let twice = &ends["twice"];
    assert_eq!(twice["second"], false);
    assert_end(&twice["first"], SUCCEEDED, Outcome::SUCCESSFUL, "");
    assert_eq!(twice["statuses"], json!([SUCCEEDED]));
}

/// A joint that does not move violates the tolerance of the path or of the goal, unless the goal permits anything.
fn tolerances_are_kept_by_the_simulated_table(python: &Path) {
    let mut scene = Scene::new("action_tolerances");
    scene.start(&simulator("4.0").parameter("stuck_joint", "outer"));
    let ends = ["off_the_path", "not_there", "tolerated"]
        .iter()
        .fold(Peer::new(python, "follow.py"), Peer::arg)
        .ask();
    scene.end();
    let end = &ends["off_the_path"];
    assert_end(
        end,
        ABORTED,
        Outcome::PATH_TOLERANCE_VIOLATED,
        "outer_joint is at 0.0000 deg",
    );
    let end = &ends["not_there"];
    assert_end(
        end,
        ABORTED,
        Outcome::GOAL_TOLERANCE_VIOLATED,
        "desired 28.6479",
    );
    assert_end(&ends["tolerated"], SUCCEEDED, Outcome::SUCCESSFUL, "");
}

/// A table in rclpy: the sequencer runs its scheme by goals, pauses by a cancel and goes on; and whatever way the table
/// fails, the scheme ends in a fault that names the action and the reason.
fn the_sequencer_moves_a_table_in_rclpy(python: &Path) {
    let mut scene = Scene::new("action_sequencer");
    scene.start(
        &Program::new("scheme_sequencer")
            .parameter("table_interface", "action")
            .parameter("dwell_s", "0.5")
            .parameter("rate_deg_per_s", "90.0")
            .parameter("acceleration_deg_per_s2", "180.0")
            .parameter("settling_s", "0.2")
            .parameter("command_lead_s", "0.2")
            .parameter("arrival_timeout_s", "2.0"),
    );
    let found = Peer::new(python, "table.py").ask();
    scene.end();

    let obey = &found["obey"];
    assert!(obey["goals"].as_i64().unwrap() >= 2, "{obey}");
    assert_eq!(obey["names"], json!(["outer_joint", "inner_joint"]));
    for tolerance in numbers(&obey["tolerance"]) {
        assert!((tolerance - 0.01f64.to_radians()).abs() < 1e-15, "{obey}");
    }
    assert_eq!(obey["time"], 1);
    assert_eq!(found["pause"], json!({"paused": true, "resumed": true}));
    assert_eq!(found["never cancelled"], 1);
    assert_eq!(
        found["late"],
        json!({"aborted": true, "goals_until_then": 0})
    );
    for (way, reason) in [
        (
            "fail",
            "the motion was aborted: path tolerance violated: outer_joint slips",
        ),
        ("reject", "the table rejects the motion"),
        (
            "never",
            "no result 2.0 s after the end of the motion: target ",
        ),
        ("cancelled", "the motion was cancelled by somebody else"),
        ("gone", "the server is gone"),
    ] {
        let message = text(&found, way);
        let expected = format!("action /turntable/follow_joint_trajectory: {reason}");
        assert!(message.starts_with(&expected), "{way}: {message}");
    }
}

/// The suite's own client and server, through a remapped name: the scheme runs, and a joint that is stuck is a fault in the
/// words of the table.
#[test]
fn sequencer_and_simulator_by_action() {
    isolated(|| {
        let name = "/joint_trajectory_controller/follow_joint_trajectory";
        let sequencer = Program::sequencer()
            .parameter("table_interface", "action")
            .parameter("dwell_s", "20.0")
            .remap("turntable/follow_joint_trajectory", name);
        let table = simulator("20.0").remap("turntable/follow_joint_trajectory", name);

        let mut scene = Scene::new("action_own");
        let listener = Listener::new();
        let statuses = listener.hear::<SchemeStatus>("/scheme/status", Qos::latched(10));
        let mut sequencing = scene.start_apart(&sequencer);
        let mut moving = scene.start_apart(&table);
        for arrival in 1..=2 {
            wait_until("the table arrives", || {
                sequencing.log().matches("arrived at").count() > arrival
            });
        }
        moving.interrupt();
        sequencing.interrupt();
        statuses.wait_for("the second rotation is over", |status| status.step >= 2);
        scene.end();
        let is_fault = |status: &SchemeStatus| status.state == SchemeStatus::FAULT;
        assert!(!statuses.all().iter().any(is_fault), "{statuses:?}");

        let mut scene = Scene::new("action_stuck");
        let mut sequencing = scene.start_apart(&sequencer);
        scene.start(&table.parameter("stuck_joint", "both"));
        let fault = format!("action {name}: the motion was aborted: goal tolerance violated: ");
        sequencing.wait_for_line(&fault);
        sequencing.interrupt();
        scene.end();
    });
}

/// Every way in which a SelfCalibrate goal ends: refused, by its time limit with the last good calibration, by another
/// scheme, converged, cancelled with the calibrator going on, by a cleanup of its node.
fn rclpy_asks_for_a_calibration(python: &Path) {
    let mut scene = Scene::new("action_calibrate");
    scene.start(
        &Program::new("self_calibrator")
            .parameter("coarse_alignment_s", "60.0")
            .parameter("silence_s", "0.5")
            .parameter("innovation_window_updates", "20"),
    );
    scene.start(&Program::sequencer().parameter("dwell_s", "20.0"));
    let samples = Program::new("imu_simulator")
        .parameter("imu_rate_hz", "20.0")
        .parameter("speed", "40.0");
    let mut simulator = scene.start_apart(&samples);
    let found = Peer::new(python, "self_calibrate.py").ask();
    simulator.interrupt();
    let silent = Peer::new(python, "self_calibrate.py").arg("silent").ask();
    let mut simulator = scene.start_apart(&samples);
    let cleaned_up = Peer::new(python, "self_calibrate.py").arg("cleanup").ask();
    simulator.interrupt();
    scene.end();

    // A goal in the midst of which its node is cleaned up has not converged, whatever a default of the result would say.
    assert_eq!(cleaned_up["status"], ABORTED, "{cleaned_up}");
    assert_eq!(cleaned_up["result"]["code"], 4, "{cleaned_up}");

    assert_eq!(silent["status"], ABORTED, "{silent}");
    assert_eq!(silent["result"]["code"], 5);
    assert_eq!(
        text(&silent["result"], "message"),
        "no /imu/data_raw for 5 s"
    );
    assert_eq!(silent["result"]["calibration"]["valid"], true);

    assert_eq!(found["nonsense"], false);
    assert_eq!(found["not a number"], false);
    assert_eq!(found["negative"], false);
    assert_eq!(found["second"], false, "a goal beside another");

    let limit = &found["time limit"];
    assert_eq!(limit["status"], ABORTED, "{limit}");
    assert_eq!(limit["result"]["code"], 1);
    assert!(text(&limit["result"], "message").starts_with("not converged within 90 s"));
    let calibration = &limit["result"]["calibration"];
    assert_eq!(calibration["valid"], true, "{calibration}");
    assert_eq!(calibration["converged"], false);
    assert!(
        numbers(&calibration["gyroscope_drift_std"])
            .iter()
            .all(|std| *std > 0.0)
    );
    follow_feedback(limit["feedback"].as_array().unwrap());

    let wrong = &found["wrong scheme"];
    assert_eq!(wrong["status"], ABORTED, "{wrong}");
    assert_eq!(wrong["result"]["code"], 3);
    assert_eq!(
        text(&wrong["result"], "message"),
        "the scheme is eight-position, the goal asks for static"
    );

    let converged = &found["converged"];
    assert_eq!(converged["status"], SUCCEEDED, "{converged}");
    assert_eq!(converged["result"]["code"], 0);
    let calibration = &converged["result"]["calibration"];
    assert_eq!(calibration["valid"], true);
    assert_eq!(calibration["converged"], true);
    for (std, limit) in [
        ("gyroscope_drift_std", 1f64.to_radians() / 3600.0),
        ("accelerometer_bias_std", 0.1),
    ] {
        let std = numbers(&calibration[std]);
        assert!(std.iter().all(|std| *std > 0.0 && *std <= limit), "{std:?}");
    }
    let feedback = converged["feedback"].as_array().unwrap();
    let last = feedback.last().unwrap();
    assert_eq!(last["progress"], 1.0, "{last}");
    assert_eq!(last["phase_name"], "converged");

    let cancelled = &found["cancelled"];
    assert_eq!(cancelled["code"], 0, "{cancelled}");
    assert_eq!(cancelled["status"], CANCELED);
    assert_eq!(cancelled["result"]["code"], 2);
    assert_eq!(cancelled["result"]["calibration"]["valid"], true);
    assert_eq!(cancelled["result"]["calibration"]["converged"], false);
    // The estimate goes on, and is no longer judged by what the goals asked for.
    let after = &found["after"];
    assert!(
        after["duration"].as_f64().unwrap() > calibration["duration"].as_f64().unwrap(),
        "{after}"
    );
    assert_eq!(after["phase"], "calibrating");
}

/// From the restart on: time counts up from 0, progress is that of coarse alignment first, sigmas become known.
fn follow_feedback(feedback: &[Value]) {
    let of =
        |key: &str| -> Vec<f64> { feedback.iter().map(|f| f[key].as_f64().unwrap()).collect() };
    let elapsed = of("elapsed");
    assert_eq!(elapsed[0], 0.0);
    assert!(
        elapsed.windows(2).all(|pair| pair[0] <= pair[1]),
        "{elapsed:?}"
    );
    assert!(*elapsed.last().unwrap() >= 90.0, "{elapsed:?}");
    let progress = of("progress");
    assert!(
        progress.iter().all(|share| (0.0..=1.0).contains(share)),
        "{progress:?}"
    );
    let (first, last) = (&feedback[0], feedback.last().unwrap());
    assert_eq!(first["phase_name"], "coarse_alignment");
    assert_eq!(numbers(&first["gyroscope_drift_std"]), [-1.0; 3]);
    assert!(
        numbers(&last["misalignment_std"])
            .iter()
            .all(|std| *std > 0.0),
        "{last}"
    );
    assert_eq!(last["scheme"], "eight-position");
}
