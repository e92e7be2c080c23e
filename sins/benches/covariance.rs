//! One covariance step and one scalar update, as one dense matrix and as it is done (partitioned), in one run:
//! `cargo bench -p sins --bench covariance`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::SMatrix;
use sins::estimation::kalman::{Dynamics, Kalman, ProcessNoise};
use sins::estimation::measurement::{Measurement, Row};

/// States that move.
const M: usize = 7;

/// A covariance with every correlation, and an A that fills the rows that a model fills: velocity and misalignment.
fn example<const N: usize>() -> (SMatrix<f64, N, N>, Dynamics<M, N>, ProcessNoise<M, N>) {
    let root = SMatrix::<f64, N, N>::from_fn(|i, j| {
        if i == j {
            1.0
        } else {
            0.01 / (1 + i + j) as f64
        }
    });
    let mut dynamics = Dynamics::<M, N>::zeros();
    for state in 0..N {
        for row in 2..M {
            dynamics.rows[(state, row)] = 1e-4 / (1 + state + row) as f64;
        }
    }
    let mut noise = ProcessNoise::<M, N>::zeros();
    noise.moving.fill_diagonal(1e-12);
    (root * root.transpose(), dynamics, noise)
}

fn states<const N: usize>(criterion: &mut Criterion) {
    let (covariance, dynamics, noise) = example::<N>();
    let mut group = criterion.benchmark_group(format!("{N} states"));
    group.bench_function("step, dense", |b| {
        let mut p = covariance;
        b.iter(|| {
            let a = black_box(&dynamics).dense();
            let phi = SMatrix::<f64, N, N>::identity() + a + a * a * 0.5;
            let half = noise.dense() * 0.5;
            p = phi * (p + half) * phi.transpose() + half;
            p = (p + p.transpose()) * 0.5;
            black_box(&p);
        });
    });
    group.bench_function("step, dense, without A²", |b| {
        let (mut p, phi, q) = (covariance, dynamics.transition().dense(), noise.dense());
        b.iter(|| {
            let phi = black_box(&phi);
            p = phi * p * phi.transpose() + q;
            black_box(&p);
        });
    });
    group.bench_function("step, partitioned", |b| {
        let mut kalman = Kalman::new(covariance).unwrap();
        b.iter(|| {
            let transition = black_box(&dynamics).transition();
            kalman.propagate(&transition, &noise).unwrap();
            black_box(kalman.covariance());
        });
    });
    group.bench_function("scalar update", |b| {
        let mut kalman = Kalman::new(covariance).unwrap();
        let measurement = Measurement::new(Row::unit(2), 0.0, 1e6);
        b.iter(|| black_box(kalman.update(black_box(&measurement))));
    });
    group.finish();
}

criterion_group!(benches, states::<13>, states::<48>);
criterion_main!(benches);
