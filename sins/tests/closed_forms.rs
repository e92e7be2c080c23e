//! Studies against outside figures: closed forms of inertial navigation, an independent prototype's covariances, printed
//! tables of chi-square. What a study says of itself is not asked here.
#![allow(clippy::unwrap_used, missing_docs)]

use std::f64::consts::PI;

use nalgebra::{DMatrix, Vector3};
use sins::earth::{EARTH_RATE_RAD_S, LocalEarth};
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::{MISALIGNMENT, VELOCITY};
use sins::estimation::state::{NamedCovariance, StateList, StateValues};
use sins::sensor::errors::SensorErrors;
use sins::sensor::sample::NoiseDensity;
use sins::simulation::NoiseReading;
use sins::studies::monte_carlo::{
    Departure, MonteCarlo, Snapshot, Statistics, Voyage, VoyageTrack, mean_nees_bounds,
};
use sins::studies::observability::{Setting, bound::bound, degree::degrees};
use sins::studies::paper::CALIBRATED;
use sins::table::scheme::Scheme;
use sins::table::{Axis, Turntable};
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

const LATITUDE_RAD: f64 = 45.78 * PI / 180.0;

fn earth() -> LocalEarth {
    LocalEarth::at(LATITUDE_RAD, 0.0)
}

/// Mean radius of the earth at the place \[m\]; meridian and transverse radius are within 0.2 % of it.
fn radius_m() -> f64 {
    0.5 * (earth().meridian_radius_m + earth().transverse_radius_m)
}

/// Schuler's angular rate \[rad/s\].
fn schuler_rad_s() -> f64 {
    (earth().gravity_m_s2 / radius_m()).sqrt()
}

/// The track of a ship at rest, heading north, whose IMU has these errors and no noise, and whose calibration knows attitude and
/// position exactly and none of the errors.
fn track(errors: &SensorErrors, hours: f64) -> VoyageTrack {
    let none = NoiseDensity {
        gyroscope: Vector3::zeros(),
        accelerometer: Vector3::zeros(),
    };
    let mut monte_carlo = MonteCarlo::paper(Scheme::stationary(), NoiseReading::D.density());
    monte_carlo.plant.imu_rate_hz = 1.0;
    monte_carlo.duration_s = 2.0;
    monte_carlo.snapshots_s.clear();
    let mut departure: Departure = monte_carlo.run(0..1).unwrap()[0].departure();
    departure.errors = *errors;
    departure.calibration.errors = SensorErrors::default();
    departure.calibration.attitude = departure.attitude;
    departure.calibration.position.latitude_rad = LATITUDE_RAD;
    let voyage = Voyage {
        turn_rad: 0.0,
        duration_s: hours * 3600.0,
        noise: none,
        every_s: 60.0,
    };
    voyage.sail(&departure).unwrap()
}

fn at(track: &VoyageTrack, time_s: f64) -> f64 {
    let index = track
        .times_s
        .iter()
        .position(|t| *t >= time_s - 0.5)
        .unwrap();
    track.compensated_m[index]
}

/// An accelerometer bias swings the position round its rest ∇/ω_s² with Schuler's period, and the earth turns the plane of the
/// swing as it does Foucault's: ∇/ω_s² |1 − cos ω_s t · exp(i ω sin L t)|, within 1 % of the swing.
#[test]
fn a_bias_makes_schulers_oscillation() {
    let bias = 100.0 * MICRO_G;
    let rest = bias / schuler_rad_s().powi(2);
    for axis in [Vector3::x(), Vector3::y()] {
        let track = track(&SensorErrors::constant(Vector3::zeros(), axis * bias), 1.5);
        for minutes in [10.0, 21.0, 42.0, 60.0, 84.0] {
            let t = minutes * 60.0;
            let swing = (schuler_rad_s() * t).cos();
            let foucault = EARTH_RATE_RAD_S * LATITUDE_RAD.sin() * t;
            let expected = rest * (1.0 - 2.0 * swing * foucault.cos() + swing * swing).sqrt();
            let ours = at(&track, t);
            assert!(
                (ours - expected).abs() < 0.01 * 2.0 * rest,
                "{minutes} min: {ours} m against {expected} m"
            );
        }
    }
}

