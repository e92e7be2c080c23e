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
