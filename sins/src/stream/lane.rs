//! What comes beside the samples and waits for them: joint states and velocities, each in the order of its own stamps.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::time::Stamp;

/// Messages kept while no samples come.
const LONGEST_QUEUE: usize = 100_000;
/// A stamp this much ahead of the one before it needs a second one to be believed \[s\].
const FAR_AHEAD_S: f64 = 10.0;

/// One topic beside the samples.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Lane<T> {
    queue: VecDeque<(Stamp, T)>,
    newest: Option<Stamp>,
    /// A stamp that is alone in its opinion so far.
    candidate: Option<(Stamp, T)>,
    /// Its clock was set back since the epoch of the samples began.
    was_set_back: bool,
    /// A sample has waited for it in vain since it last spoke.
    is_silent: bool,
    refused: u64,
}

impl<T> Default for Lane<T> {
    fn default() -> Self {
        Self {
            queue: VecDeque::new(),
            newest: None,
            candidate: None,
            was_set_back: false,
            is_silent: false,
            refused: 0,
        }
    }
}

impl<T> Lane<T> {
    /// Takes a message; says whether the clock of this topic was set back by it.
    pub(super) fn push(&mut self, stamp: Stamp, value: T) -> bool {
        let Some(newest) = self.newest else {
            self.append(stamp, value);
            return false;
        };
        let ahead_s = stamp.seconds_since(newest);
        if ahead_s > 0.0 && ahead_s <= FAR_AHEAD_S {
            self.refused += u64::from(self.candidate.take().is_some());
            self.append(stamp, value);
            return false;
        }
        if ahead_s == 0.0 {
            self.refused += 1;
            return false;
        }
        let agrees = self.candidate.as_ref().is_some_and(|(before, _)| {
            let after_s = stamp.seconds_since(*before);
            after_s > 0.0 && after_s <= FAR_AHEAD_S && (*before < newest) == (stamp < newest)
        });
        let Some((before, first)) = self.candidate.take().filter(|_| agrees) else {
            self.candidate = Some((stamp, value));
            return false;
        };
        let is_back = before < newest;
        if is_back {
            self.queue.clear();
            self.was_set_back = true;
        }
        self.append(before, first);
        self.append(stamp, value);
        is_back
    }

    fn append(&mut self, stamp: Stamp, value: T) {
        if self.queue.len() == LONGEST_QUEUE {
            self.queue.pop_front();
            self.refused += 1;
        }
        self.queue.push_back((stamp, value));
        self.newest = Some(stamp);
        self.is_silent = false;
    }

    /// The next message at or before `stamp`.
    pub(super) fn pop_until(&mut self, stamp: Stamp) -> Option<(Stamp, T)> {
        let due = self.queue.front().is_some_and(|(time, _)| *time <= stamp);
        due.then(|| self.queue.pop_front()).flatten()
    }

    /// The next message, however late.
    pub(super) fn pop(&mut self) -> Option<(Stamp, T)> {
        self.queue.pop_front()
    }

    /// Whether a sample may wait for it: something has come in this epoch, and none has waited in vain since. A topic that
    /// stops costs its patience once, and not a lag for ever.
    pub(super) fn is_awaited(&self) -> bool {
        self.newest.is_some() && !self.is_silent
    }

    /// Whether a sample has waited for it in vain since it last spoke.
    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }

    /// A sample has waited for it in vain.
    pub(super) fn give_up(&mut self) {
        self.is_silent = true;
    }

    /// Whether a message at or after `stamp` has come.
    pub(super) fn covers(&self, stamp: Stamp) -> bool {
        self.newest.is_some_and(|newest| newest >= stamp)
    }

    /// The next message, left where it is.
    pub(super) fn peek(&self) -> Option<&T> {
        self.queue.front().map(|(_, value)| value)
    }

    /// Whether messages tell of `stamp` without those up to `before`: one of its very time, or two of which one is not earlier.
    pub(super) fn tells(&self, before: Stamp, stamp: Stamp) -> bool {
        let mut after = self.queue.iter().skip_while(|(time, _)| *time <= before);
        let first = after.next().map(|(time, _)| *time);
        self.covers(stamp) && (first == Some(stamp) || after.next().is_some())
    }

    /// Messages that were left out.
    pub(super) fn refused(&self) -> u64 {
        self.refused
    }

    /// The clock of the samples was set back: what is here belongs to the time before, unless this clock was set back already.
    pub(super) fn begin_epoch(&mut self) {
        if !std::mem::take(&mut self.was_set_back) {
            self.queue.clear();
            self.newest = None;
            self.candidate = None;
        }
    }
}