/// A drift along the earth's axis makes the longitude run away at its own rate: R cos L ε t, but for Schuler's ripple of
/// R ε cos L / ω_s.
#[test]
fn a_drift_along_the_earths_axis_grows_without_end() {
    let drift = 0.01 * DEG_PER_HOUR;
    let along_axis = Vector3::new(0.0, LATITUDE_RAD.cos(), LATITUDE_RAD.sin()) * drift;
    let track = track(&SensorErrors::constant(along_axis, Vector3::zeros()), 48.0);
    let east_m = earth().transverse_radius_m * LATITUDE_RAD.cos();
    let ripple_m = east_m * drift / schuler_rad_s();
    for hours in [6.0, 12.0, 24.0, 48.0] {
        let expected = east_m * drift * hours * 3600.0;
        let ours = at(&track, hours * 3600.0);
        assert!(
            (ours - expected).abs() < 1.2 * ripple_m + 0.002 * expected,
            "{hours} h: {ours} m against {expected} m"
        );
    }
}

/// A drift across the earth's axis goes round with the earth: R ε/ω √(1 + sin² L) after six hours, 2 R sin L ε/ω after twelve, and
/// nothing after a day, but for Schuler's ripple.
#[test]
fn a_drift_across_the_earths_axis_returns_after_a_day() {
    let drift = 0.01 * DEG_PER_HOUR;
    let track = track(
        &SensorErrors::constant(Vector3::x() * drift, Vector3::zeros()),
        25.0,
    );
    let (swing_m, sin_latitude) = (radius_m() * drift / EARTH_RATE_RAD_S, LATITUDE_RAD.sin());
    let ripple_m = radius_m() * drift / schuler_rad_s();
    let day_s = 2.0 * PI / EARTH_RATE_RAD_S;
    for (part, expected) in [
        (0.25, swing_m * (1.0 + sin_latitude.powi(2)).sqrt()),
        (0.5, 2.0 * swing_m * sin_latitude),
        (1.0, 0.0),
    ] {
        let ours = at(&track, part * day_s);
        assert!(
            (ours - expected).abs() < 1.2 * ripple_m + 0.005 * expected,
            "{part} of a day: {ours} m against {expected} m"
        );
    }
    // Schuler's ripple is a twentieth of the swing: the figures above are not its.
    assert!(ripple_m < 0.06 * swing_m);
}

/// The bound after 4 h in the units of `expected-results`: φ arcsec, ∇ ug, ε 1e-4 deg/h.
fn bound_after_4_h(scheme: &Scheme, table: Turntable, noise: NoiseReading) -> [f64; 9] {
    let setting = Setting {
        noise: noise.density(),
        ..Setting::default()
    };
    let points = bound(&scheme.program(table).unwrap(), &setting, 600).unwrap();
    let units = [ARC_SECOND, MICRO_G, 1e-4 * DEG_PER_HOUR];
    let end = points.last().unwrap();
    std::array::from_fn(|k| end.sigma.value(CALIBRATED[k].name).unwrap() / units[k / 3])
}

