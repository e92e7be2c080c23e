#![allow(clippy::unwrap_used)]
use std::f64::consts::TAU;

use super::*;
use crate::estimation::grade::GroupPriors;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::simulation::Ship;
use crate::studies::observability::Setting;
use crate::studies::observability::bound::{bound, settled_s};
use crate::studies::stretch::{Physics, States};
use crate::table::scheme::Scheme;
use crate::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G, PPM};

/// The paper's constraints; `headings` of them round the compass.
fn search(physics: &Physics, headings: usize, seed: u64) -> Search {
    let headings = (0..headings).map(|k| TAU * k as f64 / headings as f64);
    let catalogue =
        Catalogue::new(physics, headings.collect(), 4, Turn::all(4), vec![500]).unwrap();
    let rules = Rules {
        closed: true,
        limits: [-4..=4, -4..=4],
        rotations: 4..=14,
    };
    let (goals, minimax) = (Goal::paper(), Criterion::Minimax);
    Search::new(catalogue, &goals, minimax, rules, 14_400.0, seed).unwrap()
}

fn eight_position(search: &Search) -> Sequence {
    search.sequence(&Scheme::eight_position()).unwrap()
}

fn found(seed: u64, chains: usize) -> Progress {
    let search = search(&Physics::default(), 4, seed);
    let mut progress = Progress::default();
    let found = (0..chains).map(|chain| search.chain(&progress, chain));
    let found = found.collect();
    search.merge(&mut progress, found);
    progress
}

/// Joined elements say what the second-by-second bound says, to 2 parts in 1000 of every sigma (its seconds lie across the ends
/// of rotations, those here do not) and to 3 s of every time.
#[test]
fn elements_agree_with_the_bound() {
    let search = search(&Physics::default(), 8, 1);
    let scheme = Scheme::eight_position();
    let program = scheme.program(scheme.default_table()).unwrap();
    for standing in search.standings(&eight_position(&search)) {
        let setting = Setting {
            ship: Ship {
                heading_rad: standing.heading_rad,
                ..Ship::default()
            },
            ..Setting::default()
        };
        let points = bound(&program, &setting, 1).unwrap();
        let end = &points.last().unwrap().sigma;
        for (label, sigma) in search
            .catalogue()
            .space()
            .labels
            .iter()
            .zip(&standing.sigma)
        {
            let slow = end.value(label.name).unwrap();
            assert!(
                (sigma / slow - 1.0).abs() < 2e-3,
                "{}: {sigma} {slow}",
                label.name
            );
        }
        for (goal, (names, limit)) in [
            (GYROSCOPE_DRIFT, 0.002 * DEG_PER_HOUR),
            (ACCELEROMETER_BIAS, 10.0 * MICRO_G),
        ]
        .into_iter()
        .enumerate()
        {
            let below = settled_s(&points, |sigma| {
                names.iter().all(|name| sigma.value(name).unwrap() < limit)
            });
            let (fast, slow) = (standing.times_s[goal + 1], below.unwrap());
            assert!((fast - slow).abs() <= 3.0, "{names:?}: {fast} {slow}");
        }
    }
}

/// The whole model with vertical velocity and encoders: the sigmas of the project's `expected-results`, by a filter of 54 states that
/// shares nothing with this suite, within 5 % (the gyroscope scale about the inner axis hangs on priors that it does not name).
#[test]
fn whole_model_has_the_expected_sigmas() {
    let mut physics = Physics {
        states: States::Groups(GroupPriors {
            gyroscope_g_sensitivity_rad_s_per_m_s2: 0.0,
            gyroscope_drift_walk_rad_s_sqrt_s: 0.0,
            accelerometer_bias_walk_m_s2_sqrt_s: 0.0,
            height_m: 0.01,
            ..GroupPriors::default()
        }),
        ..Physics::default()
    };
    physics.measurements.velocity_up_m_s = Some(0.01);
    physics.measurements.encoder_rad = Some(3.0 * ARC_SECOND);
    let search = search(&physics, 1, 1);
    let standing = search.standing(&eight_position(&search), 0);
    for (name, unit, expected) in [
        (MISALIGNMENT[2], ARC_SECOND, 14.6),
        (ACCELEROMETER_BIAS[1], MICRO_G, 0.60),
        (GYROSCOPE_DRIFT[0], 1e-4 * DEG_PER_HOUR, 6.6),
        (GYROSCOPE_DRIFT[1], 1e-4 * DEG_PER_HOUR, 5.3),
        (GYROSCOPE_DRIFT[2], 1e-4 * DEG_PER_HOUR, 6.2),
        ("gyroscope_scale_factor_x", PPM, 0.40),
        ("gyroscope_scale_factor_z", PPM, 0.43),
        ("accelerometer_delay_s", 1e-3, 0.017),
    ] {
        let state = search.catalogue().space().position(name).unwrap();
        let sigma = standing.sigma[state] / unit;
        assert!(
            (sigma / expected - 1.0).abs() < 0.1,
            "{name}: {sigma} {expected}"
        );
    }
}

