//! What the monitor has heard, and when. No terminal and no DDS in here: messages and moments go in.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use ros2_interfaces::diagnostic_msgs::DiagnosticStatus;
use rotary_sins_msgs::interfaces::topics::{DIAGNOSTICS, ESTIMATE, SCHEME_STATUS};
use rotary_sins_msgs::{CalibrationOutlook, SchemeStatus, SelfCalibrationEstimate};
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::MISALIGNMENT;

/// Sigmas kept for the small curves.
const KEPT: usize = 240;
/// Without a message for longer than this, a stream has stopped.
pub const SILENCE: Duration = Duration::from_secs(5);
/// What is sent of the past comes at once; what comes later is the present.
const PRESENT: Duration = Duration::from_millis(1200);
/// The nine that calibration is about.
pub const NINE: usize = 9;

/// The groups of the whole model beside those nine: what they are called in a line of 80 columns (scale factors and
/// installation of the gyroscopes and the accelerometers, quadratic terms, arms, g-sensitivity, delay, table and encoders,
/// vertical channel), and how the names of their states begin.
const GROUPS: [(&str, &[&str]); 8] = [
    (
        "gyro",
        &["gyroscope_scale_factor_", "gyroscope_installation_"],
    ),
    (
        "acc",
        &["accelerometer_scale_factor_", "accelerometer_installation_"],
    ),
    ("quad", &["accelerometer_quadratic_"]),
    ("arms", &["accelerometer_arm_"]),
    ("g-sens", &["gyroscope_g_sensitivity_"]),
    ("delay", &["accelerometer_delay_"]),
    ("table", &["table_", "inner_axis_", "encoder_"]),
    ("up", &["height_error_", "velocity_error_up_"]),
];

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
    /// What the scheme will still bring, as the calibrator told it last.
    pub outlook: Option<Heard<CalibrationOutlook>>,
    /// Newest diagnostics by name.
    pub diagnostics: BTreeMap<String, Heard<DiagnosticStatus>>,
    /// Full names of the nodes that publish, by topic.
    pub publishers: BTreeMap<&'static str, Vec<String>>,
    /// When the first estimate came.
    first_estimate: Option<Instant>,
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
        self.first_estimate.get_or_insert(at);
        self.estimate = Some(Heard { message, at });
    }

    /// What the scheme will still bring.
    pub fn outlook(&mut self, message: CalibrationOutlook, at: Instant) {
        self.outlook = Some(Heard { message, at });
    }

    /// Whether what is known is the present of everybody who publishes: every topic that has publishers has been heard, every
    /// node that tells how it is has told it, and the estimates of the past, of which whoever comes late may be sent some, are over.
    pub fn is_present(&self, now: Instant) -> bool {
        let said = |topic: &str| {
            let publishers = self.publishers.get(topic);
            publishers.is_some_and(|publishers| !publishers.is_empty())
        };
        let told = |node: &String| {
            let name = node.rsplit('/').next().unwrap_or(node);
            let mut statuses = self.diagnostics.keys();
            statuses.any(|status| status.split(':').next() == Some(name))
        };
        let nodes = self.publishers.get(DIAGNOSTICS.name);
        let is_over = |first| now.saturating_duration_since(first) >= PRESENT;
        self.first_estimate.is_some_and(is_over)
            && (self.scheme.is_some() || !said(SCHEME_STATUS.name))
            && nodes.is_some_and(|nodes| nodes.iter().all(told))
    }

    /// The topics of the page that nobody publishes.
    pub fn silent(&self) -> Vec<&'static str> {
        let empty = |topic: &&str| self.publishers.get(topic).is_none_or(Vec::is_empty);
        [SCHEME_STATUS.name, ESTIMATE.name, DIAGNOSTICS.name]
            .into_iter()
            .filter(empty)
            .collect()
    }

    /// Of every group of the whole model that is estimated, the share by which the 1 sigma of its least known state has shrunk.
    pub fn groups(&self) -> Vec<(&'static str, f64)> {
        let Some(Heard { message, .. }) = &self.estimate else {
            return Vec::new();
        };
        let shares = |beginnings: &[&str]| {
            let states = message.state_names.iter().zip(&message.std);
            let priors = message.prior_std.iter().copied();
            states
                .zip(priors)
                .filter(|((name, _), prior)| {
                    *prior > 0.0 && beginnings.iter().any(|begin| name.starts_with(begin))
                })
                .map(|((_, sigma), prior)| (1.0 - sigma / prior).max(0.0))
                .reduce(f64::min)
        };
        GROUPS
            .into_iter()
            .filter_map(|(name, beginnings)| Some((name, shares(beginnings)?)))
            .collect()
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

/// What the calibrator asks for, in the same order \[SI\]; infinite where nothing is asked for or told.
pub fn thresholds(estimate: &SelfCalibrationEstimate) -> [f64; NINE] {
    let asked = |name: &str| {
        let at = estimate
            .state_names
            .iter()
            .position(|state| state == name)?;
        let threshold = *estimate.threshold.get(at)?;
        (threshold > 0.0).then_some(threshold)
    };
    let mut all = [f64::INFINITY; NINE];
    let names = MISALIGNMENT
        .into_iter()
        .chain(GYROSCOPE_DRIFT)
        .chain(ACCELEROMETER_BIAS);
    for (limit, name) in all.iter_mut().zip(names) {
        *limit = asked(name).unwrap_or(f64::INFINITY);
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

    /// A page is of the present when everybody who publishes has been heard, and not of what was there before.
    #[test]
    fn the_present_has_everybody_in_it() {
        let (mut state, now) = (MonitorState::default(), Instant::now());
        let nodes = ["/ship/self_calibrator", "/ship/navigation_compensator"];
        let nodes = nodes.map(str::to_owned).to_vec();
        assert_eq!(state.silent().len(), 3);
        state.publishers.insert(DIAGNOSTICS.name, nodes);
        state.estimate(estimate(1.0, 1.0), now);
        let later = now + PRESENT;
        let told = |name: &str| DiagnosticStatus {
            name: name.to_owned(),
            ..DiagnosticStatus::default()
        };
        state.diagnostic(told("self_calibrator: imu samples"), later);
        assert!(!state.is_present(later));
        state.diagnostic(told("navigation_compensator: navigation"), later);
        assert!(state.is_present(later) && !state.is_present(now));
        let sequencer = vec!["/ship/scheme_sequencer".to_owned()];
        state.publishers.insert(SCHEME_STATUS.name, sequencer);
        assert!(!state.is_present(later));
        assert_eq!(state.silent(), [ESTIMATE.name]);
    }

    /// Thresholds are those of the message, and a group is as well known as the least known of its states.
    #[test]
    fn thresholds_and_groups_are_told() {
        let (mut state, now) = (MonitorState::default(), Instant::now());
        let names = [
            GYROSCOPE_DRIFT[1],
            "gyroscope_scale_factor_x",
            "gyroscope_installation_xy_rad",
        ];
        let message = SelfCalibrationEstimate {
            state_names: names.map(str::to_owned).to_vec(),
            std: vec![1.0, 0.2, 0.5],
            prior_std: vec![2.0, 1.0, 1.0],
            threshold: vec![0.3, 0.0, 0.0],
            ..SelfCalibrationEstimate::default()
        };
        let told = thresholds(&message);
        assert_eq!((told[3], told[4]), (f64::INFINITY, 0.3));
        state.estimate(message, now);
        assert_eq!(state.groups(), [("gyro", 0.5)]);
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
