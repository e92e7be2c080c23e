//! Readings of the table's encoders as measurements of how the block stands in its base.

use super::{ErrorFilter, shown};
use crate::estimation::groups::navigation;
use crate::estimation::measurement::{Measurement, Outcome, Row};
use crate::estimation::model::Model;
use crate::table::Turntable;

/// One-sigma of a base of which nothing is known \[rad\]: wide against every misalignment, and small enough for the
/// arithmetic.
const UNKNOWN_BASE_RAD: f64 = 0.1;

/// What the encoders read, with the table they belong to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderReading {
    /// The table's axes.
    pub turntable: Turntable,
    /// Readings, outer and inner \[rad\].
    pub angles: [f64; 2],
    /// One-sigma of a reading \[rad\].
    pub sigma_rad: f64,
    /// One-sigma about the axis across both joints, about which nothing turns: how the axes wobble \[rad\].
    pub wobble_sigma_rad: f64,
}

impl<G: Model<M, N>, const M: usize, const N: usize> ErrorFilter<G, M, N> {
    /// Measures by the encoders how the block stands in the base: z = C_n^b (ψ − φ) + D x, about the outer axis, the inner
    /// one and the one across, with the table's errors x and D their derivatives
    /// ([`AttitudeDerivatives`](crate::table::AttitudeDerivatives)). The first reading says how the base stands. A filter
    /// without the table's groups refuses.
    pub fn update_encoders(&mut self, reading: &EncoderReading, gate: Option<f64>) -> [Outcome; 3] {
        let (Some(table), Some(base)) = (G::TABLE, G::BASE) else {
            return [Outcome::Refused; 3];
        };
        let errors = &self.installation.table;
        let in_base = reading.turntable.attitude_with(reading.angles, errors);
        let attitude = self.strapdown.state().attitude;
        let stands = if let Some(stands) = self.installation.base {
            stands
        } else {
            for state in base..base + 3 {
                self.kalman.forget(state, UNKNOWN_BASE_RAD.powi(2));
            }
            self.shown = shown::<G, M, N>(self.kalman.covariance());
            *self.installation.base.insert(attitude * in_base.inverse())
        };
        let turn = ((stands * in_base).inverse() * attitude).scaled_axis();
        let derivatives = reading
            .turntable
            .attitude_derivatives(reading.angles, errors);
        let outer = derivatives.readings[0].normalize();
        let across = outer.cross(&derivatives.readings[1]).normalize();
        let axes = [outer, across.cross(&outer), across];
        let sigmas = [
            reading.sigma_rad,
            reading.sigma_rad,
            reading.wobble_sigma_rad,
        ];
        let measurements: [Measurement<N>; 3] = std::array::from_fn(|i| {
            let axis = axes[i];
            let in_navigation = attitude * axis;
            let by_table = derivatives
                .of_states()
                .map(|derivative| axis.dot(&derivative));
            let attitudes = (0..3).flat_map(|k| {
                [
                    (navigation::MISALIGNMENT_EAST + k, -in_navigation[k]),
                    (base + k, in_navigation[k]),
                ]
            });
            let tables = by_table
                .into_iter()
                .enumerate()
                .map(|(state, value)| (table + state, value));
            Measurement::new(
                Row::new(attitudes.chain(tables)),
                axis.dot(&turn),
                sigmas[i].powi(2),
            )
            .gated(gate)
        });
        self.update(&measurements)
    }

    /// How much the ship moves: the walk of the base's attitude, density \[rad/√s\].
    pub fn set_base_walk(&mut self, walk_rad_sqrt_s: f64) {
        if let Some(base) = G::BASE {
            self.walk
                .rows_mut(base, 3)
                .fill(walk_rad_sqrt_s * walk_rad_sqrt_s);
        }
    }

    /// Knows nothing more of the base: the next reading of the encoders says anew how it stands.
    pub fn forget_base(&mut self) {
        if let (Some(base), Some(_)) = (G::BASE, self.installation.base.take()) {
            for state in base..base + 3 {
                self.kalman.forget(state, 0.0);
            }
            self.set_base_walk(0.0);
            self.shown = shown::<G, M, N>(self.kalman.covariance());
        }
    }
}
