//! One judge for everything that shows a verdict: is the estimate good enough, and does the filter describe its samples?

use serde::{Deserialize, Serialize};

mod findings;
mod joints;
mod left_out;
mod turns;
mod witness;

pub use findings::{Finding, Test};
pub use joints::Joints;
pub use left_out::{LeftOut, Single};
pub use turns::{MeanSquare, Turns};
pub use witness::Testimony;

pub(super) use findings::Looked;
pub(super) use witness::{Seen, Witness};

use super::{Phase, Settings};
use crate::estimation::consistency::InnovationWindow;
use crate::estimation::state::{NamedCovariance, StateValues};
use crate::stream::counts::StreamCounts;

/// So many refused samples are an accident, whatever their share.
const REFUSED_AT_LEAST: u64 = 20;

/// The test of the innovations over a run. What failed stays failed until windows enough have passed in a row.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Judge {
    window: InnovationWindow,
    last: f64,
    failures: u64,
    /// Updates that full windows have passed since the last failure; counts only while there was one.
    agreed: u64,
    doubtful: bool,
    recovery_updates: u64,
}

impl Judge {
    pub(super) fn new(settings: &Settings) -> Self {
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
    pub(super) fn of_next_alignment(&self, settings: &Settings) -> Self {
        Self {
            failures: self.failures,
            doubtful: self.doubtful,
            ..Self::new(settings)
        }
    }

    /// Takes the normalized innovation squared of an update.
    pub(super) fn take(&mut self, normalized_squared: f64) {
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

    pub(super) fn report(&self) -> InnovationReport {
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

/// What speaks against an estimate.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// The filter does not run yet.
    NotAligned,
    /// The innovations do not agree with the covariance, now or not long ago.
    Innovations(InnovationReport),
    /// The innovations cannot be judged yet.
    WindowNotFull,
    /// The block has not turned.
    NotTurned,
    /// A state is less well known than was asked for.
    Sigma {
        /// Its name.
        state: &'static str,
        /// One-sigma, SI.
        sigma: f64,
        /// What was asked for, SI.
        limit: f64,
    },
    /// A state is asked for that the filter does not have.
    NotEstimated {
        /// Its name.
        state: &'static str,
    },
    /// A state is asked for that has kept its prior: nothing has been learned of it.
    NotLearned {
        /// Its name.
        state: &'static str,
        /// One-sigma, SI.
        sigma: f64,
        /// One-sigma before, SI.
        prior: f64,
    },
    /// A test failed.
    Found(Finding),
    /// Too many samples were refused.
    Refused {
        /// So many.
        refused: u64,
        /// Of so many that came.
        of: u64,
    },
    /// Too many holes.
    Holes {
        /// So many.
        gaps: u64,
        /// Among so many samples.
        of: u64,
    },
}

impl std::fmt::Display for Doubt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotAligned => f.write_str("the filter does not run yet"),
            Self::Innovations(i) if i.window_mean > i.window_bound => write!(
                f,
                "the innovations do not agree with the covariance: mean NIS {:.2}, bound {:.2}",
                i.window_mean, i.window_bound
            ),
            Self::Innovations(i) => write!(
                f,
                "the innovations did not agree with the covariance at {} updates; {} of {} updates have agreed since",
                i.failures, i.agreed, i.recovery
            ),
            Self::WindowNotFull => f.write_str("too few updates to judge the innovations by"),
            Self::NotTurned => f.write_str("the block has not turned"),
            Self::Sigma {
                state,
                sigma,
                limit,
            } => write!(
                f,
                "1 sigma of {state} is {sigma:.3e}, asked for at most {limit:.3e}"
            ),
            Self::NotEstimated { state } => {
                write!(
                    f,
                    "{state} is asked for, and is none of the filter's states"
                )
            }
            Self::NotLearned {
                state,
                sigma,
                prior,
            } => write!(
                f,
                "nothing has been learned of {state}: 1 sigma is {sigma:.3e}, and was {prior:.3e} before"
            ),
            Self::Found(finding) => finding.fmt(f),
            Self::Refused { refused, of } => write!(
                f,
                "{refused} of {of} samples were refused ({:.1} %)",
                100.0 * *refused as f64 / *of as f64
            ),
            Self::Holes { gaps, of } => write!(f, "{gaps} holes among {of} samples"),
        }
    }
}

/// The verdict on an estimate.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "one a test, as the JSON has it"
)]
pub struct Verdict {
    /// Everything asked for is found, and nothing speaks against it: the phase is `converged`.
    pub converged: bool,
    /// The filter describes its samples.
    pub consistent: bool,
    /// The innovations pass their test, and have for long enough where they once did not.
    pub innovations: bool,
    /// Samples came in order, whole and plausible, but for few.
    pub samples: bool,
    /// Every sigma is below its threshold.
    pub sigmas: bool,
    /// The block has turned, so that sensor errors and attitude come apart.
    pub turned: bool,
    /// Every state that is asked for is better known than before.
    pub learned: bool,
    /// What speaks against the estimate, in words; empty where it converged.
    pub reasons: Vec<String>,
    /// Every test that could be made.
    pub tests: Vec<TestResult>,
}

