//! `compare`, `experiment` and `observability` as a researcher runs them: their figures against the project's `expected-results`, and
//! that a run can be repeated.

use std::fs;

use serde_json::Value;
use suite_tests::{number, repository, rotary_sins, scratch};

const DEG_PER_HOUR: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// A short `compare`: whole outputs, and the same numbers to the last bit on one core as on two.
#[test]
fn compare_writes_everything_and_repeats_itself() {
    let folder = |name: &str| scratch(name).to_str().unwrap().to_owned();
    let (first, second) = (folder("compare-1"), folder("compare-2"));
    let arguments = |output: &str| {
        [
            "compare", "--runs", "7", "--hours", "0.5", "--rate", "10", "--json", "--output",
        ]
        .map(str::to_owned)
        .into_iter()
        .chain([output.to_owned()])
        .collect::<Vec<_>>()
    };
    let one = rotary_sins(&arguments(&first)).expect_status(0).json();
    let on_one_core = suite_tests::Program::new("rotary-sins")
        .args(&arguments(&second).join(" "))
        .environment("RAYON_NUM_THREADS", "1")
        .command()
        .output()
        .unwrap();
    assert!(on_one_core.status.success());
    for name in ["summary.txt", "results.json", "figures.json", "report.html"] {
        let [a, b] = [&first, &second].map(|f| fs::read_to_string(format!("{f}/{name}")).unwrap());
        assert!(a == b, "{name} depends on the number of cores");
    }
    assert_eq!(one["cases"].as_array().unwrap().len(), 10);
    assert_eq!(one["heading_sweep"].as_array().unwrap().len(), 130);
    let figures: Value =
        serde_json::from_str(&fs::read_to_string(format!("{first}/figures.json")).unwrap())
            .unwrap();
    for figure in figures.as_array().unwrap() {
        let csv = format!("{first}/figures/{}.csv", figure["id"].as_str().unwrap());
        assert!(
            fs::read_to_string(&csv).unwrap().lines().count() > 10,
            "{csv}"
        );
    }
    let page = fs::read_to_string(format!("{first}/report.html")).unwrap();
    assert_eq!(
        page.matches("<svg").count(),
        figures.as_array().unwrap().len(),
        "every figure has its picture"
    );
}

/// The claims that the mathematics of `expected-results` decides: x-y is not better than y-z in azimuth at heading 0 and is at
/// heading 90; a static alignment holds no bias; nothing is forced.
#[test]
fn claims_part_where_the_mathematics_parts() {
    let output = scratch("compare-claims");
    let results = rotary_sins(&[
        "compare",
        "--runs",
        "2",
        "--rate",
        "10",
        "--no-voyages",
        "--json",
        "--output",
        output.to_str().unwrap(),
    ])
    .expect_status(0)
    .json();
    let claims = results["claims"].as_array().unwrap();
    let claim = |words: &str| {
        claims
            .iter()
            .find(|c| c["text"].as_str().unwrap().contains(words))
            .unwrap_or_else(|| panic!("no claim on {words}"))
    };
    let azimuth = claim("better than y-z: azimuth");
    assert_eq!(azimuth["verdict"], "holds in part");
    let holds = |heading: f64| {
        azimuth["cells"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|c| c["heading_deg"].as_f64() == Some(heading))
            .map(|c| c["holds"].as_bool().unwrap())
            .collect::<Vec<_>>()
    };
    assert!(holds(0.0).iter().all(|h| !h) && holds(90.0).iter().all(|h| *h));
    assert_eq!(claim("biases are not estimated")["verdict"], "holds");
    assert_eq!(claim("εz is not restrained")["verdict"], "does not hold");
    // The sigma table of expected-results, D eight-position outer x inner y: ε in 1e-4 deg/h, within 2 %.
    let case = results["cases"]
        .as_array()
        .unwrap()
        .iter()
        .find(|c| c["name"] == "D x-y, outer x inner y")
        .unwrap();
    for (state, expected) in [(6, 10.2), (7, 6.71), (8, 9.50)] {
        let ours = number(&case["sigma"][state]) / (1e-4 * DEG_PER_HOUR);
        assert!(
            (ours / expected - 1.0).abs() < 0.02,
            "{state}: {ours} against {expected}"
        );
    }
    for (state, expected) in [
        (6, 1.16),
        (7, 0.62),
        (8, 0.59),
        (3, 0.74),
        (4, 0.16),
        (5, 0.30),
    ] {
        let settled = number(&case["settled_h"][state]);
        assert!((settled - expected).abs() < 0.02, "{state}: {settled} h");
    }
}

