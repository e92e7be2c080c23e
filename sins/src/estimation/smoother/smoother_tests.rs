#![allow(clippy::unwrap_used)]
use nalgebra::{DMatrix, DVector, SMatrix, SVector, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::tape::Shape;
use super::*;
use crate::earth::Position;
use crate::estimation::kalman::{Dynamics, Kalman, ProcessNoise};
use crate::estimation::measurement::{Measurement, Outcome, Row};
use crate::estimation::model::{Model, Paper};
use crate::mechanization::strapdown::NavigationState;
use crate::time::Stamp;

const MOVING: usize = Paper::M;
const ALL: usize = Paper::N;
const STEPS: usize = 12;

/// A linear system of thirteen states that has everything a filter does to its states in it, each step with another Φ.
struct World {
    prior: SMatrix<f64, ALL, ALL>,
    steps: Vec<Step>,
}

struct Step {
    dynamics: Dynamics<MOVING, ALL>,
    noise: ProcessNoise<MOVING, ALL>,
    /// A state that is forgotten before the step, with its variance.
    forgotten: Option<(usize, f64)>,
    added: Option<(usize, f64)>,
    measurements: Vec<Measurement<ALL>>,
    /// What is taken out of the state after it.
    resets: bool,
}

fn world(seed: u64) -> World {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut number = move || random.random::<f64>() - 0.5;
    let root = SMatrix::<f64, ALL, ALL>::from_fn(|_, _| number());
    let steps = (0..STEPS)
        .map(|k| {
            let mut dynamics = Dynamics::zeros();
            dynamics.rows = SMatrix::from_fn(|_, _| 0.4 * number());
            if k % 3 == 0 {
                dynamics.decay[ALL - 1] = -0.2;
            }
            let mut noise = ProcessNoise::zeros();
            let root = SMatrix::<f64, MOVING, MOVING>::from_fn(|_, _| 0.1 * number());
            noise.moving = root * root.transpose();
            noise.walk[ALL - 1] = 0.02;
            let measurements = (0..2)
                .map(|_| {
                    let row = Row::new([(2, number()), (k % ALL, 1.0), (9, number())]);
                    Measurement::new(row, number(), 0.05 + number().abs())
                })
                .collect();
            Step {
                dynamics,
                noise,
                forgotten: (k == 5).then_some((3, 0.7)),
                added: (k == 8).then_some((1, 0.3)),
                measurements,
                resets: k > 3,
            }
        })
        .collect();
    World {
        prior: root * root.transpose() + SMatrix::identity() * 0.01,
        steps,
    }
}

fn here() -> NavigationState {
    NavigationState {
        attitude: UnitQuaternion::identity(),
        velocity: Vector3::zeros(),
        position: Position {
            latitude_rad: 0.0,
            longitude_rad: 0.0,
            height_m: 0.0,
        },
    }
}

/// The filter over the world, its smoothed epochs from the first on, and the last state and covariance of the filter. `cuts` says
/// after which steps the tape is taken out.
fn smoothed(world: &World, cuts: &[i64]) -> (Vec<Smoothed>, SVector<f64, ALL>, Kalman<ALL>) {
    let mut kalman = Kalman::<ALL>::new(world.prior).unwrap();
    let shape = Shape {
        labels: Paper::LIST,
        moving: MOVING,
        smoothed: ALL,
        velocity_up: None,
    };
    kalman.record(Some(Box::new(Tape::new(shape))));
    let mut tapes = Vec::new();
    // What has been taken out of the state: the mechanization of a linear world.
    let mut taken = SVector::<f64, ALL>::zeros();
    for (k, step) in (0_i64..).zip(&world.steps) {
        let transition = step.dynamics.transition();
        if let Some((state, variance)) = step.forgotten {
            kalman.forget(state, variance);
            taken[state] = 0.0;
        }
        if let Some((state, variance)) = step.added {
            kalman.add_variance(state, variance);
        }
        kalman.propagate(&transition, &step.noise).unwrap();
        taken = transition.dense() * taken;
        for measurement in &step.measurements {
            let left = Measurement {
                value: measurement.value - measurement.row.product(&taken),
                ..*measurement
            };
            assert!(matches!(kalman.update(&left), Outcome::Accepted(_)));
        }
        if step.resets {
            taken += kalman.take_state();
        }
        let (values, covariance) = (taken + kalman.state(), *kalman.covariance());
        let tape = kalman.tape_mut().unwrap();
        tape.point(Stamp::from_nanos(k), &here(), &values, &covariance);
        if cuts.contains(&k) {
            tapes.push(tape.take());
        }
    }
    let last = taken + kalman.state();
    tapes.push(kalman.tape_mut().unwrap().take());
    let mut backward = Backward::default();
    let mut epochs = Vec::new();
    while let Some(tape) = tapes.pop() {
        backward.go_over(tape, |epoch| epochs.push(epoch));
    }
    epochs.reverse();
    (epochs, last, kalman)
}

/// What an epoch says of all states. The test's mechanization stands at zero, so that it has the errors of navigation with the
/// other sign.
fn values(epoch: &Smoothed) -> DVector<f64> {
    let NavigationState {
        attitude,
        velocity: v,
        position: p,
    } = &epoch.navigation;
    let turn = attitude.scaled_axis();
    let navigation = [
        -p.latitude_rad,
        -p.longitude_rad,
        -v.x,
        -v.y,
        turn.x,
        turn.y,
        turn.z,
    ];
    DVector::from_iterator(
        ALL,
        navigation.into_iter().chain(
            Paper::STATES[MOVING..]
                .iter()
                .map(|label| epoch.value(label.name).unwrap()),
        ),
    )
}

/// All states of all epochs at once by least squares, from the information that prior, noise and measurements give: no filter,
/// no recursion. Mean and covariance of every epoch.
fn batch(world: &World) -> (DVector<f64>, DMatrix<f64>) {
    let size = ALL * (STEPS + 1);
    let mut information = DMatrix::<f64>::zeros(size, size);
    let mut vector = DVector::<f64>::zeros(size);
    let prior = DMatrix::from_column_slice(ALL, ALL, world.prior.as_slice());
    let mut corner = information.view_mut((0, 0), (ALL, ALL));
    corner += prior.try_inverse().unwrap();
    for (k, step) in world.steps.iter().enumerate() {
        // x' = Φ (K x + w₁) + w₂. The walk is made full, so that its covariance can be inverted.
        let phi = step.dynamics.transition().dense();
        let mut keeps = SMatrix::<f64, ALL, ALL>::identity();
        let mut before = step.noise.dense() * 0.5;
        if let Some((state, variance)) = step.forgotten {
            keeps[(state, state)] = 0.0;
            before[(state, state)] += variance;
        }
        if let Some((state, variance)) = step.added {
            before[(state, state)] += variance;
        }
        let noise = phi * before * phi.transpose() + step.noise.dense() * 0.5;
        let noise = DMatrix::from_column_slice(ALL, ALL, noise.as_slice());
        let weight = (noise + DMatrix::identity(ALL, ALL) * 1e-9)
            .try_inverse()
            .unwrap();
        let phi = phi * keeps;
        let phi = DMatrix::from_column_slice(ALL, ALL, phi.as_slice());
        let mut difference = DMatrix::<f64>::zeros(ALL, size);
        difference
            .view_mut((0, ALL * k), (ALL, ALL))
            .copy_from(&-phi);
        difference
            .view_mut((0, ALL * (k + 1)), (ALL, ALL))
            .fill_with_identity();
        information += difference.transpose() * weight * &difference;
        for measurement in &step.measurements {
            let mut row = DVector::<f64>::zeros(size);
            for (state, coefficient) in measurement.row.entries() {
                row[ALL * (k + 1) + state] += coefficient;
            }
            information += &row * row.transpose() / measurement.variance;
            vector += row * (measurement.value / measurement.variance);
        }
    }
    let covariance = information.try_inverse().unwrap();
    (&covariance * vector, covariance)
}

/// Of three linear worlds with resets, a forgotten state, noise from outside and a decaying walk: every epoch is that of one least
/// squares over all states of all epochs, mean and covariance. (The batch needs noise of 1e-9 in every state to be invertible,
/// which is what the tolerance is about.)
#[test]
fn every_epoch_is_that_of_least_squares_over_the_whole_record() {
    for seed in [1, 2, 3] {
        let world = world(seed);
        let (mean, covariance) = batch(&world);
        let (epochs, ..) = smoothed(&world, &[]);
        assert_eq!(epochs.len(), STEPS);
        for (k, epoch) in epochs.iter().enumerate() {
            let first = ALL * (k + 1);
            let of_batch = mean.rows(first, ALL);
            let difference = (values(epoch) - of_batch).amax();
            assert!(difference < 2e-5, "seed {seed}, epoch {k}: {difference}");
            let of_batch = covariance.view((first, first), (ALL, ALL));
            let own = epoch.covariance().unwrap();
            let difference = (own.matrix() - of_batch).amax();
            assert!(difference < 2e-5, "seed {seed}, epoch {k}: {difference}");
        }
    }
}

/// The last epoch is the filter's, to the last digits; before it no variance is above the filter's.
#[test]
fn the_last_epoch_is_the_filters() {
    let (epochs, state, kalman) = smoothed(&world(4), &[]);
    let last = epochs.last().unwrap();
    assert!((values(last) - state).amax() < 1e-14);
    let own = last.covariance().unwrap();
    let filtered = DMatrix::from_column_slice(ALL, ALL, kalman.covariance().as_slice());
    assert_eq!(*own.matrix(), filtered);
}

/// A tape that is taken out in pieces gives the same epochs as one piece, to the last bit.
#[test]
fn pieces_of_a_tape_are_the_whole_tape() {
    let world = world(5);
    let (whole, ..) = smoothed(&world, &[]);
    let (pieces, ..) = smoothed(&world, &[2, 3, 7]);
    assert_eq!(whole, pieces);
}
