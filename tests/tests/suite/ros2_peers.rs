//! Real ROS 2 (rclpy with Fast DDS) beside the running nodes.

use std::path::Path;

use ros_node::Qos;
use ros2_interfaces::diagnostic_msgs::DiagnosticArray;
use serde_json::{Value, json};
use suite_tests::{
    Listener, Peer, Program, Scene, each_distribution, isolated, number, peer_python,
};

/// Of rcl_interfaces/msg/ParameterType.
const PARAMETER_DOUBLE: u8 = 3;

each_distribution!(
    rclpy_sees_nodes_and_reads_topics,
    rclpy_pauses_and_resumes_the_scheme,
    rclpy_uses_the_parameter_services,
    rclpy_turns_the_table,
    publishers_of_samples_are_told_by_name,
);

fn simulator() -> Program {
    Program::new("imu_simulator")
        .parameter("imu_rate_hz", "100.0")
        .parameter("speed", "2.0")
}

/// The four nodes, at twice real time.
fn four_nodes(test: &str) -> Scene {
    let mut scene = Scene::new(test);
    for node in ["navigation_compensator", "self_calibrator"] {
        scene.start(&Program::new(node));
    }
    scene.start(&Program::sequencer());
    scene.start(&simulator());
    scene
}

/// What is said on topics, once the graph shows what is expected of it.
fn observe(python: &Path, topics: &[(&str, &str, &str)], expected: &[&str]) -> Value {
    let peer = topics.iter().fold(
        Peer::new(python, "observe.py"),
        |peer, (name, kind, count)| peer.arg(name).arg(kind).arg(count),
    );
    expected.iter().fold(peer.arg("--"), Peer::arg).ask()
}

/// rclpy sees all nodes in the graph, the topics with their types and QoS, and reads what they say.
fn rclpy_sees_nodes_and_reads_topics(python: &Path) {
    const NODES: [&str; 4] = [
        "/imu_simulator",
        "/scheme_sequencer",
        "/self_calibrator",
        "/navigation_compensator",
    ];
    const TOPICS: [(&str, &str); 7] = [
        (
            "/turntable/joint_trajectory",
            "trajectory_msgs/msg/JointTrajectory",
        ),
        (
            "/self_calibration/calibration",
            "rotary_sins_msgs/msg/Calibration",
        ),
        ("/imu/data", "sensor_msgs/msg/Imu"),
        ("/odometry", "nav_msgs/msg/Odometry"),
        ("/uncompensated/odometry", "nav_msgs/msg/Odometry"),
        ("/rosout", "rcl_interfaces/msg/Log"),
        ("/clock", "rosgraph_msgs/msg/Clock"),
    ];
    let mut scene = four_nodes("rclpy_sees");
    let seen = observe(
        python,
        &[
            ("/imu/data_raw", "sensor_msgs/msg/Imu", "300"),
            (
                "/turntable/joint_states",
                "sensor_msgs/msg/JointState",
                "50",
            ),
            ("/fix", "sensor_msgs/msg/NavSatFix", "2"),
            ("/scheme/status", "rotary_sins_msgs/msg/SchemeStatus", "2L"),
            (
                "/self_calibration/estimate",
                "rotary_sins_msgs/msg/SelfCalibrationEstimate",
                "2L",
            ),
            (
                "/ground_truth/calibration",
                "rotary_sins_msgs/msg/Calibration",
                "1L",
            ),
            ("/clock", "rosgraph_msgs/msg/Clock", "2B"),
            ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "1"),
        ],
        &[&NODES[..], &TOPICS.map(|(name, _)| name)].concat(),
    );
    scene.end();

    for node in NODES {
        let nodes = seen["nodes"].as_array().unwrap();
        assert!(nodes.contains(&json!(node)), "{node} in {nodes:?}");
    }
    for (name, kind) in TOPICS {
        assert_eq!(seen["topics"][name], json!([kind]), "{name}");
    }
    assert_eq!(
        seen["publishers"]["/self_calibration/estimate"],
        json!([{
            "node": "self_calibrator",
            "type": "rotary_sins_msgs/msg/SelfCalibrationEstimate",
            "reliability": "RELIABLE",
            "durability": "TRANSIENT_LOCAL"
        }])
    );

    let imu = &seen["last"]["/imu/data_raw"];
    assert_eq!(imu["header"]["frame_id"], "imu_link");
    // At rest in position A: gravity along z, no orientation, the variance of one sample in the covariance.
    assert!(
        (number(&imu["linear_acceleration"]["z"]) - 9.807).abs() < 0.01,
        "{imu}"
    );
    assert_eq!(number(&imu["orientation_covariance"][0]), -1.0);
    assert!(number(&imu["angular_velocity_covariance"][0]) > 0.0);
    let joints = &seen["last"]["/turntable/joint_states"];
    assert_eq!(joints["name"], json!(["outer_joint", "inner_joint"]));
    assert!((number(&seen["last"]["/fix"]["latitude"]) - 45.78).abs() < 0.001);
    assert_eq!(seen["last"]["/scheme/status"]["scheme"], "eight-position");
    assert_eq!(seen["last"]["/scheme/status"]["position"], "A");
    let estimate = &seen["last"]["/self_calibration/estimate"];
    assert_eq!(estimate["phase_name"], "coarse_alignment", "{estimate}");
    assert!(number(&estimate["samples"]) > 0.0);
    let drift = 0.01f64.to_radians() / 3600.0;
    let truth = &seen["first"]["/ground_truth/calibration"]["gyroscope_drift"];
    assert!((number(&truth[0]) / drift - 1.0).abs() < 1e-12, "{truth}");
}

