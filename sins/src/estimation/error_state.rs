//! Positions of the thirteen states, for consumers that have not yet been moved to names.

use nalgebra::{SMatrix, SVector};

use super::model::{Model, Paper};
pub use super::state::StateLabel;

/// Number of states.
pub const STATES: usize = Paper::N;
/// Labels of the states, in the order of the state vector.
pub const STATE_LABELS: [StateLabel; STATES] = <Paper as Model<{ Paper::M }, { Paper::N }>>::STATES;
/// Names of the states.
pub const STATE_NAMES: [&str; STATES] = {
    let mut names = [""; STATES];
    let mut i = 0;
    while i < STATES {
        names[i] = STATE_LABELS[i].name;
        i += 1;
    }
    names
};
/// Index of the latitude error δL.
pub const LATITUDE: usize = 0;
/// Index of the longitude error δλ.
pub const LONGITUDE: usize = 1;
/// Index of δv_E; δv_N follows.
pub const VELOCITY: usize = 2;
/// Index of φ_E; φ_N and φ_U follow.
pub const MISALIGNMENT: usize = 4;
/// Index of ∇_x; y and z follow.
pub const BIAS: usize = 7;
/// Index of ε_x; y and z follow.
pub const DRIFT: usize = 10;
/// The state vector.
pub type StateVector = SVector<f64, STATES>;
/// A square matrix over the states.
pub type StateMatrix = SMatrix<f64, STATES, STATES>;