/// A test as JSON has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TestResult {
    /// Its name.
    pub name: &'static str,
    /// Whether it passed.
    pub passed: bool,
    /// Its figure.
    pub figure: f64,
    /// How large the figure may be.
    pub bound: f64,
    /// The state that the figure is about, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<&'static str>,
    /// Its value or difference, SI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The one-sigma that goes with it, SI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

impl From<&Finding> for TestResult {
    fn from(finding: &Finding) -> Self {
        Self {
            name: finding.test.name(),
            passed: finding.passes(),
            figure: finding.figure,
            bound: finding.bound,
            state: finding.about.map(|(label, _, _)| label.name),
            value: finding.about.map(|(_, value, _)| value),
            sigma: finding.about.map(|(_, _, sigma)| sigma),
        }
    }
}

/// A state that is asked for and keeps more than this share of its prior sigma has not been learned.
const LEARNED_SHARE: f64 = 0.7;

/// What the judge looks at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence<'a> {
    pub(super) innovations: InnovationReport,
    pub(super) counts: &'a StreamCounts,
    pub(super) covariance: &'a NamedCovariance,
    /// One-sigma of the states before anything was measured.
    pub(super) prior: Option<&'a StateValues>,
    pub(super) findings: &'a [Finding],
    pub(super) turned: bool,
}