/// The experiment: all IMUs converge, errors are as large as their sigmas say, and compensation shrinks the position error by more than the
/// paper's 7 to 3.
#[test]
fn experiment_converges_and_compensation_helps() {
    let report = rotary_sins(&["experiment", "--runs", "6", "--rate", "10", "--json"])
        .expect_status(0)
        .json();
    assert_eq!(report["converged"], 6);
    for state in report["states"].as_array().unwrap() {
        let ratio = state["rms_error"].as_f64().unwrap() / state["sigma"].as_f64().unwrap();
        // Six runs: chi-square of 6 over 6, 0.02 % on either side.
        assert!((0.1..2.1).contains(&ratio), "{state}");
    }
    let day = report["position"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["hours"] == 24.0)
        .unwrap();
    let [with, without] = ["median_compensated_nmi", "median_uncompensated_nmi"]
        .map(|key| day[key].as_f64().unwrap());
    assert!(without / with > 7.0 / 3.0, "{without} {with}");
}

/// What no test of the judge can see in four hours, by model and exact name, and how far an accepted world of it may be off \[sigma\]:
/// what grows no faster than the sensor's own noise lets it be measured, and what looks like an azimuth to a filter without states
/// of it. In 2000 worlds they were off by up to 5.4 and 7.6 sigma.
const UNSEEN: [(&str, &str, f64); 3] = [
    ("paper", "drifts grow 1e-3 deg/h/h", 8.0),
    ("paper", "g-sensitivity 0.01 deg/h/g", 10.0),
    ("whole", "drifts grow 1e-3 deg/h/h", 8.0),
];

/// Two hundred worlds, of every kind and for both models: none that the model holds is refused, and whatever is accepted and wrong is of a kind
/// that is known not to be seen, and not farther off than is known of it.
#[test]
fn a_verdict_is_not_wrong_in_silence() {
    for model in ["paper", "whole"] {
        let arguments = [
            "assurance",
            "--worlds",
            "100",
            "--seed",
            "3",
            "--model",
            model,
            "--json",
        ];
        let report = rotary_sins(&arguments).json();
        assert_eq!(report["false_alarm"]["count"], 0, "{report}");
        for kind in report["kinds"].as_array().unwrap() {
            let name = kind["name"].as_str().unwrap();
            let unseen = UNSEEN
                .iter()
                .find(|unseen| (unseen.0, unseen.1) == (model, name));
            match unseen {
                Some((.., farthest)) => {
                    let worst = number(&kind["worst_accepted_z"]);
                    assert!(worst < *farthest, "{model}: {kind}");
                }
                None => assert_eq!(kind["false_assurance"], 0, "{model}: {kind}"),
            }
        }
    }
}

/// A refused world through the command line: status 1, and the JSON has the failed test with figure, bound, state and sentence, which
/// is among the reasons.
#[test]
fn a_refused_world_says_why_in_json() {
    let bag = scratch("refused-world").join("bag.mcap");
    let _ = rotary_sins(&[
        "simulate",
        "--hours",
        "1",
        "--rate",
        "10",
        "--gyroscope-scale-factor-ppm",
        "50,50,50",
        "--output",
        bag.to_str().unwrap(),
    ])
    .expect_status(0);
    let arguments = [
        "calibrate",
        bag.to_str().unwrap(),
        "--model",
        "paper",
        "--json",
    ];
    let json = rotary_sins(&arguments).expect_status(1).json();
    assert_eq!(json["phase"], "inconsistent");
    assert_eq!(json["verdict"]["consistent"], false);
    let tests = json["verdict"]["tests"].as_array().unwrap();
    let named = |name: &str| tests.iter().find(|test| test["name"] == name).unwrap();
    let failed = named("left_out_state");
    assert_eq!(failed["passed"], false);
    assert!(
        number(&failed["figure"]) > number(&failed["bound"]),
        "{failed}"
    );
    let state = failed["state"].as_str().unwrap();
    assert!(
        json["state_names"]
            .as_array()
            .unwrap()
            .iter()
            .all(|name| name != state)
    );
    let sentence = failed["sentence"].as_str().unwrap();
    assert!(
        sentence.contains("the model paper does not hold it"),
        "{sentence}"
    );
    let reasons = json["verdict"]["reasons"].as_array().unwrap();
    assert!(
        reasons.iter().any(|reason| reason == sentence),
        "{reasons:?}"
    );
    let passed = named("linearity");
    assert!(
        passed["passed"] == true && passed.get("sentence").is_none(),
        "{passed}"
    );
}

