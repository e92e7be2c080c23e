//! The figures of the project's `expected-results`: an independent prototype's covariances, analytic limits, and the
//! filter's own consistency over a Monte Carlo.
#![allow(clippy::unwrap_used, missing_docs)]

use std::f64::consts::PI;

use rayon::prelude::*;
use sins::earth::EARTH_RATE_RAD_S;
use sins::simulation::NoiseReading;
use sins::studies::monte_carlo::{MonteCarlo, RunResult, TrueErrors};
use sins::table::scheme::Scheme;
use sins::table::{Axis, Turntable};
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

/// Sigma in the units of the table: φ arcsec, ∇ ug, ε 1e-4 deg/h.
fn table_units() -> [f64; 9] {
    let (a, u, d) = (ARC_SECOND, MICRO_G, 1e-4 * DEG_PER_HOUR);
    [a, a, a, u, u, u, d, d, d]
}

/// Sigma after four hours; a covariance does not ask for a fast IMU, so 20 Hz will do.
fn sigma_after_4_h(scheme: Scheme, table: Turntable, reading: NoiseReading) -> [f64; 9] {
    let mut monte_carlo = MonteCarlo::paper(scheme, reading.density());
    monte_carlo.plant.turntable = table;
    monte_carlo.plant.imu_rate_hz = 20.0;
    let sigma = monte_carlo.run(0..1).unwrap()[0].snapshots[0].calibrated_sigma();
    let units = table_units();
    std::array::from_fn(|i| sigma[i] / units[i])
}

/// Within 2 %, and half a digit of the printed table.
fn agrees(name: &str, sigma: [f64; 9], table: [&str; 9]) {
    println!("{name}: {sigma:.3?}");
    for (state, (ours, printed)) in sigma.iter().zip(table).enumerate() {
        let theirs: f64 = printed.parse().unwrap();
        let digits = printed.split('.').nth(1).map_or(0, str::len);
        let tolerance = 0.02 * theirs + 0.5 * 10f64.powi(-i32::try_from(digits).unwrap());
        assert!(
            (ours - theirs).abs() < tolerance,
            "{name}, state {state}: {ours} against {theirs}"
        );
    }
}

const XY: Turntable = Turntable {
    outer: Axis::X,
    inner: Axis::Y,
};
const YX: Turntable = Turntable {
    outer: Axis::Y,
    inner: Axis::X,
};
const YZ: Turntable = Turntable {
    outer: Axis::Y,
    inner: Axis::Z,
};

/// The sigma table of an independent prototype, reading D, every scheme and both gimbal orders, within 2 %.
#[test]
fn sigma_table_reading_d() {
    use NoiseReading::D;
    let (xy, yz) = (Scheme::eight_position, Scheme::eight_position_yz);
    let cases = [
        (
            "D static",
            Scheme::stationary(),
            XY,
            [
                "17.75", "17.85", "135.7", "86.6", "86.1", "100", "67.9", "10.5", "25.4",
            ],
        ),
        (
            "D eight-position outer x inner y",
            xy(),
            XY,
            [
                "0.603", "0.604", "20.5", "0.96", "0.68", "0.85", "10.2", "6.71", "9.50",
            ],
        ),
        (
            "D eight-position outer y inner x",
            xy(),
            YX,
            [
                "0.587", "0.583", "13.2", "1.85", "0.57", "0.57", "10.3", "6.05", "6.63",
            ],
        ),
        (
            "D y-z outer y inner z",
            yz(),
            YZ,
            [
                "0.599", "0.590", "10.8", "0.75", "0.77", "0.73", "5.93", "5.64", "8.78",
            ],
        ),
    ];
    cases
        .into_par_iter()
        .for_each(|(name, scheme, table, expected)| {
            agrees(name, sigma_after_4_h(scheme, table, D), expected);
        });
}

/// The same under reading H.
#[test]
fn sigma_table_reading_h() {
    use NoiseReading::H;
    let cases = [
        (
            "H static",
            Scheme::stationary(),
            [
                "17.74", "17.85", "133.0", "86.6", "86.1", "100", "67.7", "9.27", "9.05",
            ],
        ),
        (
            "H eight-position",
            Scheme::eight_position(),
            [
                "0.053", "0.065", "2.34", "0.20", "0.12", "0.18", "1.18", "0.59", "1.20",
            ],
        ),
    ];
    cases.into_par_iter().for_each(|(name, scheme, expected)| {
        agrees(name, sigma_after_4_h(scheme, XY, H), expected);
    });
}

