//! The filter round the mechanization: increments in, velocity measurements in, a corrected state and its covariance out.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::error_state::{
    BIAS, DRIFT, LATITUDE, LONGITUDE, Linearization, MISALIGNMENT, StateMatrix, StateVector,
    VELOCITY,
};
use super::kalman::{Innovation, Kalman};
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::Increment;
use crate::sensor::sample::NoiseDensity;
pub use crate::sensor::velocity::VelocityMeasurement;

/// Initial one-sigma of the error states.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// The diagonal P0 at a place.
    pub fn covariance(&self, place: &NavigationState) -> StateMatrix {
        let earth =
            crate::earth::LocalEarth::at(place.position.latitude_rad, place.position.height_m);
        let mut sigma = StateVector::zeros();
        sigma[LATITUDE] = self.position_m / earth.meridian_radius_m;
        sigma[LONGITUDE] = self.position_m / (earth.transverse_radius_m * earth.cos_latitude);
        sigma.fixed_rows_mut::<2>(VELOCITY).fill(self.velocity_m_s);
        sigma
            .fixed_rows_mut::<3>(MISALIGNMENT)
            .copy_from(&self.misalignment_rad);
        sigma
            .fixed_rows_mut::<3>(BIAS)
            .copy_from(&self.accelerometer_bias_m_s2);
        sigma
            .fixed_rows_mut::<3>(DRIFT)
            .copy_from(&self.gyroscope_drift_rad_s);
        StateMatrix::from_diagonal(&sigma.component_mul(&sigma))
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

/// Whether estimated errors go back into the mechanization after every update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loop {
    /// They stay in the state vector; the mechanization runs free.
    Open,
    /// They are taken out of attitude, velocity, position and sensors at once.
    Closed,
}

/// The error filter and the mechanization it belongs to.
#[derive(Clone, Debug)]
pub struct ErrorFilter {
    strapdown: Strapdown,
    kalman: Kalman<13>,
    gyroscope_drift: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
    noise: NoiseDensity,
    feedback: Loop,
    interval: Accumulated,
}

/// What the transition needs of the time since the last covariance step.
#[derive(Clone, Copy, Debug)]
struct Accumulated {
    seconds: f64,
    /// ∫ C_b^n dt \[s\].
    attitude: Matrix3<f64>,
    /// ∫ fⁿ dt \[m/s\].
    velocity: Vector3<f64>,
}

impl Accumulated {
    const ZERO: Self = Self {
        seconds: 0.0,
        attitude: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        velocity: Vector3::new(0.0, 0.0, 0.0),
    };
}

impl ErrorFilter {
    /// Starts at a navigation state with the sensor errors assumed zero and their uncertainty in `covariance`.
    pub fn new(
        start: NavigationState,
        covariance: StateMatrix,
        noise: NoiseDensity,
        feedback: Loop,
    ) -> Self {
        Self {
            strapdown: Strapdown::new(start),
            kalman: Kalman {
                state: StateVector::zeros(),
                covariance,
            },
            gyroscope_drift: Vector3::zeros(),
            accelerometer_bias: Vector3::zeros(),
            noise,
            feedback,
            interval: Accumulated::ZERO,
        }
    }

    /// Runs the mechanization over one sampling interval. The covariance waits for [`Self::step`].
    pub fn propagate(&mut self, increment: &Increment) {
        let before = *self.strapdown.body_to_navigation();
        let gained = self
            .strapdown
            .propagate(&increment.without(&self.gyroscope_drift, &self.accelerometer_bias));
        self.interval.seconds += increment.interval_s;
        self.interval.attitude +=
            (before + self.strapdown.body_to_navigation()) * (0.5 * increment.interval_s);
        self.interval.velocity += gained;
    }

    /// Time since the last covariance step \[s\].
    pub fn pending_s(&self) -> f64 {
        self.interval.seconds
    }

    /// Brings the covariance up to the mechanization: Φ = I + A + A²/2 with A = ∫F dt accumulated over the interval, noise
    /// by the trapezoid (G q Gᵀ + Φ G q Gᵀ Φᵀ) T/2.
    pub fn step(&mut self) {
        let seconds = self.interval.seconds;
        if seconds <= 0.0 {
            return;
        }
        let linearization = Linearization {
            earth: *self.strapdown.earth(),
            velocity: self.strapdown.state().velocity,
            specific_force: self.interval.velocity / seconds,
            body_to_navigation: self.interval.attitude / seconds,
        };
        let transition = linearization.transition(seconds);
        // The noise enters with a true rotation: an average of rotations is shorter than one.
        let noise = Linearization {
            body_to_navigation: *self.strapdown.body_to_navigation(),
            ..linearization
        }
        .process_noise_rate(&self.noise)
            * (0.5 * seconds);
        self.kalman.covariance += noise;
        self.kalman.propagate(&transition, &noise);
        self.interval = Accumulated::ZERO;
    }

