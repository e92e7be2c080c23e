//! The steps of the rotation scheme, as the sequencer told them.

use rotary_sins_msgs::SchemeStatus;
use sins::time::Stamp;

/// Steps and events that are kept.
const KEPT: usize = 2000;

/// One step: a rotation and the dwell after it.
#[derive(Clone, Debug)]
pub struct Step {
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
    pub steps: Vec<Step>,
    /// Steps beyond it.
    pub more_steps: u64,
    /// Faults, pauses, ends; up to a bound.
    pub events: Vec<Event>,
    /// Whether the last state was a fault.
    pub is_faulty: bool,
    /// Whether every cycle was done.
    pub is_finished: bool,
    state: Option<u8>,
}

impl Scheme {
    /// Takes a status.
    pub fn take(&mut self, status: &SchemeStatus) {
        let stamp: Stamp = status.header.stamp.into();
        if self.name != status.scheme && !status.scheme.is_empty() {
            self.name.clone_from(&status.scheme);
        }
        let before = self.state.replace(status.state);
        if before != Some(status.state) {
            self.follow(stamp, status);
        }
        self.is_faulty = status.state == SchemeStatus::FAULT;
        self.is_finished = status.state == SchemeStatus::FINISHED;
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
            self.steps.push(Step {
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
