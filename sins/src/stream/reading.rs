//! Whatever a machine is fed.

use crate::earth::Position;
use crate::sensor::{ImuSample, PositionMeasurement, VelocityMeasurement};
use crate::table::JointSample;
use crate::time::Stamp;

/// A reading of a sensor, as a bag, a simulation or a network hands it on: machines take them one after the other, in the order
/// in which they come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Of the inertial measurement unit.
    Imu(ImuSample),
    /// Of the table's encoders.
    Joints(JointSample),
    /// Of a satellite receiver.
    Fix(PositionMeasurement),
    /// A position that is given, without a time.
    Position(Position),
    /// Velocity over ground, with its time.
    Velocity(Stamp, VelocityMeasurement),
}
