//! The manners of a ROS 2 node, judged by rclpy: lifecycle, type descriptions, quality of service, time.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use ros_node::Qos;
use ros2_interfaces::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use ros2_interfaces::sensor_msgs::NavSatFix;
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate};
use serde_json::{Value, json};
use suite_tests::{
    Answer, Listener, Peer, Program, Scene, Simulation, calibrate, each_distribution, executable,
    isolated, namespaces_are_permitted, peer_python, repository, rotary_sins, skip, vector,
    wait_until,
};

each_distribution!(
    a_lifecycle_manager_rules_a_node,
    a_node_that_cannot_be_configured_stays_unconfigured,
    type_descriptions_are_those_of_rclpy,
    quality_of_service_by_parameter,
    a_dump_of_parameters_is_taken_again,
    incompatible_quality_of_service_is_told,
    the_time_can_be_changed_while_a_node_runs,
    nodes_leave_the_graph_at_once,
);

fn simulator() -> Program {
    Program::new("imu_simulator").parameter("imu_rate_hz", "50.0")
}

/// The states and transitions of a node are those of a lifecycle node of rclpy; a manager takes it through all of them,
/// and in each of them it does what is asked of a node in this state.
fn a_lifecycle_manager_rules_a_node(python: &Path) {
    let mut scene = Scene::new("lifecycle");
    scene.start(&simulator().parameter("lifecycle_autostart", "false"));
    let answer = Peer::new(python, "lifecycle.py")
        .arg("/imu_simulator")
        .arg("/imu/data_raw")
        .arg("sensor_msgs/msg/Imu")
        .ask();
    scene.end();
    assert_eq!(answer["refused"], false);
    let graphs = &answer["graphs"];
    assert_eq!(graphs["ours"], graphs["reference"]);
    let steps = answer["steps"].as_array().unwrap();
    // State, and whether the topic speaks.
    let expected = [
        ("unconfigured", false),
        ("inactive", false),
        ("active", true),
        ("inactive", false),
        ("unconfigured", false),
        ("inactive", false),
        ("active", true),
        ("finalized", false),
    ];
    assert_eq!(steps.len(), expected.len());
    for (step, (state, speaks)) in steps.iter().zip(expected) {
        assert_eq!(step["state"], state, "{steps:?}");
        assert_eq!(step["messages"].as_u64().unwrap() > 25, speaks, "{step}");
        assert!(speaks || step["messages"] == 0, "{step}");
    }
    // Endpoints come with `configure`. That they go with `cleanup` Fast DDS does not hear: RustDDS disposes by
    // serialized key, which it does not read.
    let publishers: Vec<&Value> = steps.iter().map(|step| &step["publishers"]).collect();
    assert_eq!(publishers[..3], [&json!(0), &json!(1), &json!(1)]);
    let events: Vec<&str> = answer["events"]
        .as_array()
        .unwrap()
        .iter()
        .map(|event| event.as_str().unwrap())
        .collect();
    let around = |name: &str, via: &str, from: &str, to: &str| {
        [
            format!("{from} {name} {via}"),
            format!("{via} transition_success {to}"),
        ]
    };
    let up = [
        around("configure", "configuring", "unconfigured", "inactive"),
        around("activate", "activating", "inactive", "active"),
    ];
    let down = [
        around("deactivate", "deactivating", "active", "inactive"),
        around("cleanup", "cleaningup", "inactive", "unconfigured"),
    ];
    let end = [around("shutdown", "shuttingdown", "active", "finalized")];
    let expected: Vec<String> = up
        .iter()
        .chain(&down)
        .chain(&up)
        .chain(&end)
        .flatten()
        .cloned()
        .collect();
    assert_eq!(events, expected);
}

