//! Holes in the samples: those that are bridged by an increment, and those that are crossed without one.

use nalgebra::{UnitQuaternion, Vector3};

use super::ErrorFilter;
use crate::error::Error;
use crate::estimation::groups::navigation;
use crate::estimation::model::Model;

/// A hole that is not integrated over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// What the block turned in it against the ship, in its axes before it: attitude after = attitude before · turn.
    pub turn: UnitQuaternion<f64>,
    /// Its length \[s\].
    pub seconds: f64,
    /// What is added to the misalignment about E, N, U, one-sigma \[rad\].
    pub misalignment_sigma_rad: Vector3<f64>,
    /// The ship lies: her velocity is zero, give or take this one-sigma \[m/s\]. None: she sails on as she did.
    pub rest_sigma_m_s: Option<f64>,
    /// What is added to the velocity of a ship that sails on, one-sigma \[m/s\].
    pub velocity_sigma_m_s: f64,
}

impl<G: Model<M, N>, const M: usize, const N: usize> ErrorFilter<G, M, N> {
    /// A hole in the samples was bridged: the increments at its ends are no neighbours, and the attitude and velocity gained
    /// in it are uncertain by `angle_sigma` \[rad\] and `velocity_sigma` \[m/s\].
    pub fn bridge(&mut self, angle_sigma: f64, velocity_sigma: f64) {
        self.break_stream();
        for axis in 0..3 {
            let state = navigation::MISALIGNMENT_EAST + axis;
            self.kalman.add_variance(state, angle_sigma * angle_sigma);
        }
        let rows = [
            Some(navigation::VELOCITY_EAST),
            Some(navigation::VELOCITY_NORTH),
            G::VELOCITY_UP,
        ];
        for state in rows.into_iter().flatten() {
            self.kalman
                .add_variance(state, velocity_sigma * velocity_sigma);
        }
    }

    /// The next increment does not follow the last one.
    fn break_stream(&mut self) {
        self.strapdown.break_stream();
        self.compensator.forget();
    }

    /// Goes over a hole without integrating: what was turned in it is told from outside. What is known of the sensors, and
    /// its correlation with the misalignment, stays: a ship that keeps her attitude against the earth keeps φ.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn cross(&mut self, crossing: &Crossing) -> Result<(), Error> {
        self.step()?;
        let state = *self.strapdown.state();
        let turned = state.attitude * crossing.turn * state.attitude.inverse();
        for axis in 0..3 {
            let variance = crossing.misalignment_sigma_rad[axis].powi(2);
            self.kalman
                .add_variance(navigation::MISALIGNMENT_EAST + axis, variance);
        }
        let (velocity_error, position_error) = if let Some(sigma) = crossing.rest_sigma_m_s {
            for row in [navigation::VELOCITY_EAST, navigation::VELOCITY_NORTH] {
                self.kalman.forget(row, sigma * sigma);
            }
            (state.velocity, [0.0; 2])
        } else {
            let earth = *self.strapdown.earth();
            let to_angle = [
                crossing.seconds / earth.meridian_radius_m,
                crossing.seconds / (earth.transverse_radius_m * earth.cos_latitude),
            ];
            let grown = crossing.velocity_sigma_m_s.powi(2);
            for (position, velocity, scale) in [
                (
                    navigation::LATITUDE,
                    navigation::VELOCITY_NORTH,
                    to_angle[0],
                ),
                (
                    navigation::LONGITUDE,
                    navigation::VELOCITY_EAST,
                    to_angle[1],
                ),
            ] {
                self.kalman.add_variance(velocity, grown);
                let variance = self.kalman.covariance()[(velocity, velocity)];
                self.kalman.add_variance(position, variance * scale * scale);
            }
            let v = state.velocity;
            (Vector3::zeros(), [-v.y * to_angle[0], -v.x * to_angle[1]])
        };
        self.strapdown
            .correct(&turned.scaled_axis(), &velocity_error, position_error);
        self.break_stream();
        Ok(())
    }
}
