//! What a group of error states is, and what it is told.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::groups::navigation;
use super::installation::Installation;
use super::state::StateLabel;
use crate::earth::LocalEarth;
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::Increment;
use crate::sensor::compensation::Compensation;
use crate::sensor::errors::SensorErrors;

/// Some error states that belong together. The value of a group is its settings: what is known before, and how it walks.
///
/// Every group stands in one file with the test of its columns against the nonlinear machine (`column_test`), and is part
/// of a model by one line in the model's list ([`model`](super::model)). What a group does not have it leaves out.
pub trait Group: Copy + std::fmt::Debug + PartialEq {
    /// Its states, in order.
    const LABELS: &'static [StateLabel];
    /// Number of its states.
    const SIZE: usize = Self::LABELS.len();
    /// Where the error of the vertical velocity stands in it; only a vertical channel has it.
    const VELOCITY_UP: Option<usize> = None;
    /// Whether it gathers changes of rate and specific force from sample to sample.
    const FOLLOWS_CHANGES: bool = false;
    /// Whether its states are the table's errors, as encoders show them.
    const OF_TABLE: bool = false;
    /// Whether its states are the attitude of the table's base.
    const OF_BASE: bool = false;

    /// Whether its states are the antenna's arm.
    const OF_ANTENNA: bool = false;

    /// What it gathers between two covariance steps at the rate of the samples, such as ∫C dt.
    type Gathered: Copy + Default + std::fmt::Debug + Serialize + DeserializeOwned;

    /// One-sigma of its states before anything is measured, at a place.
    fn prior(&self, place: &NavigationState, sigma: &mut [f64]);

    /// Variance that its states gain a second by walking. (Where the white noise of the sensors enters is the navigation
    /// group's business.)
    fn walk(&self, _rate: &mut [f64]) {}

    /// Gathers one sampling interval.
    #[inline]
    fn gather(_gathered: &mut Self::Gathered, _span: &Span) {}

    /// Its columns of A = ∫F dt over the step.
    fn couple(&self, gathered: &Self::Gathered, interval: &Interval, into: &mut Coupling<'_>);

    /// Takes its errors out of the mechanization.
    fn correct_navigation(_x: &[f64], _strapdown: &mut Strapdown) {}

    /// Takes its errors into the sensor model, which holds what has been found of them.
    fn correct_sensors(_x: &[f64], _errors: &mut SensorErrors) {}

    /// What the sensor model holds of its states.
    fn found(_errors: &SensorErrors, _x: &mut [f64]) {}

    /// Takes its errors into what has been found of table, base and antenna.
    fn correct_installation(_x: &[f64], _installation: &mut Installation) {}

    /// What has been found of its states there.
    fn found_of_installation(_installation: &Installation, _x: &mut [f64]) {}
}

/// One sampling interval, as the groups gather it.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// ∫C_b^n dt \[s\].
    pub attitude: Matrix3<f64>,
    /// What the sensors gathered in it, compensated.
    pub increment: Increment,
    /// Change of the angular rate over it \[rad/s\]; zero where no group follows changes.
    pub rate_change: Vector3<f64>,
    /// Change of the specific force over it, block axes \[m/s²\]; zero where no group follows changes.
    pub force_change: Vector3<f64>,
}

impl Span {
    /// Mean angular rate, block axes \[rad/s\].
    #[inline]
    pub fn angular_rate(&self) -> Vector3<f64> {
        self.increment.angle / self.increment.interval_s
    }

    /// Mean specific force, block axes \[m/s²\].
    #[inline]
    pub fn specific_force(&self) -> Vector3<f64> {
        self.increment.velocity / self.increment.interval_s
    }
}

/// The time since the last covariance step.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// Its length \[s\].
    pub seconds: f64,
    /// The earth at the present latitude.
    pub earth: LocalEarth,
    /// Velocity in n \[m/s\].
    pub velocity: Vector3<f64>,
    /// ∫fⁿ dt \[m/s\].
    pub gained: Vector3<f64>,
    /// (I + K_g)⁻¹ and (I + K_a)⁻¹ by which samples are compensated; errors behind it are seen through it.
    pub inverses: [Matrix3<f64>; 2],
}

impl Interval {
    /// At one place and velocity, with a constant specific force in n \[m/s²\] and sensors without matrices.
    pub fn constant(
        seconds: f64,
        earth: LocalEarth,
        velocity: Vector3<f64>,
        specific_force: Vector3<f64>,
    ) -> Self {
        Self {
            seconds,
            earth,
            velocity,
            gained: specific_force * seconds,
            inverses: [Matrix3::identity(); 2],
        }
    }

    pub(super) fn inverses_of(compensation: &Compensation) -> [Matrix3<f64>; 2] {
        [
            *compensation.gyroscope_inverse(),
            *compensation.accelerometer_inverse(),
        ]
    }
}

/// A group's columns of A in the rows of the moving states.
#[derive(Debug)]
pub struct Coupling<'a> {
    /// Row r of A stands in elements r·states to (r+1)·states.
    rows: &'a mut [f64],
    /// exponent of D.
    decay: &'a mut [f64],
    states: usize,
    first: usize,
    velocity_up: Option<usize>,
}

impl<'a> Coupling<'a> {
    pub(super) fn new(
        rows: &'a mut [f64],
        decay: &'a mut [f64],
        first: usize,
        velocity_up: Option<usize>,
    ) -> Self {
        let states = decay.len();
        Self {
            rows,
            decay,
            states,
            first,
            velocity_up,
        }
    }

    /// Adds to how much a state of this group adds to a moving state over the step. (Rows count from the first group.)
    pub fn add(&mut self, row: usize, state: usize, value: f64) {
        if let Some(element) = self.rows.get_mut(row * self.states + self.first + state) {
            *element += value;
        }
    }

    /// A state of this group adds this velocity \[m/s a unit\] and this misalignment \[rad a unit\], in n, over the step.
    pub fn drives(
        &mut self,
        state: usize,
        velocity: Option<Vector3<f64>>,
        misalignment: Option<Vector3<f64>>,
    ) {
        if let Some(velocity) = velocity {
            self.add(navigation::VELOCITY_EAST, state, velocity.x);
            self.add(navigation::VELOCITY_NORTH, state, velocity.y);
            if let Some(row) = self.velocity_up {
                self.add(row, state, velocity.z);
            }
        }
        if let Some(misalignment) = misalignment {
            for axis in 0..3 {
                self.add(
                    navigation::MISALIGNMENT_EAST + axis,
                    state,
                    misalignment[axis],
                );
            }
        }
    }

    /// A state of this group adds to another one of it; only of a moving group.
    pub fn rises(&mut self, to: usize, by: usize, value: f64) {
        self.add(self.first + to, by, value);
    }

    /// A state of this group forgets with a time constant: its part of A_ss is −T/τ.
    pub fn forgets(&mut self, state: usize, exponent: f64) {
        if let Some(element) = self.decay.get_mut(self.first + state) {
            *element = exponent;
        }
    }
}
