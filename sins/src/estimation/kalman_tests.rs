#![allow(clippy::unwrap_used)]
use nalgebra::{Matrix2, Matrix6, SMatrix, SVector, Vector2, Vector6};
use proptest::prelude::*;

use super::*;
use crate::estimation::measurement::Row;

const MOVING: usize = 3;
const ALL: usize = 6;

/// Six states, three of them moving, with a covariance made of `entries`.
fn kalman(entries: &[f64]) -> Kalman<ALL> {
    let a = Matrix6::from_row_slice(entries);
    Kalman::new(a * a.transpose()).unwrap()
}

/// Measuring one of two correlated states: the textbook's conditional mean and covariance.
#[test]
fn update_is_conditioning() {
    let mut kalman = Kalman::new(Matrix2::new(4.0, 3.0, 3.0, 9.0)).unwrap();
    kalman.state = Vector2::new(1.0, 2.0);
    let outcome = kalman.update(&Measurement::new(Row::unit(0), 3.0, 1.0));
    let expected = Innovation {
        value: 2.0,
        variance: 5.0,
    };
    assert_eq!(outcome, Outcome::Accepted(expected));
    assert!((kalman.state - Vector2::new(1.0 + 1.6, 2.0 + 1.2)).norm() < 1e-15);
    assert!((kalman.covariance - Matrix2::new(0.8, 0.6, 0.6, 9.0 - 1.8)).norm() < 1e-14);
}

/// What cannot be an update is told and changes nothing: P = r = 0, a value that is no number, a negative variance, an
/// innovation beyond its gate.
#[test]
fn what_is_no_update_changes_nothing() {
    let mut kalman = Kalman::new(Matrix2::new(0.0, 0.0, 0.0, 1.0)).unwrap();
    let before = kalman.clone();
    let mut tried = |measurement: Measurement<2>| {
        let outcome = kalman.update(&measurement);
        assert_eq!(kalman.covariance, before.covariance);
        assert_eq!(kalman.state, before.state);
        outcome
    };
    let nothing = Measurement::new(Row::unit(0), 1.0, 0.0);
    assert_eq!(tried(nothing), Outcome::Singular { variance: 0.0 });
    let whole = Row::unit(1);
    for (value, variance) in [
        (f64::NAN, 1.0),
        (f64::INFINITY, 1.0),
        (1.0, f64::NAN),
        (1.0, -0.5),
    ] {
        assert_eq!(
            tried(Measurement::new(whole, value, variance)),
            Outcome::Refused
        );
    }
    let far = Measurement::new(whole, 10.0, 1.0).gated(Some(25.0));
    assert!(matches!(tried(far), Outcome::Gated(i) if i.normalized_squared() == 50.0));
    assert!(
        kalman
            .update(&Measurement::new(whole, 7.0, 1.0).gated(Some(25.0)))
            .is_accepted()
    );
}

/// A state that is measured without noise is known: sigma zero, never NaN, and a second such measurement is singular.
#[test]
fn measured_without_noise() {
    let mut kalman = kalman(&std::array::from_fn::<_, 36, _>(|i| {
        ((i * 7 + 3) % 11) as f64 / 3.0
    }));
    let measurement = Measurement::new(Row::unit(2), 0.5, 0.0);
    assert!(kalman.update(&measurement).is_accepted());
    assert!(kalman.sigma()[2] < 1e-6 && kalman.sigma().iter().all(|s| s.is_finite()));
    kalman.covariance[(2, 2)] = 0.0;
    assert!(matches!(
        kalman.update(&measurement),
        Outcome::Singular { .. } | Outcome::Refused
    ));
}

/// A step that would leave NaN, and a covariance that is none from the start, are errors that name the state; the covariance
/// stays what it was.
#[test]
fn nan_does_not_enter() {
    let mut kalman = kalman(&std::array::from_fn::<_, 36, _>(|i| (i % 5) as f64));
    let before = kalman.clone();
    let mut a = Dynamics::<MOVING, ALL>::zeros();
    a.rows[(4, 1)] = f64::NAN;
    let none = ProcessNoise::zeros();
    let error = kalman.propagate(&a.transition(), &none).unwrap_err();
    assert!(matches!(error, Error::Variance { state: 1, .. }), "{error}");
    let mut negative = ProcessNoise::<MOVING, ALL>::zeros();
    negative.moving[(0, 0)] = -1e9;
    let error = kalman
        .propagate(&Dynamics::zeros().transition(), &negative)
        .unwrap_err();
    assert!(matches!(error, Error::Variance { state: 0, .. }), "{error}");
    assert_eq!(kalman.covariance, before.covariance);
    assert!(Kalman::new(Matrix2::new(1.0, 0.0, 0.0, f64::NAN)).is_err());
    assert!(Kalman::new(Matrix2::new(1.0, 0.0, 0.0, -1.0)).is_err());
}