/// Unmanaged use needs no manager: a node is active by itself. What fails at configuring leaves a managed node
/// unconfigured, with the reason in its log, and the process alive.
fn a_node_that_cannot_be_configured_stays_unconfigured(python: &Path) {
    let mut scene = Scene::new("lifecycle_failure");
    let mut node = scene.start_apart(
        &simulator()
            .parameter("lifecycle_autostart", "false")
            .parameter("wait_for_subscribers", "['no/such/topic:1']"),
    );
    let answers = Peer::new(python, "change_state.py")
        .arg("/imu_simulator")
        .arg("1")
        .ask();
    assert_eq!(
        answers,
        json!([{"success": false, "state": "unconfigured"}])
    );
    assert!(node.is_running());
    node.wait_for_line("no/such/topic");
    node.interrupt();
    scene.start(&simulator());
    let answers = Peer::new(python, "change_state.py")
        .arg("/imu_simulator")
        .ask();
    assert_eq!(answers, json!([{"success": true, "state": "active"}]));
    scene.end();
}

/// What a node tells of a type is, field by field, what rclpy tells of it; a type that it does not know has a reason.
fn type_descriptions_are_those_of_rclpy(python: &Path) {
    let types = [
        "sensor_msgs/msg/Imu",
        "nav_msgs/msg/Odometry",
        "diagnostic_msgs/msg/DiagnosticArray",
        "rotary_sins_msgs/msg/Calibration",
    ];
    let mut scene = Scene::new("type_description");
    // It publishes or hears all of them; a node answers for the types that it uses.
    scene.start(&Program::new("navigation_compensator"));
    let peer = Peer::new(python, "type_description.py").arg("/navigation_compensator");
    let answer = types.iter().fold(peer, Peer::arg).ask();
    scene.end();
    for name in types {
        let (ours, reference) = (&answer[name]["ours"], &answer[name]["reference"]);
        assert_eq!(ours["successful"], true, "{name}: {ours}");
        assert_eq!(
            ours["type_description"], reference["type_description"],
            "{name}"
        );
        let sources = |answer: &Value| -> Vec<Value> {
            let sources = answer["type_sources"].as_array().unwrap();
            let mut names: Vec<_> = sources.iter().map(|s| s["type_name"].clone()).collect();
            names.sort_by_key(ToString::to_string);
            names
        };
        assert_eq!(sources(ours), sources(reference), "{name}");
    }
    assert_eq!(answer["unknown"]["successful"], false);
    assert!(
        answer["unknown"]["failure_reason"]
            .as_str()
            .unwrap()
            .contains("PointCloud2"),
        "{answer}"
    );
}

/// Quality of service is what a parameter says, under the topic's name after remapping.
fn quality_of_service_by_parameter(python: &Path) {
    let mut scene = Scene::new("qos_overrides");
    scene.start(
        &simulator()
            .remap("imu/data_raw", "/ship/imu")
            .parameter(
                "qos_overrides./ship/imu.publisher.reliability",
                "best_effort",
            )
            .parameter("qos_overrides./ship/imu.publisher.depth", "7"),
    );
    let peer = Peer::new(python, "observe.py");
    let seen = ["/ship/imu", "sensor_msgs/msg/Imu", "20B"]
        .iter()
        .fold(peer, Peer::arg)
        .ask();
    let told = Peer::new(python, "parameters.py")
        .arg("imu_simulator")
        .arg("qos_overrides./ship/imu.publisher.depth")
        .arg("9")
        .ask();
    scene.end();
    assert_eq!(
        seen["publishers"]["/ship/imu"],
        json!([{
            "node": "imu_simulator",
            "type": "sensor_msgs/msg/Imu",
            "reliability": "BEST_EFFORT",
            "durability": "VOLATILE"
        }])
    );
    assert_eq!((&told["before"], &told["after"]), (&json!(7), &json!(7)));
    assert_eq!(told["set"]["successful"], false);
}

