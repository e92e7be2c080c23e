//! What is kept of the estimates, be they recorded or made from the samples.

use rotary_sins_msgs::SelfCalibrationEstimate;
use rotary_sins_msgs::convert::stamp_from_time;
use sins::{
    earth::rotation::HeadingPitchRoll,
    machines::self_calibration::{Estimate, Phase, TestResult},
    time::Stamp,
};

use super::thin::{POINTS, Peaks, Thinned};

/// Phases that are listed; a filter that changes its mind every second is known by then.
const PHASES: usize = 200;
/// Names of the phases by their number in messages.
const PHASE_NAMES: [&str; 6] = [
    "waiting for position",
    "coarse alignment",
    "fine alignment",
    "calibrating",
    "converged",
    "inconsistent",
];

/// The name of a phase for people.
pub fn phase_name(phase: u8) -> &'static str {
    PHASE_NAMES
        .get(usize::from(phase))
        .copied()
        .unwrap_or("unknown phase")
}

/// The number of a phase in messages.
pub fn phase_number(phase: Phase) -> u8 {
    match phase {
        Phase::WaitingForPosition => SelfCalibrationEstimate::WAITING_FOR_POSITION,
        Phase::CoarseAlignment => SelfCalibrationEstimate::COARSE_ALIGNMENT,
        Phase::FineAlignment => SelfCalibrationEstimate::FINE_ALIGNMENT,
        Phase::Calibrating => SelfCalibrationEstimate::CALIBRATING,
        Phase::Converged => SelfCalibrationEstimate::CONVERGED,
        Phase::Inconsistent => SelfCalibrationEstimate::INCONSISTENT,
    }
}

/// An estimate with its numbers, SI.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its time.
    pub stamp: Stamp,
    /// Gyroscope drifts and their sigmas.
    pub drift: [[f64; 3]; 2],
    /// Accelerometer biases and their sigmas.
    pub bias: [[f64; 3]; 2],
    /// Sigmas of the misalignment.
    pub misalignment_sigma: [f64; 3],
    /// Attitude of the ship.
    pub vehicle: HeadingPitchRoll,
    /// Its sigmas.
    pub vehicle_sigma: HeadingPitchRoll,
    /// Mean NIS of the window.
    pub nis_mean: f64,
    /// Its bound.
    pub nis_bound: f64,
}

impl From<&SelfCalibrationEstimate> for Point {
    fn from(message: &SelfCalibrationEstimate) -> Self {
        let angles = |heading, pitch, roll| HeadingPitchRoll {
            heading,
            pitch,
            roll,
        };
        Self {
            stamp: stamp_from_time(message.header.stamp),
            drift: [message.gyroscope_drift, message.gyroscope_drift_std],
            bias: [message.accelerometer_bias, message.accelerometer_bias_std],
            misalignment_sigma: message.misalignment_std,
            vehicle: angles(message.heading, message.pitch, message.roll),
            vehicle_sigma: angles(message.heading_std, message.pitch_std, message.roll_std),
            nis_mean: message.nis_window_mean,
            nis_bound: message.nis_upper_bound,
        }
    }
}

impl From<&Estimate> for Point {
    fn from(estimate: &Estimate) -> Self {
        Self {
            stamp: estimate.stamp,
            drift: [
                estimate.gyroscope_drift().into(),
                estimate.gyroscope_drift_sigma().into(),
            ],
            bias: [
                estimate.accelerometer_bias().into(),
                estimate.accelerometer_bias_sigma().into(),
            ],
            misalignment_sigma: estimate.misalignment_sigma().into(),
            vehicle: estimate.vehicle,
            vehicle_sigma: estimate.vehicle_sigma(),
            nis_mean: estimate.innovations.window_mean,
            nis_bound: estimate.innovations.window_bound,
        }
    }
}

/// A state of the newest estimate, SI.
#[derive(Clone, Debug)]
pub struct NamedState {
    /// Its name.
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// 1 sigma.
    pub sigma: f64,
    /// 1 sigma before anything was measured, where the record tells.
    pub prior: Option<f64>,
}

/// The states of a recorded estimate.
pub fn recorded_states(message: &SelfCalibrationEstimate) -> Vec<NamedState> {
    let numbers = message
        .state_names
        .iter()
        .zip(&message.state)
        .zip(&message.std);
    let prior = |at: usize| message.prior_std.get(at).copied();
    numbers
        .enumerate()
        .map(|(at, ((name, value), sigma))| NamedState {
            name: name.clone(),
            value: *value,
            sigma: *sigma,
            prior: prior(at).filter(|sigma| *sigma > 0.0),
        })
        .collect()
}

