//! One judge for everything that shows a verdict: is the estimate good enough, and does the filter describe its samples?

mod doubt;
mod findings;
mod innovations;
mod joints;
mod left_out;
mod turns;
mod verdict;
mod witness;

pub use doubt::Doubt;
pub use findings::{Finding, Test};
pub use innovations::InnovationReport;
pub use joints::Joints;
pub use left_out::{LeftOut, Single};
pub use turns::{MeanSquare, Turns};
pub use verdict::{TestResult, Verdict};
pub use witness::Testimony;

pub(super) use findings::Looked;
pub(super) use innovations::Judge;
pub(super) use witness::{Seen, Witness};

use super::{Phase, Settings};
use crate::estimation::state::{NamedCovariance, StateValues};
use crate::stream::counts::StreamCounts;

/// So many refused samples are an accident, whatever their share.
const REFUSED_AT_LEAST: u64 = 20;

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

    /// A state that is asked for and has kept its prior has not been learned, however loose the threshold is: it hinders convergence,
    /// and the reason says so. Where nothing is asked of it, it hinders nothing.
    #[test]
    fn an_unobservable_state_hinders_only_where_it_is_asked_for() {
        let state = "gyroscope_scale_factor_z";
        let counts = StreamCounts::default();
        let mut settings = settings();
        let mut judge = Judge::new(&settings);
        (0..40).for_each(|_| judge.take(2.0));
        let asked: Vec<&str> = settings.thresholds.iter().map(|(l, _)| l.name).collect();
        let sigmas = |of_state: f64| {
            let known = asked.iter().map(|name| (*name, 0.0));
            NamedCovariance::from_sigmas(known.chain([(state, of_state)])).unwrap()
        };
        let of_prior = NamedCovariance::from_sigmas([(state, 50e-6)]).unwrap();
        let prior = StateValues::new(of_prior.states().clone(), &[50e-6]).unwrap();
        let verdict = |sigma: f64, settings: &Settings| {
            let covariance = sigmas(sigma);
            let evidence = Evidence {
                prior: Some(&prior),
                ..evidence(&judge, &counts, &covariance)
            };
            evidence.verdict(settings)
        };
        // Nothing is asked of it.
        let idle = verdict(50e-6, &settings);
        assert!(idle.converged && idle.learned, "{idle:?}");
        // A threshold above the prior is reached from the beginning, and nothing has been learned.
        settings.thresholds.ask(state, 100e-6).unwrap();
        let kept = verdict(50e-6, &settings);
        assert!(!kept.converged && kept.consistent && kept.sigmas && !kept.learned);
        let expected = "nothing has been learned of gyroscope scale factor z: 1 sigma is 50.0 ppm, and was 50.0 before";
        assert_eq!(kept.reasons, [expected]);
        // Learned, it does not hinder.
        let found = verdict(10e-6, &settings);
        assert!(
            found.converged && found.learned && found.reasons.is_empty(),
            "{found:?}"
        );
        // A threshold below what it has kept hinders too, and first.
        settings.thresholds.ask(state, 10e-6).unwrap();
        let hidden = verdict(50e-6, &settings);
        assert!(!hidden.converged && !hidden.sigmas && !hidden.learned);
        assert!(hidden.reasons[0].starts_with("1 sigma of gyroscope scale factor z is 50.0 ppm"));
    }
}