/// What `ros2 param dump` writes is taken by `--params-file`, whether the node lives in simulated time or not; what may be set
/// while it runs has been set; and only streams have overrides.
fn a_dump_of_parameters_is_taken_again(python: &Path) {
    let mut scene = Scene::new("dump");
    let files = ["first.yaml", "second.yaml"].map(|name| scene.folder().join(name));
    let dump = |file: &Path, change: &[&str]| {
        let peer = Peer::new(python, "dump.py")
            .arg("/self_calibrator")
            .arg(file);
        change.iter().fold(peer, Peer::arg).ask()
    };
    let mut node =
        scene.start_apart(&Program::new("self_calibrator").parameter("use_sim_time", "true"));
    let listener = Listener::new();
    let diagnostics = listener.hear::<DiagnosticArray>("/diagnostics", Qos::reliable(100));
    let silent = |array: &DiagnosticArray| {
        array
            .status
            .iter()
            .any(|status| status.message.contains("no /imu/data_raw for"))
    };
    diagnostics.wait_for("nobody speaks", silent);
    let change = ["azimuth_threshold_arcmin", "2.5", "silence_s", "3600.0"];
    let first = dump(&files[0], &change);
    assert_eq!(first["set"]["successful"], true, "{first}");
    node.wait_for_line("the thresholds were changed");
    // What was said before is past: from here on silence is no fault.
    let said = diagnostics.all().len();
    wait_until("silence is no fault any more", || {
        let of_input = |array: &&DiagnosticArray| {
            let about = |status: &DiagnosticStatus| status.message.contains("/imu/data_raw");
            array.status.iter().any(about)
        };
        let all = diagnostics.all();
        all[said..]
            .iter()
            .rfind(of_input)
            .is_some_and(|array| !silent(array))
    });
    node.interrupt();

    let again = Program::new("self_calibrator").parameters_of(&files[0]);
    let mut node = scene.start_apart(&again.clone().parameter("use_sim_time", "false"));
    let second = dump(&files[1], &["azimuth_threshold_arcmin", "-1.0"]);
    assert_eq!(second["set"]["successful"], false, "{second}");
    node.interrupt();
    assert!(!node.log().contains("unknown parameter"), "{}", node.log());
    assert_eq!(first["names"], second["names"]);
    let [one, other] = files.map(|file| std::fs::read_to_string(file).unwrap());
    assert!(one.contains("azimuth_threshold_arcmin: 2.5"), "{one}");
    assert!(one.contains("silence_s: 3600.0"), "{one}");
    assert_eq!(
        one.replace("use_sim_time: true", "use_sim_time: false"),
        other
    );

    let of_topics: BTreeSet<&str> = first["names"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|name| name.as_str()?.strip_prefix("qos_overrides."))
        .filter_map(|rest| rest.split('.').next())
        .collect();
    let streams = ["/clock", "/fix", "/imu/data_raw", "/turntable/joint_states"];
    assert_eq!(of_topics, BTreeSet::from(streams));
    scene.end();
}

/// A sequencer that a manager has configured and not activated refuses to start its scheme, and says why; active, it starts.
#[test]
fn an_inactive_sequencer_starts_nothing() {
    const CONFIGURE: u8 = 1;
    const ACTIVATE: u8 = 3;
    isolated(|| {
        let mut scene = Scene::new("inactive");
        scene.start(&simulator());
        let managed = Program::new("scheme_sequencer").parameter("lifecycle_autostart", "false");
        let mut sequencer = scene.start_apart(&managed);
        let manager = Listener::new();
        assert!(manager.change_state("/scheme_sequencer", CONFIGURE));
        let told = manager.trigger("/scheme_sequencer/start");
        assert!(!told.success, "{told:?}");
        assert_eq!(told.message, "the node is not active");
        assert!(manager.change_state("/scheme_sequencer", ACTIVATE));
        let told = manager.trigger("/scheme_sequencer/start");
        assert!(told.success, "{told:?}");
        sequencer.interrupt();
        scene.end();
    });
}

