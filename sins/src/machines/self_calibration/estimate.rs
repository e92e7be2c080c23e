//! What self-calibration hands back.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::Settings;
use super::encoders::EncoderUse;
use super::judge::{Evidence, Finding, InnovationReport, Testimony, Verdict};
use crate::earth::Position;
use crate::earth::rotation::HeadingPitchRoll;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::estimation::measurement::UpdateCounts;
use crate::estimation::state::serialized::shared;
use crate::estimation::state::{NamedCovariance, StateEstimate, StateValues};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::NoiseDensity;
use crate::sensor::errors::SensorErrors;
use crate::stream::counts::StreamCounts;
use crate::table::TableErrors;
use crate::time::Stamp;

/// Where self-calibration stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Samples are gathered, but no position has come yet. Leaves when the first valid fix comes.
    WaitingForPosition,
    /// Gravity and earth rate are being gathered in the inertial frame. Leaves when that has lasted long enough.
    CoarseAlignment,
    /// The filter runs; the block has not turned since. Leaves when the block has turned.
    FineAlignment,
    /// The block turns and the sensor errors come apart. Leaves when every state asked for is below its threshold.
    Calibrating,
    /// Every sigma is below its threshold and the innovations pass their test.
    Converged,
    /// The innovations fail their test: the filter does not describe these samples. Leaves when they pass again.
    Inconsistent,
}

impl Phase {
    /// The name that files and messages carry.
    pub fn name(self) -> &'static str {
        match self {
            Self::WaitingForPosition => "waiting_for_position",
            Self::CoarseAlignment => "coarse_alignment",
            Self::FineAlignment => "fine_alignment",
            Self::Calibrating => "calibrating",
            Self::Converged => "converged",
            Self::Inconsistent => "inconsistent",
        }
    }
}

/// A turn of the ship above this while the table works \[rad\] says that the table's axes are set wrong.
const IMPLAUSIBLE_TURN_RAD: f64 = 0.35;

/// A state whose one-sigma has shrunk by a smaller share than this kept its prior.
const KEPT: f64 = 0.05;

/// What stands for a one-sigma that is not known, in estimates and in messages.
pub const NOT_KNOWN: f64 = -1.0;

/// What happened to the samples on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleReport {
    /// Used, missing and refused samples, and how often the alignment was started anew.
    pub counts: StreamCounts,
    /// Velocity measurements that did not come in time (reference `Measured`).
    pub missing_velocities: u64,
    /// What became of the filter's measurements, over all alignments.
    pub updates: UpdateCounts,
}

impl SampleReport {
    /// Scalar measurements that the filter left out because their numbers were none or told nothing.
    pub fn refused_measurements(&self) -> u64 {
        self.updates.singular + self.updates.refused
    }

    /// Measurements that the filter left out, in words; `None` where there are none.
    pub fn measurements_left_out(&self) -> Option<String> {
        let (gated, refused) = (self.updates.gated, self.refused_measurements());
        (gated + refused > 0)
            .then(|| format!("{gated} measurements beyond their gate, {refused} refused"))
    }
}

/// The estimate after an update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Time of the estimate.
    pub stamp: Stamp,
    /// Where self-calibration stands.
    pub phase: Phase,
    /// Attitude of the block (b to n), velocity and position.
    pub navigation: NavigationState,
    /// Attitude of the ship: the block's with both joints turned back to zero.
    pub vehicle: HeadingPitchRoll,
    /// How far that has turned since fine alignment began \[rad\]. A moored ship does not turn by tens of degrees: if this does,
    /// the joints turn about other axes than the settings say.
    pub vehicle_turn_rad: f64,
    /// The sensor errors that have been found.
    pub errors: SensorErrors,
    /// The table's errors that have been found, by its encoders.
    pub table: TableErrors,
    /// The states of the filter by name; what has been fed back is zero in the navigation and included in the sensor errors.
    pub states: StateEstimate,
    /// One-sigma of the states before anything was measured; zero where a group is not estimated.
    pub prior: StateValues,
    /// Innovations.
    pub innovations: InnovationReport,
    /// The block has turned since fine alignment began, or did before an alignment that was started anew.
    pub turned: bool,
    /// What the filter beside says.
    pub testimony: Option<Testimony>,
    /// What the judge's tests found; they are made once a minute.
    #[serde(with = "shared")]
    pub findings: Arc<[Finding]>,
    /// What became of the encoders.
    pub encoders: EncoderUse,
    /// White noise that the filter takes the sensors to have.
    pub noise: NoiseDensity,
    /// The same as the samples at rest show it, gyroscopes \[rad/√s\] and accelerometers \[m/s/√s\]; none of an axis that does not
    /// rest, or of too few samples.
    pub noise_at_rest: [Option<f64>; 6],
    /// One-sigma of the ship's velocity that she is taken to have, east, north, up \[m/s\]; none where it is measured.
    pub ship_motion_m_s: Option<[f64; 3]>,
    /// Samples.
    pub samples: SampleReport,
    /// Time from the first sample of this alignment to `stamp` \[s\].
    pub duration_s: f64,
}

