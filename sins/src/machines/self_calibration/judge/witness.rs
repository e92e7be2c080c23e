//! A second filter beside the one that is judged: the whole model on the same samples, that takes nothing of the fix, and learns
//! from its own innovations how the ship moves.
//!
//! The filter that is judged takes a ship that lies still to a tenth of a millimetre a second for one that moves by a centimetre: its
//! innovations are a hundredth of what it expects, so they cannot speak against it. This one follows the level of its innovations
//! while the block rests (not below [`STILLEST_M_S`]), and is sharper by what the ship is stiller than was said.
//!
//! It begins anew once, after [`RESTART_S`]: about the attitude, drifts and biases that it has found by then, with the
//! uncertainty of the beginning. What it says then does not hang on a linearization about a wrong azimuth or a great drift.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use serde_big_array::BigArray;

use super::super::beginning::TOLD_ARM_M;
use super::super::ship_motion::ShipMotion;
use super::super::{ModelChoice, Reference, Settings};
use super::left_out::{self, LeftOut, Single};
use super::turns::Turns;
use crate::error::Error;
use crate::estimation::filter::{AntennaArm, InitialUncertainty, Loop, VelocityMeasurement};
use crate::estimation::grade::{Grade, GroupPriors, azimuth_prior_rad};
use crate::estimation::measurement::Outcome;
use crate::estimation::model::{CALIBRATED_NAMES, Model, Whole, WholeFilter};
use crate::estimation::state::positions;
use crate::machines::unseen_motion::Passage;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::{Increment, NoiseDensity, PositionMeasurement, SensorErrors};
use crate::stream::Interval;

/// Samples are gathered over this before they are integrated \[s\].
const GATHERED_S: f64 = 0.1;
/// Samples farther apart than this do not tell how a turn begins and ends \[s\]: at 2 Hz the corners of a trapezoid alone are
/// 0.15 ms of delay, at 25 sigma of what the witness knows.
const COARSE_S: f64 = 0.15;
/// No ship is taken to lie stiller than this \[m/s\].
pub(super) const STILLEST_M_S: f64 = 1e-4;
/// One-sigma of the latitude before: nothing is taken of the fix \[m\].
const UNKNOWN_PLACE_M: f64 = 3_000.0;
/// One-sigma of the height before: normal gravity may be off by 0.1 cm/s², as real gravity is \[m\].
const UNKNOWN_HEIGHT_M: f64 = 300.0;
/// When it begins anew \[s\].
pub(super) const RESTART_S: f64 = 1500.0;
/// It does so again, at most [`MOST_RESTARTS`] times and so far apart \[s\], ...
const AGAIN_S: f64 = 600.0;
const MOST_RESTARTS: u32 = 4;
/// ... where a drift has moved by more than this from the point about which it is linear \[rad/s\].
const MOVED_RAD_S: f64 = 1e-7;
/// One-sigma of level and azimuth when it does \[rad\].
const FOUND_RAD: [f64; 2] = [1e-3, 2e-3];
/// Innovations are counted so long after it began anew \[s\].
const COUNTED_AFTER_S: f64 = 600.0;
/// Velocity of a filter that begins anew, one-sigma \[m/s\].
const VELOCITY_M_S: f64 = 0.1;

const NINE: [usize; 9] = positions(Whole::LIST, CALIBRATED_NAMES);

/// What the witness says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Testimony {
    /// Attitude of the block.
    pub attitude: UnitQuaternion<f64>,
    /// Misalignment (what has not been fed back), biases, drifts.
    pub nine: [f64; 9],
    /// Their one-sigmas.
    pub sigmas: [f64; 9],
    /// How the ship moves, east, north, up \[m/s\].
    pub level_m_s: [f64; 3],
    /// Innovations after turns and far from them.
    pub turns: Turns,
    /// What the model that is judged leaves out.
    pub left_out: LeftOut,
    /// Samples come so far apart that the mechanization itself is off while the block turns.
    pub is_coarse: bool,
}

/// What ends a covariance step.
#[derive(Clone, Copy, Debug)]
pub(in crate::machines::self_calibration) enum Seen<'a> {
    /// No measurement.
    Nothing,
    /// A velocity over ground.
    Velocity(&'a VelocityMeasurement),
    /// A position, its age \[s\], the antenna's arm, and the gate.
    Position(&'a PositionMeasurement, f64, &'a AntennaArm, Option<f64>),
}

/// The second filter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::machines::self_calibration) struct Witness {
    filter: Box<WholeFilter>,
    gathered: Increment,
    is_coarse: bool,
    groups: GroupPriors,
    initial: InitialUncertainty,
    noise: NoiseDensity,
    /// Latitude by the filter that is judged, which takes it from the fix \[rad\].
    told_rad: f64,
    /// The latitude is measured all the time.
    is_positioned: bool,
    model: ModelChoice,
    #[serde(with = "BigArray")]
    prior: [f64; Whole::N],
    motion: ShipMotion,
    seconds: f64,
    /// Drift about which it is linear.
    linear_about: Vector3<f64>,
    restarts: u32,
    next_restart_s: f64,
    counted_from_s: f64,
    turns: Turns,
    left_out: LeftOut,
    next_look_s: f64,
}