/// Ranks and conditions of a scheme from a file, on a ship elsewhere, as JSON.
#[test]
fn observability_of_a_file() {
    let file = scratch("observability").join("one-axis.yaml");
    fs::write(
        &file,
        "rotations: [{axis: x, angle_deg: 90}, {axis: x, angle_deg: 90}, {axis: x, angle_deg: 90}, {axis: x, angle_deg: -270}]\n",
    )
    .unwrap();
    let report = rotary_sins(&[
        "observability",
        "--scheme",
        file.to_str().unwrap(),
        "--latitude-deg",
        "-33",
        "--heading-deg",
        "20",
        "--json",
    ])
    .expect_status(0)
    .json();
    assert_eq!(report["accelerometers"]["four_out_of_one_plane"], false);
    assert_eq!(report["two_horizontal_axes"], false);
    let ranks: Vec<_> = report["ranks"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["rank"].as_u64().unwrap())
        .collect();
    assert_eq!(ranks[0], 7);
    assert!(ranks.iter().all(|r| *r < 12), "{ranks:?}");
    let last = report["ranks"].as_array().unwrap().last().unwrap();
    assert_eq!(
        last["hidden"].as_array().unwrap().len() as u64 + last["rank"].as_u64().unwrap(),
        13
    );
}

#[test]
fn unusable_arguments_get_one_line() {
    rotary_sins(&["observability", "--scheme", "nonsense"])
        .expect_refusal(&["nonsense", "eight-position"]);
    rotary_sins(&["observability", "--latitude-deg", "95"]).expect_refusal(&["latitude", "95"]);
    rotary_sins(&["observability", "--hours", "NaN"]).expect_refusal(&["--hours", "NaN"]);
    rotary_sins(&["compare", "--runs", "0"]).expect_refusal(&["--runs is 0", "expected"]);
    rotary_sins(&[
        "compare",
        "--heading-deg",
        "inf",
        "--runs",
        "1",
        "--output",
        scratch("refused").to_str().unwrap(),
    ])
    .expect_refusal(&["heading"]);
    let file = repository().join("Cargo.toml/compare");
    rotary_sins(&["compare", "--output", file.to_str().unwrap()]).expect_refusal(&["Cargo.toml"]);
    rotary_sins(&["experiment", "--rate", "0"]).expect_refusal(&["--rate is 0", "expected"]);
}

/// The library of studies and reports speaks to no network and to no terminal: nothing that it stands on does.
#[test]
fn the_library_has_no_network_and_no_terminal() {
    stands_on_no_network("analysis", &[]);
}

/// Nor does the Python package; and without its feature it stands on nothing of Python's, so that the workspace builds without.
#[test]
fn the_python_package_has_no_network() {
    stands_on_no_network("rotary_sins_python", &["--features", "extension"]);
    let bare = tree("rotary_sins_python", &[]);
    assert!(!bare.contains("pyo3") && !bare.contains("numpy"), "{bare}");
}

/// What a package stands on, a line each.
fn tree(package: &str, features: &[&str]) -> String {
    let tree = std::process::Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", "normal"])
        .args(["--prefix", "none", "--package", package])
        .args(features)
        .current_dir(repository())
        .output()
        .unwrap();
    assert!(tree.status.success(), "{tree:?}");
    String::from_utf8(tree.stdout).unwrap()
}

fn stands_on_no_network(package: &str, features: &[&str]) {
    let text = tree(package, features);
    let names: Vec<&str> = text.lines().filter_map(|l| l.split(' ').next()).collect();
    assert!(names.contains(&"sins") && names.contains(&"bags"), "{text}");
    for barred in [
        "ros_node",
        "ros2-client",
        "rustdds",
        "tokio",
        "clap",
        "indicatif",
        "crossterm",
        "ratatui",
    ] {
        assert!(!names.contains(&barred), "{package} stands on {barred}");
    }
}
