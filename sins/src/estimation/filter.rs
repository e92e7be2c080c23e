//! The filter round the mechanization: increments in, velocity measurements in, a corrected state and its covariance out.

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::group::{Interval, Span};
use super::groups::bias::Bias;
use super::groups::navigation::{self, Navigation, sensor_noise_rate};
use super::groups::table::TableEstimate;
use super::kalman::{Kalman, ProcessNoise};
use super::measurement::{Measurement, Outcome, Row, UpdateCounts};
use super::model::{Model, Paper};
use super::state::{NamedCovariance, Shown, StateEstimate};
use crate::error::Error;
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::compensation::{Compensation, Compensator};
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::NoiseDensity;
pub use crate::sensor::velocity::VelocityMeasurement;
use crate::sensor::{Increment, PositionMeasurement};
use crate::table::{TableErrors, Turntable};

/// Initial one-sigma of the paper's states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InitialUncertainty {
    /// Horizontal position, each axis \[m\].
    pub position_m: f64,
    /// Horizontal velocity, each axis \[m/s\].
    pub velocity_m_s: f64,
    /// Misalignment about E, N, U \[rad\].
    pub misalignment_rad: Vector3<f64>,
    /// Accelerometer bias, block axes \[m/s²\].
    pub accelerometer_bias_m_s2: Vector3<f64>,
    /// Gyroscope drift, block axes \[rad/s\].
    pub gyroscope_drift_rad_s: Vector3<f64>,
}

impl InitialUncertainty {
    /// The paper's model with these priors and sensor errors that do not walk.
    pub fn model(&self) -> Paper {
        Paper {
            navigation: Navigation {
                position_m: self.position_m,
                velocity_m_s: self.velocity_m_s,
                misalignment_rad: self.misalignment_rad,
            },
            bias: Bias {
                accelerometer_bias_m_s2: self.accelerometer_bias_m_s2,
                gyroscope_drift_rad_s: self.gyroscope_drift_rad_s,
                accelerometer_walk_m_s2_sqrt_s: 0.0,
                gyroscope_walk_rad_s_sqrt_s: 0.0,
            },
        }
    }
}

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

