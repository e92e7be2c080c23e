//! Under way, and over the holes in the samples.

use super::{Navigator, NavigatorEvent, Stage};
use crate::machines::unseen_motion::Passage;
use crate::sensor::ImuSample;
use crate::stream::Interval;

impl Navigator {
    pub(super) fn navigate(&mut self, interval: &Interval, sample: &ImuSample) {
        let passage = self.passage(interval);
        if let Some(passage) = &passage {
            self.events.push_back(NavigatorEvent::HoleCrossed {
                stamp: interval.stamp,
                seconds: interval.increment.interval_s,
                held: matches!(passage, Passage::Held(_)),
            });
        }
        let Stage::Navigating(channels) = &mut self.stage else {
            return;
        };
        let advanced = channels
            .iter_mut()
            .try_for_each(|channel| channel.advance(interval, sample, passage.as_ref()));
        if let Err(error) = advanced {
            // Numbers that are none do not come back.
            self.fail(interval.stamp, &error);
            if let Some(calibration) = self.calibration.clone()
                && let Err(error) = self.align(&calibration)
            {
                self.fail(interval.stamp, &error);
                self.stage = Stage::Waiting;
            }
        }
    }

    /// The way over a hole: that of a moored ship where she lies, by the compensated solution.
    pub(super) fn passage(&self, interval: &Interval) -> Option<Passage> {
        let hole = interval.hole.as_ref()?;
        let settings = &self.settings.alignment;
        let bridge_s = settings.restart_gap_s;
        let under_way = settings
            .unseen
            .under_way(hole, &settings.turntable, bridge_s);
        let Stage::Navigating(channels) = &self.stage else {
            return Some(under_way);
        };
        let speed = channels[0].filter.navigation().velocity.norm();
        if speed > self.settings.moored_speed_m_s || hole.interval_s <= bridge_s {
            return Some(under_way);
        }
        Some(
            match settings.unseen.moored(hole, &settings.turntable, speed) {
                // A ship that lies sways as she did; her velocity goes on, for it is what tells one solution from the other.
                Passage::Held(mut crossing) => {
                    crossing.rest_sigma_m_s = None;
                    Passage::Held(crossing)
                }
                Passage::Bridged(_) => under_way,
            },
        )
    }
}
