//! Velocities as measurements.

use super::ErrorFilter;
use crate::estimation::groups::navigation;
use crate::estimation::measurement::{Measurement, Outcome, Row};
use crate::estimation::model::Model;
pub use crate::sensor::velocity::VelocityMeasurement;

impl<G: Model<M, N>, const M: usize, const N: usize> ErrorFilter<G, M, N> {
    /// Measures the velocity error, east and then north (equations 28 and 29). `gate` is the normalized innovation squared
    /// above which a component is left out.
    pub fn update_velocity(
        &mut self,
        measurement: &VelocityMeasurement,
        gate: Option<f64>,
    ) -> [Outcome; 2] {
        let velocity = self.strapdown.state().velocity;
        let rows = [navigation::VELOCITY_EAST, navigation::VELOCITY_NORTH];
        let measurements: [Measurement<N>; 2] = std::array::from_fn(|axis| {
            let error = velocity[axis] - measurement.east_north[axis];
            let variance = measurement.sigma[axis].powi(2);
            Measurement::new(Row::unit(rows[axis]), error, variance).gated(gate)
        });
        self.update(&measurements)
    }

    /// Measures one component of the velocity error: east (0) or north (1) \[m/s\], with its variance \[m²/s²\].
    pub fn update_velocity_axis(&mut self, axis: usize, measured: f64, variance: f64) -> Outcome {
        let rows = [navigation::VELOCITY_EAST, navigation::VELOCITY_NORTH];
        let axis = axis.min(1);
        let error = self.strapdown.state().velocity[axis] - measured;
        let [outcome] = self.update(&[Measurement::new(Row::unit(rows[axis]), error, variance)]);
        outcome
    }

    /// Measures the vertical velocity \[m/s\], one-sigma `sigma_m_s`; a filter without a vertical channel refuses.
    pub fn update_vertical_velocity(
        &mut self,
        up_m_s: f64,
        sigma_m_s: f64,
        gate: Option<f64>,
    ) -> [Outcome; 1] {
        let Some(row) = G::VELOCITY_UP else {
            return [Outcome::Refused];
        };
        let error = self.strapdown.state().velocity.z - up_m_s;
        self.update(&[Measurement::new(Row::unit(row), error, sigma_m_s.powi(2)).gated(gate)])
    }
}