/// Moving states of an inertial system: position, velocity, misalignment.
const NAVIGATION: usize = 7;
/// With biases and drifts.
const INERTIAL: usize = 13;

/// A second of an inertial system at 45 deg whose block stands like this, in SI units: its states lie ten decades apart.
fn inertial(n_from_b: nalgebra::Rotation3<f64>) -> Transition<NAVIGATION, INERTIAL> {
    const RADIUS_M: f64 = 6.37e6;
    const GRAVITY_M_S2: f64 = 9.8;
    let turn_rad_s = 7.292e-5 * std::f64::consts::FRAC_1_SQRT_2;
    let [latitude, longitude, east, north] = [0, 1, 2, 3];
    let [tilt_east, tilt_north, heading, bias, drift] = [4, 5, 6, 7, 10];
    let mut a = Dynamics::<NAVIGATION, INERTIAL>::zeros();
    let mut enters = |row: usize, of: usize, value: f64| a.rows[(of, row)] += value;
    enters(latitude, north, 1.0 / RADIUS_M);
    enters(longitude, east, std::f64::consts::SQRT_2 / RADIUS_M);
    enters(east, tilt_north, -GRAVITY_M_S2);
    enters(north, tilt_east, GRAVITY_M_S2);
    enters(tilt_east, north, -1.0 / RADIUS_M);
    enters(tilt_north, east, 1.0 / RADIUS_M);
    enters(heading, east, 1.0 / RADIUS_M);
    enters(tilt_north, latitude, -turn_rad_s);
    enters(heading, latitude, turn_rad_s);
    for (row, of, sign) in [
        (tilt_east, tilt_north, 1.0),
        (tilt_north, tilt_east, -1.0),
        (tilt_east, heading, -1.0),
        (heading, tilt_east, 1.0),
    ] {
        enters(row, of, sign * turn_rad_s);
    }
    for axis in 0..3 {
        for level in 0..2 {
            enters(east + level, bias + axis, n_from_b[(level, axis)]);
        }
        for level in 0..3 {
            enters(tilt_east + level, drift + axis, -n_from_b[(level, axis)]);
        }
    }
    a.transition()
}

/// So many seconds of a moored ship on a table that turns every five minutes, each with a step and an update of both velocities:
/// the covariance stays symmetric and positive, also where ten million updates have made it small and nothing walks.
fn covariance_stays_good_over(seconds: usize) {
    let at: [_; 8] = std::array::from_fn(|k| {
        let k = k as f64 * std::f64::consts::FRAC_PI_2;
        inertial(nalgebra::Rotation3::from_euler_angles(
            k + 0.1,
            0.2,
            0.5 * k,
        ))
    });
    let sigma: [f64; INERTIAL] = [
        1.6e-6, 1.6e-6, 0.1, 0.1, 2e-4, 2e-4, 1e-3, 1e-3, 1e-3, 1e-3, 5e-8, 5e-8, 5e-8,
    ];
    let prior = SVector::from(sigma);
    let prior = SMatrix::from_diagonal(&prior.component_mul(&prior));
    let mut kalman = Kalman::<INERTIAL>::new(prior).unwrap();
    let mut noise = ProcessNoise::<NAVIGATION, INERTIAL>::zeros();
    for state in 2..NAVIGATION {
        noise.moving[(state, state)] = if state < 4 { 1e-9 } else { 1e-13 };
    }
    let looks = 100;
    let mut least = f64::INFINITY;
    for second in 0..seconds {
        kalman.propagate(&at[second / 300 % 8], &noise).unwrap();
        for velocity in [2, 3] {
            let measured = Measurement::new(Row::unit(velocity), 0.0, 1e-4);
            assert!(kalman.update(&measured).is_accepted(), "{second} s");
        }
        if second % (seconds / looks) == 0 || second + 1 == seconds {
            let sigma = kalman.sigma();
            assert!(
                sigma.iter().all(|sigma| *sigma > 0.0),
                "{second} s: {sigma}"
            );
            let covariance = kalman.covariance();
            assert_eq!(*covariance, covariance.transpose(), "{second} s");
            // In units of the sigmas: no state is hidden behind another's unit.
            let correlation = SMatrix::<f64, INERTIAL, INERTIAL>::from_fn(|row, column| {
                covariance[(row, column)] / (sigma[row] * sigma[column])
            });
            least = least.min(correlation.symmetric_eigenvalues().min());
            assert!(least > 0.0, "{second} s: {least}");
        }
    }
    // It has learnt, and what it says of every state is less than what was known before.
    for (state, before) in sigma.iter().enumerate().skip(2) {
        assert!(kalman.sigma()[state] < *before, "{state}");
    }
}

