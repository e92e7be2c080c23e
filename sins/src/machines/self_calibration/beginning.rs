//! What a filter begins with: place, priors by grade and settings, and what was known of the sensors before.

use nalgebra::Vector3;

use super::sensor_knowledge::{SensorKnowledge, SensorWalk};
use super::smoothing::Guide;
use super::{ModelChoice, Reference, Settings};
use crate::error::Error;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::filter::{ErrorFilter, InitialUncertainty, Loop};
use crate::estimation::grade::{Grade, GroupPriors, azimuth_prior_rad};
use crate::estimation::model::Model;
use crate::estimation::state::StateValues;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::{NoiseDensity, SensorErrors};
use crate::time::Stamp;

/// One-sigma of an antenna's arm that was told \[m\].
pub(super) const TOLD_ARM_M: f64 = 0.1;

/// What a filter begins with.
pub(super) struct Beginning<'a> {
    pub(super) place: NavigationState,
    pub(super) known: Option<&'a SensorKnowledge>,
    pub(super) now: Stamp,
    pub(super) walk: SensorWalk,
    pub(super) noise: NoiseDensity,
    /// What another pass is linear about, and where it begins.
    pub(super) guide: Option<(&'a Guide, NavigationState)>,
}

impl Settings {
    /// What the whole model takes to be known before of a sensor with this noise: of the paper's states, and of the others.
    pub fn whole_priors(&self, noise: &NoiseDensity) -> (InitialUncertainty, GroupPriors) {
        let grade = self.grade.unwrap_or_else(|| Grade::of_noise(noise));
        let mut initial = self.prior;
        let [drift, bias] = grade.drift_and_bias();
        let wider = |sigma: &mut Vector3<f64>, least: f64| sigma.apply(|s| *s = s.max(least));
        wider(&mut initial.gyroscope_drift_rad_s, drift);
        wider(&mut initial.accelerometer_bias_m_s2, bias);
        (initial, self.groups.resolved(grade))
    }
}

impl Beginning<'_> {
    /// The filter of the model that the settings choose, and one-sigma of its states before anything is known of the sensors.
    pub(super) fn any_filter(
        &self,
        settings: &Settings,
        reference: Reference,
    ) -> Result<(AnyFilter, StateValues), Error> {
        let (initial, noise) = (&settings.prior, &self.noise);
        Ok(match settings.model {
            ModelChoice::Paper => {
                let model = initial.model();
                // What no state describes costs nothing unless somebody says so: no grade has a figure.
                let grade = settings.grade.unwrap_or_else(|| Grade::of_noise(noise));
                let turn_noise = settings.groups.resolved(grade).turn_noise;
                let filter = self.filter(model)?.with_turn_noise(turn_noise).into();
                (filter, model.named_prior(&self.place))
            }
            ModelChoice::Whole => {
                let (mut initial, mut groups) = settings.whole_priors(noise);
                if !matches!(reference, Reference::Position { .. }) {
                    groups.antenna_arm_m = 0.0;
                } else if settings.groups.antenna_arm_m < 0.0 && settings.antenna.arm_m.amax() > 0.0
                {
                    groups.antenna_arm_m = TOLD_ARM_M;
                }
                let azimuth = azimuth_prior_rad(
                    &initial.gyroscope_drift_rad_s,
                    self.place.position.latitude_rad.cos(),
                );
                initial.misalignment_rad.z = initial.misalignment_rad.z.max(azimuth);
                let model = groups.model(&initial);
                let filter = self.filter(model)?;
                let filter = filter.with_turn_noise(groups.turn_noise).into();
                (filter, model.named_prior(&self.place))
            }
        })
    }

    fn filter<G: Model<M, N>, const M: usize, const N: usize>(
        &self,
        model: G,
    ) -> Result<ErrorFilter<G, M, N>, Error> {
        let (errors, covariance) = self.known.map_or_else(
            || {
                let prior = model.initial_covariance(&self.place);
                (SensorErrors::default(), prior)
            },
            |known| {
                let prior = known.prior(&model, &self.place, self.now, &self.walk);
                (known.errors, prior)
            },
        );
        let filter = ErrorFilter::new(
            model,
            self.place,
            &errors,
            covariance,
            self.noise,
            Loop::Open,
        )?;
        let table = self.known.map(|known| known.table).unwrap_or_default();
        let filter = filter.with_table(table);
        let Some((guide, place)) = self.guide else {
            return Ok(filter);
        };
        let mut guided = ErrorFilter::new(
            model,
            place,
            &guide.errors,
            covariance,
            self.noise,
            Loop::Open,
        )?
        .with_table(guide.table)
        .with_antenna(guide.antenna_arm_m);
        guided.believe(&filter);
        Ok(guided)
    }
}