    /// Measures the velocity error, east and then north (equations 28 and 29), and closes the loop where it is closed.
    pub fn update_velocity(&mut self, measurement: &VelocityMeasurement) -> [Innovation; 2] {
        let velocity = self.strapdown.state().velocity;
        let innovations = [0, 1].map(|axis| {
            let error = velocity[axis] - measurement.east_north[axis];
            self.kalman
                .update(VELOCITY + axis, error, measurement.sigma[axis].powi(2))
        });
        if self.feedback == Loop::Closed {
            self.feed_back();
        }
        innovations
    }

    /// Takes the estimated errors out of the mechanization and closes the loop from here on.
    pub fn close_loop(&mut self) {
        self.feed_back();
        self.feedback = Loop::Closed;
    }

    fn feed_back(&mut self) {
        let x = std::mem::replace(&mut self.kalman.state, StateVector::zeros());
        self.strapdown.correct(
            &x.fixed_rows::<3>(MISALIGNMENT).into_owned(),
            &Vector3::new(x[VELOCITY], x[VELOCITY + 1], 0.0),
            [x[LATITUDE], x[LONGITUDE]],
        );
        self.accelerometer_bias += x.fixed_rows::<3>(BIAS);
        self.gyroscope_drift += x.fixed_rows::<3>(DRIFT);
    }

    /// A hole of `seconds` in the samples was bridged: the increments at its ends are no neighbours, and the attitude and
    /// velocity gained in it are uncertain by `angle_sigma` \[rad\] and `velocity_sigma` \[m/s\].
    pub fn bridge(&mut self, angle_sigma: f64, velocity_sigma: f64) {
        self.strapdown.break_stream();
        for i in MISALIGNMENT..BIAS {
            self.kalman.covariance[(i, i)] += angle_sigma * angle_sigma;
        }
        for i in VELOCITY..MISALIGNMENT {
            self.kalman.covariance[(i, i)] += velocity_sigma * velocity_sigma;
        }
    }

    /// The same filter with sensor errors that are known already; the covariance says how well.
    #[must_use]
    pub fn with_sensor_errors(
        mut self,
        gyroscope_drift: Vector3<f64>,
        accelerometer_bias: Vector3<f64>,
    ) -> Self {
        self.gyroscope_drift = gyroscope_drift;
        self.accelerometer_bias = accelerometer_bias;
        self
    }

    /// Goes over a hole without integrating: what was turned in it is told from outside. What is known of the sensors, and
    /// its correlation with the misalignment, stays: a ship that keeps her attitude against the earth keeps φ.
    pub fn cross(&mut self, crossing: &Crossing) {
        self.step();
        let state = *self.strapdown.state();
        let turned = state.attitude * crossing.turn * state.attitude.inverse();
        let covariance = &mut self.kalman.covariance;
        for axis in 0..3 {
            let variance = crossing.misalignment_sigma_rad[axis].powi(2);
            covariance[(MISALIGNMENT + axis, MISALIGNMENT + axis)] += variance;
        }
        let (velocity_error, position_error) = if let Some(sigma) = crossing.rest_sigma_m_s {
            for i in VELOCITY..MISALIGNMENT {
                covariance.row_mut(i).fill(0.0);
                covariance.column_mut(i).fill(0.0);
                covariance[(i, i)] = sigma * sigma;
                self.kalman.state[i] = 0.0;
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
                (LATITUDE, VELOCITY + 1, to_angle[0]),
                (LONGITUDE, VELOCITY, to_angle[1]),
            ] {
                let variance = covariance[(velocity, velocity)] + grown;
                covariance[(position, position)] += variance * scale * scale;
                covariance[(velocity, velocity)] = variance;
            }
            let v = state.velocity;
            (Vector3::zeros(), [-v.y * to_angle[0], -v.x * to_angle[1]])
        };
        self.strapdown
            .correct(&turned.scaled_axis(), &velocity_error, position_error);
        self.strapdown.break_stream();
    }

    /// Attitude, velocity and position, as the mechanization has them.
    pub fn navigation(&self) -> &NavigationState {
        self.strapdown.state()
    }

    /// Gyroscope drift ε \[rad/s\]: what has been fed back plus what the state holds.
    pub fn gyroscope_drift(&self) -> Vector3<f64> {
        self.gyroscope_drift + self.kalman.state.fixed_rows::<3>(DRIFT)
    }

    /// Accelerometer bias ∇ \[m/s²\]: what has been fed back plus what the state holds.
    pub fn accelerometer_bias(&self) -> Vector3<f64> {
        self.accelerometer_bias + self.kalman.state.fixed_rows::<3>(BIAS)
    }

    /// The state vector with the sensor errors whole: δL, δλ, δv, φ not yet fed back, and ∇, ε since the start.
    pub fn state(&self) -> StateVector {
        let mut x = self.kalman.state;
        x.fixed_rows_mut::<3>(BIAS)
            .copy_from(&self.accelerometer_bias());
        x.fixed_rows_mut::<3>(DRIFT)
            .copy_from(&self.gyroscope_drift());
        x
    }

    /// Covariance of the state.
    pub fn covariance(&self) -> &StateMatrix {
        &self.kalman.covariance
    }

    /// One-sigma of the state.
    pub fn sigma(&self) -> StateVector {
        self.kalman.sigma()
    }
}
