//! The way back over the tape.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::smoothed::Smoothed;
use super::tape::{Mark, NAVIGATION, Shape, Tape};
use crate::earth::Position;
use crate::estimation::groups::navigation::{
    LATITUDE, LONGITUDE, MISALIGNMENT_EAST, VELOCITY_EAST, VELOCITY_NORTH,
};
use crate::mechanization::strapdown::NavigationState;
use crate::time::Stamp;

/// λ and Λ on their way from the end of the record to its beginning. Their size is that of the tape.
#[derive(Clone, Debug, Default)]
pub struct Backward {
    /// λ.
    adjoint: Vec<f64>,
    /// Λ, column by column.
    matrix: Vec<f64>,
    scratch: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// target ← target + factor · source.
fn add(target: &mut [f64], factor: f64, source: &[f64]) {
    for (target, source) in target.iter_mut().zip(source) {
        *target += factor * source;
    }
}

impl Backward {
    /// Goes back over the stretch of the record before what it has been over. The smoothed epochs come last one first.
    pub fn go_over(&mut self, tape: Tape, mut tell: impl FnMut(Smoothed)) {
        let shape = *tape.shape();
        let count = shape.labels.len();
        if self.adjoint.len() != count {
            self.adjoint = vec![0.0; count];
            self.matrix = vec![0.0; count * count];
            self.scratch = vec![0.0; count * count];
        }
        let (mut marks, mut numbers) = tape.into_parts();
        while let Some(mark) = marks.pop() {
            let length = match mark {
                Mark::Step { decays } => (shape.moving + usize::from(decays)) * count,
                Mark::Update { coefficients } => 2 + count + 2 * coefficients,
                Mark::Point(_) => NAVIGATION + shape.smoothed * (1 + count),
                Mark::Forgotten(_) | Mark::Epoch(_) | Mark::Break => 0,
            };
            let Some(first) = numbers.len().checked_sub(length) else {
                return;
            };
            let own = &numbers[first..];
            match mark {
                Mark::Step { .. } => self.step(shape.moving, own),
                Mark::Update { .. } => self.update(own),
                Mark::Point(stamp) => tell(self.point(stamp, &shape, own)),
                Mark::Forgotten(state) => self.forget(state),
                Mark::Epoch([from, to]) => (0..from).chain(to..count).for_each(|i| self.forget(i)),
                Mark::Break => (0..count).for_each(|i| self.forget(i)),
            }
            numbers.truncate(first);
        }
    }

    fn forget(&mut self, state: usize) {
        let count = self.adjoint.len();
        self.adjoint[state] = 0.0;
        for other in 0..count {
            self.matrix[state * count + other] = 0.0;
            self.matrix[other * count + state] = 0.0;
        }
    }

    /// λ ← Φᵀ λ, Λ ← Φᵀ (Λ Φ) with Φ = \[F; 0 D\]: `numbers` are the rows of F, and D where it is not 1.
    fn step(&mut self, moving: usize, numbers: &[f64]) {
        let count = self.adjoint.len();
        let (rows, decay) = numbers.split_at(moving * count);
        let row = |r: usize| &rows[r * count..(r + 1) * count];
        let decay = |state: usize| decay.get(state).copied().unwrap_or(1.0);
        let mut adjoint = vec![0.0; count];
        for (state, element) in adjoint.iter_mut().enumerate().skip(moving) {
            *element = decay(state) * self.adjoint[state];
        }
        for r in 0..moving {
            add(&mut adjoint, self.adjoint[r], row(r));
        }
        self.adjoint = adjoint;
        // Λ Φ, column by column.
        for column in 0..count {
            let product = &mut self.scratch[column * count..(column + 1) * count];
            product.fill(0.0);
            if column >= moving {
                let own = &self.matrix[column * count..(column + 1) * count];
                add(product, decay(column), own);
            }
            for r in 0..moving {
                let coefficient = row(r)[column];
                if coefficient != 0.0 {
                    add(
                        product,
                        coefficient,
                        &self.matrix[r * count..(r + 1) * count],
                    );
                }
            }
        }
        for column in 0..count {
            let product = &self.scratch[column * count..(column + 1) * count];
            let result = &mut self.matrix[column * count..(column + 1) * count];
            result[..moving].fill(0.0);
            for state in moving..count {
                result[state] = decay(state) * product[state];
            }
            for (r, factor) in product[..moving].iter().enumerate() {
                add(result, *factor, row(r));
            }
        }
        self.symmetrize();
    }