impl Witness {
    /// Begins where the filter that is judged begins.
    pub(in crate::machines::self_calibration) fn new(
        place: NavigationState,
        noise: NoiseDensity,
        settings: &Settings,
        reference: Reference,
        starting_m_s: f64,
    ) -> Result<Self, Error> {
        let grade = settings.grade.unwrap_or_else(|| Grade::of_noise(&noise));
        let mut initial = settings.prior;
        let [drift, bias] = grade.drift_and_bias();
        initial.gyroscope_drift_rad_s.apply(|s| *s = s.max(drift));
        initial.accelerometer_bias_m_s2.apply(|s| *s = s.max(bias));
        let is_positioned = matches!(reference, Reference::Position { .. });
        if !is_positioned {
            initial.position_m = UNKNOWN_PLACE_M;
        }
        let cos_latitude = place.position.latitude_rad.cos();
        let azimuth = azimuth_prior_rad(&initial.gyroscope_drift_rad_s, cos_latitude);
        initial.misalignment_rad.z = initial.misalignment_rad.z.max(azimuth);
        let mut groups = match settings.model {
            ModelChoice::Whole => settings.groups,
            ModelChoice::Paper => GroupPriors::BY_GRADE,
        }
        .resolved(grade);
        if is_positioned {
            if settings.antenna.arm_m != Vector3::zeros() {
                groups.antenna_arm_m = groups.antenna_arm_m.min(TOLD_ARM_M);
            }
        } else {
            groups.height_m = groups.height_m.max(UNKNOWN_HEIGHT_M);
            groups.antenna_arm_m = 0.0;
        }
        // It does not look at the encoders: they are the other's witnesses.
        groups.table_nonorthogonality_rad = 0.0;
        groups.inner_axis_tilt_rad = 0.0;
        groups.encoder_zero_rad = 0.0;
        groups.encoder_eccentricity_rad = 0.0;
        let (filter, prior) = begin(
            &groups,
            &initial,
            place,
            &SensorErrors::default(),
            noise,
            Loop::Open,
        )?;
        Ok(Self {
            filter,
            gathered: NOTHING,
            is_coarse: false,
            groups,
            initial,
            noise,
            told_rad: place.position.latitude_rad,
            is_positioned,
            model: settings.model,
            prior,
            motion: ShipMotion::new(starting_m_s.max(STARTING_M_S), STILLEST_M_S),
            seconds: 0.0,
            linear_about: Vector3::zeros(),
            restarts: 0,
            next_restart_s: RESTART_S,
            counted_from_s: f64::INFINITY,
            turns: Turns::new(place.attitude),
            left_out: LeftOut::default(),
            next_look_s: 0.0,
        })
    }

    /// See [`WholeFilter::check`].
    pub(in crate::machines::self_calibration) fn check(&self) -> Result<(), Error> {
        self.filter.check()
    }

    /// Goes over an interval as the judged filter does.
    #[inline]
    pub(in crate::machines::self_calibration) fn advance(
        &mut self,
        interval: &Interval,
        passage: Option<&Passage>,
    ) -> Result<(), Error> {
        match passage {
            Some(Passage::Bridged([angle, velocity])) => {
                self.flush();
                self.filter.bridge(*angle, *velocity);
            }
            Some(Passage::Held(crossing)) => {
                self.flush();
                return self.filter.cross(crossing);
            }
            None => {}
        }
        let increment = &interval.increment;
        self.is_coarse |= interval.hole.is_none() && increment.interval_s > COARSE_S;
        self.gathered.interval_s += increment.interval_s;
        self.gathered.angle += increment.angle;
        self.gathered.velocity += increment.velocity;
        if self.gathered.interval_s > GATHERED_S - 1e-6 {
            self.flush();
        }
        Ok(())
    }

    fn flush(&mut self) {
        if self.gathered.interval_s > 0.0 {
            self.filter.propagate(&self.gathered);
            self.gathered = NOTHING;
        }
    }

    /// See [`WholeFilter`].
    pub(in crate::machines::self_calibration) fn close_loop(&mut self) {
        self.filter.close_loop();
    }