/// The bound is that of an independent prototype, every row of its table, within 2 % and half a printed digit.
#[test]
fn the_bound_is_an_independent_prototypes() {
    use NoiseReading::{D, H};
    let of = |outer, inner| Turntable { outer, inner };
    let (still, eight, yz) = (
        Scheme::stationary(),
        Scheme::eight_position(),
        Scheme::eight_position_yz(),
    );
    let (x, y, z) = (Axis::X, Axis::Y, Axis::Z);
    for (scheme, table, noise, expected) in [
        (
            &still,
            of(x, y),
            D,
            "17.75 17.85 135.7 86.6 86.1 100 67.9 10.5 25.4",
        ),
        (
            &eight,
            of(x, y),
            D,
            ".603 .604 20.5 .96 .68 .85 10.2 6.71 9.50",
        ),
        (
            &eight,
            of(y, x),
            D,
            ".587 .583 13.2 1.85 .57 .57 10.3 6.05 6.63",
        ),
        (
            &yz,
            of(y, z),
            D,
            ".599 .590 10.8 .75 .77 .73 5.93 5.64 8.78",
        ),
        (
            &still,
            of(x, y),
            H,
            "17.74 17.85 133.0 86.6 86.1 100 67.7 9.27 9.05",
        ),
        (
            &eight,
            of(x, y),
            H,
            ".053 .065 2.34 .20 .12 .18 1.18 .59 1.20",
        ),
    ] {
        let ours = bound_after_4_h(scheme, table, noise);
        for (state, printed) in expected.split(' ').enumerate() {
            let theirs: f64 = printed.parse().unwrap();
            let digits = printed.split('.').nth(1).map_or(0, str::len);
            let tolerance = 0.02 * theirs + 0.5 / 10f64.powf(digits as f64);
            assert!(
                (ours[state] - theirs).abs() < tolerance,
                "{} {noise:?}, state {state}: {} against {theirs}",
                scheme.name,
                ours[state]
            );
        }
    }
}

/// At rest the level error is what the prior leaves of ∇/g, 36" · 20.6" / √(36² + 20.6²) = 17.9", and the drift of the north gyroscope cannot
/// be told from the level error's turning with the earth, ω sin L σ(φE).
#[test]
fn the_bound_at_rest_has_its_closed_form() {
    let sigma = bound_after_4_h(&Scheme::stationary(), Turntable::default(), NoiseReading::D);
    let level = 36.0 * 20.6 / f64::hypot(36.0, 20.6);
    assert!((sigma[0] / level - 1.0).abs() < 0.01 && (sigma[1] / level - 1.0).abs() < 0.01);
    let floor = EARTH_RATE_RAD_S * LATITUDE_RAD.sin() * level * ARC_SECOND / (1e-4 * DEG_PER_HOUR);
    assert!(
        sigma[7] > floor && sigma[7] < 1.2 * floor,
        "{} {floor}",
        sigma[7]
    );
}