    fn symmetrize(&mut self) {
        let count = self.adjoint.len();
        for column in 0..count {
            for row in column + 1..count {
                let (below, above) = (column * count + row, row * count + column);
                let mean = 0.5 * (self.matrix[below] + self.matrix[above]);
                self.matrix[below] = mean;
                self.matrix[above] = mean;
            }
        }
    }

    /// With u = Λ k: λ ← λ − hᵀ (kᵀ λ + ν/s), Λ ← Λ − hᵀ uᵀ − u h + hᵀ h (kᵀ u + 1/s).
    fn update(&mut self, numbers: &[f64]) {
        let count = self.adjoint.len();
        let (innovation, variance) = (numbers[0], numbers[1]);
        let (gain, entries) = numbers[2..].split_at(count);
        let entries = entries
            .chunks_exact(2)
            .map(|entry| (entry[0] as usize, entry[1]));
        let by_gain = &mut self.scratch[..count];
        for (column, value) in by_gain.iter_mut().enumerate() {
            *value = dot(&self.matrix[column * count..(column + 1) * count], gain);
        }
        let lowered = dot(gain, &self.adjoint) + innovation / variance;
        let own = dot(gain, by_gain) + 1.0 / variance;
        for (state, coefficient) in entries.clone() {
            self.adjoint[state] -= coefficient * lowered;
            for (other, value) in by_gain.iter().enumerate() {
                let change = coefficient * value;
                self.matrix[state * count + other] -= change;
                self.matrix[other * count + state] -= change;
            }
        }
        for (state, coefficient) in entries.clone() {
            for (other, factor) in entries.clone() {
                self.matrix[other * count + state] += coefficient * factor * own;
            }
        }
    }

    /// x − P λ and P − P Λ P, of the smoothed states.
    fn point(&mut self, stamp: Stamp, shape: &Shape, numbers: &[f64]) -> Smoothed {
        let (count, smoothed) = (self.adjoint.len(), shape.smoothed);
        let (navigation, rest) = numbers.split_at(NAVIGATION);
        let (values, columns) = rest.split_at(smoothed);
        let column = |state: usize| &columns[state * count..(state + 1) * count];
        let mut values: Vec<f64> = (0..smoothed)
            .map(|state| values[state] - dot(column(state), &self.adjoint))
            .collect();
        let mut covariance = Vec::with_capacity(smoothed * (smoothed + 1) / 2);
        let by_column = &mut self.scratch[..count];
        for first in 0..smoothed {
            by_column.fill(0.0);
            for (through, factor) in column(first).iter().enumerate() {
                if *factor != 0.0 {
                    let own = &self.matrix[through * count..(through + 1) * count];
                    add(by_column, *factor, own);
                }
            }
            for second in first..smoothed {
                covariance.push(column(first)[second] - dot(column(second), by_column));
            }
        }
        let navigation = corrected(navigation, &values, shape.velocity_up);
        values[..shape.moving].fill(0.0);
        Smoothed::new(stamp, navigation, shape.labels, &values, &covariance)
    }
}

/// A navigation state with its errors taken out, as the filter takes them out.
fn corrected(numbers: &[f64], errors: &[f64], velocity_up: Option<usize>) -> NavigationState {
    let n = numbers;
    let attitude = UnitQuaternion::new_unchecked(Quaternion::new(n[3], n[0], n[1], n[2]));
    let [up, height] = velocity_up.map_or([0.0; 2], |up| [errors[up], errors[up - 1]]);
    let misalignment =
        Vector3::from_column_slice(&errors[MISALIGNMENT_EAST..MISALIGNMENT_EAST + 3]);
    NavigationState {
        attitude: UnitQuaternion::from_scaled_axis(misalignment) * attitude,
        velocity: Vector3::new(n[4], n[5], n[6])
            - Vector3::new(errors[VELOCITY_EAST], errors[VELOCITY_NORTH], up),
        position: Position {
            latitude_rad: n[7] - errors[LATITUDE],
            longitude_rad: n[8] - errors[LONGITUDE],
            height_m: n[9] - height,
        },
    }
}
