//! The four nodes together, without a bag.

use ros_node::Qos;
use ros2_interfaces::diagnostic_msgs::DiagnosticArray;
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use suite_tests::{Listener, Program, Scene, isolated};

/// Simulated time of a run \[s\]: the first dwell, a half turn, and some of the second dwell.
const RUN_S: f64 = 700.0;

fn simulator() -> Program {
    Program::new("imu_simulator")
        .parameter("imu_rate_hz", "20.0")
        .parameter("speed", "100.0")
}

/// Started in reverse order, each when the one before is there, the four find each other and the scheme runs: the block turns, the
/// calibrator sees it, nothing is lost.
#[test]
fn started_in_reverse_order_the_scheme_runs() {
    isolated(|| {
        let mut scene = Scene::new("reverse_order");
        let listener = Listener::new();
        let statuses = listener.hear::<SchemeStatus>("/scheme/status", Qos::latched(10));
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(10));
        let truth = listener.hear::<Calibration>("/ground_truth/calibration", Qos::latched(1));
        let diagnostics = listener.hear::<DiagnosticArray>("/diagnostics", Qos::reliable(100));
        for (node, program) in [
            (
                "navigation_compensator",
                Program::new("navigation_compensator"),
            ),
            ("self_calibrator", Program::new("self_calibrator")),
            ("scheme_sequencer", Program::sequencer()),
        ] {
            scene.start(&program);
            diagnostics.wait_for(node, |array| {
                array.status.iter().any(|status| status.name.contains(node))
            });
        }
        let duration = format!("{RUN_S:?}");
        let mut simulator = scene.start_apart(&simulator().parameter("duration_s", &duration));
        let status = simulator.wait();
        assert!(status.success(), "imu_simulator: {status}");
        let start = truth.wait_for("the truth", |_| true).header.stamp.nanos();
        let last = estimates.wait_for("the estimate of the end", |estimate| {
            (estimate.header.stamp.nanos() - start) as f64 >= (RUN_S - 2.0) * 1e9
        });
        statuses.wait_for("the second dwell", |status| {
            (status.state, status.step) == (SchemeStatus::DWELLING, 1)
        });
        scene.end();

        // It was in its second dwell when it was told to end.
        let status = statuses.wait_for("the end of the scheme", |status| {
            status.state == SchemeStatus::ABORTED
        });
        assert_eq!(status.step, 1);
        let states: Vec<u8> = statuses.all().iter().map(|status| status.state).collect();
        assert!(states.contains(&SchemeStatus::ROTATING), "{states:?}");
        assert_eq!(last.phase_name, "calibrating");
        assert_eq!((last.gaps, last.lost_samples), (0, 0));
    });
}

/// A simulator that is stopped and started again is found by the sequencer and the calibrator, which begin anew.
#[test]
fn simulator_started_again_is_found() {
    isolated(|| {
        let mut scene = Scene::new("simulator_again");
        scene.start(&Program::sequencer());
        let mut calibrator = scene.start_apart(&Program::new("self_calibrator"));
        let mut first = scene.start_apart(&simulator());
        calibrator.wait_for_line("-> fine_alignment");
        first.interrupt();
        let again = scene.start_apart(&simulator().label("imu_simulator_again"));
        calibrator.wait_for_line("-> calibrating");
        calibrator.interrupt();
        // The sequencer stops the table before it ends, and wants to see it at rest.
        scene.end();
        drop(again);
        let phases = calibrator.log();
        assert_eq!(phases.matches("-> fine_alignment").count(), 2, "{phases}");
    });
}
