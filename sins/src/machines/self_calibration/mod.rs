//! Self-calibration: the state machine that both the node and the command line drive.
//!
//! Samples in, events out. Everything it does depends on the stamps and values of the samples alone, never on when they
//! arrive, so a bag gives the same numbers to the last bit through DDS and without it.
//!
//! 1. Its [stream](crate::stream) puts samples, joint states and velocities in order, and cuts them into epochs.
//! 2. Intervals are gathered while [`coarse alignment`](crate::mechanization::coarse_alignment) works on them (`alignment`).
//! 3. Its attitude is the point about which the 13-state filter is linear. The filter starts at the **first** sample with a
//!    misalignment prior so wide that it says nothing, and goes over everything gathered with its loop open. What it holds
//!    at the end is the coarse alignment's uncertainty as the samples really gave it, with the level error's correlation
//!    with the accelerometer biases and the azimuth error's with the east gyroscope drift: the P0 of what follows.
//! 4. The loop is closed and the filter goes on with every new interval (`running`; `aiding` and `schedule` say what is measured
//!    and when). Over a hole it goes as [`unseen_motion`](crate::machines::unseen_motion) says.
//! 5. `judge` says what the estimate is worth, for everything that shows a verdict.
//! 6. An epoch begins the alignment anew, with `sensor_knowledge` of the one before as prior of the sensors.

mod aiding;
mod alignment;
mod beginning;
mod calibration_check;
mod calibration_record;
mod encoders;
mod estimate;
mod estimator;
mod event;
mod further_errors;
mod judge;
mod noise_at_rest;
mod reference_choice;
mod rest;
mod running;
mod schedule;
mod sensor_knowledge;
mod settings;
mod ship_motion;
mod smoothing;
mod snapshot;
mod thresholds;

pub use calibration_record::{CalibrationRecord, RecordedCovariance};
pub use encoders::{EncoderAccuracy, EncoderUse};
pub use estimate::{Calibration, Estimate, NOT_KNOWN, Phase, SampleReport};
pub(in crate::machines) use estimator::Estimator;
pub use event::Event;
pub use further_errors::{further_errors, named_errors};
pub use judge::{
    Doubt, Finding, InnovationReport, Joints, LeftOut, MeanSquare, Single, Test, TestResult,
    Testimony, Turns, Verdict,
};
pub(in crate::machines) use sensor_knowledge::SensorKnowledge;
pub use sensor_knowledge::SensorWalk;
pub use settings::{Antenna, ModelChoice, NoiseFrom, Reference, Settings, default_noise};
pub use smoothing::{Guide, Replay, Smoothing, TAPE_BYTES};
pub use snapshot::Snapshot;
pub use thresholds::Thresholds;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::earth::Position;
use crate::error::Error;
use crate::estimation::smoother::Tape;
use crate::sensor::{ImuSample, PositionMeasurement, VelocityMeasurement};
use crate::stream::joint_history::JointHistory;
use crate::stream::{Reading, Stream};
use crate::table::JointSample;
use crate::time::Stamp;

/// The state machine.
///
/// Push whatever arrives, in the order in which it arrives, and poll until there is nothing more; at the end say so. That is the
/// whole of it, for a node as for a bag:
///
/// ```
/// use sins::earth::Position;
/// use sins::machines::self_calibration::{Event, Phase, SelfCalibration, Settings};
/// use sins::simulation::{Run, Simulator, SimulatorSettings};
/// use sins::table::scheme::{Scheme, Sequencer, sequencer::SequencerSettings};
///
/// let mut world = SimulatorSettings::default();
/// world.plant.imu_rate_hz = 10.0;
/// let program = Scheme::stationary().program(world.plant.turntable)?;
/// let sequencer = Sequencer::new(program, SequencerSettings::default())?;
///
/// let mut machine = SelfCalibration::new(Settings::default())?;
/// let mut phases = Vec::new();
/// let mut estimates = 0;
/// for tick in Run::new(Simulator::new(world)?, sequencer, 400.0) {
///     let tick = tick?;
///     if let Some(fix) = tick.position {
///         machine.push_position(Position {
///             latitude_rad: fix.latitude_rad,
///             longitude_rad: fix.longitude_rad,
///             height_m: fix.height_m,
///         })?;
///     }
///     if let Some(joints) = tick.joints {
///         machine.push_joints(joints)?;
///     }
///     machine.push_imu(&tick.imu);
///     while let Some(event) = machine.poll() {
///         match event {
///             Event::Estimate(_) => estimates += 1,
///             Event::PhaseChanged { to, .. } => phases.push(to),
///             Event::Restarted { cause, .. } => eprintln!("alignment starts anew: {cause}"),
///             Event::HoleCrossed { seconds, .. } => eprintln!("a hole of {seconds} s"),
///             Event::AlignmentFailed { reason, .. } => eprintln!("{reason}"),
///             Event::Refused(refused) => eprintln!("{:?}: {}", refused.stamp, refused.why),
///         }
///     }
/// }
/// let estimate = machine.finish()?;
/// assert_eq!(phases, [Phase::CoarseAlignment, Phase::FineAlignment]);
/// assert_eq!(estimates, 100);
/// assert!(!estimate.verdict(machine.settings()).converged);
/// # Ok::<(), sins::Error>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SelfCalibration {
    stream: Stream,
    estimator: Estimator,
}

impl SelfCalibration {
    /// A machine that waits for its first sample.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting is out of range.
    pub fn new(settings: Settings) -> Result<Self, Error> {
        let estimator = Estimator::new(settings)?;
        let stream = Stream::new(estimator.settings().stream())?;
        Ok(Self { stream, estimator })
    }

