//! The launch files, run by `tests/launch/run.py` in the installed prefix.

use std::fs;
use std::path::{Path, PathBuf};

use ros_node::{NodeBuilder, Qos};
use ros2_interfaces::sensor_msgs::JointState;
use ros2_interfaces::std_srvs::{TriggerRequest, TriggerResponse};
use rotary_sins_msgs::{SchemeStatus, SelfCalibrationEstimate};
use suite_tests::{
    GUARD, Listener, Program, Scene, Simulation, isolated, repository, scratch, without_topic,
};

use crate::install::install;

/// A launch file of an installation.
fn launch(prefix: &Path, file: &str, arguments: &[&str]) -> Program {
    let program = Program::at(file, PathBuf::from("python3"))
        .arg(repository().join("tests/launch/run.py"))
        .arg(prefix)
        .arg(prefix.join("share/rotary_sins/launch").join(file));
    arguments.iter().fold(program, Program::arg)
}

fn installed(test: &str) -> PathBuf {
    let prefix = scratch(test);
    install(&prefix);
    fs::canonicalize(prefix).unwrap()
}

/// Calls a service of the sequencer.
fn trigger(service: &str) -> TriggerResponse {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let no_arguments: [&str; 0] = [];
        let node = NodeBuilder::new("asker").start(no_arguments).unwrap();
        let client = node
            .client::<TriggerRequest, TriggerResponse>(service, "std_srvs/srv/Trigger")
            .unwrap();
        client.call(TriggerRequest::default(), GUARD).await.unwrap()
    })
}

/// A launch of the live nodes moves nothing, whatever the table does; a call of `~/start` does. A node that is killed is started
/// again and goes on where it stood; a parameter file goes before those of the package, and Ctrl-C ends everything.
#[test]
fn a_live_launch_moves_nothing() {
    isolated(|| {
        let prefix = installed("launch_live");
        let mut scene = Scene::new("launch_live_run");
        let kept = scene.folder().join("kept");
        fs::create_dir(&kept).unwrap();
        let parameters = scene.folder().join("mine.yaml");
        let text = "/**/scheme_sequencer:\n  ros__parameters:\n    dwell_s: 20.0\n    command_lead_s: 1.0\n";
        fs::write(&parameters, text).unwrap();
        scene.start(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "50.0")
                .parameter("speed", "4.0")
                .remap("turntable/joint_states", "/table/joint_states")
                .remap("turntable/joint_trajectory", "/table/motion"),
        );
        let listener = Listener::new();
        let states = listener.hear::<JointState>("/table/joint_states", Qos::sensor());
        let statuses = listener.hear::<SchemeStatus>("/ship/scheme/status", Qos::latched(1));
        let mut live = scene.start_apart(&launch(
            &prefix,
            "live.launch.py",
            &[
                "namespace:=ship",
                "imu:=/imu/data_raw",
                "fix:=/fix",
                "joint_states:=/table/joint_states",
                "joint_trajectory:=/table/motion",
                &format!("params_file:={}", parameters.display()),
                &format!("checkpoint_folder:={}", kept.display()),
            ],
        ));
        let idle = statuses.wait_for("the sequencer", |_| true);
        assert_eq!(idle.state, SchemeStatus::IDLE);
        live.wait_for_line("the scheme waits for a call of ~/start");
        live.wait_for_line("-> coarse_alignment");
        let before = states.wait_for("a reading", |_| true).header.stamp.nanos();
        states.wait_for("readings for longer than a dwell", |state| {
            state.header.stamp.nanos() - before > 60_000_000_000
        });
        let is_at_rest = |state: &JointState| state.position.iter().all(|angle| angle.abs() < 1e-3);
        assert!(states.all().iter().all(is_at_rest));

        let answer = trigger("/ship/scheme_sequencer/start");
        assert!(answer.success, "{}", answer.message);
        states.wait_for("the table turns", |state| !is_at_rest(state));
        let log = live.log();
        let started = log
            .lines()
            .rfind(|line| line.starts_with("started scheme_sequencer"));
        let pid = started.unwrap().split_whitespace().nth(2).unwrap();
        let pid = pid.trim_end_matches(':').parse().unwrap();
        let pid = rustix::process::Pid::from_raw(pid).unwrap();
        rustix::process::kill_process(pid, rustix::process::Signal::KILL).unwrap();
        live.wait_for_line("ended scheme_sequencer: -9");
        live.wait_for_line("goes on from the checkpoint");
        live.interrupt();
        assert!(live.log().contains("0 were killed"), "{}", live.log());
        scene.end();
    });
}

/// A bag without joint states is played like any other, in a namespace too, and everything ends with it.
#[test]
fn a_replay_ends_with_its_bag() {
    isolated(|| {
        let prefix = installed("launch_replay");
        let bag = Simulation::at_rest().bag();
        let mut scene = Scene::new("launch_replay_run");
        let bare = scene.folder().join("without_joints.mcap");
        without_topic(&bag, &bare, "/turntable/joint_states");
        let listener = Listener::new();
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/again/self_calibration/estimate", Qos::latched(1));
        let mut replay = scene.start_apart(&launch(
            &prefix,
            "replay.launch.py",
            &[
                &format!("bag:={}", bare.display()),
                "namespace:=again",
                "rate:=100",
                "linger_s:=1.0",
            ],
        ));
        assert!(replay.wait().success());
        let log = replay.log();
        assert!(log.contains("shutdown: the bag has been played"), "{log}");
        assert!(log.contains("0 were killed"), "{log}");
        estimates.wait_for("an estimate", |estimate| {
            estimate.phase_name == "fine_alignment"
        });

        // A bag that is none is told, and leaves nothing behind.
        let mut replay = scene.start_apart(&launch(
            &prefix,
            "replay.launch.py",
            &["bag:=/nowhere.mcap"],
        ));
        assert!(replay.wait().success());
        let log = replay.log();
        assert!(
            log.contains("shutdown: the bag could not be played"),
            "{log}"
        );
        scene.end();
    });
}

/// The demo turns its simulated table by itself and ends when the simulation does.
#[test]
fn a_demo_ends_with_its_simulation() {
    isolated(|| {
        let prefix = installed("launch_demo");
        let mut scene = Scene::new("launch_demo_run");
        let parameters = scene.folder().join("short.yaml");
        let text = "/**:\n  ros__parameters: {}\n/**/imu_simulator:\n  ros__parameters:\n    duration_s: 60.0\n    imu_rate_hz: 20.0\n";
        fs::write(&parameters, text).unwrap();
        let file = format!("params_file:={}", parameters.display());
        let mut demo = scene.start_apart(&launch(
            &prefix,
            "demo.launch.py",
            &["speed:=20.0", "log_level:=warn", &file],
        ));
        assert!(demo.wait().success());
        let log = demo.log();
        for words in [
            "shutdown: imu_simulator has ended",
            "0 were killed",
            "ended scheme_sequencer: 0",
        ] {
            assert!(log.contains(words), "no '{words}' in\n{log}");
        }
        assert!(!log.contains("[INFO]"), "{log}");
        scene.end();
    });
}
