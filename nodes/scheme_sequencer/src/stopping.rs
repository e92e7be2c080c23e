//! The last thing a sequencer does: the table is told to stop, and seen at rest, before the node falls silent.

use std::time::{Duration, Instant};

use ros_node::Ending;
use sins::table::JointSample;
use sins::time::Stamp;

/// Without joint states for so long it is not known whether the table rests.
const SILENCE: Duration = Duration::from_secs(2);

/// An ending that waits until the table rests.
pub struct Stopping {
    ending: Ending,
    rest: Rest,
    heard: Instant,
}

/// What became of it.
pub enum Progress {
    /// The table still turns, or is not seen.
    Waiting(Stopping),
    /// The ending has its answer.
    Over,
}

impl Stopping {
    /// The command to stop has just been given. A table rests below `rate_tolerance_rad_s` for `settling_s`.
    pub fn new(ending: Ending, rate_tolerance_rad_s: f64, settling_s: f64) -> Self {
        Self {
            ending,
            rest: Rest {
                rate_tolerance_rad_s,
                settling_s,
                since: None,
            },
            heard: Instant::now(),
        }
    }

    /// Takes the joint states that have come since the last look; `listens` says whether there is a table at all.
    pub fn look(mut self, samples: &[JointSample], listens: bool) -> Progress {
        for sample in samples {
            self.heard = Instant::now();
            if self.rest.ingest(sample) {
                let [outer, inner] = sample.position.map(f64::to_degrees);
                tracing::info!("the table rests at {outer:.3}, {inner:.3} deg");
                self.ending.done();
                return Progress::Over;
            }
        }
        if !listens {
            tracing::warn!("the table has gone; nobody can be told to stop");
            self.ending.done();
        } else if self.heard.elapsed() > SILENCE {
            self.ending.failed(format!(
                "the table was told to stop, but has not told for {:.0} s whether it rests",
                SILENCE.as_secs_f64()
            ));
        } else {
            return Progress::Waiting(self);
        }
        Progress::Over
    }
}

/// Whether both joints rest, by the stamps of their states.
#[derive(Debug)]
struct Rest {
    rate_tolerance_rad_s: f64,
    settling_s: f64,
    since: Option<Stamp>,
}

impl Rest {
    fn ingest(&mut self, sample: &JointSample) -> bool {
        let rests = |rate: &f64| rate.abs() <= self.rate_tolerance_rad_s;
        if !sample.velocity.iter().all(rests) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(sample.stamp);
        // The first one may be of before the command.
        sample.stamp > since && sample.stamp.seconds_since(since) >= self.settling_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64, rate_rad_s: f64) -> JointSample {
        JointSample {
            stamp: Stamp::default().plus_seconds(seconds),
            position: [0.1, 0.2],
            velocity: [rate_rad_s, 0.0],
        }
    }

    /// Rest is rest for a while: one joint state at rest may be of before the command, and a table that turns again does not
    /// rest.
    #[test]
    fn rest_lasts() {
        let mut rest = Rest {
            rate_tolerance_rad_s: 1e-4,
            settling_s: 1.0,
            since: None,
        };
        let seen = [
            (10.0, 0.0),
            (10.5, 0.05),
            (11.0, -1e-5),
            (11.9, 0.0),
            (12.0, 0.0),
        ]
        .map(|(seconds, rate)| rest.ingest(&at(seconds, rate)));
        assert_eq!(seen, [false, false, false, false, true]);
        rest.settling_s = 0.0;
        rest.since = None;
        assert!(!rest.ingest(&at(13.0, 0.0)) && rest.ingest(&at(13.1, 0.0)));
    }
}
