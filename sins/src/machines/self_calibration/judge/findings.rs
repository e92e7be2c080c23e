//! What the judge's tests found, each with a figure, its bound and a sentence.

use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

use super::super::ModelChoice;
use super::joints::Joints;
use super::left_out::Single;
use super::witness::Testimony;
use crate::estimation::any_filter::AnyFilter;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::table::BASE_ATTITUDE;
use crate::estimation::model::CALIBRATED_NAMES;
use crate::estimation::model::{self, Model, Whole};
use crate::estimation::state::{StateEstimate, StateLabel, StateValues};
use crate::units::ARC_SECOND;

/// So many sigmas a latitude may be from that of the fix, and a filter of coarse samples from the witness.
const SIGMAS: f64 = 4.75;
/// So many sigmas the best of some 45 states that are left out may be from zero.
const BEST_SIGMAS: f64 = 5.0;
/// So many sigmas of both the judged filter may be from the witness; the same samples are in both, so that they differ by less.
const WITNESS_SIGMAS: f64 = 3.75;
/// So many sigmas of its prior a state may be.
const PRIOR_SIGMAS: f64 = 4.0;
/// An azimuth more uncertain than this when the loop closes is not linear \[rad\].
const LINEAR_RAD: f64 = 0.125;

/// A test by its name in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Test {
    /// The level of the innovations at rest, against the noise of the samples.
    Rest,
    /// The same over long stretches.
    White,
    /// Innovations after turns against those at rest.
    Turns,
    /// What the model leaves out.
    LeftOut,
    /// The one of them that explains the samples best.
    LeftOutState,
    /// Misalignment, biases and drifts against the witness.
    Witness,
    /// Latitude by the earth's rate against the fix.
    Latitude,
    /// What was learned against what was known before.
    Prior,
    /// Joints against gyroscopes.
    Joints,
    /// Whether the filter began near enough.
    Linearity,
    /// The noise of the samples at rest, against what was told of it.
    Noise,
}

impl Test {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Rest,
        Self::White,
        Self::Turns,
        Self::LeftOut,
        Self::LeftOutState,
        Self::Witness,
        Self::Latitude,
        Self::Prior,
        Self::Joints,
        Self::Linearity,
        Self::Noise,
    ];

    /// Its name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::White => "white",
            Self::Turns => "turns",
            Self::LeftOut => "left_out",
            Self::LeftOutState => "left_out_state",
            Self::Witness => "witness",
            Self::Latitude => "latitude",
            Self::Prior => "prior",
            Self::Joints => "joints",
            Self::Linearity => "linearity",
            Self::Noise => "noise",
        }
    }
}

/// What a test found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Which.
    pub test: Test,
    /// The figure that it is about.
    pub figure: f64,
    /// How large it may be.
    pub bound: f64,
    /// The state that it is about, with its value and the sigma that goes with it, SI.
    #[serde(with = "crate::estimation::state::serialized::about")]
    pub about: Option<(&'static StateLabel, f64, f64)>,
}

impl Finding {
    /// On how uncertain the azimuth is about which a filter is linear \[rad\].
    pub(in crate::machines::self_calibration) fn linearity(azimuth_rad: f64) -> Self {
        Self {
            test: Test::Linearity,
            figure: azimuth_rad,
            bound: LINEAR_RAD,
            about: None,
        }
    }

    /// Whether the figure is within its bound; not a number is not.
    pub fn passes(&self) -> bool {
        self.figure <= self.bound
    }
}

