//! Navigation after calibration, held against `expected-results`: the position error with the calibration and without it, at
//! rest and after the ship has turned.
#![allow(clippy::unwrap_used, missing_docs)]

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;
use sins::earth::LocalEarth;
use sins::imu::NoiseDensity;
use sins::monte_carlo::{MonteCarlo, RunResult, TrueErrors};
use sins::navigator::{Navigator, NavigatorOutput, NavigatorSettings};
use sins::scheme::Scheme;
use sins::self_calibration::Calibration;
use sins::sensor_errors::SensorErrors;
use sins::simulation::{ImuErrorSettings, ImuErrors, NoiseReading, TruthSample};
use sins::strapdown::NavigationState;
use sins::turntable::JointSample;
use sins::units::NAUTICAL_MILE_M;

const RUNS: u64 = 20;
const LATITUDE_DEG: f64 = 45.78;

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
fn navigate(run: &RunResult, turn_deg: f64, noise: NoiseDensity) -> [f64; 2] {
    let earth = LocalEarth::at(LATITUDE_DEG.to_radians(), 0.0);
    // The true attitude at the end of calibration, from the estimate and what is left of its error.
    let left = run
        .snapshots
        .last()
        .unwrap()
        .calibrated_error()
        .fixed_rows::<3>(0)
        .into_owned();
    let mut attitude = UnitQuaternion::from_scaled_axis(left) * run.calibration.attitude;
    let errors = SensorErrors::constant(run.truth.gyroscope_drift, run.truth.accelerometer_bias);
    let mut imu = ImuErrors::new(ImuErrorSettings { errors, noise }, 1000 + run.run).unwrap();
    let mut navigator = Navigator::new(NavigatorSettings::default()).unwrap();
    let mut stamp = run.calibration.stamp;
    let mut worst = [0.0f64; 2];
    let mut feed = |attitude: &UnitQuaternion<f64>, turn_rate: f64, seconds: f64| {
        stamp = stamp.plus_seconds(seconds);
        let rate = earth.earth_rate() + Vector3::z() * turn_rate;
        let truth = TruthSample {
            stamp,
            interval_nanos: (seconds * 1e9) as i64,
            angular_rate: attitude.inverse() * rate,
            specific_force: attitude.inverse() * (Vector3::z() * earth.gravity_m_s2),
            joints: JointSample {
                stamp,
                position: [0.0; 2],
                velocity: [0.0; 2],
            },
        };
        let output: Option<NavigatorOutput> = navigator.ingest_imu(&imu.measure(&truth)).unwrap();
        if let Some(output) = output {
            for (worst, solution) in worst
                .iter_mut()
                .zip([output.compensated, output.uncompensated])
            {
                *worst = worst.max(position_error_nmi(&solution.navigation, &run.calibration));
            }
        } else {
            // The first sample ends at the calibration's stamp plus one interval; the calibration then starts navigation.
            let mut calibration = run.calibration.clone();
            calibration.stamp = stamp;
            navigator.ingest_calibration(calibration).unwrap();
        }
    };
    let (step, seconds) = (0.1f64.to_radians(), 1.0);
    feed(&attitude, 0.0, seconds);
    for _ in 0..(turn_deg / 0.1).round() as usize {
        // The turn about the vertical, with the attitude at the middle of the interval.
        let middle = UnitQuaternion::from_scaled_axis(Vector3::z() * (0.5 * step)) * attitude;
        feed(&middle, step / seconds, seconds);
        attitude = UnitQuaternion::from_scaled_axis(Vector3::z() * step) * attitude;
    }
    for _ in 0..24 * 3600 {
        feed(&attitude, 0.0, seconds);
    }
    worst
}

fn position_error_nmi(state: &NavigationState, mooring: &Calibration) -> f64 {
    let earth = LocalEarth::at(mooring.latitude, mooring.height);
    f64::hypot(
        (state.latitude - mooring.latitude) * earth.meridian_radius_m,
        (state.longitude - mooring.longitude) * earth.transverse_radius_m * earth.cos_latitude,
    ) / NAUTICAL_MILE_M
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// At rest: about 14.5 nmi without the calibration; with it a median of 20 runs of at most 1.3 nmi and none above 3.
#[test]
fn calibration_shrinks_the_position_error() {
    let runs = calibrations(&Scheme::eight_position(), Some(TrueErrors::table_1()));
    let results: Vec<[f64; 2]> = runs
        .par_iter()
        .map(|run| navigate(run, 0.0, NoiseReading::D.density()))
        .collect();
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
            .map(|run| navigate(run, 90.0, NoiseReading::D.density())[0].powi(2))
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
