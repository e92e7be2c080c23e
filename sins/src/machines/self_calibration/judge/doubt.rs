//! What speaks against an estimate, in words.

use super::findings::significant;
use super::{Finding, InnovationReport};
use crate::estimation::model;

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
            } => {
                let (words, [sigma, limit], unit) = in_words(state, [*sigma, *limit]);
                write!(
                    f,
                    "1 sigma of {words} is {sigma} {unit}, asked for at most {limit}"
                )
            }
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
            } => {
                let (words, [sigma, prior], unit) = in_words(state, [*sigma, *prior]);
                write!(
                    f,
                    "nothing has been learned of {words}: 1 sigma is {sigma} {unit}, and was {prior} before"
                )
            }
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

/// A state in words, values in its field unit, and the unit.
fn in_words(state: &'static str, values: [f64; 2]) -> (&'static str, [String; 2], &'static str) {
    match model::label(state) {
        Some(label) => (
            label.words,
            values.map(|value| significant(value / label.scale)),
            label.unit,
        ),
        None => (state, values.map(|value| format!("{value:.3e}")), ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::groups::bias::GYROSCOPE_DRIFT;
    use crate::units::DEG_PER_HOUR;

    /// Sigmas are told in the words and the unit that an engineer knows.
    #[test]
    fn sigmas_are_told_in_field_units() {
        let doubt = Doubt::Sigma {
            state: GYROSCOPE_DRIFT[0],
            sigma: 0.003_07 * DEG_PER_HOUR,
            limit: 0.002 * DEG_PER_HOUR,
        };
        let expected = "1 sigma of gyroscope drift x is 0.00307 deg/h, asked for at most 0.00200";
        assert_eq!(doubt.to_string(), expected);
    }
}