/// An input that was remapped is called as it is called on the network, in /diagnostics and in the log, and nowhere by the name that it
/// would have had.
#[test]
fn a_remapped_input_is_told_by_its_name() {
    isolated(|| {
        let scene = Scene::new("remapped_input");
        let remapped = Program::new("self_calibrator")
            .parameter("silence_s", "1.0")
            .remap("imu/data_raw", "/ship/imu")
            .remap("fix", "/ship/fix");
        let mut node = scene.start_apart(&remapped);
        let listener = Listener::new();
        let diagnostics = listener.hear::<DiagnosticArray>("/diagnostics", Qos::reliable(100));
        let array = diagnostics.wait_for("nobody speaks", |array| {
            let silent = |status: &DiagnosticStatus| status.message.contains("no /ship/imu for");
            array.status.iter().any(silent)
        });
        assert!(!format!("{array:?}").contains("imu/data_raw"), "{array:?}");
        let voice = listener.speak::<NavSatFix>("/ship/fix", Qos::reliable(10));
        let nowhere = NavSatFix {
            latitude: 95.0,
            ..NavSatFix::default()
        };
        wait_until("a fix is refused", || {
            let _tried = voice.publish(nowhere.clone());
            node.log().contains("the message is left out")
        });
        let log = node.log();
        let line = log
            .lines()
            .find(|line| line.contains("the message is left out"));
        assert!(line.unwrap().contains("/ship/fix: "), "{log}");
        node.interrupt();
        assert!(!node.log().contains(" /fix"), "{}", node.log());
    });
}

/// A policy that makes no sense, and one for a topic that the node does not have, are told in one line each.
#[test]
fn overrides_without_meaning_are_told() {
    isolated(|| {
        let scene = Scene::new("qos_nonsense");
        let wrong = |name: &str, value: &str| {
            let program = simulator().parameter(name, value);
            scene.start_apart(&program)
        };
        let mut node = wrong(
            "qos_overrides./imu/data_raw.publisher.reliability",
            "sometimes",
        );
        assert_eq!(node.wait().code(), Some(2));
        let log = node.log();
        assert!(
            log.contains("'sometimes', expected string, one of reliable, best_effort"),
            "{log}"
        );

        let mut node = wrong("qos_overrides./imu/data.publisher.depth", "5");
        node.wait_for_line(
            "unknown parameter 'qos_overrides./imu/data.publisher.depth'; did you mean 'qos_overrides./imu/data_raw.publisher.depth'",
        );
        node.interrupt();
    });
}

/// A publisher that offers too little is an ERROR that names the topic and the policy.
fn incompatible_quality_of_service_is_told(python: &Path) {
    let mut scene = Scene::new("incompatible");
    scene.start(&Program::new("navigation_compensator").parameter("hardware_id", "rlg-7"));
    let answer = Peer::new(python, "incompatible.py")
        .arg("navigation_compensator")
        .arg("/self_calibration/calibration")
        .arg("rotary_sins_msgs/msg/Calibration")
        .ask();
    scene.end();
    assert_eq!(answer["level"], 2, "{answer}");
    assert_eq!(answer["hardware_id"], "rlg-7");
    let message = answer["message"].as_str().unwrap();
    for word in ["/self_calibration/calibration", "durability"] {
        assert!(message.contains(word), "{message}");
    }
}

/// `use_sim_time` can be set and unset while a node runs, and its time follows.
fn the_time_can_be_changed_while_a_node_runs(python: &Path) {
    let mut scene = Scene::new("use_sim_time");
    scene.start(&Program::new("self_calibrator"));
    let answer = Peer::new(python, "sim_time.py")
        .arg("self_calibrator")
        .ask();
    scene.end();
    assert!(
        answer["error_of_the_last_s"].as_f64().unwrap() < 30.0,
        "{answer}"
    );
}

/// A node that ends leaves the graph of a peer at once, with its endpoints, while one that was killed beside it is still believed
/// to be there: the lease of a participant that does not take its leave is most of a minute.
fn nodes_leave_the_graph_at_once(python: &Path) {
    let scene = Scene::new("leaving");
    let mut node = scene.start_apart(&simulator());
    let mut killed = scene.start_apart(&Program::new("scheme_sequencer"));
    let answer = Peer::new(python, "leaving.py")
        .arg(node.id().to_string())
        .arg("imu_simulator")
        .arg("/imu/data_raw")
        .arg(killed.id().to_string())
        .arg("scheme_sequencer")
        .ask();
    assert!(node.wait().success());
    assert!(!killed.wait().success());
    assert_eq!(answer["killed_is_there"], true, "{answer}");
}