    /// A covariance step, with an update where there is a measurement.
    pub(in crate::machines::self_calibration) fn step(
        &mut self,
        seen: Seen<'_>,
        latitude_rad: f64,
    ) -> Result<(), Error> {
        self.told_rad = latitude_rad;
        self.flush();
        let seconds = self.filter.pending_s();
        self.filter.step()?;
        if seconds <= 0.0 {
            return Ok(());
        }
        self.seconds += seconds;
        self.turns
            .turned(self.filter.navigation().attitude, seconds);
        match seen {
            Seen::Nothing => {}
            Seen::Velocity(measurement) => self.update(measurement, seconds),
            Seen::Position(measurement, age_s, arm, gate) => {
                let outcomes = self.filter.update_position(measurement, age_s, arm, gate);
                let normalized = outcomes.map(|outcome| match outcome {
                    Outcome::Accepted(found) => found.value / found.variance.sqrt(),
                    _ => 0.0,
                });
                self.count(normalized);
            }
        }
        if self.seconds > self.next_restart_s {
            self.next_restart_s += AGAIN_S;
            let drift = self.filter.sensor_errors().gyroscope_drift;
            let has_moved = (drift - self.linear_about).amax() > MOVED_RAD_S;
            if self.restarts == 0 || (has_moved && self.restarts < MOST_RESTARTS) {
                self.restart()?;
            }
        }
        if self.seconds >= self.next_look_s {
            self.next_look_s = self.seconds + left_out::PERIOD_S;
            self.left_out = LeftOut::look(&self.filter, &self.prior, self.told_rad, self.model);
            if self.is_positioned {
                self.left_out.latitude = Single::default();
            }
        }
        Ok(())
    }

    fn update(&mut self, measurement: &VelocityMeasurement, seconds: f64) {
        let mut normalized = [0.0; 3];
        for (axis, normalized) in normalized.iter_mut().enumerate() {
            let sigma = self.motion.sigma_m_s(axis);
            let outcome = match measurement.east_north.get(axis) {
                Some(velocity) => {
                    let variance = sigma.powi(2);
                    self.filter.update_velocity_axis(axis, *velocity, variance)
                }
                None => self.filter.update_vertical_velocity(0.0, sigma, None)[0],
            };
            let Some(innovation) = outcome.innovation() else {
                return;
            };
            *normalized = innovation.value / innovation.variance.sqrt();
            if self.turns.is_quiet() {
                self.motion.learn(axis, &innovation, sigma, seconds);
            }
        }
        self.count(normalized);
    }

    fn count(&mut self, normalized: [f64; 3]) {
        if self.seconds > self.counted_from_s {
            self.turns.count(normalized);
        }
    }

    /// Begins anew about what has been found.
    fn restart(&mut self) -> Result<(), Error> {
        self.restarts += 1;
        self.counted_from_s = self.seconds + COUNTED_AFTER_S;
        self.turns.forget();
        let mut place = *self.filter.navigation();
        if !self.is_positioned {
            place.position.latitude_rad = self.told_rad;
        }
        let found = self.filter.sensor_errors();
        self.linear_about = found.gyroscope_drift;
        let errors = SensorErrors::constant(found.gyroscope_drift, found.accelerometer_bias);
        let mut initial = self.initial;
        initial.velocity_m_s = VELOCITY_M_S;
        initial.misalignment_rad.x = FOUND_RAD[0];
        initial.misalignment_rad.y = FOUND_RAD[0];
        let azimuth = self.filter.sigma()[NINE[2]];
        initial.misalignment_rad.z = FOUND_RAD[1]
            .max(3.0 * azimuth)
            .min(initial.misalignment_rad.z);
        let (filter, prior) = begin(
            &self.groups,
            &initial,
            place,
            &errors,
            self.noise,
            Loop::Closed,
        )?;
        (self.filter, self.prior) = (filter, prior);
        Ok(())
    }

    /// What it has to say.
    pub(in crate::machines::self_calibration) fn testimony(&self) -> Testimony {
        let (state, sigma) = (self.filter.state(), self.filter.sigma());
        Testimony {
            attitude: self.filter.navigation().attitude,
            nine: NINE.map(|i| state[i]),
            sigmas: NINE.map(|i| sigma[i]),
            level_m_s: self.motion.sigmas_m_s(),
            turns: self.turns,
            left_out: self.left_out,
            is_coarse: self.is_coarse,
        }
    }
}

/// How a ship moves before anything has been seen of her \[m/s\].
const STARTING_M_S: f64 = 0.01;

const NOTHING: Increment = Increment {
    interval_s: 0.0,
    angle: Vector3::new(0.0, 0.0, 0.0),
    velocity: Vector3::new(0.0, 0.0, 0.0),
};

fn begin(
    groups: &GroupPriors,
    initial: &InitialUncertainty,
    place: NavigationState,
    errors: &SensorErrors,
    noise: NoiseDensity,
    feedback: Loop,
) -> Result<(Box<WholeFilter>, [f64; Whole::N]), Error> {
    let model = groups.model(initial);
    let covariance = model.initial_covariance(&place);
    let prior = std::array::from_fn(|state| covariance[(state, state)]);
    let filter = WholeFilter::new(model, place, errors, covariance, noise, feedback)?;
    Ok((Box::new(filter), prior))
}
