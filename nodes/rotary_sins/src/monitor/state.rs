//! What the monitor has heard, and when. No terminal and no DDS in here: messages and moments go in.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use ros2_interfaces::diagnostic_msgs::DiagnosticStatus;
use rotary_sins_msgs::{SchemeStatus, SelfCalibrationEstimate};
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::MISALIGNMENT;
use sins::machines::self_calibration::Thresholds;

/// Sigmas kept for the small curves.
const KEPT: usize = 240;
/// Without a message for longer than this, a stream has stopped.
pub const SILENCE: Duration = Duration::from_secs(5);
/// The nine that calibration is about.
pub const NINE: usize = 9;

/// The newest message of a stream.
#[derive(Clone, Debug)]
pub struct Heard<M> {
    /// The message.
    pub message: M,
    /// When it came.
    pub at: Instant,
}

/// Everything heard so far.
#[derive(Clone, Debug, Default)]
pub struct MonitorState {
    /// Newest of the sequencer.
    pub scheme: Option<Heard<SchemeStatus>>,
    /// When the scheme came to its present place, by the scheme's own clock \[s\].
    pub place_since_s: f64,
    /// Newest of the calibrator.
    pub estimate: Option<Heard<SelfCalibrationEstimate>>,
    /// Newest diagnostics by name.
    pub diagnostics: BTreeMap<String, Heard<DiagnosticStatus>>,
    /// One-sigmas of the nine against time, thinned as they grow.
    history: [VecDeque<f64>; NINE],
    /// Only every so many estimates goes into the history.
    every: usize,
    skipped: usize,
}

impl MonitorState {
    /// A status of the sequencer.
    pub fn scheme(&mut self, message: SchemeStatus, at: Instant) {
        let place = |s: &SchemeStatus| (s.state, s.cycle, s.step);
        let is_new = self
            .scheme
            .as_ref()
            .is_none_or(|before| place(&before.message) != place(&message));
        if is_new {
            self.place_since_s = message.elapsed;
        }
        self.scheme = Some(Heard { message, at });
    }

    /// An estimate. One that goes back in time begins the curves anew.
    pub fn estimate(&mut self, message: SelfCalibrationEstimate, at: Instant) {
        let went_back = self
            .estimate
            .as_ref()
            .is_some_and(|before| before.message.duration > message.duration);
        if went_back || self.every == 0 {
            self.history = std::array::from_fn(|_| VecDeque::with_capacity(KEPT));
            (self.every, self.skipped) = (1, 0);
        }
        self.skipped += 1;
        if self.skipped >= self.every {
            self.skipped = 0;
            for (history, sigma) in self.history.iter_mut().zip(sigmas(&message)) {
                history.push_back(sigma);
            }
            if self.history[0].len() >= KEPT {
                // Half as many points of twice the distance: a run of any length fits.
                for history in &mut self.history {
                    let mut index = 0;
                    history.retain(|_| {
                        index += 1;
                        index % 2 == 1
                    });
                }
                self.every *= 2;
            }
        }
        self.estimate = Some(Heard { message, at });
    }

    /// One status of the diagnostics.
    pub fn diagnostic(&mut self, message: DiagnosticStatus, at: Instant) {
        self.diagnostics
            .insert(message.name.clone(), Heard { message, at });
    }

