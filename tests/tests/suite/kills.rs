//! Nodes that are killed in the middle of their work, and started again.

use std::path::Path;

use ros_node::Qos;
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
    Program::new("scheme_sequencer")
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
