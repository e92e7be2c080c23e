//! The filter once it runs.

use std::sync::Arc;

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

use super::aiding::{Aiding, Due};
use super::encoders::Encoders;
use super::judge::{Finding, Joints, Judge, Looked, Seen, Witness};
use super::noise_at_rest::NoiseAtRest;
use super::rest::Rest;
use super::sensor_knowledge::SensorKnowledge;
use super::settings::Reference;
use super::ship_motion::ShipMotion;
use super::smoothing::Guide;
use super::{ModelChoice, Settings};
use crate::error::Error;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::filter::AntennaArm;
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::estimation::measurement::{Innovation, Outcome};
use crate::estimation::state::StateValues;
use crate::estimation::state::serialized::shared;
use crate::machines::unseen_motion::Passage;
use crate::sensor::VelocityMeasurement;
use crate::stream::joint_history::JointHistory;
use crate::stream::{Hole, Interval};
use crate::time::Stamp;

/// The judge's tests are made once in so many steps.
const LOOK_STEPS: u64 = 60;

/// What an interval brought.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Advance {
    /// A covariance step ended with it.
    pub(super) stepped: bool,
    /// A step was due and no velocity had come for it.
    pub(super) velocity_missing: bool,
    /// The way over a hole.
    pub(super) passage: Option<Passage>,
}

/// A filter whose azimuth was surer than this when the loop closed needs no second pass, one-sigma \[rad\]: with a drift that
/// explains such an azimuth, their product is below 0.004 deg/h.
const NEAR_RAD: f64 = 0.0175;
/// A pass that turns the azimuth of the one before it by less than this share of its sigma is the last one.
const STEADY: f64 = 0.3;

/// Mean normalized innovation squared of a pair above which the ship moves; a still one has two at most.
const MOVES: f64 = 4.0;

/// The filter with its aiding and its judge.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Running {
    pub(super) filter: AnyFilter,
    /// What it is linear about where this is not the first pass over a record.
    #[serde(skip)]
    pub(super) guide: Option<Arc<Guide>>,
    /// One-sigma of its states as a sensor of which nothing is known has them.
    pub(super) prior: StateValues,
    pub(super) start: Stamp,
    pub(super) last: Stamp,
    pub(super) aiding: Aiding,
    /// How the ship moves where she is taken to lie; none where that is measured.
    pub(super) motion: Option<ShipMotion>,
    pub(super) rest: Rest,
    pub(super) noise_at_rest: NoiseAtRest,
    pub(super) encoders: Encoders,
    pub(super) judge: Judge,
    /// Sum of the normalized innovations squared of the pairs, and their number.
    pub(super) normalized: (f64, u64),
    /// The filter beside.
    pub(super) witness: Option<Witness>,
    /// Joints against gyroscopes.
    pub(super) joints: Joints,
    /// What the judge's tests found.
    #[serde(with = "shared")]
    pub(super) findings: Arc<[Finding]>,
    /// One-sigma of the azimuth when the loop was closed \[rad\].
    pub(super) azimuth_rad: f64,
    pub(super) steps: u64,
    /// Attitude when fine alignment began; the turn from it begins calibration.
    pub(super) reference_attitude: UnitQuaternion<f64>,
    pub(super) turned: bool,
    /// Attitude of the ship when fine alignment began, by the joints and the table's axes as they are set.
    pub(super) reference_vehicle: UnitQuaternion<f64>,
}

impl Running {
    /// A filter that has seen nothing yet, with the prior of its states; nobody looks at it beside the innovations.
    pub(super) fn new(
        (filter, prior): (AnyFilter, StateValues),
        start: Stamp,
        aiding: Aiding,
        judge: Judge,
    ) -> Self {
        let attitude = filter.navigation().attitude;
        Self {
            filter,
            prior,
            guide: None,
            start,
            last: start,
            aiding,
            motion: None,
            rest: Rest::new(attitude),
            noise_at_rest: NoiseAtRest::default(),
            encoders: Encoders::default(),
            judge,
            normalized: (0.0, 0),
            witness: None,
            joints: Joints::default(),
            findings: Arc::default(),
            azimuth_rad: 0.0,
            steps: 0,
            reference_attitude: attitude,
            turned: false,
            reference_vehicle: attitude,
        }
    }

