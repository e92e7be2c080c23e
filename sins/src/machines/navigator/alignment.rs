//! Its own alignment, on compensated samples.

use nalgebra::Vector3;

use super::{Navigator, NavigatorEvent, Stage};
use crate::error::Error;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::machines::self_calibration::{Calibration, Estimator, Event as AlignmentEvent};
use crate::sensor::Increment;
use crate::sensor::compensation::Compensation;
use crate::sensor::sample::ImuSample;
use crate::stream::order::EpochCause;
use crate::stream::{Interval, Item, Stream};

impl Navigator {
    /// Begins its own alignment: compensated samples, and as prior of the sensor errors what calibration left of them.
    pub(super) fn align(
        &mut self,
        calibration: &Calibration,
        compensation: &Compensation,
    ) -> Result<(), Error> {
        let mut settings = self.settings.alignment.clone();
        let sigma = |names: &[&str; 3], before: &Vector3<f64>| {
            Vector3::from_fn(|axis, _| {
                let sigma = calibration.covariance.sigma(names[axis]);
                sigma.filter(|s| *s > 0.0).unwrap_or(before[axis])
            })
        };
        settings.prior.accelerometer_bias_m_s2 =
            sigma(&ACCELEROMETER_BIAS, &settings.prior.accelerometer_bias_m_s2);
        settings.prior.gyroscope_drift_rad_s =
            sigma(&GYROSCOPE_DRIFT, &settings.prior.gyroscope_drift_rad_s);
        // It stands still: nobody could say what a turn does.
        settings.witness = false;
        let longest_s = settings.restart_gap_s;
        let mut alignment = Estimator::new(settings)?;
        if let Some(fix) = self.position {
            alignment.take_position(fix);
        }
        for (sample, interval) in &self.history {
            take_compensated(
                &mut alignment,
                compensation,
                interval.clone(),
                sample,
                &self.stream,
                longest_s,
            );
        }
        self.stage = Stage::Aligning(Box::new(alignment));
        Ok(())
    }

    pub(super) fn continue_alignment(&mut self, interval: Interval, sample: &ImuSample) {
        let (Stage::Aligning(alignment), Some((_, compensation))) =
            (&mut self.stage, &self.calibration)
        else {
            return;
        };
        let longest_s = self.settings.alignment.restart_gap_s;
        let interval = Some(interval);
        take_compensated(
            alignment,
            compensation,
            interval,
            sample,
            &self.stream,
            longest_s,
        );
        let mut aligned = None;
        while let Some(event) = alignment.next_event() {
            match event {
                AlignmentEvent::Estimate(estimate)
                    if estimate.duration_s >= self.settings.alignment_s =>
                {
                    aligned = Some(estimate);
                }
                AlignmentEvent::AlignmentFailed { stamp, reason } => self
                    .events
                    .push_back(NavigatorEvent::AlignmentFailed { stamp, reason }),
                _ => {}
            }
        }
        let Some(estimate) = aligned else {
            return;
        };
        // The alignment's own small corrections belong to its attitude; without them its level would not hold.
        let mut errors = *compensation.errors();
        errors.gyroscope_drift +=
            estimate.gyroscope_drift() + errors.gyroscope_matrix * estimate.gyroscope_drift();
        errors.accelerometer_bias += estimate.accelerometer_bias()
            + errors.accelerometer_matrix * estimate.accelerometer_bias();
        match self.channels(estimate.navigation, &errors, estimate.covariance()) {
            Ok(channels) => self.stage = Stage::Navigating(channels),
            Err(error) => self.fail(sample.stamp, &error),
        }
    }
}

/// Feeds an alignment with compensated samples. A hole longer than an alignment bridges begins it anew.
fn take_compensated(
    alignment: &mut Estimator,
    compensation: &Compensation,
    interval: Option<Interval>,
    sample: &ImuSample,
    stream: &Stream,
    longest_s: f64,
) {
    let (angular_rate, specific_force) =
        compensation.apply(&sample.angular_rate, &sample.specific_force);
    let sample = ImuSample {
        angular_rate,
        specific_force,
        ..*sample
    };
    let Some(mut interval) = interval else {
        return alignment.begin(sample.stamp, EpochCause::First, stream);
    };
    let seconds = interval.increment.interval_s;
    if seconds > longest_s && interval.hole.as_ref().is_some_and(|h| h.turned.is_none()) {
        return alignment.begin(sample.stamp, EpochCause::Hole { seconds }, stream);
    }
    interval.increment = compensated_increment(compensation, &interval.increment);
    alignment.take(Item::Interval(interval, sample), stream);
}

fn compensated_increment(compensation: &Compensation, increment: &Increment) -> Increment {
    let seconds = increment.interval_s;
    let (rate, force) = compensation.apply(
        &(increment.angle / seconds),
        &(increment.velocity / seconds),
    );
    Increment {
        interval_s: seconds,
        angle: rate * seconds,
        velocity: force * seconds,
    }
}