/// One chain after another gives what all at once give, to the last bit; another seed gives something else.
#[test]
fn a_seed_decides_everything() {
    let search = search(&Physics::default(), 2, 7);
    let progress = Progress::default();
    let alone: Vec<Found> = (0..2).map(|chain| search.chain(&progress, chain)).collect();
    let together = std::thread::scope(|scope| {
        let chains: Vec<_> = (0..2)
            .map(|chain| {
                scope.spawn({
                    let (search, progress) = (&search, &progress);
                    move || search.chain(progress, chain)
                })
            })
            .collect();
        chains
            .into_iter()
            .map(|chain| chain.join().unwrap())
            .collect::<Vec<_>>()
    });
    assert_eq!(alone, together);
    assert_ne!(alone[0].stands.sequence, alone[1].stands.sequence);
}

/// A short search, of 8000 schemes, ends far below the paper's 1.88, whatever the seed, with what keeps to the rules.
#[test]
fn a_short_search_betters_the_paper() {
    for seed in [2, 3] {
        let progress = found(seed, 4);
        let search = search(&Physics::default(), 4, seed);
        let best = &progress.best[0];
        assert!(best.score < 1.25, "seed {seed}: {}", best.score);
        assert!(
            best.sequence
                .keeps_to(search.rules(), search.catalogue().turns())
        );
        let scheme = best
            .sequence
            .scheme("found", search.catalogue(), search.rules());
        scheme.program(scheme.default_table()).unwrap();
        assert_eq!(search.sequence(&scheme).as_ref(), Some(&best.sequence));
    }
}

/// A score that is given up early is one that is above the limit, and no other.
#[test]
fn limits_cut_only_what_is_above_them() {
    let search = search(&Physics::default(), 4, 1);
    let paper = eight_position(&search);
    let worst = search
        .standings(&paper)
        .iter()
        .map(|standing| standing.score)
        .fold(0.0, f64::max);
    assert_eq!(search.score_within(&paper, worst), Some(worst));
    assert_eq!(search.score_within(&paper, worst * (1.0 - 1e-9)), None);
}

/// Goals of states that the model does not have are refused by name; so are encoders with thirteen states.
#[test]
fn what_means_nothing_is_refused() {
    let mut goals = Goal::paper();
    goals[0].states = vec!["nonsense".to_owned()];
    let catalogue =
        || Catalogue::new(&Physics::default(), vec![0.0], 4, Turn::all(4), vec![500]).unwrap();
    let rules = Rules {
        closed: true,
        limits: [-4..=4, -4..=4],
        rotations: 4..=14,
    };
    let refused = Search::new(catalogue(), &goals, Criterion::A, rules, 14_400.0, 1);
    assert!(refused.err().unwrap().to_string().contains("nonsense"));
    let mut physics = Physics::default();
    physics.measurements.encoder_rad = Some(1e-5);
    let refused = Catalogue::new(&physics, vec![0.0], 4, Turn::all(4), vec![500]);
    assert!(refused.err().unwrap().to_string().contains("encoders"));
}

/// The shipped scheme has at each of 24 headings what its page says: azimuth 10.72 arcsec, drifts 0.71 h, biases 0.31 h.
#[test]
fn the_shipped_scheme_has_its_figures() {
    let headings = (0..24).map(|k| TAU * f64::from(k) / 24.0).collect();
    let (physics, goals) = (Physics::default(), Goal::paper());
    let scheme = Scheme::designed();
    let of_scheme = Search::of_scheme(
        &scheme,
        &physics,
        headings,
        &goals,
        Criterion::Minimax,
        14_400.0,
    );
    let (search, sequence) = of_scheme.unwrap();
    for standing in search.standings(&sequence) {
        let azimuth = standing.values[0] * 11.0;
        let [drift, bias] = [1, 2].map(|goal| standing.times_s[goal] / 3600.0);
        assert!((10.68..10.73).contains(&azimuth), "{azimuth}");
        assert!((0.66..0.72).contains(&drift), "{drift}");
        assert!((0.29..0.315).contains(&bias), "{bias}");
    }
}
