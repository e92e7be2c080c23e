//! The four nodes together, without a bag.
#![allow(clippy::unwrap_used)]

use std::time::Duration;

use rotary_sins_msgs::SchemeStatus;
use suite_tests::{Program, Scene, estimates, isolated, messages};

/// Simulated time of a run \[s\]: the first dwell, a half turn, and some of the second dwell.
const RUN_S: f64 = 700.0;

fn simulator() -> Program {
    Program::new("imu_simulator")
        .parameter("imu_rate_hz", "20.0")
        .parameter("speed", "100.0")
}

/// Started in reverse order, half a second apart, the four find each other and the scheme runs: the block turns, the
/// calibrator sees it, nothing is lost.
#[test]
fn started_in_reverse_order_the_scheme_runs() {
    isolated(|| {
        let mut scene = Scene::new("reverse_order");
        let recording = scene.record(
            "recording",
            &["/scheme/status", "/self_calibration/estimate"],
        );
        for node in [
            "navigation_compensator",
            "self_calibrator",
            "scheme_sequencer",
        ] {
            scene.start(&Program::new(node));
            std::thread::sleep(Duration::from_millis(500));
        }
        let duration = format!("{RUN_S:?}");
        let mut simulator = scene.start_apart(&simulator().parameter("duration_s", &duration));
        let status = simulator.wait(Duration::from_secs(60));
        assert!(status.success(), "imu_simulator: {status}");
        std::thread::sleep(Duration::from_secs(2));
        scene.end();

        let statuses: Vec<SchemeStatus> = messages(&recording, "/scheme/status");
        let states: Vec<u8> = statuses.iter().map(|status| status.state).collect();
        assert!(states.contains(&SchemeStatus::ROTATING), "{states:?}");
        let last = statuses.last().unwrap();
        assert_eq!((last.state, last.step), (SchemeStatus::DWELLING, 1));
        let all = estimates(&recording);
        let last = all.last().unwrap();
        assert_eq!(last.phase_name, "calibrating");
        assert_eq!((last.gaps, last.lost_samples), (0, 0));
    });
}

/// A simulator that is stopped and started again is found by the sequencer and the calibrator, which begin anew.
#[test]
fn simulator_started_again_is_found() {
    isolated(|| {
        let mut scene = Scene::new("simulator_again");
        scene.start(&Program::new("scheme_sequencer"));
        let mut calibrator = scene.start_apart(&Program::new("self_calibrator"));
        let mut first = scene.start_apart(&simulator());
        calibrator.wait_for_line("-> fine_alignment", Duration::from_secs(60));
        first.interrupt();
        let again = scene.start_apart(&simulator().label("imu_simulator_again"));
        calibrator.wait_for_line("-> calibrating", Duration::from_secs(60));
        drop(again);
        calibrator.interrupt();
        scene.end();
        let phases = calibrator.log();
        assert_eq!(phases.matches("-> fine_alignment").count(), 2, "{phases}");
    });
}
