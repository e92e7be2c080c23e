//! Calibrations and the samples of late: how navigation starts from a calibration, before, amid or after its samples.

use nalgebra::Vector3;

use super::{Navigator, NavigatorEvent, Stage};
use crate::error::Error;
use crate::machines::self_calibration::{Calibration, Phase};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::ImuSample;
use crate::stream::Interval;
use crate::time::{Stamp, seconds_to_nanos};

impl Navigator {
    /// Takes a calibration. The first one starts the navigation, from its own attitude where the samples since then are at
    /// hand and by an alignment where they are not; one that has overtaken its samples waits for them. Later ones refine the
    /// compensation of the solution that runs. Where that solution stands on a calibration that had not converged, attitude and
    /// place are as wrong as that one was: it starts anew, unless she is under way, where no alignment would hold.
    ///
    /// # Errors
    /// As [`Calibration::usable`].
    pub fn push_calibration(&mut self, calibration: Calibration) -> Result<(), Error> {
        let calibration = calibration.usable()?;
        let used = self.history.back().map(|(sample, _)| sample.stamp);
        let arrived = used.or(self.stream.newest().filter(|_| self.stream.waiting() > 0));
        let ahead = arrived.filter(|arrived| {
            let ahead_s = calibration.stamp.seconds_since(*arrived);
            let is_ahead = ahead_s > 0.0 || used.is_none();
            is_ahead && ahead_s.abs() <= self.settings.history_s
        });
        if ahead.is_some() {
            self.early = Some(calibration);
            return Ok(());
        }
        self.early = None;
        self.take_calibration(calibration)
    }

    fn take_calibration(&mut self, calibration: Calibration) -> Result<(), Error> {
        calibration.errors.compensation()?;
        let is_covered =
            self.history
                .front()
                .zip(self.history.back())
                .is_some_and(|(first, last)| {
                    first.0.stamp <= calibration.stamp && last.0.stamp >= calibration.stamp
                });
        let stands_on_less = self
            .calibration
            .as_ref()
            .is_some_and(|before| before.phase != Phase::Converged);
        let mut restarted = false;
        if let Stage::Navigating(channels) = &mut self.stage {
            let speed = channels[0].filter.navigation().velocity.norm();
            restarted = stands_on_less && speed <= self.settings.moored_speed_m_s;
            if !restarted {
                channels[0].set_sensor_errors(&calibration.errors)?;
            }
        }
        if restarted || !matches!(self.stage, Stage::Navigating(_)) {
            if is_covered && self.settings.start_from_calibration {
                self.start_from(&calibration)?;
            } else {
                self.align(&calibration)?;
            }
        }
        self.events.push_back(NavigatorEvent::CalibrationTaken {
            stamp: calibration.stamp,
            restarted,
        });
        self.calibration = Some(calibration);
        self.tell_phase();
        Ok(())
    }

    /// A calibration that waited for its samples.
    pub(super) fn take_early(&mut self, stamp: Stamp) {
        let Some(calibration) = self.early.take_if(|early| early.stamp <= stamp) else {
            return;
        };
        let its = calibration.stamp;
        if let Err(error) = self.take_calibration(calibration) {
            self.events.push_back(NavigatorEvent::CalibrationRefused {
                stamp: its,
                reason: error.to_string(),
            });
        }
    }

    /// Keeps a sample with the interval that it ends, as long as a calibration may still ask for it.
    pub(super) fn remember(&mut self, sample: &ImuSample, interval: Interval) {
        let oldest = sample
            .stamp
            .plus_nanos(-seconds_to_nanos(self.settings.history_s));
        while self
            .history
            .front()
            .is_some_and(|(kept, _)| kept.stamp < oldest)
        {
            self.history.pop_front();
        }
        self.history.push_back((*sample, Some(interval)));
    }

    /// Starts at the calibration's stamp and catches up through the samples since.
    fn start_from(&mut self, calibration: &Calibration) -> Result<(), Error> {
        let start = NavigationState {
            attitude: calibration.attitude,
            velocity: Vector3::zeros(),
            position: calibration.position,
        };
        let mut channels = self.channels(start, &calibration.errors, &calibration.covariance)?;
        for (sample, interval) in &self.history {
            let Some(interval) = interval.as_ref().filter(|i| i.stamp > calibration.stamp) else {
                continue;
            };
            let passage = self.passage(interval);
            for channel in channels.iter_mut() {
                channel.advance(interval, sample, passage.as_ref())?;
            }
        }
        self.stage = Stage::Navigating(channels);
        Ok(())
    }
}
