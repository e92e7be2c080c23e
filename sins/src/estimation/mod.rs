//! The 13-state error filter: its states, its covariance arithmetic, and the loop that closes it round the mechanization.

pub mod consistency;
pub mod error_state;
pub mod filter;
pub mod kalman;