/// The states of one of our own.
pub fn own_states(estimate: &Estimate) -> Vec<NamedState> {
    let states = &estimate.states;
    let named = states.states().iter().zip(states.values());
    named
        .map(|(name, value)| NamedState {
            name: name.to_owned(),
            value: *value,
            sigma: states.sigma(name).unwrap_or_default(),
            prior: estimate.prior.value(name).filter(|sigma| *sigma > 0.0),
        })
        .collect()
}

/// Counts that come with an estimate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Samples used.
    pub samples: u64,
    /// Holes among them.
    pub gaps: u64,
    /// Samples missing.
    pub lost: u64,
    /// Measurements beyond their gate; where the estimates are recorded, nothing tells.
    pub gated: Option<u64>,
    /// Measurements refused, likewise.
    pub refused: Option<u64>,
    /// Length of the alignment \[s\].
    pub duration_s: f64,
}

impl From<&Estimate> for Counts {
    fn from(estimate: &Estimate) -> Self {
        let counts = estimate.samples.counts;
        Self {
            samples: counts.samples,
            gaps: counts.gaps,
            lost: counts.lost,
            gated: Some(estimate.samples.updates.gated),
            refused: Some(estimate.samples.refused_measurements()),
            duration_s: estimate.duration_s,
        }
    }
}

/// A phase and when it began.
#[derive(Clone, Copy, Debug)]
pub struct PhaseChange {
    /// Its beginning.
    pub stamp: Stamp,
    /// Its number in messages.
    pub phase: u8,
}

/// Everything that is kept of the estimates.
pub struct History {
    points: Thinned<Point>,
    singles: Peaks,
    /// Phases in their order, up to a bound.
    pub phases: Vec<PhaseChange>,
    /// Changes beyond that bound.
    pub more_phases: u64,
    /// The phase now.
    pub phase: Option<u8>,
    /// Updates at which a full window of innovations failed.
    pub failures: u64,
    /// What the judge has against the last of our own estimates.
    pub reasons: Vec<String>,
    /// The judge's tests of the last of our own estimates; the messages of a record do not have them.
    pub tests: Vec<TestResult>,
    /// What the line of the newest recorded estimate says, the judge's first reason where it is inconsistent.
    pub recorded_words: Option<String>,
    /// States of the newest estimate.
    pub states: Vec<NamedState>,
    /// Counts of the newest estimate.
    pub counts: Counts,
    /// Times at which an alignment began anew, up to a bound.
    pub restarts: Vec<Stamp>,
    /// Estimates with numbers.
    pub taken: u64,
    /// Time of the newest one.
    pub newest: Option<Stamp>,
}

impl Default for History {
    fn default() -> Self {
        Self {
            points: Thinned::new(POINTS),
            singles: Peaks::new(POINTS),
            phases: Vec::new(),
            more_phases: 0,
            phase: None,
            failures: 0,
            reasons: Vec::new(),
            tests: Vec::new(),
            recorded_words: None,
            states: Vec::new(),
            counts: Counts::default(),
            restarts: Vec::new(),
            taken: 0,
            newest: None,
        }
    }
}

impl History {
    /// What speaks against the newest estimate, the worst first: of our own the judge's reason, of a recorded one its words.
    pub fn reason(&self) -> Option<&str> {
        let own = self.reasons.first();
        own.or(self.recorded_words.as_ref()).map(String::as_str)
    }

    /// Follows the phase.
    pub fn take_phase(&mut self, stamp: Stamp, phase: u8) {
        if self.phase == Some(phase) {
            return;
        }
        self.phase = Some(phase);
        if self.phases.len() < PHASES {
            self.phases.push(PhaseChange { stamp, phase });
        } else {
            self.more_phases += 1;
        }
    }

    /// Takes an estimate with its newest normalized innovation squared.
    pub fn take(&mut self, point: Point, nis: f64, counts: Counts) {
        if self.taken > 0
            && counts.duration_s < self.counts.duration_s
            && self.restarts.len() < PHASES
        {
            self.restarts.push(point.stamp);
        }
        self.taken += 1;
        self.newest = Some(point.stamp);
        self.counts = counts;
        self.singles.push(point.stamp, nis);
        self.points.push(point.stamp, point);
    }

    /// Points and the greatest single NIS of every spacing; what is counted stays.
    pub fn take_series(&mut self) -> (Vec<Point>, Vec<(Stamp, f64)>) {
        let points = std::mem::replace(&mut self.points, Thinned::new(POINTS)).finish();
        let singles = std::mem::replace(&mut self.singles, Peaks::new(POINTS)).finish();
        (
            points.into_iter().map(|(_, point)| point).collect(),
            singles,
        )
    }
}
