//! Its own alignment, with the calibration as what is known of the sensors.

use super::solution::model_of;
use super::{Navigator, NavigatorEvent, Stage};
use crate::error::Error;
use crate::machines::self_calibration::{
    Calibration, Estimator, Event as AlignmentEvent, SensorKnowledge,
};
use crate::sensor::sample::ImuSample;
use crate::stream::order::EpochCause;
use crate::stream::{Interval, Item, Stream};

impl Navigator {
    /// Begins its own alignment, which knows of the sensors what the calibration says: their errors, and what it left of them.
    pub(super) fn align(&mut self, calibration: &Calibration) -> Result<(), Error> {
        let mut settings = self.settings.alignment.clone();
        settings.model = model_of(&calibration.covariance);
        // The ship lies: what the encoders would tell of the table is not asked for.
        settings.encoders = None;
        // It stands still: nobody could say what a turn does.
        settings.witness = false;
        let longest_s = settings.restart_gap_s;
        let first = self.history.front().map(|(sample, _)| sample.stamp);
        let now = first.unwrap_or(calibration.stamp);
        let known = SensorKnowledge::of_calibration(calibration, now);
        let mut alignment = Estimator::new(settings)?.knowing(known);
        if let Some(fix) = self.position {
            alignment.take_position(fix);
        }
        for (sample, interval) in &self.history {
            take(
                &mut alignment,
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
        let Stage::Aligning(alignment) = &mut self.stage else {
            return;
        };
        let longest_s = self.settings.alignment.restart_gap_s;
        take(alignment, Some(interval), sample, &self.stream, longest_s);
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
        // The alignment's own small corrections of the sensors belong to its attitude; without them its level would not hold.
        match self.channels(estimate.navigation, &estimate.errors, estimate.covariance()) {
            Ok(channels) => self.stage = Stage::Navigating(channels),
            Err(error) => self.fail(sample.stamp, &error),
        }
    }
}

/// Feeds an alignment. A hole longer than an alignment bridges begins it anew.
fn take(
    alignment: &mut Estimator,
    interval: Option<Interval>,
    sample: &ImuSample,
    stream: &Stream,
    longest_s: f64,
) {
    let Some(interval) = interval else {
        return alignment.begin(sample.stamp, EpochCause::First, stream);
    };
    let seconds = interval.increment.interval_s;
    if seconds > longest_s && interval.hole.as_ref().is_some_and(|h| h.turned.is_none()) {
        return alignment.begin(sample.stamp, EpochCause::Hole { seconds }, stream);
    }
    alignment.take(Item::Interval(interval, *sample), stream);
}
