#![allow(clippy::unwrap_used)]
use super::*;
use crate::error::Error;
use crate::machines::self_calibration::Test;
use crate::table::Turntable;
use crate::units::{MICRO_G, PPM};

/// The first world of a kind, by an estimate's verdict.
fn outcome(name: &str, model: ModelChoice, change: impl FnOnce(&mut World)) -> Outcome {
    let kind = kind(name);
    let mut world = kind.draw(3, 0, model);
    change(&mut world);
    world.run().unwrap()
}

fn kind(name: &str) -> &'static Kind {
    KINDS.iter().find(|kind| kind.name == name).unwrap()
}

/// A world that the model holds and that ends without any estimate is a false alarm; one that it does not hold is not.
#[test]
fn no_estimate_is_an_alarm() {
    let error = Error::setting("anything", 0, "something");
    let alarm = |name: &str| is_false_alarm(kind(name), ModelChoice::Paper, Err(&error));
    assert!(alarm("drift and bias alone"));
    assert!(!alarm("ring laser"));
}

/// An accepted world whose nine are right is a false assurance all the same where a scale factor that was learned is wrong.
#[test]
fn learned_states_beyond_the_nine_count() {
    let mut outcome = outcome("gyroscope scale 10 ppm", ModelChoice::Whole, |world| {
        world.duration_s = 3600.0;
    });
    let names: Vec<&str> = outcome.others.iter().map(|(name, _)| *name).collect();
    assert!(names.contains(&"gyroscope_scale_factor_x"), "{names:?}");
    assert!(!names.contains(&"gyroscope_drift_x_rad_s"), "{names:?}");
    let (state, worst) = outcome.worst_other().unwrap();
    assert!(worst < OTHERS_FALSE_BEYOND_SIGMA, "{state} {worst}");
    outcome.verdict.converged = true;
    outcome.verdict.consistent = true;
    assert!(!is_false_assurance(&outcome), "{:?}", outcome.z);
    outcome.others[0].1 = -5.1;
    assert!(is_false_assurance(&outcome));
    outcome.others[0].1 = f64::NAN;
    assert!(is_false_assurance(&outcome));
}

/// Rotation-driven noise of 10 ppm carries the thirteen states over scale factors of 10 ppm that they do not hold: NEES of the nine
/// falls from hundreds to about ten, and a bias costs 4 to 5.5 ug. (An independent filter takes 10 ppm of each turn of 90 deg and
/// has 3 to 4 ug; here it is 10 ppm of 180 deg and grows in squares, which is √2 more for turns of 90 deg.)
#[test]
fn turn_noise_carries_the_thirteen_states() {
    const WORLDS: u64 = 5;
    let mut nees = [0.0; 2];
    for number in 0..WORLDS {
        for (sum, turn_noise) in nees.iter_mut().zip([0.0, 10.0 * PPM]) {
            let kind = kind("gyroscope scale 10 ppm");
            let mut world = kind.draw(3, number, ModelChoice::Paper);
            // The setting of the figures in the manual: outer x, inner y, heading 0.
            world.simulator.plant.turntable = Turntable::default();
            world.calibration.turntable = Turntable::default();
            world.simulator.plant.ship.latitude_rad = 45.78f64.to_radians();
            world.simulator.plant.ship.heading_rad = 0.0;
            world.calibration.groups.turn_noise = turn_noise;
            let outcome = world.run().unwrap();
            *sum += outcome.nees / WORLDS as f64;
            let sigma = outcome.estimate.accelerometer_bias_sigma() / MICRO_G;
            let expected = if turn_noise > 0.0 { 4.0..5.5 } else { 0.6..1.0 };
            assert!(sigma.iter().all(|s| expected.contains(s)), "{sigma}");
        }
    }
    println!("mean NEES {nees:?}");
    // Chi-square of 45 over 5: at most 16 by chance once in 10000, and the scale factors are no noise.
    assert!(nees[0] > 200.0 && nees[1] < 16.0, "{nees:?}");
}

