//! Navigation after calibration, held against `expected-results`: the position error with the calibration and without it, at
//! rest and after the ship has turned.
#![allow(clippy::unwrap_used, missing_docs)]

use rayon::prelude::*;
use sins::simulation::NoiseReading;
use sins::studies::monte_carlo::{MonteCarlo, RunResult, TrueErrors, Voyage};
use sins::table::scheme::Scheme;
use sins::units::NAUTICAL_MILE_M;

const RUNS: u64 = 20;

/// Calibrations of twenty IMUs, each with these errors or with errors drawn from P0.
fn calibrations(scheme: &Scheme, errors: Option<TrueErrors>) -> Vec<RunResult> {
    let mut monte_carlo = MonteCarlo::paper(scheme.clone(), NoiseReading::D.density());
    monte_carlo.plant.imu_rate_hz = 10.0;
    monte_carlo.errors = errors;
    monte_carlo.seed = 14;
    [0..RUNS / 2, RUNS / 2..RUNS]
        .into_par_iter()
        .flat_map_iter(|batch| monte_carlo.run(batch).unwrap())
        .collect()
}

/// Greatest horizontal position error in 24 h \[nmi\], with the calibration and without, of a ship that first turns by
/// `turn_deg` and then lies still. The block stands as calibration left it.
fn navigate(run: &RunResult, turn_deg: f64) -> [f64; 2] {
    let voyage = Voyage {
        turn_rad: turn_deg.to_radians(),
        duration_s: 24.0 * 3600.0,
        noise: NoiseReading::D.density(),
        every_s: 60.0,
    };
    let track = voyage.sail(&run.departure()).unwrap();
    assert_eq!(track.times_s.len(), 24 * 60);
    track
        .greatest_m(voyage.duration_s)
        .map(|m| m / NAUTICAL_MILE_M)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// At rest: about 14.5 nmi without the calibration; with it a median of 20 runs of at most 1.3 nmi and none above 3.
#[test]
fn calibration_shrinks_the_position_error() {
    let runs = calibrations(&Scheme::eight_position(), Some(TrueErrors::table_1()));
    let results: Vec<[f64; 2]> = runs.par_iter().map(|run| navigate(run, 0.0)).collect();
    let mut with: Vec<f64> = results.iter().map(|r| r[0]).collect();
    let mut without: Vec<f64> = results.iter().map(|r| r[1]).collect();
    println!(
        "with {:.2?}, median {:.2}; without, median {:.2}",
        with.clone(),
        median(&mut with),
        median(&mut without)
    );
    assert!(median(&mut with) <= 1.3);
    assert!(with.iter().all(|w| *w <= 3.0));
    assert!((median(&mut without) - 14.5).abs() < 1.5);
}

/// After a turn of 90 deg the eight-position calibration still serves, and a static one shows what it never knew.
#[test]
fn a_static_calibration_does_not_survive_a_turn() {
    let rms = |scheme: &Scheme| {
        let runs = calibrations(scheme, None);
        let squares: f64 = runs
            .par_iter()
            .map(|run| navigate(run, 90.0)[0].powi(2))
            .sum();
        (squares / RUNS as f64).sqrt()
    };
    let (eight, stationary) = (rms(&Scheme::eight_position()), rms(&Scheme::stationary()));
    println!(
        "rms of the greatest error after a turn: eight-position {eight:.2} nmi, static {stationary:.2} nmi"
    );
    assert!(eight <= 1.5);
    assert!(stationary >= 5.0);
}
