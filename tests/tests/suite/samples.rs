//! The bags that ship with the project: made again they are the same, each is what it is said to be, and they stay small.

use std::fs;
use std::path::Path;
use std::process::Command;

use suite_tests::{
    BAD_SAMPLES, GOOD_SAMPLES, assert_within_sigmas, calibrate, executable, rotary_sins, sample,
    samples, scratch, text, truth_of_sample, vector,
};

const MEGABYTE: u64 = 1_000_000;

/// Paths of all files below a folder, with their content.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            let below = contents(&path).into_iter();
            all.extend(below.map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else {
            all.push((name, fs::read(path).unwrap()));
        }
    }
    all.sort();
    all
}

/// `make.sh` makes every bag and every truth again, to the last bit.
#[test]
fn they_are_made_again_bit_for_bit() {
    let folder = scratch("made");
    let made = Command::new(samples().join("make.sh"))
        .arg(&folder)
        .env(
            "ROTARY_SINS_BIN_DIR",
            executable("rotary-sins").parent().unwrap(),
        )
        .output()
        .unwrap();
    assert!(made.status.success(), "{made:?}");
    let mut kept = contents(&samples());
    kept.retain(|(name, _)| !["make.sh", "README.md"].contains(&name.as_str()));
    let made = contents(&folder);
    let names = |list: &[(String, Vec<u8>)]| -> Vec<String> {
        list.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(&kept), names(&made));
    for ((name, kept), (_, made)) in kept.iter().zip(&made) {
        assert!(
            kept == made,
            "{name} is made otherwise now ({} and {} bytes); where that is meant: bags/samples/make.sh",
            kept.len(),
            made.len()
        );
    }
}

/// A clone stays small: 5 MB a bag, 15 MB together.
#[test]
fn they_are_small() {
    let mut together = 0;
    for name in GOOD_SAMPLES.iter().chain(&BAD_SAMPLES) {
        let bytes: usize = contents(&sample(name)).iter().map(|(_, b)| b.len()).sum();
        assert!(bytes as u64 <= 5 * MEGABYTE, "{name}: {bytes} bytes");
        together += bytes as u64;
    }
    assert!(together <= 15 * MEGABYTE, "{together} bytes together");
}

/// `calibrate` and `report` converge on each whole one, status 0, within 3.5 of its sigmas of the truth; and its attitude is
/// the true one.
#[test]
fn the_good_ones_converge_to_their_truth() {
    for name in GOOD_SAMPLES {
        let bag = sample(name);
        let json = calibrate(&bag).expect_status(0).json();
        let truth = truth_of_sample(name);
        let page = scratch(name).join("page.html");
        let report = rotary_sins(&["report", text(&bag), "--output", text(&page)]);
        let _ = report.expect_status(0);
        assert_eq!(
            (&json["gaps"], &json["phase"]),
            (&0.into(), &"converged".into())
        );
        for (key, sigma) in [
            ("gyroscope_drift_rad_s", "gyroscope_drift_std_rad_s"),
            ("accelerometer_bias_m_s2", "accelerometer_bias_std_m_s2"),
        ] {
            let [estimate, truth, sigma] =
                [(&json, key), (&truth, key), (&json, sigma)].map(|(json, key)| vector(json, key));
            assert_within_sigmas(&format!("{name}: {key}"), &estimate, &truth, &sigma, 3.5);
        }
        // The truth is of the end, half a second after the last estimate: a ship that rolls is elsewhere by then.
        if name == "moored_sea" {
            continue;
        }
        let [estimate, truth] = [&json, &truth].map(|json| vector(json, "attitude_xyzw"));
        let cosine: f64 = estimate.iter().zip(&truth).map(|(a, b)| a * b).sum();
        let off = 2.0 * (1.0 - cosine.abs()).max(0.0).sqrt() * 2f64.sqrt();
        let sigma = vector(&json, "misalignment_std_rad");
        let limit = 4.0 * sigma.iter().map(|s| s * s).sum::<f64>().sqrt();
        assert!(
            off <= limit,
            "{name}: attitude off by {off} rad, {limit} expected"
        );
    }
}

/// The one that was cut off is read as far as it goes, and a line says where it ends.
#[test]
fn the_one_that_was_cut_off_says_so() {
    let bag = sample("cut_off");
    let answer = calibrate(&bag).expect_status(1);
    answer.expect_words(&["cut_off_0.mcap", "ends at byte"]);
    let duration = answer.json()["duration_s"].as_f64().unwrap();
    assert!(duration > 600.0 && duration < 1800.0, "{duration} s");
}

/// The damaged chunk is left out, a line says which, and the result says that samples are missing.
#[test]
fn the_damaged_one_says_so() {
    let bag = sample("damaged_chunk");
    let answer = calibrate(&bag).expect_status(1);
    answer.expect_words(&["damaged_chunk_0.mcap", "chunk at byte", "left out"]);
    let json = answer.json();
    assert_ne!(json["lost_samples"], 0);
    assert_ne!(json["gaps"], 0);
}
