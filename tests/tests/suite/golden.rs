//! Golden summaries: the results of a few runs stand in `tests/golden`, so that a change of any estimate is seen in review.
//!
//! A changed result fails here. Where the change is meant, `ROTARY_SINS_UPDATE_GOLDEN=1 cargo test --release -p suite_tests
//! golden` writes the new summaries, and the commit shows what moved.

use suite_tests::{Simulation, hold_file, rotary_sins, scratch};

fn hold(name: &str, text: &str) {
    let path = format!("tests/golden/{name}");
    hold_file(&path, text, "ROTARY_SINS_UPDATE_GOLDEN");
}

#[test]
fn compare_gives_what_it_gave() {
    let directory = scratch("golden-compare");
    let output = directory.to_str().unwrap();
    let answer = rotary_sins(&["compare", "--runs", "4", "--rate", "10", "--output", output])
        .expect_status(0);
    hold("compare.txt", &answer.stdout);
}

#[test]
fn experiment_gives_what_it_gave() {
    let answer = rotary_sins(&["experiment", "--runs", "4", "--rate", "10"]).expect_status(0);
    hold("experiment.txt", &answer.stdout);
}

#[test]
fn observability_is_what_it_was() {
    for (name, arguments) in [
        ("observability-static.txt", vec!["--scheme", "static"]),
        ("observability-eight-position.txt", vec![]),
        (
            "observability-eight-position-heading-30-outer-y.txt",
            vec![
                "--heading-deg",
                "30",
                "--outer-axis",
                "y",
                "--inner-axis",
                "x",
            ],
        ),
        (
            "observability-eight-position-yz.txt",
            vec!["--scheme", "eight-position-yz", "--noise", "H"],
        ),
    ] {
        let answer = rotary_sins(&[vec!["observability"], arguments].concat()).expect_status(0);
        hold(name, &answer.stdout);
    }
}

/// Through bags: simulated, packed, read and calibrated.
#[test]
fn calibration_of_a_bag_is_what_it_was() {
    let bag = Simulation::new("eight-position", 4.0, 10.0, 1).bag();
    let answer =
        rotary_sins(&["calibrate", bag.to_str().unwrap(), "--model", "paper"]).expect_status(0);
    hold("calibrate-eight-position.txt", &answer.stdout);
}
