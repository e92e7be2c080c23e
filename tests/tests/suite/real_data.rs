//! Data that this project did not make, through the command line as a user types it.

use std::path::Path;

use serde_json::Value;
use suite_tests::{assert_within_sigmas, data_file, rotary_sins, vector};

/// Heading of the ring-laser record by its logger's header \[deg\].
const LOGGER_HEADING_DEG: f64 = 90.6;

fn heading_deg(bag: &Path, window: &[&str]) -> (f64, f64) {
    let arguments = [&["align", bag.to_str().unwrap(), "--json"], window].concat();
    let json = rotary_sins(&arguments).expect_status(0).json();
    let number = |key: &str| {
        json[key]
            .as_f64()
            .unwrap_or_else(|| panic!("{key} in {json}"))
    };
    (number("heading_deg"), number("heading_deg_std"))
}

/// The whole ring-laser record gives the heading of its logger, with a sigma that covers the difference.
#[test]
fn ring_laser_record_aligns_to_the_heading_of_its_logger() {
    let Some(bag) = data_file("rlg_static.mcap") else {
        return;
    };
    let (heading, sigma) = heading_deg(&bag, &[]);
    assert!(
        (heading - LOGGER_HEADING_DEG).abs() < 0.05,
        "heading {heading} deg"
    );
    assert!(sigma > 0.0 && sigma < 0.2, "sigma {sigma} deg");
}

/// Every 300 s of the ring-laser record, aligned by itself, agrees with the whole.
#[test]
fn windows_of_the_ring_laser_record_agree_with_the_whole() {
    let Some(bag) = data_file("rlg_static.mcap") else {
        return;
    };
    let (whole, _) = heading_deg(&bag, &[]);
    for start in ["0", "300", "600", "900", "1200", "1500"] {
        let (heading, _) = heading_deg(&bag, &["--start-offset", start, "--duration", "300"]);
        assert!(
            (heading - whole).abs() < 0.05,
            "from {start} s: {heading} deg, whole {whole} deg"
        );
    }
}

/// The two halves of the ring-laser record agree with each other.
#[test]
fn halves_of_the_ring_laser_record_agree() {
    let Some(bag) = data_file("rlg_static.mcap") else {
        return;
    };
    let (first, _) = heading_deg(&bag, &["--duration", "923"]);
    let (second, _) = heading_deg(&bag, &["--start-offset", "923"]);
    assert!((first - second).abs() < 0.02, "{first} deg, {second} deg");
}

/// The independent simulation of the eight-position scheme is calibrated to its truth, with the sigmas of the table in
/// expected-results.md.
#[test]
fn independent_eight_position_bag_is_calibrated_to_its_truth() {
    /// One sigma after 4 h, reading D, outer x, inner y: φ arcsec, ∇ ug, ε 1e-4 deg/h.
    const EXPECTED: [(&str, [f64; 3], f64); 3] = [
        ("misalignment_std_rad", [0.603, 0.604, 20.5], ARC_SECOND),
        (
            "accelerometer_bias_std_m_s2",
            [0.96, 0.68, 0.85],
            9.806_65e-6,
        ),
        (
            "gyroscope_drift_std_rad_s",
            [10.2, 6.71, 9.50],
            1e-4 * DEG_PER_HOUR,
        ),
    ];
    const ARC_SECOND: f64 = std::f64::consts::PI / 648_000.0;
    const DEG_PER_HOUR: f64 = ARC_SECOND;
    let (Some(bag), Some(truth)) = (
        data_file("eight_position.mcap"),
        data_file("eight_position.truth.json"),
    ) else {
        return;
    };
    let truth: Value = serde_json::from_str(&std::fs::read_to_string(truth).unwrap()).unwrap();
    let answer = rotary_sins(&[
        "calibrate",
        bag.to_str().unwrap(),
        "--model",
        "paper",
        "--json",
    ]);
    let json = answer.expect_status(0).json();
    for (key, sigma) in [
        ("gyroscope_drift_rad_s", "gyroscope_drift_std_rad_s"),
        ("accelerometer_bias_m_s2", "accelerometer_bias_std_m_s2"),
    ] {
        assert_within_sigmas(
            key,
            &vector(&json, key),
            &vector(&truth, key),
            &vector(&json, sigma),
            3.5,
        );
    }
    for (key, expected, unit) in EXPECTED {
        for (sigma, expected) in vector(&json, key).into_iter().zip(expected) {
            let ratio = sigma / (expected * unit);
            assert!((ratio - 1.0).abs() < 0.05, "{key}: {ratio} of {expected}");
        }
    }
    assert_eq!(json["phase"], "converged");
    assert_eq!(json["gaps"], 0);
}