/// Three days.
#[test]
fn covariance_stays_good_over_three_days() {
    covariance_stays_good_over(72 * 3600);
}

/// Ten million updates: 58 days.
#[test]
fn covariance_stays_good_over_ten_million_updates() {
    covariance_stays_good_over(5_000_000);
}

proptest! {
    /// Whatever the covariance, the row and the precision, the covariance stays symmetric and not negative.
    #[test]
    fn covariance_stays_positive(
        entries in prop::collection::vec(-1e3..1e3f64, 36),
        rows in prop::collection::vec(prop::array::uniform6(-2.0..2.0f64), 5),
        r in -12..3i32,
    ) {
        let mut kalman = kalman(&entries);
        let scale = kalman.covariance.norm();
        for row in rows {
            let row = Row::dense(&SVector::from(row));
            kalman.update(&Measurement::new(row, 1.0, 10f64.powi(r)));
        }
        prop_assert!((kalman.covariance - kalman.covariance.transpose()).norm() == 0.0);
        prop_assert!(kalman.covariance.symmetric_eigenvalues().min() > -1e-9 * scale);
        prop_assert!(kalman.sigma().iter().all(|sigma| sigma.is_finite()));
    }

    /// Two scalar updates are the one update of both measurements at once (their noises do not depend on each other).
    #[test]
    fn scalar_updates_are_the_batch(
        entries in prop::collection::vec(-1.0..1.0f64, 36),
        h in prop::collection::vec(-1.0..1.0f64, 12),
        z in prop::array::uniform2(-1.0..1.0f64),
        r in prop::array::uniform2(0.01..1.0f64),
    ) {
        let mut kalman = kalman(&entries);
        let p = kalman.covariance;
        let h = SMatrix::<f64, 2, ALL>::from_row_slice(&h);
        let s = h * p * h.transpose() + Matrix2::from_diagonal(&Vector2::from(r));
        let gain = p * h.transpose() * s.try_inverse().unwrap();
        let (state, covariance) = (gain * Vector2::from(z), p - gain * h * p);
        for axis in 0..2 {
            let row = Row::dense(&h.row(axis).transpose());
            prop_assert!(kalman.update(&Measurement::new(row, z[axis], r[axis])).is_accepted());
        }
        prop_assert!((kalman.state - state).norm() < 1e-9, "{} {}", kalman.state, state);
        prop_assert!((kalman.covariance - covariance).norm() < 1e-9);
    }

    /// The partitioned step is the dense one: Φ P Φᵀ + Q with Φ = exp A to the second order, decay and walks included.
    #[test]
    fn partitioned_is_dense(
        entries in prop::collection::vec(-1.0..1.0f64, 36),
        a in prop::collection::vec(-0.1..0.1f64, ALL * MOVING),
        q in prop::array::uniform9(-0.1..0.1f64),
        walk in prop::array::uniform3(0.0..0.1f64),
        decay in prop::array::uniform3(-0.2..0.0f64),
        state in prop::array::uniform6(-1.0..1.0f64),
        decays in any::<bool>(),
    ) {
        let mut kalman = kalman(&entries);
        kalman.state = Vector6::from(state);
        let mut dynamics = Dynamics::<MOVING, ALL> {
            rows: SMatrix::from_row_slice(&a),
            decay: SVector::zeros(),
        };
        let mut noise = ProcessNoise::<MOVING, ALL>::zeros();
        let root = nalgebra::Matrix3::from_row_slice(&q);
        noise.moving = root * root.transpose();
        for i in 0..3 {
            dynamics.decay[MOVING + i] = if decays { decay[i] } else { 0.0 };
            noise.walk[MOVING + i] = walk[i];
        }
        let whole = dynamics.dense();
        let mut phi = Matrix6::identity() + whole + whole * whole * 0.5;
        for i in MOVING..ALL {
            phi[(i, i)] = dynamics.decay[i].exp();
        }
        let half = noise.dense() * 0.5;
        let expected = phi * (kalman.covariance + half) * phi.transpose() + half;
        let expected_state = phi * kalman.state;
        let transition = dynamics.transition();
        prop_assert!((transition.dense() - phi).norm() < 1e-14);
        kalman.propagate(&transition, &noise).unwrap();
        prop_assert!((kalman.covariance - expected).norm() < 1e-12);
        prop_assert!((kalman.state - expected_state).norm() < 1e-13);
        prop_assert!((kalman.covariance - kalman.covariance.transpose()).norm() == 0.0);
    }
}
