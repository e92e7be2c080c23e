//! What is gathered before the filter can start, and what its noise is.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::default_noise;
use super::noise_at_rest::NoiseAtRest;
use super::sensor_knowledge::SensorKnowledge;
use crate::mechanization::coarse_alignment::CoarseAlignment;
use crate::sensor::compensation::Compensator;
use crate::sensor::{ImuSample, NoiseDensity};
use crate::stream::Interval;
use crate::table::Turntable;
use crate::time::Stamp;

/// Intervals of one alignment.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Gathering {
    /// The sample that the first interval begins with.
    pub(super) start: Stamp,
    pub(super) coarse: CoarseAlignment,
    pub(super) backlog: Vec<Interval>,
    /// What was known of the sensors before.
    pub(super) known: Option<SensorKnowledge>,
    /// Takes that out, for the coarse alignment.
    compensator: Option<Compensator>,
    /// Σ variance · interval², for the noise densities.
    gyroscope_noise: Vector3<f64>,
    accelerometer_noise: Vector3<f64>,
    /// What the samples at rest show of it.
    pub(super) at_rest: NoiseAtRest,
}

impl Gathering {
    pub(super) fn new(start: Stamp, known: Option<&SensorKnowledge>) -> Self {
        Self {
            start,
            coarse: CoarseAlignment::default(),
            backlog: Vec::new(),
            known: known.cloned(),
            compensator: known
                .and_then(|known| known.errors.compensation().ok())
                .map(Compensator::new),
            gyroscope_noise: Vector3::zeros(),
            accelerometer_noise: Vector3::zeros(),
            at_rest: NoiseAtRest::default(),
        }
    }

    /// Takes an interval. The coarse alignment turns by the encoders where samples are missing and they know.
    pub(super) fn take(&mut self, interval: Interval, sample: &ImuSample, turntable: Turntable) {
        let mut increment = interval.increment;
        self.at_rest.take(&increment, interval.hole.is_some());
        if let Some(compensator) = &mut self.compensator {
            if interval.hole.is_some() {
                compensator.forget();
            }
            increment = compensator.next(&increment).increment;
        }
        if let Some(turned) = interval.hole.as_ref().and_then(|hole| hole.turned)
            && turned.from != turned.to
        {
            let turn = turntable.attitude(turned.from).inverse() * turntable.attitude(turned.to);
            increment.angle = turn.scaled_axis();
        }
        self.coarse.ingest(&increment);
        let weight = increment.interval_s.powi(2);
        self.gyroscope_noise += sample.angular_rate_variance * weight;
        self.accelerometer_noise += sample.specific_force_variance * weight;
        self.backlog.push(interval);
    }

    /// Length of what has been gathered \[s\].
    pub(super) fn seconds(&self) -> f64 {
        self.coarse.seconds()
    }

    /// Noise densities from the variances that came with the samples: density² = variance × interval.
    pub(super) fn noise(&self) -> NoiseDensity {
        let seconds = self.seconds();
        let density = |sum: &Vector3<f64>, default: &Vector3<f64>| {
            Vector3::from_fn(|i, _| {
                if sum[i].is_finite() && sum[i] > 0.0 {
                    (sum[i] / seconds).sqrt()
                } else {
                    default[i]
                }
            })
        };
        let default = default_noise();
        NoiseDensity {
            gyroscope: density(&self.gyroscope_noise, &default.gyroscope),
            accelerometer: density(&self.accelerometer_noise, &default.accelerometer),
        }
    }
}
