//! `rotary-sins monitor` beside the running nodes.

use suite_tests::{Program, Scene, isolated, rotary_sins};

/// Nothing runs: one line says what was listened to, and the status is not 0.
#[test]
fn silence_is_told() {
    isolated(|| {
        let answer = rotary_sins(&["monitor", "--once", "--timeout", "2"]);
        assert_ne!(answer.status, 0);
        answer.expect_words(&["nothing heard", "self_calibration/estimate"]);
    });
}

/// A calibration that runs is shown with its phase, the scheme and nine sigmas; when the nodes end, the page says that data
/// have stopped.
#[test]
fn a_running_calibration_is_shown() {
    isolated(|| {
        let mut scene = Scene::new("monitor");
        scene.start(&Program::sequencer());
        let mut calibrator = scene.start_apart(&Program::new("self_calibrator"));
        scene.start(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "100.0"),
        );
        // Standard output is a file: a page a second.
        let picture = scene.folder().join("monitor.svg");
        let pages = Program::new("rotary-sins").label("pages").arg("monitor");
        let mut pages = scene.start_apart(&pages.arg("--picture").arg(&picture));
        calibrator.wait_for_line("-> fine_alignment");
        let answer = rotary_sins(&["monitor", "--once"]).expect_status(0);
        for words in [
            "eight-position",
            "step",
            "position",
            "misalignment U",
            "gyro drift x",
            "acc bias z",
            "heading",
            "learned %: gyro",
            "NIS",
            "Hz",
        ] {
            assert!(
                answer.stdout.contains(words),
                "no '{words}' in\n{}",
                answer.stdout
            );
        }
        assert!(
            ["fine alignment", "calibrating"]
                .iter()
                .any(|p| answer.stdout.contains(p)),
            "{}",
            answer.stdout
        );
        // What the scheme will still bring has come too, worked out beside the samples.
        pages.wait_for_line("best next: turn about");
        assert!(pages.log().contains("cycle's end ("));
        scene.end();
        calibrator.interrupt();
        pages.wait_for_line("NO DATA for");
        pages.interrupt();
        assert!(!pages.log().contains("panicked"));
        // The page of its end, as a picture.
        let picture = std::fs::read_to_string(picture).unwrap();
        for words in ["<svg ", "NO DATA for", "gyro drift x"] {
            assert!(picture.contains(words), "no '{words}' in\n{picture}");
        }
    });
}
