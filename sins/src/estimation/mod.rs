//! The error filter, made of groups: states and their names, covariance arithmetic, measurements, and the loop that closes it
//! round the mechanization.
//!
//! x = \[navigation | parameters\]. A [`model`] is a list of [`groups`]; the [`filter`] is generic over it. Outside the filter
//! nothing is generic: an estimate is a list of named [`state`]s with a covariance.

pub mod any_filter;
#[cfg(test)]
mod column_test;
pub mod consistency;
pub mod filter;
pub mod grade;
pub mod group;
mod group_priors;
pub mod groups;
pub mod installation;
pub mod kalman;
pub mod measurement;
pub mod model;
pub mod smoother;
pub mod state;
