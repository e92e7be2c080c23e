//! The steps of the rotation scheme, as the sequencer told them.

use rotary_sins_msgs::SchemeStatus;
use rotary_sins_msgs::convert::stamp_from_time;
use sins::time::Stamp;

/// Steps and events that are kept.
const KEPT: usize = 2000;

/// One step: a rotation and the dwell after it.
#[derive(Clone, Debug)]
pub struct RecordedStep {
    /// Counts from 0.
    pub cycle: u32,
    /// Counts from 0, the first dwell.
    pub number: u32,
    /// Letter of the position at its end.
    pub position: String,
    /// Rotation, e.g. `x +180 deg`; empty for none.
    pub turn: String,
    /// Its beginning.
    pub start: Stamp,
    /// When the block came to rest in the position.
    pub dwell: Option<Stamp>,
    /// Its end, where the next one or the end of the scheme was seen.
    pub end: Option<Stamp>,
}

/// What the sequencer told besides.
#[derive(Clone, Debug)]
pub struct Event {
    /// When.
    pub stamp: Stamp,
    /// What.
    pub text: String,
}

/// Follows the sequencer.
#[derive(Default)]
pub struct Scheme {
    /// Its name.
    pub name: String,
    /// Steps, up to a bound.
    pub steps: Vec<RecordedStep>,
    /// Steps beyond it.
    pub more_steps: u64,
    /// Faults, pauses, ends; up to a bound.
    pub events: Vec<Event>,
    state: Option<u8>,
}

impl Scheme {
    /// Takes a status.
    pub fn take(&mut self, status: &SchemeStatus) {
        let stamp: Stamp = stamp_from_time(status.header.stamp);
        if self.name != status.scheme && !status.scheme.is_empty() {
            self.name.clone_from(&status.scheme);
        }
        let before = self.state.replace(status.state);
        if before != Some(status.state) {
            self.follow(stamp, status);
        }
        match status.state {
            SchemeStatus::DWELLING | SchemeStatus::ROTATING => self.place(stamp, status),
            SchemeStatus::FINISHED | SchemeStatus::ABORTED => self.close(stamp),
            _ => {}
        }
    }

    /// A change of state that is worth a line.
    fn follow(&mut self, stamp: Stamp, status: &SchemeStatus) {
        let what = match status.state {
            SchemeStatus::FAULT => "fault of the scheme",
            SchemeStatus::PAUSED => "scheme paused",
            SchemeStatus::ABORTED => "scheme aborted",
            _ => return,
        };
        if self.events.len() < KEPT {
            let text = if status.message.is_empty() {
                what.to_owned()
            } else {
                format!("{what}: {}", status.message)
            };
            self.events.push(Event { stamp, text });
        }
    }

    fn place(&mut self, stamp: Stamp, status: &SchemeStatus) {
        let is_new = self.steps.last().is_none_or(|last| {
            (last.cycle, last.number) != (status.cycle, status.step) || last.end.is_some()
        });
        if is_new {
            self.close(stamp);
            if self.steps.len() == KEPT {
                self.more_steps += 1;
                return;
            }
            self.steps.push(RecordedStep {
                cycle: status.cycle,
                number: status.step,
                position: status.position.clone(),
                turn: String::new(),
                start: stamp,
                dwell: None,
                end: None,
            });
        }
        let Some(step) = self.steps.last_mut() else {
            return;
        };
        if status.state == SchemeStatus::DWELLING {
            step.dwell.get_or_insert(stamp);
        } else if step.turn.is_empty() {
            step.turn = format!(
                "{} {:+.0} deg",
                status.rotation_axis,
                status.rotation_angle_rad.to_degrees()
            );
        }
    }

    fn close(&mut self, stamp: Stamp) {
        if let Some(last) = self.steps.last_mut() {
            last.end.get_or_insert(stamp);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rotary_sins_msgs::convert::header;
    use sins::time::NANOS_PER_SECOND;

    fn at(seconds: i64) -> Stamp {
        Stamp::from_nanos(seconds * NANOS_PER_SECOND)
    }

    fn status(seconds: i64, state: u8, step: u32) -> SchemeStatus {
        SchemeStatus {
            header: header(at(seconds), ""),
            scheme: "short".to_owned(),
            state,
            step,
            position: "AB"[step as usize..=step as usize].to_owned(),
            rotation_axis: "x".to_owned(),
            rotation_angle_rad: std::f64::consts::PI,
            message: "it stands".to_owned(),
            ..SchemeStatus::default()
        }
    }

    /// A dwell, a rotation and its dwell are two steps; the end of the scheme ends the last one.
    #[test]
    fn steps_begin_with_their_rotation() {
        let mut scheme = Scheme::default();
        for (seconds, state, step) in [
            (0, SchemeStatus::WAITING_FOR_TABLE, 0),
            (1, SchemeStatus::DWELLING, 0),
            (50, SchemeStatus::DWELLING, 0),
            (100, SchemeStatus::ROTATING, 1),
            (138, SchemeStatus::DWELLING, 1),
            (200, SchemeStatus::FINISHED, 1),
            (300, SchemeStatus::FINISHED, 1),
        ] {
            scheme.take(&status(seconds, state, step));
        }
        let [first, second] = &scheme.steps[..] else {
            panic!("{:?}", scheme.steps)
        };
        assert_eq!((first.start, first.end), (at(1), Some(at(100))));
        assert_eq!(
            (second.start, second.dwell, second.end),
            (at(100), Some(at(138)), Some(at(200)))
        );
        assert_eq!(
            (second.position.as_str(), second.turn.as_str()),
            ("B", "x +180 deg")
        );
        assert!(scheme.events.is_empty());
    }

    /// A fault is told once, with the sequencer's own words.
    #[test]
    fn a_fault_is_told_once() {
        let mut scheme = Scheme::default();
        scheme.take(&status(1, SchemeStatus::ROTATING, 1));
        scheme.take(&status(2, SchemeStatus::FAULT, 1));
        scheme.take(&status(3, SchemeStatus::FAULT, 1));
        assert_eq!(scheme.events.len(), 1);
        assert_eq!(scheme.events[0].text, "fault of the scheme: it stands");
    }
}
