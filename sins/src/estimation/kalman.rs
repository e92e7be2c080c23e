//! Covariance arithmetic: time propagation and scalar measurement updates in Joseph form.

use nalgebra::{SMatrix, SVector};

/// Estimate and covariance of `N` error states.
#[derive(Clone, Debug)]
pub struct Kalman<const N: usize> {
    /// Estimated state.
    pub state: SVector<f64, N>,
    /// Covariance of the estimate's error.
    pub covariance: SMatrix<f64, N, N>,
}

/// Innovation of a scalar measurement and its variance before the update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Measurement minus prediction.
    pub value: f64,
    /// H P Hᵀ + R.
    pub variance: f64,
}

impl Innovation {
    /// Normalized innovation squared of this scalar.
    pub fn normalized_squared(&self) -> f64 {
        self.value * self.value / self.variance
    }
}

impl<const N: usize> Kalman<N> {
    /// x ← Φ x, P ← Φ P Φᵀ + Q.
    pub fn propagate(&mut self, transition: &SMatrix<f64, N, N>, noise: &SMatrix<f64, N, N>) {
        self.state = transition * self.state;
        self.covariance = transition * self.covariance * transition.transpose() + noise;
        self.symmetrize();
    }

    /// Updates with a direct measurement of the state at `index`, of variance `r`.
    ///
    /// Joseph form, P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ; with H a unit row both products are of rank one.
    pub fn update(&mut self, index: usize, measurement: f64, r: f64) -> Innovation {
        let variance = self.covariance[(index, index)] + r;
        let gain = self.covariance.column(index) / variance;
        let value = measurement - self.state[index];
        self.state += gain * value;

        let row = self.covariance.row(index).into_owned();
        let left = self.covariance - gain * row;
        let column = left.column(index).into_owned();
        self.covariance = left - column * gain.transpose() + gain * (r * gain.transpose());
        self.symmetrize();
        Innovation { value, variance }
    }

    /// One-sigma of every state.
    pub fn sigma(&self) -> SVector<f64, N> {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }

    fn symmetrize(&mut self) {
        for i in 0..N {
            for j in 0..i {
                let mean = 0.5 * (self.covariance[(i, j)] + self.covariance[(j, i)]);
                self.covariance[(i, j)] = mean;
                self.covariance[(j, i)] = mean;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
    use proptest::prelude::*;

    /// Measuring one of two correlated states: the textbook's conditional mean and covariance.
    #[test]
    fn update_is_conditioning() {
        let mut kalman = Kalman {
            state: Vector2::new(1.0, 2.0),
            covariance: Matrix2::new(4.0, 3.0, 3.0, 9.0),
        };
        let innovation = kalman.update(0, 3.0, 1.0);
        assert_eq!(
            innovation,
            Innovation {
                value: 2.0,
                variance: 5.0
            }
        );
        assert!((kalman.state - Vector2::new(1.0 + 1.6, 2.0 + 1.2)).norm() < 1e-15);
        assert!((kalman.covariance - Matrix2::new(0.8, 0.6, 0.6, 9.0 - 1.8)).norm() < 1e-14);
    }

    proptest! {
        /// Whatever the covariance and however precise the measurement, the covariance stays symmetric and not negative.
        #[test]
        fn covariance_stays_positive(entries in prop::array::uniform9(-1e3..1e3f64), r in -12..3i32, index in 0..3usize) {
            let a = Matrix3::from_row_slice(&entries);
            let mut kalman = Kalman { state: Vector3::zeros(), covariance: a * a.transpose() };
            let scale = kalman.covariance.norm();
            for _ in 0..5 {
                kalman.update(index, 1.0, 10f64.powi(r));
            }
            prop_assert!((kalman.covariance - kalman.covariance.transpose()).norm() == 0.0);
            prop_assert!(kalman.covariance.symmetric_eigenvalues().min() > -1e-9 * scale);
        }
    }
}
