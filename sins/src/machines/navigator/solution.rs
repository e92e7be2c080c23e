//! Two mechanizations side by side, and what they say.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Navigator, Stage};
use crate::earth::rotation::base_link_to_block;
use crate::error::Error;
use crate::estimation::filter::Loop;
use crate::estimation::model::{Model, Paper, PaperFilter};
use crate::estimation::state::NamedCovariance;
use crate::machines::self_calibration::default_noise;
use crate::machines::unseen_motion::Passage;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::{ImuSample, NoiseDensity};
use crate::stream::Interval;
use crate::time::Stamp;

/// Time between covariance steps \[s\].
const COVARIANCE_STEP_S: f64 = 1.0;

/// One solution at the time of a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Attitude of the block (b to n), velocity, position.
    pub navigation: NavigationState,
    /// Attitude of the ship: turns `base_link` (forward-left-up) into n.
    pub base_link: UnitQuaternion<f64>,
    /// Angular rate of the block against inertial space, its own axes \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Specific force, block axes \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// Covariance of the filter's states at the last covariance step (at most a second ago).
    pub covariance: NamedCovariance,
}

/// Both solutions.
#[derive(Clone, Debug, PartialEq)]
pub struct NavigatorOutput {
    /// Time of the sample.
    pub stamp: Stamp,
    /// With the calibration.
    pub compensated: Solution,
    /// Without it.
    pub uncompensated: Solution,
}

/// One mechanization with its covariance.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) filter: PaperFilter,
    /// That of the filter, shared by the solutions until the next step.
    covariance: NamedCovariance,
}

impl Channel {
    pub(super) fn advance(
        &mut self,
        interval: &Interval,
        passage: Option<&Passage>,
    ) -> Result<(), Error> {
        let mut changed = passage.is_some();
        match passage {
            Some(Passage::Held(crossing)) => {
                self.filter.cross(crossing)?;
                self.covariance = self.filter.named_covariance();
                return Ok(());
            }
            Some(Passage::Bridged([angle, velocity])) => self.filter.bridge(*angle, *velocity),
            None => {}
        }
        self.filter.propagate(&interval.increment);
        if self.filter.pending_s() >= COVARIANCE_STEP_S {
            self.filter.step()?;
            changed = true;
        }
        if changed {
            self.covariance = self.filter.named_covariance();
        }
        Ok(())
    }

    pub(super) fn solution(&self, table: &UnitQuaternion<f64>, sample: &ImuSample) -> Solution {
        let navigation = *self.filter.navigation();
        let (angular_rate, specific_force) = self
            .filter
            .compensation()
            .apply(&sample.angular_rate, &sample.specific_force);
        Solution {
            navigation,
            base_link: navigation.attitude * table.inverse() * base_link_to_block(),
            angular_rate,
            specific_force,
            covariance: self.covariance.clone(),
        }
    }
}

impl Navigator {
    pub(super) fn output(&self, sample: &ImuSample) -> Option<Box<NavigatorOutput>> {
        let Stage::Navigating(channels) = &self.stage else {
            return None;
        };
        let angles = self.stream.joints().angles_at(sample.stamp);
        let table = self.settings.alignment.turntable.attitude(angles);
        Some(Box::new(NavigatorOutput {
            stamp: sample.stamp,
            compensated: channels[0].solution(&table, sample),
            uncompensated: channels[1].solution(&table, sample),
        }))
    }

    pub(super) fn channels(
        &self,
        start: NavigationState,
        errors: &SensorErrors,
        covariance: &NamedCovariance,
    ) -> Result<Box<[Channel; 2]>, Error> {
        let noise = self.noise();
        let model = self.settings.alignment.prior.model();
        // What is not taken out is as uncertain as it was before calibration.
        let raw = covariance.retain(|name, _| Paper::is_moving(name));
        let channel = |errors: &SensorErrors, known: &NamedCovariance| {
            let covariance = model.covariance_of(known, &start);
            let filter = PaperFilter::new(model, start, errors, covariance, noise, Loop::Open)?;
            Ok::<_, Error>(Channel {
                covariance: filter.named_covariance(),
                filter,
            })
        };
        Ok(Box::new([
            channel(errors, covariance)?,
            channel(&SensorErrors::default(), &raw)?,
        ]))
    }

    /// Noise densities: as set, or as the last sample's variances say.
    fn noise(&self) -> NoiseDensity {
        let default = default_noise();
        self.settings.alignment.noise.unwrap_or_else(|| {
            let interval = self.stream.usual_interval_s().unwrap_or(0.0);
            let last = self.history.back().map(|(s, _)| s);
            let density = |variance: Option<f64>, default: f64| {
                variance
                    .filter(|v| *v > 0.0)
                    .map_or(default, |v| (v * interval).sqrt())
            };
            NoiseDensity {
                gyroscope: Vector3::from_fn(|i, _| {
                    density(
                        last.map(|s| s.angular_rate_variance[i]),
                        default.gyroscope[i],
                    )
                }),
                accelerometer: Vector3::from_fn(|i, _| {
                    density(
                        last.map(|s| s.specific_force_variance[i]),
                        default.accelerometer[i],
                    )
                }),
            }
        })
    }
}