/// How much a state alone moves the velocities of a ship at rest, within 42 min: a bias by ∇/ω_s sin ω_s t, an initial velocity by
/// cos ω_s t, a level drift by ε R (1 − cos ω_s t). The earth's turn in that time is worth 2 % of the last.
#[test]
fn signals_at_rest_are_schulers() {
    let setting = Setting {
        duration_s: 2520.0,
        ..Setting::default()
    };
    let scheme = Scheme::stationary();
    let program = scheme.program(scheme.default_table()).unwrap();
    let found = degrees(&program, &setting).unwrap();
    let rate = schuler_rad_s();
    let norm = |of: &dyn Fn(f64) -> f64| {
        let squares = (1..=2520).map(|k| (of(rate * f64::from(k)) / 0.01).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let (bias, drift) = (100.0 * MICRO_G, 0.01 * DEG_PER_HOUR);
    let swing = norm(&|angle| bias / rate * angle.sin());
    let growth = norm(&|angle| drift * radius_m() * (1.0 - angle.cos()));
    for (state, expected, tolerance) in [
        (VELOCITY[0], norm(&|angle| 0.01 * angle.cos()), 0.01),
        (VELOCITY[1], norm(&|angle| 0.01 * angle.cos()), 0.01),
        (ACCELEROMETER_BIAS[0], swing, 0.01),
        (ACCELEROMETER_BIAS[1], swing, 0.01),
        (GYROSCOPE_DRIFT[0], growth, 0.03),
        (GYROSCOPE_DRIFT[1], growth, 0.03),
    ] {
        let ours = found.of(state).unwrap().signal;
        assert!(
            (ours / expected - 1.0).abs() < tolerance,
            "{state}: {ours} against {expected}"
        );
    }
}

/// Noise of the sensors only takes away: what degrees say without it, σ0 / √(1 + degree²), is below the independent prototype's sigmas of
/// the eight positions with little noise (H).
#[test]
fn degrees_bound_an_independent_prototypes_sigmas() {
    let scheme = Scheme::eight_position();
    let program = scheme.program(scheme.default_table()).unwrap();
    let found = degrees(&program, &Setting::default()).unwrap();
    let prior = [36.0, 36.0, 180.0, 100.0, 100.0, 100.0, 100.0, 100.0, 100.0];
    let theirs = [0.053, 0.065, 2.34, 0.20, 0.12, 0.18, 1.18, 0.59, 1.20];
    for (k, theirs) in theirs.into_iter().enumerate() {
        let degree = found.of(CALIBRATED[k].name).unwrap().degree;
        let least = prior[k] / (1.0 + degree.powi(2)).sqrt();
        println!("{k}: {least:.4} {theirs}");
        assert!(least < 1.03 * theirs, "{k}: {least} against {theirs}");
    }
}

/// Bounds of the mean NEES against printed quantiles of chi-square with 9, 18, 27, 45 and 90 degrees.
#[test]
fn nees_bounds_are_those_of_printed_tables() {
    for (runs, confidence, low, high) in [
        (1, 0.95, 2.700, 19.023),
        (1, 0.99, 1.735, 23.589),
        (2, 0.95, 8.231, 31.526),
        (3, 0.95, 14.573, 43.195),
        (5, 0.95, 28.366, 65.410),
        (10, 0.95, 65.647, 118.136),
    ] {
        let found = mean_nees_bounds(runs, confidence).map(|bound| bound * runs as f64);
        assert!(
            (found[0] - low).abs() < 1e-3 && (found[1] - high).abs() < 1e-3,
            "{runs} runs: {found:?}"
        );
    }
}

/// Sums over runs whose errors and covariances are given: rms, sigma, their ratio, and NEES by hand, a correlated pair included.
#[test]
fn statistics_are_those_by_hand() {
    let mut monte_carlo = MonteCarlo::paper(Scheme::stationary(), NoiseReading::D.density());
    monte_carlo.plant.imu_rate_hz = 1.0;
    monte_carlo.duration_s = 2.0;
    let mut run = monte_carlo.run(0..1).unwrap().remove(0);
    let mut statistics = Statistics::default();
    // Sigmas 2; one error of 3 and one of 4 sigmas, which are correlated by a half, then by nothing.
    for (errors, correlation) in [([6.0, 8.0], 0.5), ([2.0, 0.0], 0.0)] {
        let states = StateList::labels(&CALIBRATED);
        let mut covariance = DMatrix::identity(states.len(), states.len()) * 4.0;
        let [i, j] = [MISALIGNMENT[0], MISALIGNMENT[1]].map(|n| states.position(n).unwrap());
        covariance[(i, j)] = 4.0 * correlation;
        covariance[(j, i)] = 4.0 * correlation;
        let mut error = vec![0.0; states.len()];
        error[i] = errors[0];
        error[j] = errors[1];
        let error = StateValues::new(states.clone(), &error).unwrap();
        let covariance = NamedCovariance::new(states, covariance).unwrap();
        run.snapshots = vec![Snapshot {
            time_s: 2.0,
            error,
            covariance,
        }];
        statistics.add(&run, 0);
    }
    let end = statistics.end().unwrap();
    // (3² − 2·3·4/2 + 4²) / (1 − 1/4) = 52/3, and 1.
    let nees = f64::midpoint(52.0 / 3.0, 1.0);
    assert!((end.mean_nees().unwrap() - nees).abs() < 1e-12);
    assert!((end.rms().value(MISALIGNMENT[0]).unwrap() - 20.0_f64.sqrt()).abs() < 1e-12);
    assert!((end.rms().value(MISALIGNMENT[1]).unwrap() - 32.0_f64.sqrt()).abs() < 1e-12);
    assert!((end.sigma().value(MISALIGNMENT[0]).unwrap() - 2.0).abs() < 1e-12);
    assert!((end.rms_over_sigma().value(MISALIGNMENT[0]).unwrap() - 5.0_f64.sqrt()).abs() < 1e-12);
}