/// Where the antenna of a position is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntennaArm {
    /// From the table's centre, in the axes that the block has at zero joints: starboard, forward, up \[m\].
    pub from_table_centre_m: Vector3<f64>,
    /// Turns those axes into n.
    pub ship: UnitQuaternion<f64>,
}

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
    table: TableEstimate,
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
            table: TableEstimate::default(),
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
        self.table.errors = errors;
        self
    }

    /// Begins with what was known of the antenna's arm beyond what was told.
    #[must_use]
    pub fn with_antenna(mut self, arm_m: Vector3<f64>) -> Self {
        self.table.antenna_arm_m = arm_m;
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
        if let Some(base) = &self.table.base
            && !((base.norm() - 1.0).abs() < 1e-6)
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
        let mut outcomes = measurements
            .each_ref()
            .map(|measurement| self.kalman.update(measurement));
        if self.feedback == Loop::Closed && !self.feed_back() {
            outcomes = [Outcome::Refused; K];
        }
        for outcome in &outcomes {
            self.counts.count(outcome);
        }
        outcomes
    }

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

    /// Measures where the antenna is: z = (p + C_v^n l) − p̃ in metres east, north and, with a vertical channel and a known
    /// sigma, up; l is the antenna's arm in the ship, what has been found of it added, and `ship` how she stands (v to n). An error φ of the attitude turns the arm
    /// by −φ × (C l). A position that is older than the state by `age_s` is carried on by the velocity. Where any component lies
    /// beyond the gate none is taken.
    pub fn update_position(
        &mut self,
        measurement: &PositionMeasurement,
        age_s: f64,
        arm: &AntennaArm,
        gate: Option<f64>,
    ) -> [Outcome; 3] {
        let state = self.strapdown.state();
        let earth = self.strapdown.earth();
        let lever = arm.ship * (arm.from_table_centre_m + self.table.antenna_arm_m);
        let ship = arm.ship.to_rotation_matrix().into_inner();
        let there = measurement.position;
        let scale = [
            earth.transverse_radius_m * earth.cos_latitude,
            earth.meridian_radius_m,
        ];
        let here = &state.position;
        let apart = Vector3::new(
            (here.longitude_rad - there.longitude_rad) * scale[0],
            (here.latitude_rad - there.latitude_rad) * scale[1],
            here.height_m - there.height_m,
        );
        let error = apart + lever - state.velocity * age_s;
        let turned = lever.cross_matrix();
        let height = G::VELOCITY_UP.map(|up| up - 1);
        let rows = [
            Some((navigation::LONGITUDE, scale[0])),
            Some((navigation::LATITUDE, scale[1])),
            height.map(|height| (height, 1.0)),
        ];
        let measurements: [Option<Measurement<N>>; 3] = std::array::from_fn(|axis| {
            let sigma = measurement.sigma_m[axis];
            let direct = rows[axis].filter(|_| sigma > 0.0)?;
            let by_attitude =
                (0..3).map(|k| (navigation::MISALIGNMENT_EAST + k, turned[(axis, k)]));
            let by_arm = G::ANTENNA
                .into_iter()
                .flat_map(|first| (0..3).map(move |k| (first + k, -ship[(axis, k)])));
            let row = Row::new(std::iter::once(direct).chain(by_attitude).chain(by_arm));
            Some(Measurement::new(row, error[axis], sigma * sigma))
        });
        let beyond = measurements.iter().flatten().find_map(|measurement| {
            let innovation = self.kalman.innovation(measurement)?;
            gate.filter(|gate| innovation.normalized_squared() > *gate)
                .map(|_| innovation)
        });
        let mut outcomes = measurements.map(|measurement| match (measurement, beyond) {
            (None, _) => Outcome::Refused,
            (Some(_), Some(innovation)) => Outcome::Gated(innovation),
            (Some(measurement), None) => self.kalman.update(&measurement),
        });
        if self.feedback == Loop::Closed && !self.feed_back() {
            outcomes = [Outcome::Refused; 3];
        }
        for (outcome, row) in outcomes.iter().zip(rows) {
            if row.is_some() {
                self.counts.count(outcome);
            }
        }
        outcomes
    }

    /// Measures by the encoders how the block stands in the base: z = C_n^b (ψ − φ) + D x, about the outer axis, the inner
    /// one and the one across, with the table's errors x and D their derivatives
    /// ([`AttitudeDerivatives`](crate::table::AttitudeDerivatives)). The first reading says how the base stands. A filter
    /// without the table's groups refuses.
    pub fn update_encoders(&mut self, reading: &EncoderReading, gate: Option<f64>) -> [Outcome; 3] {
        let (Some(table), Some(base)) = (G::TABLE, G::BASE) else {
            return [Outcome::Refused; 3];
        };
        let errors = &self.table.errors;
        let in_base = reading.turntable.attitude_with(reading.angles, errors);
        let attitude = self.strapdown.state().attitude;
        let stands = if let Some(stands) = self.table.base {
            stands
        } else {
            for state in base..base + 3 {
                self.kalman.forget(state, UNKNOWN_BASE_RAD.powi(2));
            }
            self.shown = shown::<G, M, N>(self.kalman.covariance());
            *self.table.base.insert(attitude * in_base.inverse())
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
        if let (Some(base), Some(_)) = (G::BASE, self.table.base.take()) {
            for state in base..base + 3 {
                self.kalman.forget(state, 0.0);
            }
            self.set_base_walk(0.0);
            self.shown = shown::<G, M, N>(self.kalman.covariance());
        }
    }

    /// White noise of the sensors.
    pub fn noise(&self) -> &NoiseDensity {
        &self.noise
    }

    /// What has been found of the table and its base.
    pub fn table(&self) -> &TableEstimate {
        &self.table
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
        G::correct_table(&x, &mut self.table);
        true
    }

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
        G::found(self.compensator.compensation().errors(), &self.table) + self.kalman.state()
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