    /// Propagates, and at the end of a covariance step updates. Joints are given where they belong to this interval.
    ///
    /// # Errors
    /// As [`ErrorFilter::step`](crate::estimation::filter::ErrorFilter::step): the filter is of no more use.
    pub(super) fn advance(
        &mut self,
        interval: &Interval,
        settings: &Settings,
        joints: Option<&JointHistory>,
    ) -> Result<Advance, Error> {
        let reference = self.aiding.reference();
        let passage = interval.hole.as_ref().map(|hole| {
            let seen_m_s = self
                .motion
                .map_or(0.0, |motion| motion.sigma_m_s(0).max(motion.sigma_m_s(1)));
            passage(hole, settings, reference, seen_m_s)
        });
        if self.rest.is_quiet() {
            self.noise_at_rest
                .take(&interval.increment, interval.hole.is_some());
        } else {
            self.noise_at_rest.interrupt();
        }
        let mut held = false;
        match passage {
            Some(Passage::Bridged([angle, velocity])) => self.filter.bridge(angle, velocity),
            Some(Passage::Held(crossing)) => {
                self.filter.cross(&crossing)?;
                held = true;
            }
            None => {}
        }
        if !held {
            self.filter.propagate(&interval.increment);
        }
        if let Some(witness) = &mut self.witness {
            witness.advance(interval, passage.as_ref())?;
        }
        self.last = interval.stamp;
        let mut advance = Advance {
            passage,
            ..Advance::default()
        };
        let due = self.aiding.due(interval);
        if due == Due::Nothing {
            return Ok(advance);
        }
        let seconds = self.filter.pending_s();
        self.filter.step()?;
        let carried = self.filter.navigation().attitude;
        self.rest.turned(carried, seconds);
        match due {
            Due::Nothing => {}
            Due::Step => {
                advance.velocity_missing = true;
                self.ask_witness(Seen::Nothing)?;
            }
            Due::Update(measurement) => self.update_velocity(measurement, settings, seconds)?,
            Due::Position(position) => {
                let table = settings.turntable.attitude(position.angles);
                let arm = AntennaArm {
                    from_table_centre_m: settings.antenna.arm_m,
                    ship: carried * table.inverse(),
                };
                let measurement = &position.measurement;
                let behind_s = interval.stamp.seconds_since(measurement.stamp);
                let age_s = behind_s + settings.antenna.latency_s;
                self.ask_witness(Seen::Position(measurement, age_s, &arm, settings.gate()))?;
                let [east, north, _] =
                    self.filter
                        .update_position(measurement, age_s, &arm, settings.gate());
                self.judge_pair(&[east, north]);
            }
        }
        if let Some(guide) = &self.guide
            && let Some(navigation) = guide.at(interval.stamp)
        {
            self.filter.move_to(navigation);
        }
        if let (Some(joints), Some(accuracy)) = (joints, &settings.encoders) {
            let (stamp, turntable) = (interval.stamp, settings.turntable);
            self.encoders.take(
                stamp,
                &carried,
                joints,
                turntable,
                accuracy,
                &mut self.filter,
            );
        }
        self.filter.mark(interval.stamp);
        advance.stepped = true;
        let attitude = self.filter.believed().attitude;
        self.turned |= attitude.angle_to(&self.reference_attitude) > settings.turn_rad;
        if settings.witness {
            let lies = matches!(self.aiding.reference(), Reference::Moored { .. });
            if let Some(joints) = joints.filter(|_| lies) {
                let sigma = self.filter.largest_misalignment_sigma();
                let table = settings.turntable;
                self.joints
                    .take(interval.stamp, joints, table, &attitude, sigma);
            }
            self.steps += 1;
            if self.steps.is_multiple_of(LOOK_STEPS) {
                self.look(settings.model);
            }
        }
        Ok(advance)
    }

    /// Takes a velocity: one that was measured, or none at a mooring, give or take how the ship moves there.
    fn update_velocity(
        &mut self,
        mut measurement: VelocityMeasurement,
        settings: &Settings,
        seconds: f64,
    ) -> Result<(), Error> {
        if let Some(motion) = &self.motion {
            measurement.sigma = [motion.sigma_m_s(0), motion.sigma_m_s(1)];
        }
        let gate = match self.aiding.reference() {
            Reference::Measured { .. } => settings.gate(),
            _ => None,
        };
        self.ask_witness(Seen::Velocity(&measurement))?;
        let [east, north] = self.filter.update_velocity(&measurement, gate);
        self.judge_pair(&[east, north]);
        let mut outcomes = [Some(east), Some(north), None];
        if self.filter.has_vertical_channel() {
            let [x, y] = measurement.sigma;
            let sigma = self.motion.map_or(x.max(y), |motion| motion.sigma_m_s(2));
            let [up] = self.filter.update_vertical_velocity(0.0, sigma, None);
            outcomes[2] = Some(up);
        }
        self.learn_motion(&outcomes, seconds);
        Ok(())
    }

    /// Refuses what no filter of these settings holds.
    pub(super) fn check(&self, settings: &Settings) -> Result<(), Error> {
        let is_model = match settings.model {
            ModelChoice::Paper => matches!(self.filter, AnyFilter::Paper(_)),
            ModelChoice::Whole => matches!(self.filter, AnyFilter::Whole(_)),
        };
        if !(is_model && self.aiding.has_period(settings.step_s)) {
            return Err(Error::Snapshot {
                reason: "its filter is not that of its settings".to_owned(),
            });
        }
        self.filter.check()?;
        self.witness.as_ref().map_or(Ok(()), Witness::check)
    }

