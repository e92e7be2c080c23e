//! What a stretch of a run does to any covariance, worked out once: P ← N + A (P⁻¹ + UᵀU)⁻¹ Aᵀ.
//!
//! A Kalman filter that starts a stretch knowing everything (P = 0) ends with the covariance N, its closed-loop transition
//! A, and the normalized innovations' rows U over the initial state; any other start follows from these three (the
//! partitioned filter of Lainiotis). Stretches join: `first.then(&second)` is the same as one after the other, so a dwell of
//! 500 s takes nine joinings and no 500 steps.
//!
//! States are those of a [`Space`](super::space::Space): the first m move, the others stand still, so that only m rows of A
//! and of N are kept. U has as many rows as its stretch shows directions.

use nalgebra::DMatrix;

/// Information below this, in units of the prior's, is none: what a stretch adds to a state is not seen in eight digits.
const NO_INFORMATION: f64 = 1e-8;

/// One step: Φ, Q and scalar measurements, in the scaled states.
#[derive(Clone, Debug)]
pub(in crate::studies) struct Second {
    /// Length \[s\].
    pub seconds: f64,
    /// Rows of Φ of the moving states, m × n.
    pub transition: DMatrix<f64>,
    /// Q, m × m; half of it enters before Φ and half after.
    pub noise: DMatrix<f64>,
    /// h and r of every measurement at its end.
    pub measurements: Vec<(Vec<f64>, f64)>,
}

/// A stretch of a run.
#[derive(Clone, Debug)]
pub(in crate::studies) struct Element {
    /// Length \[s\].
    pub seconds: f64,
    moving: usize,
    states: usize,
    /// A, m rows of n.
    transition: Vec<f64>,
    /// N, m rows of m.
    noise: Vec<f64>,
    /// U, rows of n.
    shown: Vec<f64>,
}

/// Room for [`Element::apply`], so that nothing is allocated in a search.
#[derive(Clone, Debug, Default)]
pub(in crate::studies) struct Scratch {
    vector: Vec<f64>,
    rows: Vec<f64>,
}

