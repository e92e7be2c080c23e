//! What a filter leaves for those who go over its record once more: its tape, and how it goes over a record for the second time.

use nalgebra::SVector;

use super::ErrorFilter;
use crate::estimation::groups::navigation::{
    LATITUDE, LONGITUDE, MISALIGNMENT_EAST, VELOCITY_EAST, VELOCITY_NORTH,
};
use crate::estimation::installation::Installation;
use crate::estimation::model::Model;
use crate::estimation::smoother::{Shape, Tape};
use crate::estimation::state::StateEstimate;
use crate::mechanization::strapdown::NavigationState;
use crate::time::Stamp;

/// Biases and drifts, which stand behind the states that move and may walk.
const WALKING: usize = 6;

impl<G: Model<M, N>, const M: usize, const N: usize> ErrorFilter<G, M, N> {
    /// Writes down what smoothing needs from here on, or no longer.
    pub fn record(&mut self, records: bool) {
        let shape = Shape {
            labels: G::LIST,
            moving: M,
            smoothed: M + WALKING,
            velocity_up: G::VELOCITY_UP,
        };
        let tape = records.then(|| Box::new(Tape::new(shape)));
        self.kalman.record(tape);
    }

    /// Length of what has been written down and not taken \[bytes\].
    pub fn tape_bytes(&self) -> usize {
        self.kalman.tape().map_or(0, Tape::bytes)
    }

    /// Where the base's states stand, which another epoch does not take over.
    pub fn base_state(&self) -> Option<usize> {
        G::BASE
    }

    /// Takes what has been written down since the last time; it goes on writing. `None` where it does not.
    pub fn take_tape(&mut self) -> Option<Tape> {
        self.kalman.tape_mut().map(Tape::take)
    }

    /// Marks this epoch as one that is to be smoothed; only after a covariance step, when everything has been measured.
    pub fn mark(&mut self, stamp: Stamp) {
        if self.kalman.tape().is_none() {
            return;
        }
        let found = G::found(self.compensator.compensation().errors(), &self.installation);
        let values = found + self.kalman.state();
        let covariance = *self.kalman.covariance();
        if let Some(tape) = self.kalman.tape_mut() {
            tape.point(stamp, self.strapdown.state(), &values, &covariance);
        }
    }

    /// Believes that attitude, velocity, position and sensor errors are those of another filter, instead of those about which it
    /// is linear. Its covariance is about that.
    pub fn believe(&mut self, other: &Self) {
        let found = |filter: &Self| {
            let errors = filter.compensator.compensation().errors();
            G::found(errors, &filter.installation)
        };
        let apart = self.apart(other.navigation());
        self.kalman.believe(found(other) - found(self) + apart);
    }

    /// Moves the point about which it is linear to a navigation state; what it believes stays.
    pub fn move_to(&mut self, navigation: &NavigationState) {
        let apart = self.apart(navigation);
        let state = *self.kalman.state();
        self.kalman.believe(state - apart);
        G::correct_navigation(&apart, &mut self.strapdown);
    }

    /// The error of the mechanization if this were true.
    fn apart(&self, truth: &NavigationState) -> SVector<f64, N> {
        let here = self.strapdown.state();
        let mut x = SVector::<f64, N>::zeros();
        let turn = (truth.attitude * here.attitude.inverse()).scaled_axis();
        x.fixed_rows_mut::<3>(MISALIGNMENT_EAST).copy_from(&turn);
        let velocity = here.velocity - truth.velocity;
        x[VELOCITY_EAST] = velocity.x;
        x[VELOCITY_NORTH] = velocity.y;
        x[LATITUDE] = here.position.latitude_rad - truth.position.latitude_rad;
        x[LONGITUDE] = here.position.longitude_rad - truth.position.longitude_rad;
        if let Some(up) = G::VELOCITY_UP {
            x[up] = velocity.z;
            x[up - 1] = here.position.height_m - truth.position.height_m;
        }
        x
    }

    /// Attitude, velocity and position as it believes them to be: the mechanization with what has not been fed back.
    pub fn believed(&self) -> NavigationState {
        let x = self.kalman.state();
        if x.iter().take(M).all(|x| *x == 0.0) {
            return *self.strapdown.state();
        }
        let mut strapdown = self.strapdown.clone();
        G::correct_navigation(x, &mut strapdown);
        *strapdown.state()
    }

    /// Table, base and antenna as it believes them to be.
    pub fn believed_installation(&self) -> Installation {
        let mut installation = self.installation;
        G::correct_installation(self.kalman.state(), &mut installation);
        installation
    }

    /// The estimate that goes with [`Self::believed`]: no error of navigation is left in it.
    pub fn estimate_about_believed(&self) -> StateEstimate {
        let mut state = self.state();
        state.rows_mut(0, M).fill(0.0);
        StateEstimate::of_filter(&self.shown, &state, self.kalman.covariance())
    }
}