    fn ask_witness(&mut self, seen: Seen<'_>) -> Result<(), Error> {
        let latitude_rad = self.filter.navigation().position.latitude_rad;
        self.witness
            .as_mut()
            .map_or(Ok(()), |witness| witness.step(seen, latitude_rad))
    }

    /// Makes the judge's tests.
    fn look(&mut self, model: ModelChoice) {
        let states = self.filter.estimate_about_believed();
        let testimony = self.witness.as_ref().map(Witness::testimony);
        let looked = Looked {
            testimony: testimony.as_ref(),
            joints: &self.joints,
            filter: &self.filter,
            states: &states,
            prior: &self.prior,
            linearity: self.linearity(),
            attitude: self.filter.believed().attitude,
            model,
            turned: self.turned,
            // A ship that moves makes noise of her own.
            noisiest: match self.motion {
                Some(motion) if !motion.is_above_floor() => {
                    self.noise_at_rest.against(self.filter.noise())
                }
                _ => None,
            },
        };
        self.findings = looked.findings().into();
    }

    /// Whether it began near enough: how uncertain the azimuth was, about which it is linear. Of another pass that is what the
    /// one before it left, and by how much this one has turned it.
    pub(super) fn linearity(&self) -> Finding {
        let figure = self.guide.as_ref().map_or(self.azimuth_rad, |guide| {
            self.azimuth_turned_rad().hypot(guide.azimuth_sigma_rad)
        });
        Finding::linearity(figure)
    }

    /// By how much it has turned the azimuth about which it is linear \[rad\].
    fn azimuth_turned_rad(&self) -> f64 {
        let linear_about = self.filter.navigation().attitude;
        let turned = self.filter.believed().attitude * linear_about.inverse();
        turned.scaled_axis().z.abs()
    }

    /// Whether another pass would be about another point.
    pub(super) fn wants_another_pass(&self) -> bool {
        if self.guide.is_some() {
            self.azimuth_turned_rad() > STEADY * self.azimuth_sigma_rad()
        } else {
            self.azimuth_rad > NEAR_RAD
        }
    }

    /// One-sigma of the azimuth \[rad\].
    pub(super) fn azimuth_sigma_rad(&self) -> f64 {
        let covariance = self.filter.named_covariance();
        covariance.sigma(MISALIGNMENT[2]).unwrap_or(f64::NAN)
    }

    /// The innovations of a pair; one of which a component was left out says nothing.
    fn judge_pair(&mut self, outcomes: &[Outcome; 2]) {
        if let [Outcome::Accepted(east), Outcome::Accepted(north)] = outcomes {
            let normalized = [east, north].map(Innovation::normalized_squared);
            let sum = normalized.iter().sum::<f64>();
            self.normalized.0 += sum;
            self.normalized.1 += 1;
            self.judge.take(sum);
        }
    }

    /// The level of the innovations at rest is that of the ship's motion.
    fn learn_motion(&mut self, outcomes: &[Option<Outcome>; 3], seconds: f64) {
        let Some(motion) = &mut self.motion else {
            return;
        };
        if !self.rest.is_quiet() {
            return;
        }
        let used = motion.sigmas_m_s();
        for (axis, outcome) in outcomes.iter().enumerate() {
            if let Some(innovation) = outcome.and_then(|outcome| outcome.innovation()) {
                motion.learn(axis, &innovation, used[axis], seconds);
            }
        }
    }

    /// Whether the innovations say that the ship does not lie as still as the reference takes her to: their mean is well above
    /// the two of a pair. (Of a filter that does not follow her motion.)
    pub(super) fn moves(&self) -> bool {
        let (sum, count) = self.normalized;
        sum > MOVES * count as f64
    }

    /// What it knows of the sensors.
    pub(super) fn knowledge(&self) -> SensorKnowledge {
        SensorKnowledge::of(&self.filter, self.last, self.turned)
    }
}

/// The way over a hole in the samples, of a ship that was seen to move with a sigma of `seen_m_s`.
fn passage(hole: &Hole, settings: &Settings, reference: Reference, seen_m_s: f64) -> Passage {
    let (unseen, turntable) = (&settings.unseen, &settings.turntable);
    match reference {
        Reference::Moored { sigma_m_s } | Reference::Auto { sigma_m_s, .. } => {
            unseen.moored(hole, turntable, sigma_m_s.max(seen_m_s))
        }
        Reference::Measured { .. } | Reference::Position { .. } => {
            unseen.under_way(hole, turntable, settings.restart_gap_s)
        }
    }
}
