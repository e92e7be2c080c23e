//! The test of the innovations over a run.

use serde::{Deserialize, Serialize};

use super::super::Settings;
use crate::estimation::consistency::InnovationWindow;

/// The test of the innovations. What failed stays failed until windows enough have passed in a row.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in super::super) struct Judge {
    window: InnovationWindow,
    last: f64,
    failures: u64,
    /// Updates that full windows have passed since the last failure; counts only while there was one.
    agreed: u64,
    doubtful: bool,
    recovery_updates: u64,
}

impl Judge {
    pub(in super::super) fn new(settings: &Settings) -> Self {
        let updates = settings.window_updates;
        Self {
            window: InnovationWindow::new(updates, settings.window_false_alarm),
            last: 0.0,
            failures: 0,
            agreed: 0,
            doubtful: false,
            recovery_updates: settings.recovery_windows as u64 * updates as u64,
        }
    }

    /// The judge of a new alignment: its window is empty, but what was doubtful stays so.
    pub(in super::super) fn of_next_alignment(&self, settings: &Settings) -> Self {
        Self {
            failures: self.failures,
            doubtful: self.doubtful,
            ..Self::new(settings)
        }
    }

    /// Takes the normalized innovation squared of an update.
    pub(in super::super) fn take(&mut self, normalized_squared: f64) {
        self.last = normalized_squared;
        self.window.push(normalized_squared);
        if !self.window.passes() {
            self.failures += 1;
            self.doubtful = true;
            self.agreed = 0;
        } else if self.doubtful && self.window.is_full() {
            self.agreed += 1;
            self.doubtful = self.agreed < self.recovery_updates;
        }
    }

    pub(in super::super) fn report(&self) -> InnovationReport {
        InnovationReport {
            last: self.last,
            window_mean: self.window.mean().unwrap_or(0.0),
            window_bound: self.window.upper_mean(),
            failures: self.failures,
            is_full: self.window.is_full(),
            doubtful: self.doubtful,
            agreed: self.agreed,
            recovery: self.recovery_updates,
        }
    }
}

/// Innovations of the last updates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InnovationReport {
    /// Normalized innovation squared of the last update, two degrees of freedom.
    pub last: f64,
    /// Mean over the window.
    pub window_mean: f64,
    /// Upper bound of that mean.
    pub window_bound: f64,
    /// Updates at which a full window failed, since the first alignment.
    pub failures: u64,
    /// The window is full, so that it can be judged.
    pub is_full: bool,
    /// A window failed, and not enough of them have passed since.
    pub doubtful: bool,
    /// Updates with passing windows since the last failure.
    pub agreed: u64,
    /// Updates that have to pass before a run that failed counts as consistent again.
    pub recovery: u64,
}
