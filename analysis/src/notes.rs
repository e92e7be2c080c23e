//! What was wrong with a bag on the way.

use std::collections::BTreeMap;

use sins::{machines::self_calibration::Event, stream::counts::Refused};

use crate::Listener;

/// What was wrong on the way, said once at the end of each kind.
#[derive(Default)]
pub struct Notes {
    /// Messages that did not hold what their type says.
    pub undecodable_messages: u64,
    /// Lines for a person.
    pub lines: Vec<String>,
    /// Of those, what was not said yet.
    held: Vec<String>,
    refused: BTreeMap<String, BTreeMap<&'static str, u64>>,
}

impl Notes {
    /// A line for the person at the screen and for the result.
    pub fn say(&mut self, listener: &dyn Listener, line: String) {
        listener.note(&line);
        self.lines.push(line);
    }

    /// What the machine refused.
    pub fn error(&mut self, listener: &dyn Listener, topic: &str, error: &sins::Error) {
        let kind = match error {
            sins::Error::NotFinite { .. } => "not finite",
            _ => "unusable",
        };
        if self.count(topic, kind) == 1 {
            self.say(listener, format!("{topic}: {error}"));
        }
    }

    /// What the machine tells of its samples, which come from `topic`.
    pub fn event(&mut self, listener: &dyn Listener, topic: &str, event: &Event) {
        match event {
            Event::Refused(refused) => self.refused(listener, topic, refused),
            Event::Restarted {
                stamp,
                cause,
                sensors_kept,
            } => {
                let kept = if *sensors_kept {
                    "; what is known of the sensors is kept"
                } else {
                    ""
                };
                self.hold(format!(
                    "{topic}: {cause} at {} ns: alignment starts anew{kept}",
                    stamp.nanos()
                ));
            }
            Event::AlignmentFailed { reason, .. } => {
                self.hold(format!("{topic}: {reason}"));
            }
            Event::Estimate(_) | Event::PhaseChanged { .. } | Event::HoleCrossed { .. } => {}
        }
    }

    /// A sample that is not used; the first of its kind is said.
    pub fn refused(&mut self, listener: &dyn Listener, topic: &str, refused: &Refused) {
        if self.count(topic, refused.why.name()) == 1 {
            let (stamp, why) = (refused.stamp.nanos(), refused.why);
            self.say(listener, format!("{topic}: sample at {stamp} ns: {why}"));
        }
    }

    fn count(&mut self, topic: &str, kind: &'static str) -> u64 {
        let of_topic = self.refused.entry(topic.to_owned()).or_default();
        let count = of_topic.entry(kind).or_default();
        *count += 1;
        *count
    }

    /// An alignment that fails again for the same reason is no news; and where none succeeds, the refusal says why.
    pub fn hold(&mut self, line: String) {
        if !self.lines.contains(&line) {
            self.held.push(line.clone());
            self.lines.push(line);
        }
    }

    /// A message that is none of its type.
    pub fn undecodable(&mut self, listener: &dyn Listener, error: &bags::Error) {
        self.undecodable_messages += 1;
        if self.undecodable_messages == 1 {
            self.say(listener, error.to_string());
        }
    }

    /// Says what was held back, where there is a result all the same.
    pub fn tell(&mut self, listener: &dyn Listener) {
        for line in self.held.drain(..) {
            listener.note(&line);
        }
    }

    /// The sums, at the end.
    pub fn sum_up(&mut self, listener: &dyn Listener) {
        if self.undecodable_messages > 1 {
            let line = format!(
                "{} messages could not be read in all",
                self.undecodable_messages
            );
            self.say(listener, line);
        }
        for (topic, kinds) in std::mem::take(&mut self.refused) {
            for (kind, count) in kinds.into_iter().filter(|(_, count)| *count > 1) {
                self.say(listener, format!("{topic}: {count} refused in all: {kind}"));
            }
        }
    }
}