/// The judge's tests, and how the sentence of one that failed goes on. `innovations` is the one of the filter's own window.
const SENTENCES: [(&str, &str); 12] = [
    (
        "innovations",
        "the innovations did not agree with the covariance",
    ),
    ("rest", "at rest the innovations are"),
    ("white", "drifts or biases wander more than was said"),
    (
        "turns",
        "something turns with the block that no state describes",
    ),
    ("left_out", "the model paper does not hold it (chi-square"),
    ("left_out_state", "the model paper does not hold it ("),
    (
        "witness",
        "sigma from what a whole model finds on the same samples",
    ),
    (
        "latitude",
        "the earth's rate shows another latitude than the fix",
    ),
    ("prior", "the prior is too narrow for this sensor"),
    (
        "joints",
        "axes, signs or scale of the joints are told wrong",
    ),
    ("linearity", "a second pass is needed"),
    ("noise", "times as noisy as they say"),
];

/// Which test must fail in the first world of a kind (seed 3), and about which state.
const SHOWN: &[(ModelChoice, &str, &str, Option<&str>)] = {
    use ModelChoice::{Paper, Whole};
    &[
        (Paper, "installation 10 arcsec", "innovations", None),
        (
            Paper,
            "gyroscope scale 3 ppm",
            "left_out",
            Some("gyroscope_scale_factor_x"),
        ),
        (
            Paper,
            "gyroscope scale 3 ppm",
            "left_out_state",
            Some("gyroscope_scale_factor_x"),
        ),
        (
            Paper,
            "gyroscope scale 10 ppm",
            "left_out_state",
            Some("gyroscope_scale_factor_x"),
        ),
        (
            Paper,
            "gyroscope scale 50 ppm",
            "left_out_state",
            Some("gyroscope_scale_factor_x"),
        ),
        (
            Paper,
            "gyroscope installation 2 arcsec",
            "left_out_state",
            Some("gyroscope_installation_yx_rad"),
        ),
        (
            Paper,
            "accelerometer scale 30 ppm",
            "left_out_state",
            Some("accelerometer_scale_factor_y"),
        ),
        (
            Paper,
            "accelerometer squares 5 ug/g2",
            "left_out_state",
            Some("accelerometer_quadratic_y_per_m_s2"),
        ),
        (
            Paper,
            "accelerometers 25 mm apart",
            "left_out_state",
            Some("accelerometer_arm_zz_m"),
        ),
        (
            Paper,
            "accelerometers 0.3 ms late",
            "left_out_state",
            Some("accelerometer_delay_s"),
        ),
        (
            Paper,
            "accelerometers 2 ms late",
            "left_out_state",
            Some("accelerometer_delay_s"),
        ),
        (
            Paper,
            "ring laser",
            "left_out_state",
            Some("accelerometer_scale_factor_y"),
        ),
        (
            Paper,
            "fibre optic",
            "left_out_state",
            Some("accelerometer_scale_factor_y"),
        ),
        (
            Paper,
            "gyroscope scale 50 ppm",
            "witness",
            Some("accelerometer_bias_z_m_s2"),
        ),
        (
            Whole,
            "table bends 3 arcsec/g",
            "witness",
            Some("misalignment_east_rad"),
        ),
        (Whole, "walks 1e-3 deg/h/rt-h, 3 ug/rt-h", "white", None),
        (Whole, "biases grow 5 ug/h", "white", None),
        (Whole, "biases grow 5 ug/h", "rest", None),
        (Whole, "warming up", "white", None),
        (Whole, "warming up", "rest", None),
        (Whole, "covariances 3 times too small", "rest", None),
        (Whole, "no covariances, 3 times the noise", "rest", None),
        (Whole, "stamps jittered by 2 ms", "turns", None),
        (Whole, "biases grow 5 ug/h", "turns", None),
        (Whole, "warming up", "turns", None),
        (
            Paper,
            "fix wrong by 0.1 deg",
            "latitude",
            Some("latitude_error_rad"),
        ),
        (
            Whole,
            "fix wrong by 0.1 deg",
            "latitude",
            Some("latitude_error_rad"),
        ),
        (
            Whole,
            "0.06 deg/h, priors of 0.01",
            "prior",
            Some("gyroscope_drift_z_rad_s"),
        ),
        (
            Whole,
            "gyroscope scale 200 ppm",
            "prior",
            Some("gyroscope_scale_factor_x"),
        ),
        (Paper, "order of the joints told wrong", "joints", None),
        (Paper, "a joint told with the wrong sign", "joints", None),
        (Paper, "a joint told 0.1 % too large", "joints", None),
        (
            Whole,
            "covariances 3 times too small",
            "noise",
            Some("gyroscope_drift_z_rad_s"),
        ),
        (
            Whole,
            "no covariances, 3 times the noise",
            "noise",
            Some("gyroscope_drift_z_rad_s"),
        ),
        (Whole, "MEMS, thresholds of its grade", "linearity", None),
    ]
};

