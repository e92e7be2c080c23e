//! Two mechanizations side by side, and what they say.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Navigator, Stage};
use crate::earth::rotation::base_link_to_block;
use crate::error::Error;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::filter::{ErrorFilter, Loop};
use crate::estimation::grade::Grade;
use crate::estimation::model::{Inertial, Model, Paper};
use crate::estimation::state::NamedCovariance;
use crate::machines::self_calibration::{ModelChoice, default_noise};
use crate::machines::unseen_motion::Passage;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::compensation::Compensator;
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
    pub(super) filter: AnyFilter,
    /// Takes the sensor errors out of the samples that are handed on.
    compensator: Compensator,
    /// The newest sample without its errors: angular rate \[rad/s\] and specific force \[m/s²\].
    sensed: [Vector3<f64>; 2],
    /// That of the filter, shared by the solutions until the next step.
    covariance: NamedCovariance,
}

impl Channel {
    fn new(filter: AnyFilter) -> Self {
        Self {
            compensator: Compensator::new(*filter.compensation()),
            sensed: [Vector3::zeros(); 2],
            covariance: filter.named_covariance(),
            filter,
        }
    }

    /// Takes out something else from the next sample on.
    pub(super) fn set_sensor_errors(&mut self, errors: &SensorErrors) -> Result<(), Error> {
        self.filter.set_sensor_errors(errors)?;
        self.compensator.set(*self.filter.compensation());
        Ok(())
    }

    /// Goes over an interval, which ends with a sample.
    pub(super) fn advance(
        &mut self,
        interval: &Interval,
        sample: &ImuSample,
        passage: Option<&Passage>,
    ) -> Result<(), Error> {
        if passage.is_some() {
            // The sample follows what nobody saw.
            self.compensator.forget();
        }
        self.sensed = self
            .compensator
            .averages(
                interval.increment.interval_s,
                &sample.angular_rate,
                &sample.specific_force,
            )
            .into();
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

    pub(super) fn solution(&self, table: &UnitQuaternion<f64>) -> Solution {
        let navigation = *self.filter.navigation();
        let [angular_rate, specific_force] = self.sensed;
        Solution {
            navigation,
            base_link: navigation.attitude * table.inverse() * base_link_to_block(),
            angular_rate,
            specific_force,
            covariance: self.covariance.clone(),
        }
    }
}

/// The model that a covariance speaks of: the paper's, or the whole one where it holds more of the sensors.
pub(super) fn model_of(covariance: &NamedCovariance) -> ModelChoice {
    let is_further = |name| Paper::position(name).is_none() && Inertial::position(name).is_some();
    if covariance.states().iter().any(is_further) {
        ModelChoice::Whole
    } else {
        ModelChoice::Paper
    }
}

/// A solution that runs free from here, with errors taken out and what is known of the rest.
fn channel<G: Model<M, N>, const M: usize, const N: usize>(
    model: G,
    start: NavigationState,
    (errors, known): (&SensorErrors, &NamedCovariance),
    noise: NoiseDensity,
) -> Result<Channel, Error>
where
    AnyFilter: From<ErrorFilter<G, M, N>>,
{
    let covariance = model.covariance_of(known, &start);
    let filter = ErrorFilter::new(model, start, errors, covariance, noise, Loop::Open)?;
    Ok(Channel::new(filter.into()))
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
            compensated: channels[0].solution(&table),
            uncompensated: channels[1].solution(&table),
        }))
    }

    pub(super) fn channels(
        &self,
        start: NavigationState,
        errors: &SensorErrors,
        covariance: &NamedCovariance,
    ) -> Result<Box<[Channel; 2]>, Error> {
        let noise = self.noise();
        // What is not taken out is as uncertain as it was before calibration.
        let raw = covariance.retain(|name, _| Paper::is_moving(name));
        let both = [(errors, covariance), (&SensorErrors::default(), &raw)];
        let settings = &self.settings.alignment;
        // What remains of errors that the model does not hold is not in its covariance, so it is the calibration's model.
        let of_whole = model_of(covariance) == ModelChoice::Whole;
        let channels = if of_whole {
            let grade = settings.grade.unwrap_or_else(|| Grade::of_noise(&noise));
            let model = settings.groups.resolved(grade).model(&settings.prior);
            both.map(|both| channel(Inertial::from(model), start, both, noise))
        } else {
            both.map(|both| channel(settings.prior.model(), start, both, noise))
        };
        let [compensated, uncompensated] = channels;
        Ok(Box::new([compensated?, uncompensated?]))
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
