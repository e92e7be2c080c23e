//! The filter round the mechanization: increments in, velocity measurements in, a corrected state and its covariance out.

mod crossing;
mod encoders;
mod initial;
mod position;
mod recording;
mod velocity;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::group::{Interval, Span};
use super::groups::navigation::{self, sensor_noise_rate};
use super::installation::Installation;
use super::kalman::{Kalman, ProcessNoise};
use super::measurement::{Measurement, Outcome, UpdateCounts};
use super::model::Model;
use super::state::{NamedCovariance, Shown, StateEstimate};
use crate::error::Error;
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::Increment;
use crate::sensor::compensation::{Compensation, Compensator};
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::NoiseDensity;
use crate::table::TableErrors;

pub use crossing::Crossing;
pub use encoders::EncoderReading;
pub use initial::InitialUncertainty;
pub use position::AntennaArm;
pub use velocity::VelocityMeasurement;

/// Whether estimated errors go back into the mechanization after every update.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Loop {
    /// They stay in the state vector; the mechanization runs free.
    Open,
    /// They are taken out of attitude, velocity, position and sensors at once.
    Closed,
}

/// The error filter of a model and the mechanization it belongs to: `M` states that move, `N` in all.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct ErrorFilter<G: Model<M, N>, const M: usize, const N: usize> {
    model: G,
    strapdown: Strapdown,
    kalman: Kalman<N>,
    compensator: Compensator,
    installation: Installation,
    shown: Shown,
    noise: NoiseDensity,
    turn_noise: f64,
    /// ∫|ω_i| dt \[rad\] since the last step.
    turned: Vector3<f64>,
    walk: SVector<f64, N>,
    feedback: Loop,
    seconds: f64,
    /// ∫fⁿ dt \[m/s\] since the last step.
    gained: Vector3<f64>,
    gathered: G::Gathered,
    counts: UpdateCounts,
}

impl<G: Model<M, N>, const M: usize, const N: usize> ErrorFilter<G, M, N> {
    /// Starts at a navigation state with sensor errors that are known to be `errors`, and the uncertainty of both in
    /// `covariance`.
    ///
    /// # Errors
    /// [`Error::Setting`] where the sensor errors cannot be inverted, [`Error::Variance`] where the covariance is none.
    pub fn new(
        model: G,
        start: NavigationState,
        errors: &SensorErrors,
        covariance: SMatrix<f64, N, N>,
        noise: NoiseDensity,
        feedback: Loop,
    ) -> Result<Self, Error> {
        Ok(Self {
            strapdown: Strapdown::new(start).with_vertical_channel(G::VELOCITY_UP.is_some()),
            installation: Installation::default(),
            shown: shown::<G, M, N>(&covariance),
            turn_noise: 0.0,
            turned: Vector3::zeros(),
            kalman: Kalman::new(covariance)?,
            compensator: Compensator::new(errors.compensation()?)
                .following_changes(G::FOLLOWS_CHANGES),
            noise,
            walk: model.walk(),
            model,
            feedback,
            seconds: 0.0,
            gained: Vector3::zeros(),
            gathered: G::Gathered::default(),
            counts: UpdateCounts::default(),
        })
    }

    /// Begins with what was known of the table.
    #[must_use]
    pub fn with_table(mut self, errors: TableErrors) -> Self {
        self.installation.table = errors;
        self
    }

    /// Begins with what was known of the antenna's arm beyond what was told.
    #[must_use]
    pub fn with_antenna(mut self, arm_m: Vector3<f64>) -> Self {
        self.installation.antenna_arm_m = arm_m;
        self
    }

    /// Makes every turn uncertain: a turn of 180 deg about an axis costs this share of 180 deg, one-sigma, and what turns come
    /// after adds in squares. It stands for what no state describes.
    #[must_use]
    pub fn with_turn_noise(mut self, share: f64) -> Self {
        self.turn_noise = share;
        self
    }

