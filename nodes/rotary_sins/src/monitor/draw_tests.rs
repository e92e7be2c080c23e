#![allow(clippy::unwrap_used)]
use super::*;
use ratatui::{Terminal, backend::TestBackend};
use ros2_interfaces::diagnostic_msgs::DiagnosticStatus;
use rotary_sins_msgs::CalibrationOutlook;
use std::time::Duration;

fn text(state: &MonitorState, now: Instant, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal
        .draw(|frame| page(frame, state, now, Look { colour: false }))
        .unwrap();
    let buffer = terminal.backend().buffer();
    (0..height)
        .map(|y| {
            let line: String = (0..width).map(|x| buffer[(x, y)].symbol()).collect();
            line.trim_end().to_owned()
        })
        .collect()
}

fn running(now: Instant) -> MonitorState {
    let mut state = MonitorState::default();
    state.scheme(
        SchemeStatus {
            scheme: "a-scheme-with-a-name-that-is-much-too-long".to_owned(),
            state: SchemeStatus::DWELLING,
            step: 3,
            steps_per_cycle: 10,
            position: "D".to_owned(),
            elapsed: 1650.0,
            remaining: -1.0,
            rotation_axis: "x".to_owned(),
            rotation_angle_rad: -std::f64::consts::FRAC_PI_2,
            ..SchemeStatus::default()
        },
        now,
    );
    for step in 0..500 {
        state.estimate(
            SelfCalibrationEstimate {
                phase: SelfCalibrationEstimate::CALIBRATING,
                phase_name: "calibrating".to_owned(),
                duration: f64::from(step),
                misalignment_std: [3e-6, f64::NAN, f64::INFINITY],
                gyroscope_drift: [0.0123 * DEG_PER_HOUR; 3],
                gyroscope_drift_std: [1e-8 / f64::from(step + 1); 3],
                accelerometer_bias: [-100.4 * MICRO_G; 3],
                accelerometer_bias_std: [50.0 * MICRO_G; 3],
                state_names: ["gyroscope_drift_x_rad_s", "gyroscope_scale_factor_x"]
                    .map(str::to_owned)
                    .to_vec(),
                std: vec![1e-8, 1e-6],
                prior_std: vec![1e-7, 1e-5],
                threshold: vec![1e-8, 0.0],
                nis_window_mean: 1.2,
                nis_upper_bound: 2.6,
                ..SelfCalibrationEstimate::default()
            },
            now,
        );
    }
    state
}

/// On 80 × 24 everything is there: phase, scheme, nine rows with marks and curves, numbers, faults, keys.
#[test]
fn everything_fits_on_80_by_24() {
    let now = Instant::now();
    let mut state = running(now);
    for (name, level) in [
        ("self_calibrator: imu samples", 1),
        ("x: y", 2),
        ("z", 2),
        ("w", 1),
        ("v", 1),
        ("u", 1),
        ("t", 1),
    ] {
        let message = "imu/data_raw: 3 gaps, 17 samples lost, and a text that is longer than what is left of the line".to_owned();
        state.diagnostic(
            DiagnosticStatus {
                name: name.to_owned(),
                level,
                message,
                ..DiagnosticStatus::default()
            },
            now,
        );
    }
    let lines = text(&state, now, 80, 24);
    let all = lines.join("\n");
    for words in [
        "calibrating",
        "0:08:19 since",
        "cycle 1 step 3 of 10",
        "position D",
        "dwelling",
        "until stopped",
        "next -90 deg about x",
        "misalignment U",
        "gyro drift z",
        "0.0123",
        "-100",
        "acc bias z",
        "learned %: gyro 90",
        "heading 0.0000",
        "NIS",
        "consistent",
        "samples",
        "ERROR x: y",
        "and 3 more",
        "q quits",
    ] {
        assert!(all.contains(words), "no '{words}' in\n{all}");
    }
    assert!(lines[23].starts_with("q quits"), "{all}");
    assert!(
        lines.iter().any(|l| l.starts_with("gyro drift x")
            && l.contains('✓')
            && l.contains('█')
            && l.contains('▁')),
        "{all}"
    );
    assert!(
        lines
            .iter()
            .any(|l| l.starts_with("acc bias x") && !l.contains('·') && !l.contains('✓')),
        "{all}"
    );
    assert!(all.contains("NaN") && all.contains("inf"), "{all}");
}

