//! The filter once it runs.

use nalgebra::UnitQuaternion;

use super::Settings;
use super::aiding::{Aiding, Due};
use super::encoders::Encoders;
use super::judge::Judge;
use super::sensor_knowledge::SensorKnowledge;
use super::settings::Reference;
use crate::error::Error;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::measurement::{Innovation, Outcome};
use crate::machines::unseen_motion::Passage;
use crate::stream::joint_history::JointHistory;
use crate::stream::{Hole, Interval};
use crate::time::Stamp;

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
        self.last = interval.stamp;
        let mut advance = Advance {
            passage,
            ..Advance::default()
        };
        match self.aiding.due(interval) {
            Due::Nothing => return Ok(advance),
            Due::Step => {
                self.filter.step()?;
                advance.velocity_missing = true;
            }
            Due::Update(measurement) => {
                self.filter.step()?;
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
        Ok(advance)
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