/// rclpy calls the services of the sequencer; what cannot be done is answered with a reason.
fn rclpy_pauses_and_resumes_the_scheme(python: &Path) {
    let mut scene = four_nodes("rclpy_services");
    // Without joint states there is nothing to pause yet.
    observe(
        python,
        &[("/scheme/status", "rotary_sins_msgs/msg/SchemeStatus", "2L")],
        &[],
    );
    let service = |name: &str| format!("/scheme_sequencer/{name}");
    let answers = Peer::new(python, "trigger.py")
        .arg(service("pause"))
        .arg(service("resume"))
        .arg(service("resume"))
        .arg(service("abort"))
        .ask();
    scene.end();
    let success: Vec<bool> = answers
        .as_array()
        .unwrap()
        .iter()
        .map(|answer| answer["success"].as_bool().unwrap())
        .collect();
    assert_eq!(success, [true, true, false, true], "{answers}");
    assert_ne!(answers[2]["message"], "");
}

/// rclpy lists, gets and describes the parameters of a node; one that is fixed at the start is not set, with a reason.
fn rclpy_uses_the_parameter_services(python: &Path) {
    let mut scene = Scene::new("rclpy_parameters");
    scene.start(&Program::new("self_calibrator").parameter("turn_deg", "12.5"));
    let answer = Peer::new(python, "parameters.py")
        .arg("self_calibrator")
        .arg("turn_deg")
        .arg("20.0")
        .ask();
    scene.end();
    let names = answer["names"].as_array().unwrap();
    for name in ["turn_deg", "use_sim_time", "coarse_alignment_s"] {
        assert!(names.contains(&json!(name)), "{name} in {names:?}");
    }
    assert_eq!(answer["types"], json!([PARAMETER_DOUBLE]));
    let descriptor = &answer["descriptor"];
    assert_eq!(descriptor["read_only"], true);
    assert_eq!(
        descriptor["floating_point_range"][0]["to_value"], 180.0,
        "{descriptor}"
    );
    assert_ne!(descriptor["description"], "");
    assert_eq!(answer["before"], 12.5);
    assert_eq!(answer["set"]["successful"], false);
    assert_ne!(answer["set"]["reason"], "");
    assert_eq!(answer["after"], 12.5);
}

/// A JointTrajectory from rclpy turns the table.
fn rclpy_turns_the_table(python: &Path) {
    let mut scene = Scene::new("rclpy_table");
    scene.start(&simulator().parameter("speed", "1.0"));
    let answer = Peer::new(python, "move_table.py")
        .arg("0.3")
        .arg("-0.2")
        .ask();
    scene.end();
    for (joint, target) in [0.3, -0.2].into_iter().enumerate() {
        assert_eq!(number(&answer["start"][joint]), 0.0);
        let error = number(&answer["end"][joint]) - target;
        assert!(error.abs() < 1e-9, "joint {joint}: {answer}");
    }
}