/// What lies ahead has two lines on 80 columns, and none where nobody told it; all the rest stays.
#[test]
fn what_lies_ahead_is_told_in_two_lines() {
    let now = Instant::now();
    let mut state = running(now);
    let before = text(&state, now, 80, 24);
    state.outlook(
        CalibrationOutlook {
            message: "thresholds met in 12 min (cycle 1 step 5); scheme's end (119 min): azimuth 120.6 arcsec, \
                      drift 0.0010 deg/h, bias 11.1 ug; best next: turn about y by -270 deg"
                .to_owned(),
            ..CalibrationOutlook::default()
        },
        now,
    );
    let lines = text(&state, now, 80, 24);
    let all = lines.join("\n");
    let next = "best next: turn about y by -270 deg; thresholds met in 12 min (cycle 1 step 5)";
    let end = "scheme's end (119 min): azimuth 120.6 arcsec, drift 0.0010 deg/h, bias 11.1 ug";
    assert_eq!(lines[4..6], [next, end], "{all}");
    assert_eq!(&lines[6..20], &before[4..18], "{all}");
    assert_eq!(lines[23], before[23]);
    let unknown = CalibrationOutlook {
        message: "nothing is foreseen: the scheme is finished".to_owned(),
        ..CalibrationOutlook::default()
    };
    state.outlook(unknown, now);
    let lines = text(&state, now, 80, 24);
    assert_eq!(lines[4], "nothing is foreseen: the scheme is finished");
    assert_eq!(&lines[5..20], &before[4..19]);
}

/// A sigma that is not known, while the alignment gathers, is a dash and below no threshold.
#[test]
fn unknown_sigmas_are_dashes() {
    assert_eq!(sigma_text(-206_265.0), "-");
    assert_eq!(sigma_text(0.0125), significant(0.0125));
    assert!(!is_known(-1.0) && is_known(0.0) && is_known(f64::NAN));
}

/// Larger terminals and small ones do not panic, and empty states speak.
#[test]
fn any_size_and_an_empty_state() {
    let now = Instant::now();
    for (width, height) in [(1, 1), (20, 5), (80, 24), (120, 40), (300, 100)] {
        text(&running(now), now, width, height);
        text(&MonitorState::default(), now, width, height);
    }
    let all = text(&MonitorState::default(), now, 80, 24).join("\n");
    for words in [
        "nothing heard yet",
        "scheme/status: nothing heard",
        "self_calibration/estimate: nothing heard",
    ] {
        assert!(all.contains(words), "{all}");
    }
}

/// Data that stop are told to have stopped, each stream and all of them.
#[test]
fn stopped_data_are_told() {
    let now = Instant::now();
    let all = text(&running(now), now + Duration::from_secs(12), 80, 24).join("\n");
    assert!(all.contains("NO DATA for 12 s"), "{all}");
    assert!(all.contains("estimate: no data for 12 s"), "{all}");
}

/// Curves go by the logarithm, and have holes where nothing is known.
#[test]
fn sparklines_fall_and_leave_holes() {
    assert_eq!(
        sparkline([100.0, 10.0, f64::NAN, 1.0].into_iter(), 10),
        "█▅ ▁"
    );
    assert_eq!(sparkline([5.0, 5.0].into_iter(), 10), "▁▁");
    assert_eq!(sparkline((0..1000).map(f64::from), 10).chars().count(), 10);
    assert_eq!(sparkline(std::iter::empty(), 10), "");
}

/// An inconsistent run is not called consistent for its small innovations, and the reason of its message stands below them.
#[test]
fn an_inconsistent_run_shows_its_reason() {
    let now = Instant::now();
    let mut state = running(now);
    assert!(!text(&state, now, 80, 24).join("\n").contains("because"));
    let mut estimate = state.estimate.as_ref().unwrap().message.clone();
    estimate.phase = SelfCalibrationEstimate::INCONSISTENT;
    estimate.phase_name = "inconsistent".to_owned();
    let reason = "gyroscope scale factor z 52.0 ± 0.60 ppm: the model paper does not hold it";
    estimate.message = format!("inconsistent at 3600 s: {reason}; 1 sigma at most 0.0010 deg/h");
    state.estimate(estimate, now);
    let lines = text(&state, now, 80, 24);
    let all = lines.join("\n");
    let nis = lines.iter().find(|line| line.starts_with("NIS")).unwrap();
    assert!(
        nis.ends_with("mean 1.20, bound 2.60: INCONSISTENT"),
        "{all}"
    );
    assert!(!all.contains(": consistent"), "{all}");
    let at = lines
        .iter()
        .position(|line| line.starts_with("because: gyroscope scale factor z 52.0"));
    let both = lines[at.unwrap()..at.unwrap() + 2].join(" ");
    assert!(both.contains("the model paper does not hold it"), "{all}");
    assert!(lines[23].starts_with("q quits"), "{all}");
}
