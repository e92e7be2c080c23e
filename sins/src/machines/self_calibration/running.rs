//! The filter once it runs.

use std::sync::Arc;

use nalgebra::UnitQuaternion;

use super::aiding::{Aiding, Due};
use super::encoders::Encoders;
use super::judge::{Finding, Joints, Judge, Looked, Witness};
use super::sensor_knowledge::SensorKnowledge;
use super::settings::Reference;
use super::{ModelChoice, Settings};
use crate::error::Error;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::estimation::measurement::{Innovation, Outcome};
use crate::estimation::state::NamedCovariance;
use crate::machines::unseen_motion::Passage;
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

/// The filter with its aiding and its judge.
#[derive(Clone, Debug)]
pub(super) struct Running {
    pub(super) filter: AnyFilter,
    pub(super) start: Stamp,
    pub(super) last: Stamp,
    pub(super) aiding: Aiding,
    pub(super) encoders: Encoders,
    pub(super) judge: Judge,
    /// The filter beside.
    pub(super) witness: Option<Witness>,
    /// Joints against gyroscopes.
    pub(super) joints: Joints,
    /// What the judge's tests found.
    pub(super) findings: Arc<[Finding]>,
    /// The covariance that the first alignment began with.
    pub(super) prior: NamedCovariance,
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
        let passage = interval.hole.as_ref().map(|hole| passage(hole, settings));
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
            match &passage {
                Some(Passage::Bridged([angle, velocity])) => witness.bridge(*angle, *velocity),
                Some(Passage::Held(crossing)) => witness.cross(crossing)?,
                None => {}
            }
            if !held {
                witness.propagate(&interval.increment);
            }
        }
        self.last = interval.stamp;
        let mut advance = Advance {
            passage,
            ..Advance::default()
        };
        match self.aiding.due(interval) {
            Due::Nothing => return Ok(advance),
            Due::Step => {
                self.filter.step()?;
                if let Some(witness) = &mut self.witness {
                    witness.step(None)?;
                }
                advance.velocity_missing = true;
            }
            Due::Update(measurement) => {
                self.filter.step()?;
                if let Some(witness) = &mut self.witness {
                    witness.step(Some(&measurement))?;
                }
                let outcomes = self.filter.update_velocity(&measurement, None);
                // A component that was left out says nothing of the pair.
                if let [Some(east), Some(north)] = outcomes.each_ref().map(Outcome::innovation) {
                    let normalized = [east, north].map(|i| Innovation::normalized_squared(&i));
                    self.judge.take(normalized.iter().sum());
                }
                if self.filter.has_vertical_channel() {
                    let sigma = measurement.sigma[0].max(measurement.sigma[1]);
                    self.filter.update_vertical_velocity(0.0, sigma, None);
                }
            }
        }
        if let (Some(joints), Some(accuracy)) = (joints, &settings.encoders) {
            let (stamp, turntable) = (interval.stamp, settings.turntable);
            self.encoders
                .take(stamp, joints, turntable, accuracy, &mut self.filter);
        }
        advance.stepped = true;
        let attitude = self.filter.navigation().attitude;
        self.turned |= attitude.angle_to(&self.reference_attitude) > settings.turn_rad;
        if settings.witness {
            if let Some(joints) = joints {
                let sigma = self.filter.largest_misalignment_sigma();
                let table = settings.turntable;
                self.joints
                    .take(interval.stamp, joints, table, &attitude, sigma);
            }
            self.steps += 1;
            if self.steps % LOOK_STEPS == 0 {
                self.look(settings.model);
            }
        }
        Ok(advance)
    }

    /// Makes the judge's tests.
    pub(super) fn look(&mut self, model: ModelChoice) {
        let states = self.filter.estimate();
        let testimony = self.witness.as_ref().map(Witness::testimony);
        let looked = Looked {
            testimony: testimony.as_ref(),
            joints: &self.joints,
            filter: &self.filter,
            states: &states,
            prior: Some(&self.prior),
            azimuth_rad: self.azimuth_rad,
            model,
            turned: self.turned,
        };
        self.findings = looked.findings().into();
    }

    /// One-sigma of the azimuth \[rad\].
    pub(super) fn azimuth_sigma_rad(&self) -> f64 {
        let covariance = self.filter.named_covariance();
        covariance.sigma(MISALIGNMENT[2]).unwrap_or(f64::NAN)
    }

    /// What it knows of the sensors.
    pub(super) fn knowledge(&self) -> SensorKnowledge {
        SensorKnowledge::of(&self.filter, self.last, self.turned)
    }
}

/// The way over a hole in the samples.
fn passage(hole: &Hole, settings: &Settings) -> Passage {
    let (unseen, turntable) = (&settings.unseen, &settings.turntable);
    match settings.reference {
        Reference::Moored { sigma_m_s } => unseen.moored(hole, turntable, sigma_m_s),
        Reference::Measured { .. } => unseen.under_way(hole, turntable, settings.restart_gap_s),
    }
}
