//! Nodes that are killed in the middle of their work, and started again.

use std::path::Path;
use std::time::Duration;

use ros_node::Qos;
use ros2_interfaces::sensor_msgs::Imu;
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use suite_tests::{Listener, Program, Running, Scene, isolated};

fn calibrator(kept: &Path) -> Program {
    Program::new("self_calibrator")
        .parameter("checkpoint_file", kept.to_str().unwrap())
        .parameter("checkpoint_period_s", "0.5")
        .parameter(
            "gyroscope_drift_threshold_deg_per_hour",
            "[0.01, 0.01, 0.01]",
        )
        .parameter("accelerometer_bias_threshold_ug", "[30.0, 30.0, 30.0]")
        .parameter("azimuth_threshold_arcmin", "10.0")
}

fn sequencer(kept: &Path) -> Program {
    Program::sequencer()
        .parameter("dwell_s", "400.0")
        .parameter("checkpoint_file", kept.to_str().unwrap())
}

/// Killed and started again; what the new one writes begins where the old one ended.
fn again(scene: &Scene, program: &Program, killed: &mut Running, label: &str) -> Running {
    killed.kill();
    let mut running = scene.start_apart(&program.clone().label(label));
    running.wait_for_line("goes on from");
    running
}

/// The calibrator is killed in a dwell and in a rotation, and the sequencer in another rotation. Each goes on where it stood: nothing is
/// aligned anew, the scheme skips and repeats nothing, and the calibration converges, as far from the truth as its sigmas say.
#[test]
fn killed_nodes_go_on_where_they_stood() {
    isolated(|| {
        let mut scene = Scene::new("killed_nodes");
        let [of_calibrator, of_sequencer] =
            ["calibrator.kept", "sequencer.kept"].map(|name| scene.folder().join(name));
        for file in [&of_calibrator, &of_sequencer] {
            // Of an earlier run of this test.
            let _none = std::fs::remove_file(file);
        }
        let listener = Listener::new();
        let statuses = listener.hear::<SchemeStatus>("/scheme/status", Qos::latched(10));
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        let truth = listener.hear::<Calibration>("/ground_truth/calibration", Qos::latched(1));
        let (calibrator, sequencer) = (calibrator(&of_calibrator), sequencer(&of_sequencer));
        let mut calibrating = scene.start_apart(&calibrator);
        let mut turning = scene.start_apart(&sequencer);
        scene.start(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "20.0"),
        );
        let rotates = |step: u32| {
            move |status: &SchemeStatus| {
                (status.state, status.step) == (SchemeStatus::ROTATING, step)
            }
        };
        // A dwell, with more than one checkpoint since the alignment.
        estimates.wait_for("the first dwell", |estimate| estimate.duration > 340.0);
        calibrating = again(&scene, &calibrator, &mut calibrating, "calibrator_2");
        statuses.wait_for("the first rotation", rotates(1));
        calibrating = again(&scene, &calibrator, &mut calibrating, "calibrator_3");
        statuses.wait_for("the second rotation", rotates(2));
        turning = again(&scene, &sequencer, &mut turning, "sequencer_2");
        calibrating.wait_for_line("-> converged");
        let last = estimates.wait_for("convergence", |estimate| {
            estimate.phase == SelfCalibrationEstimate::CONVERGED
        });
        calibrating.interrupt();
        turning.interrupt();
        scene.end();

        let phases: Vec<u8> = estimates.all().iter().map(|e| e.phase).collect();
        let fine = phases
            .iter()
            .position(|phase| *phase == SelfCalibrationEstimate::FINE_ALIGNMENT)
            .unwrap();
        let is_anew = |phase: &u8| *phase <= SelfCalibrationEstimate::COARSE_ALIGNMENT;
        assert!(!phases[fine..].iter().any(is_anew), "{phases:?}");
        assert!((2..=4).contains(&last.gaps), "{} gaps", last.gaps);
        let steps: Vec<u32> = statuses
            .all()
            .iter()
            .filter(|status| status.state != SchemeStatus::WAITING_FOR_TABLE)
            .map(|status| status.cycle * status.steps_per_cycle + status.step)
            .collect();
        let moves_on = |pair: &[u32]| pair[1] == pair[0] || pair[1] == pair[0] + 1;
        let ended = statuses.all().last().unwrap().state;
        assert_eq!(ended, SchemeStatus::ABORTED, "ended in order");
        assert!(steps.windows(2).all(moves_on), "{steps:?}");
        let truth = truth.all().pop().unwrap();
        for axis in 0..3 {
            let drift = (last.gyroscope_drift[axis] - truth.gyroscope_drift[axis])
                / last.gyroscope_drift_std[axis];
            let bias = (last.accelerometer_bias[axis] - truth.accelerometer_bias[axis])
                / last.accelerometer_bias_std[axis];
            assert!(
                drift.abs() < 4.0 && bias.abs() < 4.0,
                "{axis}: {drift} {bias}"
            );
        }
        assert!(
            !of_sequencer.exists(),
            "a scheme that ended in order keeps nothing"
        );
        assert!(of_calibrator.exists());
    });
}