    /// Refuses numbers that no running filter holds, such as those of a damaged file.
    ///
    /// # Errors
    /// [`Error::Snapshot`] with what they are of; [`Error::Diverged`] with the state.
    pub fn check(&self) -> Result<(), Error> {
        let refused = |what: &str| Error::Snapshot {
            reason: format!("{what} cannot be"),
        };
        self.kalman.check().map_err(name_state::<G, M, N>)?;
        self.strapdown.state().check()?;
        if let Some(base) = &self.installation.base
            && !(0.999_999..1.000_001).contains(&base.norm())
        {
            return Err(refused("the attitude of the base"));
        }
        self.compensator.compensation().errors().compensation()?;
        if !self.shown.is_within(N) {
            return Err(refused("a list of states"));
        }
        Ok(())
    }

    /// Runs the mechanization over one sampling interval. The covariance waits for [`Self::step`].
    pub fn propagate(&mut self, increment: &Increment) {
        let seconds = increment.interval_s;
        let compensated = self.compensator.next(increment);
        let before = *self.strapdown.body_to_navigation();
        let gained = self.strapdown.propagate(&compensated.increment);
        self.seconds += seconds;
        self.gained += gained;
        if self.turn_noise > 0.0 {
            self.turned += compensated.increment.angle.abs();
        }
        let span = Span {
            attitude: (before + self.strapdown.body_to_navigation()) * (0.5 * seconds),
            increment: compensated.increment,
            rate_change: compensated.rate_change,
            force_change: compensated.force_change,
        };
        G::gather(&mut self.gathered, &span);
    }

    /// Time since the last covariance step \[s\].
    pub fn pending_s(&self) -> f64 {
        self.seconds
    }

    /// The greatest one-sigma of the misalignment \[rad\].
    pub fn largest_misalignment_sigma(&self) -> f64 {
        let covariance = self.kalman.covariance();
        let variance = (0..3).map(|axis| {
            let state = navigation::MISALIGNMENT_EAST + axis;
            covariance[(state, state)]
        });
        variance.fold(0.0, f64::max).sqrt()
    }

    /// Brings the covariance up to the mechanization: Φ = I + A + A²/2 with A = ∫F dt as gathered, noise by the trapezoid.
    ///
    /// # Errors
    /// [`Error::Variance`] where the mechanization or the covariance would no longer be numbers; the covariance stays as it
    /// was, and the filter is of no more use.
    pub fn step(&mut self) -> Result<(), Error> {
        let seconds = self.seconds;
        if seconds <= 0.0 {
            return Ok(());
        }
        let interval = Interval {
            seconds,
            earth: *self.strapdown.earth(),
            velocity: self.strapdown.state().velocity,
            gained: self.gained,
            inverses: Interval::inverses_of(self.compensator.compensation()),
        };
        let transition = self.model.dynamics(&self.gathered, &interval).transition();
        // The noise enters with a true rotation: an average of rotations is shorter than one.
        let attitude = self.strapdown.body_to_navigation();
        let mut noise = ProcessNoise {
            moving: sensor_noise_rate::<M>(&self.noise, attitude, G::VELOCITY_UP) * seconds,
            walk: self.walk * seconds,
        };
        if self.turn_noise > 0.0 {
            let variance = self.turned * (self.turn_noise.powi(2) * std::f64::consts::PI);
            let spread = attitude * Matrix3::from_diagonal(&variance) * attitude.transpose();
            let first = navigation::MISALIGNMENT_EAST;
            for (row, column) in (0..9).map(|element| (element / 3, element % 3)) {
                noise.moving[(first + row, first + column)] += spread[(row, column)];
            }
            self.turned = Vector3::zeros();
        }
        self.seconds = 0.0;
        self.gained = Vector3::zeros();
        self.gathered = G::Gathered::default();
        self.kalman
            .propagate(&transition, &noise)
            .map_err(name_state::<G, M, N>)
    }

    /// Updates with scalar measurements one after the other, and closes the loop where it is closed.
    pub fn update<const K: usize>(&mut self, measurements: &[Measurement<N>; K]) -> [Outcome; K] {
        let outcomes = measurements
            .each_ref()
            .map(|measurement| self.kalman.update(measurement));
        self.conclude(outcomes, [true; K])
    }

