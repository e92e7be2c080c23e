//! What a scheme is searched for: sigmas and times of chosen states, weighed into one number.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::range;
use crate::studies::stretch::Space;
use crate::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

/// The share of the mean that decides between schemes whose worst parts are equal.
const TIE: f64 = 0.01;

/// How the goals of one heading become one number. Over the headings the worst one counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// A-optimal: root of the weighted mean square of every state's sigma and of every time.
    A,
    /// E-optimal: root of the largest eigenvalue of the weighted covariance, or the worst time.
    E,
    /// The worst of all weighted values; a hundredth of their mean decides between equals.
    #[default]
    Minimax,
}

/// What is asked of the states of a goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Their one-sigma at the end; 1 is this value, SI.
    SigmaAtEnd(f64),
    /// The time from which all of them stay below a limit (SI); 1 is that time \[s\].
    TimeBelow {
        /// One-sigma, SI.
        limit: f64,
        /// The time that counts as 1 \[s\].
        one_s: f64,
    },
}

/// One goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// Names of its states, all of one unit.
    pub states: Vec<String>,
    /// What is asked.
    pub measure: Measure,
    /// How much it counts; 1 is usual.
    pub weight: f64,
}

impl Goal {
    /// What is known to be possible at every heading with the paper's constraints: azimuth 11 arcsec at the end, every drift below
    /// 0.002 deg/h after 0.82 h, every bias below 10 ug after 0.45 h.
    pub fn paper() -> Vec<Self> {
        let below = |states: &[&str], limit: f64, hours: f64| Self {
            states: states.iter().map(|name| (*name).to_owned()).collect(),
            measure: Measure::TimeBelow {
                limit,
                one_s: hours * 3600.0,
            },
            weight: 1.0,
        };
        vec![
            Self {
                states: vec![MISALIGNMENT[2].to_owned()],
                measure: Measure::SigmaAtEnd(11.0 * ARC_SECOND),
                weight: 1.0,
            },
            below(&GYROSCOPE_DRIFT, 0.002 * DEG_PER_HOUR, 0.82),
            below(&ACCELEROMETER_BIAS, 10.0 * MICRO_G, 0.45),
        ]
    }
}

/// Goals over the states of a search.
#[derive(Clone, Debug)]
pub(super) struct Goals {
    pub criterion: Criterion,
    pub all: Vec<(Vec<usize>, Measure, f64)>,
    weights: f64,
}

impl Goals {
    /// Finds the states by their names.
    pub fn new(goals: &[Goal], criterion: Criterion, space: &Space) -> Result<Self, Error> {
        let mut found = Vec::new();
        for goal in goals {
            let states = goal
                .states
                .iter()
                .map(|name| {
                    space.position(name).ok_or_else(|| {
                        let known: Vec<&str> = space.labels.iter().map(|l| l.name).collect();
                        Error::setting("goal", name, format!("one of {}", known.join(", ")))
                    })
                })
                .collect::<Result<Vec<_>, Error>>()?;
            if states.is_empty() {
                return Err(Error::setting("states of a goal", "none", "at least one"));
            }
            range::positive("weight of a goal", goal.weight)?;
            match goal.measure {
                Measure::SigmaAtEnd(one) => {
                    range::positive("value of a goal", one)?;
                }
                Measure::TimeBelow { limit, one_s } => {
                    range::positive("limit of a goal", limit)?;
                    range::positive("time of a goal [s]", one_s)?;
                }
            }
            found.push((states, goal.measure, goal.weight));
        }
        if found.is_empty() {
            return Err(Error::setting("goals", "none", "at least one"));
        }
        let weights = found.iter().map(|(_, _, weight)| weight).sum();
        Ok(Self {
            criterion,
            all: found,
            weights,
        })
    }

    /// The greatest sigma of a goal's states over a limit.
    pub fn over_limit(&self, goal: usize, limit: f64, space: &Space, covariance: &[f64]) -> f64 {
        let sigma = |state: &usize| space.sigma(covariance, *state);
        self.all[goal].0.iter().map(sigma).fold(0.0, f64::max) / limit
    }

    /// Values of all goals (1: as asked) at the end of a run, from its covariance and the times \[s\].
    pub fn values(&self, space: &Space, covariance: &[f64], times_s: &[f64]) -> Vec<f64> {
        let value =
            |(goal, (states, measure, _)): (usize, &(Vec<usize>, Measure, f64))| match measure {
                Measure::SigmaAtEnd(one) => match self.criterion {
                    Criterion::Minimax => self.over_limit(goal, *one, space, covariance),
                    Criterion::A => {
                        let squares = states.iter().map(|s| space.sigma(covariance, *s).powi(2));
                        (squares.sum::<f64>() / states.len() as f64).sqrt() / one
                    }
                    Criterion::E => largest(space, covariance, states, *one),
                },
                Measure::TimeBelow { one_s, .. } => times_s[goal] / one_s,
            };
        self.all.iter().enumerate().map(value).collect()
    }

    /// The number of one heading.
    pub fn score(&self, values: &[f64]) -> f64 {
        let weighted = || values.iter().zip(&self.all).map(|(v, (_, _, w))| (v, w));
        let worst = weighted().map(|(v, w)| v * w).fold(0.0, f64::max);
        match self.criterion {
            Criterion::A => (weighted().map(|(v, w)| w * v * v).sum::<f64>() / self.weights).sqrt(),
            Criterion::E => worst,
            Criterion::Minimax => {
                worst + TIE * weighted().map(|(v, w)| w * v).sum::<f64>() / self.weights
            }
        }
    }

    /// What the score of a run will be at least, where the goals in `pending` are not yet met after `time_s`.
    pub fn at_least(&self, time_s: f64, pending: &[bool]) -> f64 {
        let values = self
            .all
            .iter()
            .zip(pending)
            .map(|((_, measure, _), pending)| match measure {
                Measure::TimeBelow { one_s, .. } if *pending => time_s / one_s,
                _ => 0.0,
            });
        let values: Vec<f64> = values.collect();
        self.score(&values)
    }
}

/// Root of the largest eigenvalue of the covariance of some states, over `one`.
fn largest(space: &Space, covariance: &[f64], states: &[usize], one: f64) -> f64 {
    let n = space.len();
    let block = DMatrix::from_fn(states.len(), states.len(), |i, j| {
        let (i, j) = (states[i], states[j]);
        covariance[i * n + j] * (space.scale[i] / one) * (space.scale[j] / one)
    });
    block.symmetric_eigenvalues().max().max(0.0).sqrt()
}