/// A subscriber that is killed, and says no farewell, costs the others nothing: the simulator's window does not fill up with what it will
/// never acknowledge, and the calibrator misses no sample. (A participant announces itself every few seconds; only who has heard it knows
/// where it was.)
#[test]
fn a_killed_subscriber_halts_nobody() {
    isolated(|| {
        let scene = Scene::new("killed_subscriber");
        let listener = Listener::new();
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        let calibrator = Program::new("self_calibrator").parameter("coarse_alignment_s", "60.0");
        let other = calibrator
            .clone()
            .label("other")
            .remap("__node", "other")
            .remap("self_calibration/estimate", "other/estimate");
        let mut calibrator = scene.start_apart(&calibrator);
        let mut other = scene.start_apart(&other);
        let mut table = scene.start_apart(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "20.0")
                .parameter("wait_for_subscribers", "[\"imu/data_raw:2\"]"),
        );
        let before = estimates.wait_for("several announcements", |estimate| {
            estimate.duration > 400.0
        });
        other.kill();
        // More than the 10 000 samples that the window takes.
        let last = estimates.wait_for("700 s later", |estimate| {
            estimate.duration > before.duration + 700.0
        });
        assert_eq!((last.gaps, last.lost_samples), (0, 0));
        table.interrupt();
        let log = calibrator.log();
        assert!(!log.contains("no imu/data_raw"), "{log}");
        calibrator.interrupt();
    });
}

/// How long a process is stopped: as long as a hand takes for Ctrl-Z and `fg`.
const STOPPED: Duration = Duration::from_millis(500);

/// All four nodes are stopped and continued, one after the other, several times. All of them go on hearing and speaking, and end in order.
#[test]
fn a_stop_and_a_continuation_are_lived_through() {
    isolated(|| {
        let scene = Scene::new("stopped_nodes");
        let listener = Listener::new();
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        let statuses = listener.hear::<SchemeStatus>("/scheme/status", Qos::latched(10));
        let solutions = listener.hear::<Imu>("/imu/data", Qos::reliable(1000));
        let mut nodes = [
            Program::new("self_calibrator").parameter("coarse_alignment_s", "60.0"),
            Program::new("scheme_sequencer"),
            Program::new("navigation_compensator").parameter("alignment_s", "60.0"),
            Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "20.0"),
        ]
        .map(|program| scene.start_apart(&program));
        estimates.wait_for("an estimate with numbers", |estimate| {
            estimate.phase >= SelfCalibrationEstimate::FINE_ALIGNMENT
        });
        // So that all four work.
        let published = listener.trigger("/self_calibrator/publish_calibration");
        assert!(published.success, "{}", published.message);
        solutions.wait_for("a solution", |_| true);
        for _ in 0..3 {
            for node in &nodes {
                node.stop_for(STOPPED);
            }
        }
        let since = estimates.all().last().unwrap().header.stamp.nanos();
        let later = |stamp: i64| stamp > since + 60_000_000_000;
        estimates.wait_for("a later estimate", |e| later(e.header.stamp.nanos()));
        statuses.wait_for("a later status", |s| later(s.header.stamp.nanos()));
        solutions.wait_for("a later solution", |s| later(s.header.stamp.nanos()));
        for node in &mut nodes {
            node.interrupt();
            let log = node.log();
            assert!(
                !log.contains("FATAL") && !log.contains("poll failed"),
                "{log}"
            );
        }
    });
}