    /// Sigma of one of the nine against time.
    pub fn history(&self, index: usize) -> impl Iterator<Item = f64> + '_ {
        self.history[index].iter().copied()
    }

    /// A key of a diagnostic status.
    pub fn value(&self, name: &str, key: &str) -> Option<&str> {
        let status = &self.diagnostics.get(name)?.message;
        let found = status.values.iter().find(|value| value.key == key)?;
        Some(&found.value)
    }

    /// Diagnostics above OK, the worst first. What has not been said again for a while has gone with its node.
    pub fn faults(&self, now: Instant) -> Vec<&DiagnosticStatus> {
        let mut faults: Vec<_> = self
            .diagnostics
            .values()
            .filter(|d| {
                d.message.level > DiagnosticStatus::OK && now.duration_since(d.at) < SILENCE * 2
            })
            .map(|d| &d.message)
            .collect();
        faults.sort_by(|a, b| b.level.cmp(&a.level).then_with(|| a.name.cmp(&b.name)));
        faults
    }

    /// How long ago the newest message of any stream came.
    pub fn newest(&self, now: Instant) -> Option<Duration> {
        let scheme = self.scheme.as_ref().map(|h| h.at);
        let estimate = self.estimate.as_ref().map(|h| h.at);
        let diagnostics = self.diagnostics.values().map(|h| h.at).max();
        let newest = [scheme, estimate, diagnostics]
            .into_iter()
            .flatten()
            .max()?;
        Some(now.saturating_duration_since(newest))
    }
}

/// Whether a one-sigma is one: messages say below zero where it is not known.
pub fn is_known(sigma: f64) -> bool {
    sigma.is_nan() || sigma >= 0.0
}

/// One-sigma of misalignment (E, N, U), gyroscope drift and accelerometer bias (x, y, z), SI, as the message has them.
pub fn sigmas(estimate: &SelfCalibrationEstimate) -> [f64; NINE] {
    let mut all = [0.0; NINE];
    all[..3].copy_from_slice(&estimate.misalignment_std);
    all[3..6].copy_from_slice(&estimate.gyroscope_drift_std);
    all[6..].copy_from_slice(&estimate.accelerometer_bias_std);
    all
}

/// The calibrator's default thresholds in the same order \[SI\]; infinite where none is asked for.
pub fn thresholds() -> [f64; NINE] {
    let thresholds = Thresholds::default();
    let mut all = [f64::INFINITY; NINE];
    let names = MISALIGNMENT
        .into_iter()
        .chain(GYROSCOPE_DRIFT)
        .chain(ACCELEROMETER_BIAS);
    for (limit, name) in all.iter_mut().zip(names) {
        *limit = thresholds.of(name).unwrap_or(f64::INFINITY);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(duration: f64, sigma: f64) -> SelfCalibrationEstimate {
        SelfCalibrationEstimate {
            duration,
            gyroscope_drift_std: [sigma; 3],
            ..SelfCalibrationEstimate::default()
        }
    }

    /// A day of estimates stays within what is kept, oldest first, newest last; a new run begins anew.
    #[test]
    fn history_is_bounded_and_whole() {
        let (mut state, now) = (MonitorState::default(), Instant::now());
        for second in 0..86_400 {
            state.estimate(estimate(f64::from(second), f64::from(86_400 - second)), now);
        }
        let kept: Vec<f64> = state.history(3).collect();
        assert!((KEPT / 2..KEPT).contains(&kept.len()), "{}", kept.len());
        assert!(kept.windows(2).all(|w| w[0] > w[1]));
        assert!(kept[0] > 86_000.0 && kept[kept.len() - 1] < 1000.0);
        state.estimate(estimate(1.0, 5.0), now);
        assert_eq!(state.history(3).collect::<Vec<_>>(), [5.0]);
    }

    /// Faults come worst first, and those of a node that has gone are not shown for ever.
    #[test]
    fn faults_are_sorted_and_age() {
        let (mut state, now) = (MonitorState::default(), Instant::now());
        for (name, level) in [("a", 0), ("b", 1), ("c", 2)] {
            let status = DiagnosticStatus {
                name: name.to_owned(),
                level,
                ..DiagnosticStatus::default()
            };
            state.diagnostic(status, now);
        }
        let names = |state: &MonitorState, at| {
            let faults = state.faults(at);
            faults.iter().map(|f| f.name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(names(&state, now), ["c", "b"]);
        assert!(names(&state, now + SILENCE * 3).is_empty());
    }
}
