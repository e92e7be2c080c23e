//! `design-scheme` as a script sees it: the same result on any number of cores and after a break, a scheme file that the other
//! commands take, and one line for what cannot be.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A search of an hour at one heading: a round is two seconds of a core.
fn search(arguments: &[&str], cores: &str) -> Output {
    let small = [
        "design-scheme",
        "--seed",
        "5",
        "--headings",
        "1",
        "--hours",
        "1",
        "--goal",
        "accelerometer_bias<10@0.45",
        "--goal",
        "misalignment_up=100",
    ];
    Command::new(env!("CARGO_BIN_EXE_rotary-sins"))
        .args(small)
        .args(arguments)
        .env("RAYON_NUM_THREADS", cores)
        .output()
        .unwrap()
}

fn json(output: &Output) -> Value {
    let told = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {told}"))
}

/// What a seed decides: everything but the speed and the words of the command.
fn decided(output: &Output) -> Value {
    let mut report = json(output);
    let fields = report.as_object_mut().unwrap();
    fields.remove("evaluations_per_s");
    fields.remove("command");
    report
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Two rounds on two cores, on one, and with a break between them give the same; the file is a scheme that `observability` takes.
#[test]
fn a_seed_decides_the_result() {
    let folder = tempfile::tempdir().unwrap();
    let [state, found] = ["state.json", "found.yaml"].map(|name| folder.path().join(name));
    let whole = search(&["--rounds", "2", "--json", "--output", text(&found)], "2");
    let report = decided(&whole);
    assert!(
        report["evaluations"].as_u64().unwrap() == 64_000,
        "{report}"
    );
    let best = report["schemes"][0]["score"].as_f64().unwrap();
    let paper = report["schemes"][1]["score"].as_f64().unwrap();
    assert!(best < 0.8 * paper, "{best} against the paper's {paper}");
    assert_eq!(report, decided(&search(&["--rounds", "2", "--json"], "1")));
    search(&["--rounds", "1", "--resume", text(&state)], "2");
    let resumed = search(&["--rounds", "2", "--json", "--resume", text(&state)], "2");
    assert_eq!(report, decided(&resumed));
    let other = search(&["--rounds", "2", "--open", "--resume", text(&state)], "2");
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("other options"));
    let shown = Command::new(env!("CARGO_BIN_EXE_rotary-sins"))
        .args(["observability", "--hours", "1", "--scheme", text(&found)])
        .output()
        .unwrap();
    assert!(
        shown.status.success(),
        "{}",
        String::from_utf8_lossy(&shown.stderr)
    );
    let again = search(&["--rounds", "1", "--output", text(&found)], "2");
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--force"));
}

/// What cannot be is refused in one line that names it, before anything is searched.
#[test]
fn what_cannot_be_is_refused() {
    for (arguments, word) in [
        (&["--goal", "nonsense=1"][..], "nonsense=1"),
        (&["--step-deg", "30"], "30"),
        (&["--dwells-s", "0"], "dwells"),
        (&["--rotations", "9,3"], "rotations"),
        (&["--outer-limits-deg", "10,20"], "cable limits"),
        (&["--without", "accelerometer_arm_m"], "--without"),
        (&["--inner-axis", "x"], "axis"),
        (
            &["--model", "whole", "--without", "arm"],
            "accelerometer_arm_m",
        ),
        (&["--hours", "NaN"], "--hours"),
        (&["--compare", "nonsense"], "nonsense"),
    ] {
        let output = search(arguments, "1");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert!(
            told.lines().count() == 1 && told.contains(word),
            "{arguments:?}: {told}"
        );
    }
}