    /// Closes the loop where it is closed, and counts what became of those measurements that this filter can make.
    fn conclude<const K: usize>(
        &mut self,
        mut outcomes: [Outcome; K],
        can_make: [bool; K],
    ) -> [Outcome; K] {
        if self.feedback == Loop::Closed && !self.feed_back() {
            outcomes = [Outcome::Refused; K];
        }
        for (outcome, _) in outcomes.iter().zip(can_make).filter(|(_, can)| *can) {
            self.counts.count(outcome);
        }
        outcomes
    }

    /// White noise of the sensors.
    pub fn noise(&self) -> &NoiseDensity {
        &self.noise
    }

    /// What has been found of the table, its base and the antenna.
    pub fn installation(&self) -> &Installation {
        &self.installation
    }

    /// What became of the measurements so far.
    pub fn counts(&self) -> UpdateCounts {
        self.counts
    }

    /// Takes the estimated errors out of the mechanization and closes the loop from here on.
    pub fn close_loop(&mut self) {
        self.feed_back();
        self.feedback = Loop::Closed;
    }

    /// Says whether the sensor model could take what was estimated; nothing is fed back where it could not.
    fn feed_back(&mut self) -> bool {
        let x = self.kalman.take_state();
        let mut errors = *self.compensator.compensation().errors();
        G::correct_sensors(&x, &mut errors);
        let Ok(compensation) = errors.compensation() else {
            return false;
        };
        self.compensator.set(compensation);
        G::correct_navigation(&x, &mut self.strapdown);
        G::correct_installation(&x, &mut self.installation);
        true
    }

    /// Replaces what is known of the sensors, from outside. The covariance stays.
    ///
    /// # Errors
    /// [`Error::Setting`] where the sensor errors cannot be inverted.
    pub fn set_sensor_errors(&mut self, errors: &SensorErrors) -> Result<(), Error> {
        self.compensator.set(errors.compensation()?);
        Ok(())
    }

    /// Attitude, velocity and position, as the mechanization has them.
    pub fn navigation(&self) -> &NavigationState {
        self.strapdown.state()
    }

    /// What is taken out of the samples.
    pub fn compensation(&self) -> &Compensation {
        self.compensator.compensation()
    }

    /// The sensor errors: what has been fed back plus what the state holds.
    pub fn sensor_errors(&self) -> SensorErrors {
        let mut errors = *self.compensator.compensation().errors();
        G::correct_sensors(self.kalman.state(), &mut errors);
        errors
    }

    /// The state vector with the sensor errors whole: navigation errors not yet fed back, and sensor errors since the start.
    pub fn state(&self) -> SVector<f64, N> {
        G::found(self.compensator.compensation().errors(), &self.installation) + self.kalman.state()
    }

    /// Covariance of the state.
    pub fn covariance(&self) -> &SMatrix<f64, N, N> {
        self.kalman.covariance()
    }

    /// One-sigma of the state.
    pub fn sigma(&self) -> SVector<f64, N> {
        self.kalman.sigma()
    }

    /// State and covariance with their names.
    pub fn estimate(&self) -> StateEstimate {
        StateEstimate::of_filter(&self.shown, &self.state(), self.kalman.covariance())
    }

    /// Covariance with the names of the states.
    pub fn named_covariance(&self) -> NamedCovariance {
        NamedCovariance::of_filter(&self.shown, self.kalman.covariance())
    }
}

/// The states that the outside sees: those of navigation, and of the others those of which something is not known. They come as
/// files have them: navigation, sensors, table, vertical channel, base.
fn shown<G: Model<M, N>, const M: usize, const N: usize>(covariance: &SMatrix<f64, N, N>) -> Shown {
    let (first, base) = (navigation::NAVIGATION_STATES, G::BASE.unwrap_or(N));
    let order = (0..first).chain(M..base).chain(first..M).chain(base..N);
    let positions: Vec<usize> = order
        .filter(|state| *state < first || covariance[(*state, *state)] > 0.0)
        .collect();
    Shown::new(G::LIST, &positions)
}

/// The error with the name of the state in it.
fn name_state<G: Model<M, N>, const M: usize, const N: usize>(error: Error) -> Error {
    match error {
        Error::Variance { state, value } => Error::Diverged {
            state: G::STATES[state.min(N - 1)].name,
            variance: value,
        },
        other => other,
    }
}
