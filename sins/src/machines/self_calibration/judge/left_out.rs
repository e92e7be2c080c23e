//! What the model that is judged leaves out, as the witness would have it.
//!
//! The witness estimates every group at once, and each hides behind the others. The question is another one: are they all zero, as the
//! smaller model says? With the witness' estimates x of what is left out and their covariance P that is xᵀ P⁻¹ x, which is
//! large as soon as any of them shows, and the state that explains it best by itself is (P⁻¹x)_i / (P⁻¹)_ii, with the sigma that it has
//! where all others are zero.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::super::ModelChoice;
use crate::estimation::groups::navigation::POSITION;
use crate::estimation::model::{Model, Whole, WholeFilter};
use crate::estimation::state::positions;
use crate::units::ARC_SECOND;

/// How often it is looked at \[s\].
pub(super) const PERIOD_S: f64 = 60.0;
/// A filter that is linear about a latitude and drifts that were not known yet tells a latitude no better, one-sigma \[rad\].
const LATITUDE_RAD: f64 = 15.0 * ARC_SECOND;
/// Probability that the test of all fails when all is well.
const FALSE_ALARM: f64 = 1e-6;

const ENDS: [usize; 2] = positions(
    Whole::LIST,
    ["gyroscope_scale_factor_x", "accelerometer_delay_s"],
);
const LATITUDE: usize = positions(Whole::LIST, [POSITION[0]])[0];

/// What explains the samples best by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Single {
    /// Number of the state in the whole model.
    pub state: usize,
    /// Its value, SI.
    pub value: f64,
    /// Its one-sigma, SI.
    pub sigma: f64,
}

impl Single {
    /// Value over sigma.
    pub fn over(&self) -> f64 {
        if self.sigma > 0.0 {
            self.value / self.sigma
        } else {
            0.0
        }
    }
}

/// The test of what is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// xᵀ P⁻¹ x over all groups.
    pub sum: f64,
    /// How large it may be by chance; zero where nothing is left out.
    pub bound: f64,
    /// The state that explains it best.
    pub best: Single,
    /// Latitude that the earth's rate shows less that of the fix.
    pub latitude: Single,
}

impl LeftOut {
    /// Looks at the filter. The prior is a variance for every state.
    pub(super) fn look(
        filter: &WholeFilter,
        prior: &[f64; Whole::N],
        fix_rad: f64,
        model: ModelChoice,
    ) -> Self {
        let (state, covariance) = (filter.state(), filter.covariance());
        let off = filter.navigation().position.latitude_rad - fix_rad;
        let mut left_out = Self {
            latitude: Single {
                state: LATITUDE,
                value: off,
                sigma: covariance[(LATITUDE, LATITUDE)]
                    .max(0.0)
                    .sqrt()
                    .hypot(LATITUDE_RAD),
            },
            ..Self::default()
        };
        if model == ModelChoice::Whole {
            return left_out;
        }
        let of: Vec<usize> = (ENDS[0]..=ENDS[1])
            .filter(|i| prior[*i] > 0.0)
            .chain([LATITUDE])
            .collect();
        let scale = DVector::from_iterator(of.len(), of.iter().map(|i| prior[*i].sqrt()));
        let x = DVector::from_fn(of.len(), |i, _| {
            (if of[i] == LATITUDE { off } else { state[of[i]] }) / scale[i]
        });
        let matrix = DMatrix::from_fn(of.len(), of.len(), |i, j| {
            let floor = if i == j && of[i] == LATITUDE {
                LATITUDE_RAD.powi(2)
            } else {
                0.0
            };
            (covariance[(of[i], of[j])] + floor) / (scale[i] * scale[j])
        });
        let learned: f64 = (0..of.len())
            .map(|i| (1.0 - matrix[(i, i)]).clamp(0.0, 1.0))
            .sum();
        let Some(information) = matrix.cholesky().map(|c| c.inverse()) else {
            return left_out;
        };
        let score = &information * &x;
        left_out.sum = x.dot(&score);
        left_out.bound = ChiSquared::new(learned.max(1.0))
            .map_or(f64::INFINITY, |d| d.inverse_cdf(1.0 - FALSE_ALARM));
        for (i, at) in of.iter().enumerate() {
            let single = Single {
                state: *at,
                value: score[i] / information[(i, i)] * scale[i],
                sigma: scale[i] / information[(i, i)].sqrt(),
            };
            if *at == LATITUDE {
                left_out.latitude = single;
            } else if single.over().abs() > left_out.best.over().abs() {
                left_out.best = single;
            }
        }
        left_out
    }
}