/// A second DDS vendor reads the samples too, without losing one.
#[test]
fn cyclone_dds_reads_the_samples() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    isolated(|| {
        let mut scene = Scene::new("cyclone");
        scene.start(&simulator());
        let answer = Peer::new(&python, "cyclone.py").arg("1000").ask();
        scene.end();
        assert_eq!(answer["frame_id"], "imu_link");
        assert!((number(&answer["linear_acceleration_z"]) - 9.807).abs() < 0.01);
        assert_eq!(answer["intervals_ns"], json!([10_000_000]));
    });
}

/// Two nodes of ours and one of rclpy, best effort and one of two in its process, publish on the topic of the samples: log and
/// diagnostics name all three.
fn publishers_of_samples_are_told_by_name(python: &Path) {
    const NAMED: &str =
        "3 publishers, expected one (/imu_simulator, /second_simulator, /ship/imu_driver)";
    let mut scene = Scene::new("publishers_by_name");
    let diagnostics = Listener::new();
    let diagnostics = diagnostics.hear::<DiagnosticArray>("/diagnostics", Qos::reliable(100));
    let mut calibrator = scene.start_apart(&Program::new("self_calibrator"));
    let mut compensator = scene.start_apart(&Program::new("navigation_compensator"));
    scene.start(&simulator());
    scene.start(
        &simulator()
            .label("second_simulator")
            .remap("__node", "second_simulator"),
    );
    let _driver = scene.start_apart(Peer::new(python, "imu_driver.py").program());
    for node in [&mut calibrator, &mut compensator] {
        node.wait_for_line(&format!("imu/data_raw: {NAMED}"));
    }
    for node in ["self_calibrator", "navigation_compensator"] {
        diagnostics.wait_for(node, |array| {
            let mut of_node = array.status.iter().filter(|s| s.name.starts_with(node));
            of_node.any(|status| status.message.contains(NAMED))
        });
    }
    scene.end();
}

/// By each distribution; the libraries that read the bag are of the newest one's environment.
mod foreign_types_are_recorded_with_their_definition {
    use super::{isolated, peer_python};

    fn recorded_from(distribution: &str) {
        if let (Some(publisher), Some(reader)) = (peer_python(distribution), peer_python("kilted"))
        {
            isolated(|| super::foreign_types(&publisher, &reader));
        }
    }

    #[test]
    fn kilted() {
        recorded_from("kilted");
    }

    #[test]
    fn jazzy() {
        recorded_from("jazzy");
    }
}

/// A topic of a type that only the ROS 2 beside us has is recorded with the definition from its prefix, which readers of others
/// decode it by; where there is no prefix, the recorder says what is missing.
fn foreign_types(python: &Path, reader: &Path) {
    let scene = Scene::new("foreign_types");
    let prefix = python.ancestors().nth(2).unwrap().to_str().unwrap();
    let recorder = |label: &str, prefix: &str| {
        let program = Program::new("rotary-sins")
            .label(label)
            .args("record /scan --output");
        let program = program.arg(scene.folder().join(label));
        scene.start_apart(&program.environment("AMENT_PREFIX_PATH", prefix))
    };
    let mut with = recorder("with_prefix", prefix);
    let mut without = recorder("without_prefix", "");
    let mut lidar = scene.start_apart(Peer::new(python, "scan.py").arg("2").program());
    lidar.wait_for_line("the scan has arrived");
    for recorder in [&mut with, &mut without] {
        recorder.wait_for_line("recording /scan");
        recorder.interrupt();
    }
    let missing = "/scan: recorded without the definition of sensor_msgs/msg/LaserScan";
    assert!(without.log().contains(missing), "{}", without.log());
    assert!(!with.log().contains(missing), "{}", with.log());
    let read = Peer::new(reader, "read_bag.py")
        .arg(scene.folder().join("with_prefix"))
        .arg("10")
        .ask();
    let scan = &read["/scan"]["messages"][0];
    assert_eq!(read["/scan"]["count"], 1);
    assert_eq!(scan["header"]["frame_id"], "text 3");
    assert_eq!(scan["ranges"], json!([11.25, 12.25]));
}