impl Estimate {
    pub(super) fn evidence(&self) -> Evidence<'_> {
        Evidence {
            innovations: self.innovations,
            counts: &self.samples.counts,
            covariance: self.states.covariance(),
            prior: Some(&self.prior),
            findings: &self.findings,
            turned: self.turned,
        }
    }

    /// What the judge says of it, by the thresholds of these settings. The phase says the same in one word.
    pub fn verdict(&self, settings: &Settings) -> Verdict {
        self.evidence().verdict(settings)
    }

    /// What record and scheme have taught of a state: the share by which its one-sigma has shrunk. `None` where nothing was
    /// said of it before.
    pub fn learned(&self, name: &str) -> Option<f64> {
        let prior = self.prior.value(name).filter(|sigma| *sigma > 0.0)?;
        Some((1.0 - self.states.sigma(name)? / prior).max(0.0))
    }

    /// States that kept their prior: what neither record nor scheme shows. Their estimates are not found, and their sigmas are
    /// what was known before.
    pub fn unobservable(&self) -> Vec<&str> {
        let names = self.states.states().iter();
        names
            .filter(|name| self.learned(name).is_some_and(|share| share < KEPT))
            .collect()
    }

    /// Covariance of the states.
    pub fn covariance(&self) -> &NamedCovariance {
        self.states.covariance()
    }

    /// One-sigma of three states; [`NOT_KNOWN`] where the filter does not have them.
    fn sigma3(&self, names: &[&str; 3]) -> Vector3<f64> {
        self.states
            .sigma3(names)
            .unwrap_or(Vector3::repeat(NOT_KNOWN))
    }

    /// Gyroscope drift ε, block axes \[rad/s\].
    pub fn gyroscope_drift(&self) -> Vector3<f64> {
        self.errors.gyroscope_drift
    }

    /// Its one-sigma \[rad/s\].
    pub fn gyroscope_drift_sigma(&self) -> Vector3<f64> {
        self.sigma3(&GYROSCOPE_DRIFT)
    }

    /// Accelerometer bias ∇, block axes \[m/s²\].
    pub fn accelerometer_bias(&self) -> Vector3<f64> {
        self.errors.accelerometer_bias
    }

    /// Its one-sigma \[m/s²\].
    pub fn accelerometer_bias_sigma(&self) -> Vector3<f64> {
        self.sigma3(&ACCELEROMETER_BIAS)
    }

    /// One-sigma of the misalignment (E, N, U) \[rad\].
    pub fn misalignment_sigma(&self) -> Vector3<f64> {
        self.sigma3(&MISALIGNMENT)
    }

    /// One-sigma of heading, pitch and roll of the ship \[rad\]; see [`HeadingPitchRoll::sigma`].
    pub fn vehicle_sigma(&self) -> HeadingPitchRoll {
        let unknown = HeadingPitchRoll {
            heading: NOT_KNOWN,
            pitch: NOT_KNOWN,
            roll: NOT_KNOWN,
        };
        let misalignment = self.covariance().block(&MISALIGNMENT);
        misalignment.map_or(unknown, |covariance| {
            HeadingPitchRoll::sigma(self.vehicle.heading, &covariance)
        })
    }

    /// Says so where the ship seems to turn with the table, for heading, pitch and roll are then meaningless. The sensor
    /// errors and the block's attitude do not depend on the joints.
    pub fn axes_doubt(&self) -> Option<String> {
        (self.vehicle_turn_rad > IMPLAUSIBLE_TURN_RAD).then(|| {
            format!(
                "the ship seems to have turned by {:.0} deg with the table: heading, pitch and roll are wrong, \
                 for outer_axis and inner_axis are not the table's",
                self.vehicle_turn_rad.to_degrees()
            )
        })
    }

    /// The calibration that this estimate amounts to.
    pub fn calibration(&self) -> Calibration {
        Calibration {
            stamp: self.stamp,
            phase: self.phase,
            errors: self.errors,
            table: self.table,
            attitude: self.navigation.attitude,
            position: self.navigation.position,
            covariance: self.covariance().clone(),
            samples: self.samples.counts.samples,
            gaps: self.samples.counts.gaps,
        }
    }
}

/// What navigation needs of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Time of the estimate.
    pub stamp: Stamp,
    /// Where self-calibration stood then.
    pub phase: Phase,
    /// The sensor errors to take out.
    pub errors: SensorErrors,
    /// Errors of the table and its encoders.
    pub table: TableErrors,
    /// Attitude of the block at `stamp` (b to n).
    pub attitude: UnitQuaternion<f64>,
    /// Position; the height stays as it was given.
    pub position: Position,
    /// Covariance at `stamp`, of the states that the filter had. Readers take those that they know; of one that is missing they
    /// know what they knew before.
    pub covariance: NamedCovariance,
    /// Samples that went into it.
    pub samples: u64,
    /// Gaps among them.
    pub gaps: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measurements that were left out are told in words, each kind with its number; where all were taken, nothing is said.
    #[test]
    fn what_was_left_out_is_told() {
        let mut samples = SampleReport::default();
        samples.updates.accepted = 9;
        assert_eq!(samples.measurements_left_out(), None);
        samples.updates.gated = 2;
        (samples.updates.singular, samples.updates.refused) = (1, 3);
        let told = samples.measurements_left_out();
        let expected = "2 measurements beyond their gate, 4 refused";
        assert_eq!(told.as_deref(), Some(expected));
    }
}