/// Analytic limits of a static alignment: the level error is the part of ∇/g that P0 does not already know, and the drift
/// of the north gyroscope cannot be told from the level error's turning by the earth.
#[test]
fn analytic_floors_of_static_alignment() {
    let sigma = sigma_after_4_h(Scheme::stationary(), XY, NoiseReading::D);
    let (prior, accelerometer) = (36.0, 100.0 * MICRO_G / 9.806_7 / ARC_SECOND);
    let level = prior * accelerometer / f64::hypot(prior, accelerometer);
    assert!(
        (sigma[0] / level - 1.0).abs() < 0.01,
        "{} {level}",
        sigma[0]
    );
    let latitude = 45.78 * PI / 180.0;
    let floor = EARTH_RATE_RAD_S * latitude.sin() * level * ARC_SECOND / (1e-4 * DEG_PER_HOUR);
    assert!((floor - 9.3).abs() < 0.1, "{floor}");
    assert!(
        sigma[7] > floor && sigma[7] < 1.2 * floor,
        "{} {floor}",
        sigma[7]
    );
}

/// Noise-free sensors and measurements at 100 Hz, Table 1 errors, the filter's Q that of reading H: what is left after four
/// hours is the arithmetic's. Catches wrong signs, skews of one sample, lost precision.
#[test]
fn noise_free_run() {
    let mut monte_carlo = MonteCarlo::paper(Scheme::eight_position(), NoiseReading::H.density());
    monte_carlo.noise.gyroscope.fill(0.0);
    monte_carlo.noise.accelerometer.fill(0.0);
    monte_carlo.noisy_measurements = false;
    monte_carlo.errors = Some(TrueErrors::table_1());
    let error = monte_carlo.run(0..1).unwrap()[0].snapshots[0].calibrated_error();
    println!(
        "noise-free: phi {:?} arcsec, bias {:?} ug, drift {:?} deg/h",
        (error.fixed_rows::<3>(0) / ARC_SECOND).as_slice(),
        (error.fixed_rows::<3>(3) / MICRO_G).as_slice(),
        (error.fixed_rows::<3>(6) / DEG_PER_HOUR).as_slice(),
    );
    assert!(error[2].abs() < 0.1 * ARC_SECOND);
    assert!(error.fixed_rows::<3>(3).amax() < 0.01 * MICRO_G);
    assert!(error.fixed_rows::<3>(6).amax() < 5e-6 * DEG_PER_HOUR);
}

/// Twenty runs with errors drawn from P0: rms of every state over its sigma in [0.5, 1.55], mean NEES of the nine in
/// [6.2, 12.4] at 1, 2, 3 and 4 h.
#[test]
fn monte_carlo_is_consistent() {
    const RUNS: u64 = 20;
    let mut monte_carlo = MonteCarlo::paper(Scheme::eight_position(), NoiseReading::D.density());
    monte_carlo.plant.imu_rate_hz = 20.0;
    monte_carlo.snapshots_s = [1.0, 2.0, 3.0, 4.0].map(|h| h * 3600.0).to_vec();
    monte_carlo.seed = 20_261_122;
    let batches: Vec<RunResult> = [0..RUNS / 2, RUNS / 2..RUNS]
        .into_par_iter()
        .flat_map_iter(|batch| monte_carlo.run(batch).unwrap())
        .collect();
    for k in 0..4 {
        let nees = batches
            .iter()
            .map(|r| r.snapshots[k].nees().unwrap())
            .sum::<f64>()
            / RUNS as f64;
        println!("mean NEES at {} h: {nees:.2}", k + 1);
        assert!(
            (6.2..=12.4).contains(&nees),
            "mean NEES {nees} at {} h",
            k + 1
        );
    }
    for state in 0..9 {
        let ratio = |r: &RunResult| {
            (r.snapshots[3].calibrated_error()[state] / r.snapshots[3].calibrated_sigma()[state])
                .powi(2)
        };
        let rms = (batches.iter().map(ratio).sum::<f64>() / RUNS as f64).sqrt();
        println!("state {state}: rms/sigma {rms:.2}");
        assert!(
            (0.5..=1.55).contains(&rms),
            "state {state}: rms/sigma {rms}"
        );
    }
}