    /// The same machine, to go over a record for another time: linear about what the pass before it found. It is to be given the
    /// same readings, from the first one on; what the guide does not know it takes as a first pass does.
    #[must_use]
    pub fn guided(mut self, guide: Arc<Guide>) -> Self {
        self.estimator = self.estimator.guided(guide);
        self
    }

    /// Writes down what smoothing needs from here on, or no longer ([`Smoothing`] does it).
    fn record(&mut self, records: bool) {
        self.estimator.record(records);
    }

    fn take_tape(&mut self) -> Option<Tape> {
        self.estimator.take_tape()
    }

    fn tape_bytes(&self) -> usize {
        self.estimator.tape_bytes()
    }

    /// Whether another pass ([`Self::guided`]) is worth its time: the first one began with an azimuth that was uncertain by more
    /// than a degree, or the present one has turned the azimuth of the one before by more than a third of its sigma. `None` while no
    /// filter runs.
    pub fn wants_another_pass(&self) -> Option<bool> {
        self.estimator.wants_another_pass()
    }

    /// The settings it works with.
    pub fn settings(&self) -> &Settings {
        self.estimator.settings()
    }

    /// Asks for other sigmas from now on. The estimate does not depend on them; only its phase does.
    pub fn set_thresholds(&mut self, thresholds: Thresholds) {
        self.estimator.set_thresholds(thresholds);
        self.estimator
            .tell_phase(self.stream.newest().unwrap_or_default(), &self.stream);
    }

    /// Takes a reading of any kind, as it comes.
    ///
    /// # Errors
    /// As [`Self::push_fix`], [`Self::push_joints`] and [`Self::push_velocity`].
    pub fn push(&mut self, reading: &Reading) -> Result<(), Error> {
        match reading {
            Reading::Imu(sample) => {
                self.push_imu(sample);
                Ok(())
            }
            Reading::Joints(joints) => self.push_joints(*joints),
            Reading::Position(position) => self.push_position(*position),
            Reading::Fix(fix) => self.push_fix(*fix),
            Reading::Velocity(stamp, velocity) => self.push_velocity(*stamp, *velocity),
        }
    }

    /// Takes a position. The first one of an epoch counts; the ship lies at her mooring.
    ///
    /// # Errors
    /// As [`Position::checked`].
    pub fn push_position(&mut self, fix: Position) -> Result<(), Error> {
        self.estimator.take_position(fix.checked()?);
        Ok(())
    }

    /// Takes a position with its time and its uncertainty: the place of the alignment, and where the reference asks for positions
    /// a measurement.
    ///
    /// # Errors
    /// As [`Position::checked`].
    pub fn push_fix(&mut self, fix: PositionMeasurement) -> Result<(), Error> {
        self.push_position(fix.position)?;
        self.stream.push_position(fix)
    }

    /// Takes a reading of the joints.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn push_joints(&mut self, joints: JointSample) -> Result<(), Error> {
        self.stream.push_joints(joints)
    }

    /// Takes a velocity over ground (reference `Measured`; otherwise it is left aside).
    ///
    /// # Errors
    /// [`Error::NotFinite`], or [`Error::Setting`] where a sigma is not positive.
    pub fn push_velocity(
        &mut self,
        stamp: Stamp,
        measurement: VelocityMeasurement,
    ) -> Result<(), Error> {
        self.stream.push_velocity(stamp, measurement)
    }

    /// Takes a sample.
    pub fn push_imu(&mut self, sample: &ImuSample) {
        self.stream.push_sample(sample);
    }

    /// What happened next; `None` until more has been pushed.
    pub fn poll(&mut self) -> Option<Event> {
        loop {
            if let Some(event) = self.estimator.next_event() {
                return Some(event);
            }
            let item = self.stream.next()?;
            self.estimator.take(item, &self.stream);
        }
    }

    /// Says that no more samples will come: what waits is worked off, and an alignment that has gathered enough is finished with
    /// what there is. Returns the last estimate. What happened on the way can be polled afterwards.
    ///
    /// # Errors
    /// [`Error::Alignment`] where there never was one, with what was missing.
    pub fn finish(&mut self) -> Result<Estimate, Error> {
        self.stream.end();
        while let Some(item) = self.stream.next() {
            self.estimator.take(item, &self.stream);
        }
        self.estimator.finish(&self.stream)
    }

    /// Where the machine stands now.
    pub fn phase(&self) -> Phase {
        self.estimator.phase(&self.stream)
    }

    /// How much of coarse alignment is done, 0..1; 1 when the filter runs.
    pub fn coarse_progress(&self) -> f64 {
        self.estimator.coarse_progress()
    }

    /// What happened to the samples so far.
    pub fn samples(&self) -> SampleReport {
        self.estimator.samples(&self.stream)
    }

    /// The last estimate.
    pub fn last(&self) -> Option<&Estimate> {
        self.estimator.last()
    }

    /// Readings of the joints up to the last interval.
    pub fn joints(&self) -> &JointHistory {
        self.stream.joints()
    }

    /// Finds attitude and velocity anew from the next sample on; what is known of the sensors stays.
    pub fn restart(&mut self) {
        self.stream.restart();
    }

    /// Forgets all that was estimated and gathered, the sensors too, and starts anew with the next sample; counts and
    /// position stay.
    pub fn reset(&mut self) {
        self.stream.restart();
        self.estimator.reset();
    }
}
