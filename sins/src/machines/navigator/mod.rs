//! Compensation and free-inertial navigation, with the calibration and without it side by side.
//!
//! Both solutions start from the same attitude and run the same mechanization; the one takes the calibrated sensor errors
//! out of every sample, the other does not (the paper's Figure 14). The start is the attitude that came with the
//! calibration where the samples since then are still at hand, and otherwise an alignment of its own on compensated samples.
//! The covariance of each solution is that of the paper's error model, propagated without updates.
//!
//! A hole in the samples under way is no reason to align as if she were moored: the solutions keep course and speed, and their
//! covariance grows. Only a clock that is set back, or a hole longer than [`NavigatorSettings::longest_hole_s`], begins an
//! alignment, from the newest position.
//!
//! `start` joins calibrations and samples, `alignment` aligns, `solution` navigates and `holes` leads over what is missing.

mod alignment;
mod event;
mod holes;
mod settings;
mod solution;
mod start;

use std::collections::VecDeque;

pub use event::NavigatorEvent;
pub use settings::{NavigatorPhase, NavigatorSettings};
use solution::Channel;
pub use solution::{NavigatorOutput, Solution};

use crate::earth::Position;
use crate::error::Error;
use crate::machines::self_calibration::{Calibration, Estimator};
use crate::sensor::{ImuSample, VelocityMeasurement};
use crate::stream::order::EpochCause;
use crate::stream::{Interval, Item, Stream};
use crate::table::JointSample;
use crate::time::Stamp;

/// What it does.
#[derive(Clone, Debug)]
enum Stage {
    Waiting,
    Aligning(Box<Estimator>),
    Navigating(Box<[Channel; 2]>),
}

impl Stage {
    fn phase(&self) -> NavigatorPhase {
        match self {
            Self::Waiting => NavigatorPhase::WaitingForCalibration,
            Self::Aligning(_) => NavigatorPhase::Aligning,
            Self::Navigating(_) => NavigatorPhase::Navigating,
        }
    }
}

/// The state machine.
///
/// Push whatever arrives and poll until there is nothing more:
///
/// ```
/// use nalgebra::UnitQuaternion;
/// use sins::earth::{LocalEarth, Position};
/// use sins::estimation::state::NamedCovariance;
/// use sins::machines::navigator::{Navigator, NavigatorEvent, NavigatorSettings};
/// use sins::machines::self_calibration::{Calibration, Phase};
/// use sins::sensor::{ImuSample, SensorErrors};
/// use sins::table::TableErrors;
/// use sins::Stamp;
///
/// let place = Position::from_degrees(45.0, 126.6, 0.0);
/// let earth = LocalEarth::at(place.latitude_rad, place.height_m);
/// let stamp = |k: i64| Stamp::from_nanos(k * 10_000_000);
/// let mut navigator = Navigator::new(NavigatorSettings::default())?;
/// let mut solutions = 0;
/// for k in 0..200 {
///     if k == 100 {
///         navigator.push_calibration(Calibration {
///             stamp: stamp(90),
///             phase: Phase::Converged,
///             errors: SensorErrors::default(),
///             table: TableErrors::default(),
///             attitude: UnitQuaternion::identity(),
///             position: place,
///             covariance: NamedCovariance::from_sigmas([("gyroscope_drift_x_rad_s", 1e-9)])?,
///             samples: 1_440_000,
///             gaps: 0,
///         })?;
///     }
///     let mut sample = ImuSample::at_rest(stamp(k), earth.gravity_m_s2);
///     sample.angular_rate = earth.earth_rate();
///     navigator.push_imu(&sample);
///     while let Some(event) = navigator.poll() {
///         match event {
///             NavigatorEvent::Sample { output: Some(output), .. } => {
///                 solutions += 1;
///                 assert!(output.compensated.navigation.velocity.norm() < 1e-6);
///             }
///             NavigatorEvent::Sample { output: None, .. } => {}
///             NavigatorEvent::PhaseChanged { from, to } => eprintln!("{} -> {}", from.name(), to.name()),
///             other => eprintln!("{other:?}"),
///         }
///     }
/// }
/// navigator.end();
/// while navigator.poll().is_some() {}
/// assert_eq!(solutions, 100);
/// # Ok::<(), sins::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Navigator {
    settings: NavigatorSettings,
    stream: Stream,
    /// Samples of late, for a calibration that arrives after them; each with the interval that it ends.
    history: VecDeque<(ImuSample, Option<Interval>)>,
    position: Option<Position>,
    calibration: Option<Calibration>,
    /// A calibration of a time whose samples are still to come.
    early: Option<Calibration>,
    stage: Stage,
    phase_told: NavigatorPhase,
    events: VecDeque<NavigatorEvent>,
}

