//! What was wrong with a bag on the way.

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
    not_finite: u64,
}

impl Notes {
    /// A line for the person at the screen and for the result.
    pub fn say(&mut self, listener: &dyn Listener, line: String) {
        listener.note(&line);
        self.lines.push(line);
    }

    /// What the machine refused.
    pub fn error(&mut self, listener: &dyn Listener, topic: &str, error: &sins::Error) {
        if matches!(error, sins::Error::NotFinite { .. }) {
            self.not_finite += 1;
            if self.not_finite > 1 {
                return;
            }
        }
        // An alignment that fails again for the same reason is no news; and where none succeeds, the refusal says why.
        let line = format!("{topic}: {error}");
        if self.lines.contains(&line) {
            return;
        }
        if matches!(error, sins::Error::Alignment { .. }) {
            self.held.push(line.clone());
            self.lines.push(line);
        } else {
            self.say(listener, line);
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
        if self.not_finite > 1 {
            let line = format!("{} samples were not finite in all", self.not_finite);
            self.say(listener, line);
        }
    }
}
