//! Is the filter consistent? A chi-square test of its innovations over a window.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Sum of normalized innovations squared over a sliding window of updates, against the chi-square bound for its length.
///
/// Only the upper bound is a fault: a ship that lies stiller than the measurement's sigma makes the innovations smaller than
/// the filter expects, which costs nothing but accuracy.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct InnovationWindow {
    updates: usize,
    values: VecDeque<f64>,
    mean: Option<f64>,
    upper_mean: f64,
}

impl InnovationWindow {
    /// Degrees of freedom of one update: east and north velocity.
    pub const DEGREES: f64 = 2.0;

    /// A window of `updates` updates whose mean may exceed its bound with `false_alarm` probability when all is well.
    pub fn new(updates: usize, false_alarm: f64) -> Self {
        let updates = updates.max(1);
        let degrees = Self::DEGREES * updates as f64;
        // The distribution exists for every positive number of degrees, so the fallback never speaks.
        let bound =
            ChiSquared::new(degrees).map_or(f64::INFINITY, |d| d.inverse_cdf(1.0 - false_alarm));
        Self {
            updates,
            values: VecDeque::with_capacity(updates),
            mean: None,
            upper_mean: bound / updates as f64,
        }
    }

    /// Adds one update's normalized innovation squared.
    pub fn push(&mut self, normalized_squared: f64) {
        if self.values.len() == self.updates {
            self.values.pop_front();
        }
        self.values.push_back(normalized_squared);
        // Summed anew once an update: a sum that is carried along would gather rounding, and a sum for every question costs more
        // than the covariance step.
        self.mean = Some(self.values.iter().sum::<f64>() / self.values.len() as f64);
    }

    /// Mean of the window; `None` while it is empty.
    pub fn mean(&self) -> Option<f64> {
        self.mean
    }

    /// The bound on the mean of a full window.
    pub fn upper_mean(&self) -> f64 {
        self.upper_mean
    }

    /// Whether the window holds as many updates as it is long.
    pub fn is_full(&self) -> bool {
        self.values.len() == self.updates
    }

    /// Whether a full window passes. A window that is still filling passes: it cannot yet be judged.
    pub fn passes(&self) -> bool {
        !self.is_full() || self.mean().is_none_or(|mean| mean <= self.upper_mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bound for 1 update of 2 degrees at 5 % is the table's 5.991; for 300 updates it closes in on 2.
    #[test]
    fn bounds_are_those_of_the_table() {
        assert!((InnovationWindow::new(1, 0.05).upper_mean() - 5.991).abs() < 1e-3);
        let long = InnovationWindow::new(300, 1e-6).upper_mean();
        assert!(long > 2.4 && long < 2.7, "{long}");
    }

    /// A window full of 2.0 passes, of 3.0 fails; what has left the window no longer counts.
    #[test]
    fn judges_the_last_updates_only() {
        let mut window = InnovationWindow::new(300, 1e-6);
        (0..300).for_each(|_| window.push(3.0));
        assert!(!window.passes());
        (0..300).for_each(|_| window.push(2.0));
        assert!(window.passes());
    }
}