impl Navigator {
    /// A navigator that waits for a calibration.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting is out of range.
    pub fn new(settings: NavigatorSettings) -> Result<Self, Error> {
        settings.check()?;
        let stream = Stream::new(settings.stream())?;
        Ok(Self {
            settings,
            stream,
            history: VecDeque::new(),
            position: None,
            calibration: None,
            early: None,
            stage: Stage::Waiting,
            phase_told: NavigatorPhase::WaitingForCalibration,
            events: VecDeque::new(),
        })
    }

    /// Where it stands.
    pub fn phase(&self) -> NavigatorPhase {
        self.stage.phase()
    }

    /// Whether its alignment cannot begin, because no position has come: that of a calibration is of the time of the calibration.
    pub fn waits_for_position(&self) -> bool {
        self.phase() == NavigatorPhase::Aligning && self.position.is_none()
    }

    /// The stream of its samples: counts, what waits, the joints.
    pub fn stream(&self) -> &Stream {
        &self.stream
    }

    /// Takes a position; its own alignment begins from the newest.
    ///
    /// # Errors
    /// As [`Position::checked`].
    pub fn push_position(&mut self, fix: Position) -> Result<(), Error> {
        let checked = fix.checked()?;
        self.position = Some(checked);
        if let Stage::Aligning(alignment) = &mut self.stage {
            alignment.take_position(checked);
        }
        Ok(())
    }

    /// Takes a reading of the joints.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn push_joints(&mut self, joints: JointSample) -> Result<(), Error> {
        self.stream.push_joints(joints)
    }

    /// Takes a velocity over ground, where its alignment is told that there are any (reference `Measured`).
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
    pub fn poll(&mut self) -> Option<NavigatorEvent> {
        loop {
            if let Some(event) = self.events.pop_front() {
                return Some(event);
            }
            let item = self.stream.next()?;
            match item {
                Item::Refused(refused) => return Some(NavigatorEvent::Refused(refused)),
                Item::Epoch { sample, cause } => self.begin(&sample, cause),
                Item::Interval(interval, sample) => self.advance(interval, &sample),
            }
            self.tell_phase();
        }
    }

    /// No more will come: what waits can be polled.
    pub fn end(&mut self) {
        self.stream.end();
    }

    fn tell_phase(&mut self) {
        let to = self.phase();
        let from = std::mem::replace(&mut self.phase_told, to);
        if from != to {
            self.events
                .push_back(NavigatorEvent::PhaseChanged { from, to });
        }
    }

    /// The clock begins, or begins anew.
    fn begin(&mut self, sample: &ImuSample, cause: EpochCause) {
        self.history.clear();
        self.history.push_back((*sample, None));
        if cause != EpochCause::First {
            self.events.push_back(NavigatorEvent::Restarted {
                stamp: sample.stamp,
                cause,
            });
        }
        if let Some(calibration) = self.calibration.clone()
            && let Err(error) = self.align(&calibration)
        {
            self.events.push_back(NavigatorEvent::AlignmentFailed {
                stamp: sample.stamp,
                reason: error.to_string(),
            });
        }
        self.tell_sample(sample, None);
        self.take_early(sample.stamp);
    }

    fn advance(&mut self, interval: Interval, sample: &ImuSample) {
        self.remember(sample, interval.clone());
        let mut output = None;
        match &mut self.stage {
            Stage::Waiting => {}
            Stage::Aligning(_) => self.continue_alignment(interval, sample),
            Stage::Navigating(_) => {
                self.navigate(&interval, sample);
                output = self.output(sample);
            }
        }
        self.tell_sample(sample, output);
        self.take_early(sample.stamp);
    }

    fn tell_sample(&mut self, sample: &ImuSample, output: Option<Box<NavigatorOutput>>) {
        self.events.push_back(NavigatorEvent::Sample {
            sample: *sample,
            joints: self.stream.joints().at(sample.stamp),
            output,
        });
    }

    fn fail(&mut self, stamp: Stamp, error: &Error) {
        let reason = error.to_string();
        self.events
            .push_back(NavigatorEvent::AlignmentFailed { stamp, reason });
    }
}