impl Element {
    /// Steps one after the other.
    pub fn of_seconds<'a>(
        moving: usize,
        states: usize,
        seconds: impl IntoIterator<Item = &'a Second>,
    ) -> Self {
        let (m, n) = (moving, states);
        let mut transition = DMatrix::<f64>::identity(m, n);
        let mut noise = DMatrix::<f64>::zeros(m, m);
        let mut information = DMatrix::<f64>::zeros(n, n);
        let mut length = 0.0;
        for second in seconds {
            length += second.seconds;
            let phi_mm = second.transition.columns(0, m);
            let half = &second.noise * 0.5;
            noise = phi_mm * (&noise + &half) * phi_mm.transpose() + half;
            let mut next = phi_mm * &transition;
            let mut still = next.columns_mut(m, n - m);
            still += second.transition.columns(m, n - m);
            transition = next;
            for (row, variance) in &second.measurements {
                let h = DMatrix::from_row_slice(1, m, &row[..m]);
                let projected = &noise * h.transpose();
                let innovation = (&h * &projected)[0] + variance;
                let mut over_start = &h * &transition;
                for state in m..n {
                    over_start[state] += row[state];
                }
                let gain = &projected / innovation;
                transition -= &gain * &over_start;
                noise -= &gain * projected.transpose();
                information.ger(
                    1.0 / innovation,
                    &over_start.transpose().column(0),
                    &over_start.transpose().column(0),
                    1.0,
                );
            }
        }
        Self {
            seconds: length,
            moving,
            states,
            transition: rows_of(&transition),
            noise: rows_of(&noise),
            shown: directions(&information),
        }
    }

    /// This stretch and then another.
    pub fn then(&self, next: &Self) -> Self {
        let (m, n) = (self.moving, self.states);
        let first = self.dense_transition();
        let second = DMatrix::from_row_slice(m, n, &next.transition);
        let noise = DMatrix::from_row_slice(m, m, &self.noise);
        let rows = next.shown.len() / n;
        let shown = DMatrix::from_row_slice(rows, n, &next.shown);
        let mut information = {
            let own = DMatrix::from_row_slice(self.shown.len() / n, n, &self.shown);
            own.transpose() * own
        };
        // N U₂ᵀ with the rows of N that are none left out, and what the second stretch sees of the first one's start.
        let spread = &noise * shown.columns(0, m).transpose();
        let seen = &shown * &first;
        let innovation = shown.columns(0, m) * &spread + DMatrix::identity(rows, rows);
        let Some(root) = innovation.cholesky() else {
            // A sum of a unit matrix and a square: only numbers that are none come here, and they show in the result.
            return Self {
                transition: vec![f64::NAN; m * n],
                ..self.clone()
            };
        };
        let solved = root.solve(&seen);
        information += seen.transpose() * &solved;
        let corrected = {
            let mut corrected = first;
            let mut moving = corrected.rows_mut(0, m);
            moving -= &spread * &solved;
            corrected
        };
        let remaining = &noise - &spread * root.solve(&spread.transpose());
        let turn = second.columns(0, m);
        let after =
            turn * remaining * turn.transpose() + DMatrix::from_row_slice(m, m, &next.noise);
        Self {
            seconds: self.seconds + next.seconds,
            moving: m,
            states: n,
            transition: rows_of(&(second * corrected)),
            noise: rows_of(&((&after + after.transpose()) * 0.5)),
            shown: directions(&information),
        }
    }

    fn dense_transition(&self) -> DMatrix<f64> {
        let (m, n) = (self.moving, self.states);
        DMatrix::from_fn(n, n, |row, column| {
            if row < m {
                self.transition[row * n + column]
            } else if row == column {
                1.0
            } else {
                0.0
            }
        })
    }

    /// P ← N + A (P⁻¹ + UᵀU)⁻¹ Aᵀ, P n × n and symmetric. States that walk gain `walk` a second, at the end of the stretch: drifts
    /// and biases walk too little for what they do within one to count.
    pub fn apply(&self, covariance: &mut [f64], walk: &[f64], scratch: &mut Scratch) {
        let (m, n) = (self.moving, self.states);
        let vector = &mut scratch.vector;
        vector.resize(n, 0.0);
        for row in self.shown.chunks_exact(n) {
            vector.fill(0.0);
            for (coefficient, line) in row.iter().zip(covariance.chunks_exact(n)) {
                for (sum, value) in vector.iter_mut().zip(line) {
                    *sum += coefficient * value;
                }
            }
            let own: f64 = row.iter().zip(vector.iter()).map(|(u, v)| u * v).sum();
            let scale = 1.0 / (1.0 + own);
            for (state, line) in covariance.chunks_exact_mut(n).enumerate() {
                let factor = scale * vector[state];
                for (value, v) in line.iter_mut().zip(vector.iter()) {
                    *value -= factor * v;
                }
            }
        }
        let rows = &mut scratch.rows;
        rows.resize(m * n, 0.0);
        for (row, sum) in self
            .transition
            .chunks_exact(n)
            .zip(rows.chunks_exact_mut(n))
        {
            sum.fill(0.0);
            for (coefficient, line) in row.iter().zip(covariance.chunks_exact(n)) {
                for (sum, value) in sum.iter_mut().zip(line) {
                    *sum += coefficient * value;
                }
            }
        }
        for row in 0..m {
            let product = &rows[row * n..(row + 1) * n];
            for column in 0..=row {
                let other = &self.transition[column * n..(column + 1) * n];
                let value: f64 = product.iter().zip(other).map(|(t, a)| t * a).sum();
                let value = value + self.noise[row * m + column];
                covariance[row * n + column] = value;
                covariance[column * n + row] = value;
            }
            for state in m..n {
                covariance[row * n + state] = product[state];
                covariance[state * n + row] = product[state];
            }
        }
        for state in m..n {
            covariance[state * n + state] += walk[state] * self.seconds;
        }
    }
}

fn rows_of(matrix: &DMatrix<f64>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}

/// Rows U with UᵀU the information, as many as it has directions.
fn directions(information: &DMatrix<f64>) -> Vec<f64> {
    let n = information.nrows();
    let eigen = ((information + information.transpose()) * 0.5).symmetric_eigen();
    let mut order: Vec<usize> = (0..n)
        .filter(|k| eigen.eigenvalues[*k] > NO_INFORMATION)
        .collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let mut rows = Vec::with_capacity(order.len() * n);
    for k in order {
        let size = eigen.eigenvalues[k].sqrt();
        rows.extend(eigen.eigenvectors.column(k).iter().map(|part| part * size));
    }
    rows
}