impl Evidence<'_> {
    /// The phase of a running filter.
    pub(super) fn phase(&self, settings: &Settings) -> Phase {
        if self.innovations.doubtful || self.failed().next().is_some() {
            Phase::Inconsistent
        } else if !self.turned {
            Phase::FineAlignment
        } else if self.innovations.is_full
            && self.stream_doubt(settings).is_none()
            && self.sigma_doubt(settings).is_none()
            && self.unlearned(settings).is_none()
        {
            Phase::Converged
        } else {
            Phase::Calibrating
        }
    }

    /// What speaks against the estimate, the worst first.
    pub(super) fn doubts(&self, settings: &Settings) -> Vec<Doubt> {
        let innovations = self.innovations;
        let mut doubts = Vec::new();
        if innovations.doubtful {
            doubts.push(Doubt::Innovations(innovations));
        } else if !innovations.is_full {
            doubts.push(Doubt::WindowNotFull);
        }
        doubts.extend(self.failed().map(|finding| Doubt::Found(*finding)));
        if !self.turned {
            doubts.push(Doubt::NotTurned);
        }
        doubts.extend(self.stream_doubt(settings));
        doubts.extend(self.sigma_doubt(settings));
        doubts.extend(self.unlearned(settings));
        doubts
    }

    /// Tests that failed.
    fn failed(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !finding.passes())
    }

    /// A state that is asked for and that nothing has been learned of.
    fn unlearned(&self, settings: &Settings) -> Option<Doubt> {
        settings.thresholds.iter().find_map(|(label, _)| {
            let state = label.name;
            let sigma = self.covariance.sigma(state)?;
            let prior = self.prior?.value(state)?;
            (prior > 0.0 && sigma > LEARNED_SHARE * prior).then_some(Doubt::NotLearned {
                state,
                sigma,
                prior,
            })
        })
    }

    fn sigma_doubt(&self, settings: &Settings) -> Option<Doubt> {
        let mut worst: Option<(Doubt, f64)> = None;
        for (label, limit) in settings.thresholds.iter() {
            let state = label.name;
            let Some(sigma) = self.covariance.sigma(state) else {
                return Some(Doubt::NotEstimated { state });
            };
            let share = sigma / limit;
            // Not a number is not below anything.
            let is_above = share.is_nan() || share > 1.0;
            if is_above
                && worst
                    .as_ref()
                    .is_none_or(|(_, w)| share.total_cmp(w).is_ge())
            {
                let doubt = Doubt::Sigma {
                    state,
                    sigma,
                    limit,
                };
                worst = Some((doubt, share));
            }
        }
        worst.map(|(doubt, _)| doubt)
    }

    fn stream_doubt(&self, settings: &Settings) -> Option<Doubt> {
        let (refused, used) = (self.counts.refused(), self.counts.samples);
        let of = refused + used;
        if refused >= REFUSED_AT_LEAST && refused as f64 > settings.refused_share * of as f64 {
            return Some(Doubt::Refused { refused, of });
        }
        let gaps = self.counts.gaps;
        (gaps >= REFUSED_AT_LEAST && gaps as f64 > settings.gap_share * used as f64)
            .then_some(Doubt::Holes { gaps, of: used })
    }

    /// The verdict.
    pub(super) fn verdict(&self, settings: &Settings) -> Verdict {
        let phase = self.phase(settings);
        Verdict {
            converged: phase == Phase::Converged,
            consistent: phase != Phase::Inconsistent,
            innovations: self.innovations.is_full && !self.innovations.doubtful,
            samples: self.stream_doubt(settings).is_none(),
            sigmas: self.sigma_doubt(settings).is_none(),
            turned: self.turned,
            learned: self.unlearned(settings).is_none(),
            reasons: self.doubts(settings).iter().map(Doubt::to_string).collect(),
            tests: self.findings.iter().map(TestResult::from).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::Thresholds;
    use super::*;

    /// Whatever is asked for is known to `sigma`.
    fn known(settings: &Settings, sigma: f64) -> NamedCovariance {
        let states = settings.thresholds.iter();
        NamedCovariance::from_sigmas(states.map(|(label, _)| (label.name, sigma))).unwrap()
    }

    fn settings() -> Settings {
        Settings {
            window_updates: 30,
            recovery_windows: 3,
            ..Settings::default()
        }
    }

    fn evidence<'a>(
        judge: &Judge,
        counts: &'a StreamCounts,
        covariance: &'a NamedCovariance,
    ) -> Evidence<'a> {
        Evidence {
            innovations: judge.report(),
            counts,
            covariance,
            prior: None,
            findings: &[],
            turned: true,
        }
    }

    /// A run that was inconsistent stays so until windows enough have agreed, also over a new alignment, and says why.
    #[test]
    fn doubt_lasts_until_windows_enough_agree() {
        let settings = settings();
        let (counts, sigma) = (StreamCounts::default(), known(&settings, 0.0));
        let mut judge = Judge::new(&settings);
        (0..40).for_each(|_| judge.take(2.0));
        let good = evidence(&judge, &counts, &sigma).verdict(&settings);
        assert!(good.converged && good.consistent && good.reasons.is_empty());
        (0..40).for_each(|_| judge.take(30.0));
        (0..60).for_each(|_| judge.take(2.0));
        let verdict = evidence(&judge, &counts, &sigma).verdict(&settings);
        assert!(!verdict.converged && !verdict.consistent);
        assert!(
            verdict.reasons[0].contains("have agreed since"),
            "{verdict:?}"
        );
        let mut next = judge.of_next_alignment(&settings);
        assert!(next.report().doubtful);
        (0..118).for_each(|_| next.take(2.0));
        assert!(next.report().doubtful);
        (0..2).for_each(|_| next.take(2.0));
        assert!(!next.report().doubtful);
        assert!(
            evidence(&next, &counts, &sigma)
                .verdict(&settings)
                .converged
        );
    }

    /// Half of the samples refused is never converged; one in a thousand is.
    #[test]
    fn refused_samples_speak_against_the_estimate() {
        let settings = settings();
        let sigma = known(&settings, 0.0);
        let mut judge = Judge::new(&settings);
        (0..40).for_each(|_| judge.take(2.0));
        for (repeated, converged) in [(5000, false), (5, true)] {
            let counts = StreamCounts {
                samples: 5000,
                repeated,
                ..StreamCounts::default()
            };
            let verdict = evidence(&judge, &counts, &sigma).verdict(&settings);
            assert_eq!((verdict.converged, verdict.consistent), (converged, true));
            assert_eq!(verdict.samples, converged);
        }
    }

    /// A sigma above its threshold, and a state that the filter does not have, are never converged, and the reason names them; a
    /// state that nothing is asked of does not hinder.
    #[test]
    fn what_is_asked_for_must_be_known() {
        let mut settings = settings();
        let counts = StreamCounts::default();
        let mut judge = Judge::new(&settings);
        (0..40).for_each(|_| judge.take(2.0));
        let covariance = known(&settings, 1.0);
        let verdict = evidence(&judge, &counts, &covariance).verdict(&settings);
        assert!(!verdict.converged && !verdict.sigmas);
        let covariance = known(&settings, 0.0);
        settings
            .thresholds
            .ask("gyroscope_scale_factor_z", 1e-6)
            .unwrap();
        let verdict = evidence(&judge, &counts, &covariance).verdict(&settings);
        assert!(!verdict.converged && verdict.reasons[0].contains("gyroscope_scale_factor_z"));
        let covariance = known(&settings, 1e9);
        settings.thresholds = Thresholds::NONE;
        let verdict = evidence(&judge, &counts, &covariance).verdict(&settings);
        assert!(verdict.converged, "{verdict:?}");
    }
}