/// On a wire that carries no multicast two hosts find each other where `ROS_STATIC_PEERS` names one to the other, and
/// only there.
mod static_peers_are_found_without_multicast {
    #[test]
    fn kilted() {
        super::find_static_peers("kilted");
    }

    #[test]
    fn jazzy() {
        super::find_static_peers("jazzy");
    }
}

fn find_static_peers(distribution: &str) {
    let Some(python) = peer_python(distribution) else {
        return;
    };
    if !namespaces_are_permitted() {
        return skip("network namespaces are not permitted here");
    }
    isolated(|| {
        assert_eq!(heard_over_a_wire(&python, "", "6"), 0);
        assert_eq!(heard_over_a_wire(&python, "10.77.0.1", "300"), 100);
    });
}

/// Samples of a simulator on another host that a listener on this one takes in so many seconds, at most 100.
fn heard_over_a_wire(python: &Path, peers_of_the_node: &str, seconds: &str) -> u64 {
    let listener = Peer::new(python, "hear.py");
    let listener = ["/imu/data_raw", "100", seconds]
        .iter()
        .fold(listener, Peer::arg);
    let output = Command::new("unshare")
        .arg("-n")
        .arg(repository().join("tests/ros2_peers/two_hosts.sh"))
        .arg(executable("imu_simulator"))
        .arg(listener.program().path())
        .args(listener.program().command().get_args())
        .envs([
            ("NODE_PEERS", peers_of_the_node),
            ("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4"),
        ])
        .output()
        .unwrap();
    let answer = Answer::from(output).expect_status(0).json();
    answer["received"].as_u64().unwrap()
}

/// What `~/save` writes is what the command line writes, and another calibrator publishes it after `~/load`, to the last
/// bit.
#[test]
fn a_saved_calibration_is_loaded_again() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    isolated(|| {
        let bag = Simulation::new("eight-position", 0.5, 10.0, 21).bag();
        let mut scene = Scene::new("save_load");
        let file = scene.folder().join("kept/calibration.yaml");
        let calibrator = Program::new("self_calibrator")
            .parameter("calibration_file", file.to_str().unwrap())
            .parameter("joint_patience_s", "300.0")
            .parameter("velocity_patience_s", "300.0");
        let ask = |service: &str| {
            let name = format!("/self_calibrator/{service}");
            let answers = Peer::new(&python, "trigger.py").arg(name).ask();
            let answer = &answers[0];
            let message = answer["message"].as_str().unwrap().to_owned();
            (answer["success"].as_bool().unwrap(), message)
        };

        let mut first = scene.start_apart(&calibrator);
        let (success, message) = ask("load");
        assert!(
            !success && message.contains("kept/calibration.yaml"),
            "{message}"
        );
        let (success, message) = ask("save");
        assert!(!success && message.contains("no estimate"), "{message}");
        let json = calibrate(&bag).expect_status(1).json();
        let listener = Listener::new();
        let estimates =
            listener.hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(1));
        scene.finish(scene.play(&bag, 300.0, 1));
        estimates.wait_for("the estimate of calibrate", |estimate| {
            json["stamp_ns"] == estimate.header.stamp.nanos()
        });
        let (success, message) = ask("save");
        assert!(success, "{message}");
        first.interrupt();

        let _ = rotary_sins(&[
            "navigate",
            bag.to_str().unwrap(),
            "--calibration",
            file.to_str().unwrap(),
        ])
        .expect_status(0);

        let heard = listener.hear::<Calibration>("/self_calibration/calibration", Qos::latched(10));
        scene.start(&calibrator);
        let (success, message) = ask("load");
        assert!(success, "{message}");
        heard.wait_for("a calibration", |_| true);
        scene.end();
        let loaded = heard.all();
        assert_eq!(loaded.len(), 1);
        assert_eq!(loaded[0].source, file.to_str().unwrap());
        assert_eq!(
            loaded[0].gyroscope_drift.to_vec(),
            vector(&json, "gyroscope_drift_rad_s")
        );
        assert_eq!(loaded[0].covariance, vector(&json, "covariance"));
    });
}