/// Where the middleware ends all the same (here by the interruption that is lived through otherwise), a node says FATAL and ends with
/// status 1 by itself, with its state kept. Started again it goes on from there.
#[test]
fn a_node_without_its_middleware_ends() {
    isolated(|| {
        let scene = Scene::new("deaf_nodes");
        let [of_calibrator, of_sequencer] =
            ["calibrator.kept", "sequencer.kept"].map(|name| scene.folder().join(name));
        for file in [&of_calibrator, &of_sequencer] {
            // Of an earlier run of this test.
            let _none = std::fs::remove_file(file);
        }
        let listener = Listener::new();
        let statuses = listener.hear::<SchemeStatus>("/scheme/status", Qos::latched(10));
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        // So that what is there afterwards was written at the end.
        let seldom = |program: Program| program.parameter("checkpoint_period_s", "3600.0");
        let programs = [
            seldom(calibrator(&of_calibrator)),
            seldom(sequencer(&of_sequencer)),
        ];
        let interruptible = |program: &Program| {
            let program = program
                .clone()
                .environment("ROS_NODE_WAITS", "interruptible");
            scene.start_apart(&program)
        };
        let mut nodes = programs.each_ref().map(interruptible);
        let mut table = scene.start_apart(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "20.0"),
        );
        let last = estimates.wait_for("the first dwell", |estimate| estimate.duration > 340.0);
        statuses.wait_for("a dwell", |status| status.state == SchemeStatus::DWELLING);
        for (node, kept) in nodes.iter_mut().zip([&of_calibrator, &of_sequencer]) {
            let before = std::fs::read(kept).unwrap();
            node.stop_for(STOPPED);
            let status = node.wait();
            assert_ne!(std::fs::read(kept).unwrap(), before);
            let log = node.log();
            assert_eq!(status.code(), Some(1), "{log}");
            let told = log.lines().find(|line| line.contains("FATAL"));
            assert!(
                told.is_some_and(|line| line.contains("middleware")),
                "{log}"
            );
        }
        for program in &programs {
            let mut node = scene.start_apart(&program.clone().label("again"));
            node.wait_for_line("goes on from");
            node.interrupt();
        }
        table.interrupt();
        let again = estimates.all().pop().unwrap();
        assert!(again.duration >= last.duration, "{} s", again.duration);
    });
}

/// A checkpoint that is torn, of other settings, or no checkpoint at all is refused in one line with its reason, and put aside; the
/// node begins anew.
#[test]
fn what_cannot_be_gone_on_with_is_put_aside() {
    isolated(|| {
        let scene = Scene::new("refused_checkpoints");
        let kept = scene.folder().join("c.kept");
        let aside = scene.folder().join("c.kept.refused");
        std::fs::create_dir_all(scene.folder()).unwrap();
        for (text, reason) in [
            ("stamp_ns: 0", "it does not begin as one"),
            ("ROTARY-SINS-KEPTself_", "it ends within its header"),
        ] {
            std::fs::write(&kept, text).unwrap();
            let mut running = scene.start_apart(&calibrator(&kept));
            running.wait_for_line("begins anew");
            running.interrupt();
            let log = running.log();
            let line = log.lines().find(|line| line.contains("begins anew"));
            assert!(line.is_some_and(|line| line.contains(reason)), "{log}");
            assert_eq!(std::fs::read_to_string(&aside).unwrap(), text);
        }
    });
}