/// Digits that a person reads.
pub(super) fn significant(value: f64) -> String {
    let digits = if value == 0.0 {
        0
    } else {
        (2 - value.abs().log10().floor() as i32).clamp(0, 6)
    };
    format!("{value:.*}", digits as usize)
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (figure, bound) = (significant(self.figure), significant(self.bound));
        let about = self.about.map(|(label, value, sigma)| {
            let in_unit = |value: f64| significant(value / label.scale);
            (label, in_unit(value), in_unit(sigma))
        });
        match (self.test, about) {
            (Test::Rest, _) => write!(
                f,
                "at rest the innovations are {figure} times what the noise of the samples explains (mean square over 20 s, \
                 at most {bound}): the sensors are noisier than their covariances say, or the ship moves slowly"
            ),
            (Test::White, _) => write!(
                f,
                "over long stretches the innovations are {figure} times what the noise of the samples explains (mean square, at \
                 most {bound}): drifts or biases wander more than was said"
            ),
            (Test::Turns, _) => write!(
                f,
                "after turns the innovations are {figure} times those at rest (mean square over 20 s, at most {bound}): \
                 something turns with the block that no state describes"
            ),
            (Test::LeftOut, Some((label, value, sigma))) => write!(
                f,
                "{} {value} ± {sigma} {}: the model paper does not hold it (chi-square of all that it leaves out {figure}, \
                 at most {bound})",
                label.words, label.unit
            ),
            (Test::LeftOutState, Some((label, value, sigma))) => write!(
                f,
                "{} {value} ± {sigma} {}: the model paper does not hold it ({figure} sigma by itself, at most {bound})",
                label.words, label.unit
            ),
            (Test::Witness, Some((label, value, sigma))) => write!(
                f,
                "{} is {figure} sigma from what a whole model finds on the same samples (by {value} {}, 1 sigma of the \
                 difference {sigma}, at most {bound} sigma)",
                label.words, label.unit
            ),
            (Test::Latitude, Some((_, value, sigma))) => write!(
                f,
                "the earth's rate shows another latitude than the fix, by {value} ± {sigma} arcsec ({figure} sigma, at most {bound})"
            ),
            (Test::Prior, Some((label, value, sigma))) => write!(
                f,
                "{} {value} {} is {figure} times its prior of {sigma} (at most {bound}): the prior is too narrow for this sensor",
                label.words, label.unit
            ),
            (Test::Joints, _) => write!(
                f,
                "joints and gyroscopes differ by {} arcsec over a motion (at most {}): axes, signs or scale of the joints are told wrong",
                significant(self.figure / ARC_SECOND),
                significant(self.bound / ARC_SECOND)
            ),
            (Test::Linearity, _) => write!(
                f,
                "the azimuth was uncertain by {} deg after coarse alignment (at most {}): a filter that is linear about it is not to be \
                 believed, and a second pass is needed",
                significant(self.figure.to_degrees()),
                significant(self.bound.to_degrees())
            ),
            (Test::Noise, Some((label, ..))) => write!(
                f,
                "samples at rest are {figure} times as noisy as they say, or as was said of them (at most {bound}), worst on the axis of \
                 {}: take the noise from the samples (noise_from: rest), or tell it",
                label.words
            ),
            (test, None) => write!(f, "{}: {figure}, at most {bound}", test.name()),
        }
    }
}

/// What the tests look at.
pub(in crate::machines::self_calibration) struct Looked<'a> {
    pub(in crate::machines::self_calibration) testimony: Option<&'a Testimony>,
    pub(in crate::machines::self_calibration) joints: &'a Joints,
    pub(in crate::machines::self_calibration) filter: &'a AnyFilter,
    pub(in crate::machines::self_calibration) states: &'a StateEstimate,
    pub(in crate::machines::self_calibration) prior: &'a StateValues,
    pub(in crate::machines::self_calibration) linearity: Finding,
    /// Attitude of the block as the filter believes it to be.
    pub(in crate::machines::self_calibration) attitude: UnitQuaternion<f64>,
    pub(in crate::machines::self_calibration) model: ModelChoice,
    pub(in crate::machines::self_calibration) turned: bool,
    /// The noisiest axis (gyroscopes, then accelerometers) against what was told: how much noisier, and how much that may be.
    pub(in crate::machines::self_calibration) noisiest: Option<(usize, f64, f64)>,
}