/// Every test of the judge is failed by a world of a kind that it is there for, about the state that is wrong there, and its
/// sentence is among the reasons; and there is such a kind for every test.
#[test]
fn kinds_fail_the_tests_that_see_them() {
    let mut outcomes: Vec<((ModelChoice, &str), Outcome)> = Vec::new();
    for &(model, name, test, state) in SHOWN {
        if !outcomes.iter().any(|(of, _)| *of == (model, name)) {
            outcomes.push(((model, name), outcome(name, model, |_| ())));
        }
        let of = |(of, outcome): &((ModelChoice, &str), Outcome)| {
            (*of == (model, name)).then(|| outcome.verdict.clone())
        };
        let verdict = outcomes.iter().find_map(of).unwrap();
        assert!(!verdict.consistent, "{name}");
        if test == "innovations" {
            assert!(!verdict.innovations, "{name}: {:?}", verdict.reasons);
        } else {
            let found = verdict.tests.iter().find(|found| found.name == test);
            let found = found.unwrap_or_else(|| panic!("{name}: {test} was not made"));
            assert!(
                !found.passed && found.figure > found.bound,
                "{name}: {found:?}"
            );
            assert_eq!(found.state, state, "{name}: {found:?}");
        }
        let sentence = SENTENCES.iter().find(|(of, _)| *of == test).unwrap().1;
        let said = verdict
            .reasons
            .iter()
            .any(|reason| reason.contains(sentence));
        assert!(said, "{name}, {test}: {:?}", verdict.reasons);
    }
    for test in Test::ALL {
        let shown = SHOWN.iter().any(|(_, _, of, _)| *of == test.name());
        assert!(shown, "no kind shows {}", test.name());
    }
}

/// The manual's column "shown by the kinds" has the pairs of test and kind above, no more and no less.
#[test]
fn the_manual_names_the_kinds_that_were_run() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../docs/when-it-does-not-converge.md"
    );
    let page = std::fs::read_to_string(path).unwrap();
    let mut told = Vec::new();
    let from = page.find("## Inconsistent").unwrap();
    for row in page[from..].lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let tests = SENTENCES.iter().map(|(name, _)| *name);
        let tests: Vec<&str> = tests
            .filter(|name| {
                cells[0].contains(&format!("`{name}`"))
                    || (*name == "innovations" && cells[0].starts_with(*name))
            })
            .collect();
        for kind in cells[3].split("; ").filter(|_| !tests.is_empty()) {
            told.push((tests.clone(), kind.to_owned()));
        }
    }
    for &(_, kind, test, _) in SHOWN {
        let is_told = told
            .iter()
            .any(|(tests, of)| tests.contains(&test) && of == kind);
        assert!(is_told, "the manual does not say that {kind} shows {test}");
    }
    for (tests, kind) in &told {
        let is_run = |(_, of, test, _): &(ModelChoice, &str, &str, Option<&str>)| {
            of == kind && tests.contains(test)
        };
        assert!(SHOWN.iter().any(is_run), "{kind} is not run for {tests:?}");
    }
}