impl Looked<'_> {
    /// What can be judged by now.
    pub(in crate::machines::self_calibration) fn findings(&self) -> Vec<Finding> {
        let mut findings = vec![self.linearity];
        findings.extend(self.farthest());
        if let Some((figure, bound)) = self.joints.turn() {
            findings.push(Finding {
                test: Test::Joints,
                figure,
                bound,
                about: None,
            });
        }
        findings.extend(
            self.noisiest
                .filter(|_| self.turned)
                .and_then(|(axis, figure, bound)| {
                    let name = [GYROSCOPE_DRIFT, ACCELEROMETER_BIAS].concat()[axis];
                    Some(Finding {
                        test: Test::Noise,
                        figure,
                        bound,
                        about: Some((model::label(name)?, 0.0, 0.0)),
                    })
                }),
        );
        let Some(testimony) = self.testimony.filter(|_| self.turned) else {
            return findings;
        };
        let of = |test: Test, (figure, bound): (f64, f64)| Finding {
            test,
            figure,
            bound,
            about: None,
        };
        findings.extend(testimony.turns.at_rest().map(|found| of(Test::Rest, found)));
        let is_fine = !testimony.is_coarse;
        let white = testimony.turns.whiteness().filter(|_| is_fine);
        findings.extend(white.map(|found| of(Test::White, found)));
        let turns = testimony.turns.ratio().filter(|_| is_fine);
        findings.extend(turns.map(|found| of(Test::Turns, found)));
        let single = |test: Test, found: &Single, figure: f64, bound: f64| Finding {
            test,
            figure,
            bound,
            about: Whole::LIST
                .get(found.state)
                .map(|label| (label, found.value, found.sigma)),
        };
        let left_out = &testimony.left_out;
        let latitude = single(
            Test::Latitude,
            &left_out.latitude,
            left_out.latitude.over().abs(),
            SIGMAS,
        );
        if left_out.latitude.sigma > 0.0 {
            findings.push(latitude);
        }
        if self.model == ModelChoice::Paper && left_out.bound > 0.0 && is_fine {
            findings.push(single(
                Test::LeftOut,
                &left_out.best,
                left_out.sum,
                left_out.bound,
            ));
            findings.push(single(
                Test::LeftOutState,
                &left_out.best,
                left_out.best.over().abs(),
                BEST_SIGMAS,
            ));
        }
        findings.extend(self.apart(testimony));
        findings
    }

    /// The state that is farthest from what was known of it.
    fn farthest(&self) -> Option<Finding> {
        let mut worst: Option<Finding> = None;
        for (name, value) in self
            .states
            .states()
            .iter()
            .zip(self.states.values().iter().copied())
        {
            if self.filter.is_moving(name) || BASE_ATTITUDE.contains(&name) {
                continue;
            }
            let (Some(sigma), Some(label)) = (
                self.prior.value(name).filter(|s| *s > 0.0),
                model::label(name),
            ) else {
                continue;
            };
            let figure = value.abs() / sigma;
            if worst.is_none_or(|worst| figure > worst.figure) {
                worst = Some(Finding {
                    test: Test::Prior,
                    figure,
                    bound: PRIOR_SIGMAS,
                    about: Some((label, value, sigma)),
                });
            }
        }
        worst
    }

    /// The greatest difference to the witness.
    fn apart(&self, testimony: &Testimony) -> Option<Finding> {
        let misalignment = (testimony.attitude * self.attitude.inverse()).scaled_axis();
        let mut worst: Option<Finding> = None;
        for (state, name) in CALIBRATED_NAMES.into_iter().enumerate() {
            let (sigma, label) = (self.states.sigma(name)?, model::label(name)?);
            let difference = match misalignment.as_slice().get(state) {
                Some(angle) => *angle,
                None => testimony.nine[state] - self.states.value(name)?,
            };
            let sigma = sigma.hypot(testimony.sigmas[state]);
            let figure = difference.abs() / sigma;
            if worst.is_none_or(|worst| figure > worst.figure) {
                worst = Some(Finding {
                    test: Test::Witness,
                    figure,
                    bound: if testimony.is_coarse {
                        SIGMAS
                    } else {
                        WITNESS_SIGMAS
                    },
                    about: Some((label, difference, sigma)),
                });
            }
        }
        worst
    }
}
