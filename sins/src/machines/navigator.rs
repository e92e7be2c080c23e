//! Compensation and free-inertial navigation, with the calibration and without it side by side.
//!
//! Both solutions start from the same attitude and run the same mechanization; the one takes the calibrated sensor errors
//! out of every sample, the other does not (the paper's Figure 14). The start is the attitude that came with the
//! calibration where the samples since then are still at hand, and otherwise an alignment of its own on compensated samples.
//! The covariance of each solution is that of the 13-state error model, propagated without updates.
//!
//! A hole in the samples under way is no reason to align as if she were moored: the solutions keep course and speed, and their
//! covariance grows. Only a clock that is set back, or a hole longer than [`NavigatorSettings::longest_hole_s`], begins an alignment, from
//! the newest position.

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector3};

use crate::earth::Position;
use crate::earth::rotation::base_link_to_block;
use crate::error::Error;
use crate::estimation::error_state::{BIAS, DRIFT, StateMatrix};
use crate::estimation::filter::Loop;
use crate::estimation::model::{Model, Paper, PaperFilter};
use crate::machines::self_calibration::{
    Calibration, Estimator, Event as AlignmentEvent, Settings, default_noise,
};
use crate::machines::unseen_motion::Passage;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::{Compensation, SensorErrors};
use crate::sensor::sample::{ImuSample, NoiseDensity};
use crate::sensor::{Increment, VelocityMeasurement};
use crate::stream::counts::Refused;
use crate::stream::order::EpochCause;
use crate::stream::{Interval, Item, Stream, StreamSettings};
use crate::table::JointSample;
use crate::time::{Stamp, seconds_to_nanos};

/// Time between covariance steps \[s\].
const COVARIANCE_STEP_S: f64 = 1.0;

/// Settings of the navigator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigatorSettings {
    /// Settings of its own alignment (prior, coarse alignment, noise, table, longest bridge over a hole).
    pub alignment: Settings,
    /// Length of its own alignment \[s\]; longer than coarse alignment, because the heading goes on improving.
    pub alignment_s: f64,
    /// How long samples are kept for a calibration that arrives after them \[s\].
    pub history_s: f64,
    /// Whether a calibration's attitude may start the navigation; otherwise it always aligns itself.
    pub start_from_calibration: bool,
    /// How much later than a sample its joint state may come \[s\].
    pub joint_patience_s: f64,
    /// A longer hole in the samples begins an alignment \[s\].
    pub longest_hole_s: f64,
    /// A ship that is slower than this, by its own solution, lies at her mooring \[m/s\].
    pub moored_speed_m_s: f64,
}

impl Default for NavigatorSettings {
    fn default() -> Self {
        Self {
            alignment: Settings::default(),
            alignment_s: 900.0,
            history_s: 60.0,
            start_from_calibration: true,
            joint_patience_s: 0.0,
            longest_hole_s: 300.0,
            moored_speed_m_s: 0.5,
        }
    }
}

/// Where the navigator stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NavigatorPhase {
    /// No calibration has come yet.
    WaitingForCalibration,
    /// It aligns itself on compensated samples.
    Aligning,
    /// Both solutions run.
    Navigating,
}

impl NavigatorPhase {
    /// The name that diagnostics carry.
    pub fn name(self) -> &'static str {
        match self {
            Self::WaitingForCalibration => "waiting_for_calibration",
            Self::Aligning => "aligning",
            Self::Navigating => "navigating",
        }
    }
}

/// One solution at the time of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Attitude of the block (b to n), velocity, position.
    pub navigation: NavigationState,
    /// Attitude of the ship: turns `base_link` (forward-left-up) into n.
    pub base_link: UnitQuaternion<f64>,
    /// Angular rate of the block against inertial space, its own axes \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Specific force, block axes \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// Covariance of the thirteen states at the last covariance step (at most a second ago).
    pub covariance: StateMatrix,
}

/// Both solutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigatorOutput {
    /// Time of the sample.
    pub stamp: Stamp,
    /// With the calibration.
    pub compensated: Solution,
    /// Without it.
    pub uncompensated: Solution,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum NavigatorEvent {
    /// A sample was used; both solutions at its time while navigating.
    Sample {
        /// The sample.
        sample: ImuSample,
        /// The joints at its time.
        joints: JointSample,
        /// Both solutions.
        output: Option<Box<NavigatorOutput>>,
    },
    /// Another phase began.
    PhaseChanged {
        /// The phase before.
        from: NavigatorPhase,
        /// The phase now.
        to: NavigatorPhase,
    },
    /// A calibration is used from now on.
    CalibrationTaken {
        /// Its time.
        stamp: Stamp,
    },
    /// A calibration that had waited for its samples is not used.
    CalibrationRefused {
        /// Its time.
        stamp: Stamp,
        /// What speaks against it.
        reason: String,
    },
    /// The clock was broken: navigation cannot go on, and an alignment begins from the newest position.
    Restarted {
        /// The first sample of the new time.
        stamp: Stamp,
        /// Why.
        cause: EpochCause,
    },
    /// The solutions went over a hole in the samples.
    HoleCrossed {
        /// Its end.
        stamp: Stamp,
        /// Its length \[s\].
        seconds: f64,
        /// Nothing was integrated: course and speed were kept.
        held: bool,
    },
    /// The alignment failed and begins anew.
    AlignmentFailed {
        /// When.
        stamp: Stamp,
        /// What was found and what was expected.
        reason: String,
    },
    /// A sample was not used.
    Refused(Refused),
}

/// One mechanization with its covariance.
#[derive(Clone, Debug)]
struct Channel {
    filter: PaperFilter,
}

impl Channel {
    fn advance(&mut self, interval: &Interval, passage: Option<&Passage>) -> Result<(), Error> {
        match passage {
            Some(Passage::Held(crossing)) => return self.filter.cross(crossing),
            Some(Passage::Bridged([angle, velocity])) => self.filter.bridge(*angle, *velocity),
            None => {}
        }
        self.filter.propagate(&interval.increment);
        if self.filter.pending_s() >= COVARIANCE_STEP_S {
            self.filter.step()?;
        }
        Ok(())
    }

    fn solution(&self, table: &UnitQuaternion<f64>, sample: &ImuSample) -> Solution {
        let navigation = *self.filter.navigation();
        let (angular_rate, specific_force) = self
            .filter
            .compensation()
            .apply(&sample.angular_rate, &sample.specific_force);
        Solution {
            navigation,
            base_link: navigation.attitude * table.inverse() * base_link_to_block(),
            angular_rate,
            specific_force,
            covariance: *self.filter.covariance(),
        }
    }
}

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
/// use sins::estimation::error_state::StateMatrix;
/// use sins::machines::navigator::{Navigator, NavigatorEvent, NavigatorSettings};
/// use sins::machines::self_calibration::{Calibration, Phase};
/// use sins::sensor::{ImuSample, SensorErrors};
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
///             attitude: UnitQuaternion::identity(),
///             position: place,
///             covariance: StateMatrix::zeros(),
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
    calibration: Option<(Calibration, Compensation)>,
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
        settings.alignment.check()?;
        for (name, value) in [
            ("alignment_s", settings.alignment_s),
            ("history_s", settings.history_s),
            ("joint_patience_s", settings.joint_patience_s),
            ("longest_hole_s", settings.longest_hole_s),
            ("moored_speed_m_s", settings.moored_speed_m_s),
        ] {
            if !value.is_finite() || value < 0.0 {
                return Err(Error::setting(name, value, "a number that is not negative"));
            }
        }
        let stream = Stream::new(StreamSettings {
            joint_patience_s: settings.joint_patience_s,
            longest_bridge_s: settings
                .longest_hole_s
                .max(settings.alignment.restart_gap_s),
            ..settings.alignment.stream()
        })?;
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

    /// Takes a calibration. The first one starts the navigation, from its own attitude where the samples since then are at
    /// hand and by an alignment where they are not; one that has overtaken its samples waits for them. Later ones refine the
    /// compensation of the solution that runs.
    ///
    /// # Errors
    /// As [`Calibration::usable`].
    pub fn push_calibration(&mut self, calibration: Calibration) -> Result<(), Error> {
        let calibration = calibration.usable()?;
        let used = self.history.back().map(|(sample, _)| sample.stamp);
        let arrived = used.or(self.stream.newest().filter(|_| self.stream.waiting() > 0));
        let ahead = arrived.filter(|arrived| {
            let ahead_s = calibration.stamp.seconds_since(*arrived);
            let is_ahead = ahead_s > 0.0 || used.is_none();
            is_ahead && ahead_s.abs() <= self.settings.history_s
        });
        if ahead.is_some() {
            self.early = Some(calibration);
            return Ok(());
        }
        self.early = None;
        self.take_calibration(calibration)
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

    fn take_calibration(&mut self, calibration: Calibration) -> Result<(), Error> {
        let compensation = calibration.errors.compensation()?;
        if let Stage::Navigating(channels) = &mut self.stage {
            channels[0].filter.set_sensor_errors(&calibration.errors)?;
        } else {
            let is_covered =
                self.history
                    .front()
                    .zip(self.history.back())
                    .is_some_and(|(first, last)| {
                        first.0.stamp <= calibration.stamp && last.0.stamp >= calibration.stamp
                    });
            if is_covered && self.settings.start_from_calibration {
                self.start_from(&calibration)?;
            } else {
                self.align(&calibration, &compensation)?;
            }
        }
        self.events.push_back(NavigatorEvent::CalibrationTaken {
            stamp: calibration.stamp,
        });
        self.calibration = Some((calibration, compensation));
        self.tell_phase();
        Ok(())
    }

    /// A calibration that waited for its samples.
    fn take_early(&mut self, stamp: Stamp) {
        let Some(calibration) = self.early.take_if(|early| early.stamp <= stamp) else {
            return;
        };
        let its = calibration.stamp;
        if let Err(error) = self.take_calibration(calibration) {
            self.events.push_back(NavigatorEvent::CalibrationRefused {
                stamp: its,
                reason: error.to_string(),
            });
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
        if let Some((calibration, compensation)) = self.calibration.clone()
            && let Err(error) = self.align(&calibration, &compensation)
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
        let oldest = sample
            .stamp
            .plus_nanos(-seconds_to_nanos(self.settings.history_s));
        while self
            .history
            .front()
            .is_some_and(|(kept, _)| kept.stamp < oldest)
        {
            self.history.pop_front();
        }
        self.history.push_back((*sample, Some(interval.clone())));
        let mut output = None;
        match &mut self.stage {
            Stage::Waiting => {}
            Stage::Aligning(_) => self.continue_alignment(interval, sample),
            Stage::Navigating(_) => {
                self.navigate(&interval);
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

    fn navigate(&mut self, interval: &Interval) {
        let passage = self.passage(interval);
        if let Some(passage) = &passage {
            self.events.push_back(NavigatorEvent::HoleCrossed {
                stamp: interval.stamp,
                seconds: interval.increment.interval_s,
                held: matches!(passage, Passage::Held(_)),
            });
        }
        let Stage::Navigating(channels) = &mut self.stage else {
            return;
        };
        let advanced = channels
            .iter_mut()
            .try_for_each(|channel| channel.advance(interval, passage.as_ref()));
        if let Err(error) = advanced {
            // Numbers that are none do not come back.
            self.fail(interval.stamp, &error);
            if let Some((calibration, compensation)) = self.calibration.clone()
                && let Err(error) = self.align(&calibration, &compensation)
            {
                self.fail(interval.stamp, &error);
                self.stage = Stage::Waiting;
            }
        }
    }

    fn fail(&mut self, stamp: Stamp, error: &Error) {
        let reason = error.to_string();
        self.events
            .push_back(NavigatorEvent::AlignmentFailed { stamp, reason });
    }

    /// The way over a hole: that of a moored ship where she lies, by the compensated solution.
    fn passage(&self, interval: &Interval) -> Option<Passage> {
        let hole = interval.hole.as_ref()?;
        let settings = &self.settings.alignment;
        let bridge_s = settings.restart_gap_s;
        let under_way = settings
            .unseen
            .under_way(hole, &settings.turntable, bridge_s);
        let Stage::Navigating(channels) = &self.stage else {
            return Some(under_way);
        };
        let speed = channels[0].filter.navigation().velocity.norm();
        if speed > self.settings.moored_speed_m_s || hole.interval_s <= bridge_s {
            return Some(under_way);
        }
        Some(
            match settings.unseen.moored(hole, &settings.turntable, speed) {
                // A ship that lies sways as she did; her velocity goes on, for it is what tells one solution from the other.
                Passage::Held(mut crossing) => {
                    crossing.rest_sigma_m_s = None;
                    Passage::Held(crossing)
                }
                Passage::Bridged(_) => under_way,
            },
        )
    }

    fn output(&self, sample: &ImuSample) -> Option<Box<NavigatorOutput>> {
        let Stage::Navigating(channels) = &self.stage else {
            return None;
        };
        let angles = self.stream.joints().angles_at(sample.stamp);
        let table = self.settings.alignment.turntable.attitude(angles);
        Some(Box::new(NavigatorOutput {
            stamp: sample.stamp,
            compensated: channels[0].solution(&table, sample),
            uncompensated: channels[1].solution(&table, sample),
        }))
    }

    /// Starts at the calibration's stamp and catches up through the samples since.
    fn start_from(&mut self, calibration: &Calibration) -> Result<(), Error> {
        let start = NavigationState {
            attitude: calibration.attitude,
            velocity: Vector3::zeros(),
            position: calibration.position,
        };
        let mut channels = self.channels(start, &calibration.errors, &calibration.covariance)?;
        let intervals = self.history.iter().filter_map(|(_, i)| i.as_ref());
        for interval in intervals.filter(|interval| interval.stamp > calibration.stamp) {
            let passage = self.passage(interval);
            for channel in channels.iter_mut() {
                channel.advance(interval, passage.as_ref())?;
            }
        }
        self.stage = Stage::Navigating(channels);
        Ok(())
    }

    fn channels(
        &self,
        start: NavigationState,
        errors: &SensorErrors,
        covariance: &StateMatrix,
    ) -> Result<Box<[Channel; 2]>, Error> {
        let noise = self.noise();
        let model = self.settings.alignment.prior.model();
        // What is not taken out is as uncertain as it was before calibration.
        let prior = model.initial_covariance(&start);
        let raw = StateMatrix::from_fn(|row, column| {
            let both_move = row < Paper::M && column < Paper::M;
            if both_move {
                covariance[(row, column)]
            } else {
                prior[(row, column)]
            }
        });
        let channel = |errors: &SensorErrors, covariance: StateMatrix| {
            PaperFilter::new(model, start, errors, covariance, noise, Loop::Open)
                .map(|filter| Channel { filter })
        };
        Ok(Box::new([
            channel(errors, *covariance)?,
            channel(&SensorErrors::default(), raw)?,
        ]))
    }

    /// Noise densities: as set, or as the last sample's variances say.
    fn noise(&self) -> NoiseDensity {
        let default = default_noise();
        self.settings.alignment.noise.unwrap_or_else(|| {
            let interval = self.stream.usual_interval_s().unwrap_or(0.0);
            let last = self.history.back().map(|(s, _)| s);
            let density = |variance: Option<f64>, default: f64| {
                variance
                    .filter(|v| *v > 0.0)
                    .map_or(default, |v| (v * interval).sqrt())
            };
            NoiseDensity {
                gyroscope: Vector3::from_fn(|i, _| {
                    density(
                        last.map(|s| s.angular_rate_variance[i]),
                        default.gyroscope[i],
                    )
                }),
                accelerometer: Vector3::from_fn(|i, _| {
                    density(
                        last.map(|s| s.specific_force_variance[i]),
                        default.accelerometer[i],
                    )
                }),
            }
        })
    }

    /// Begins its own alignment: compensated samples, and as prior of the sensor errors what calibration left of them.
    fn align(
        &mut self,
        calibration: &Calibration,
        compensation: &Compensation,
    ) -> Result<(), Error> {
        let mut settings = self.settings.alignment;
        let sigma = |start: usize, fallback: &Vector3<f64>| {
            Vector3::from_fn(|i, _| {
                let variance = calibration.covariance[(start + i, start + i)];
                if variance > 0.0 {
                    variance.sqrt()
                } else {
                    fallback[i]
                }
            })
        };
        settings.prior.accelerometer_bias_m_s2 =
            sigma(BIAS, &settings.prior.accelerometer_bias_m_s2);
        settings.prior.gyroscope_drift_rad_s = sigma(DRIFT, &settings.prior.gyroscope_drift_rad_s);
        let mut alignment = Estimator::new(&settings)?;
        if let Some(fix) = self.position {
            alignment.take_position(fix);
        }
        let longest_s = settings.restart_gap_s;
        for (sample, interval) in &self.history {
            take_compensated(
                &mut alignment,
                compensation,
                interval.clone(),
                sample,
                &self.stream,
                longest_s,
            );
        }
        self.stage = Stage::Aligning(Box::new(alignment));
        Ok(())
    }

    fn continue_alignment(&mut self, interval: Interval, sample: &ImuSample) {
        let (Stage::Aligning(alignment), Some((_, compensation))) =
            (&mut self.stage, &self.calibration)
        else {
            return;
        };
        let longest_s = self.settings.alignment.restart_gap_s;
        let interval = Some(interval);
        take_compensated(
            alignment,
            compensation,
            interval,
            sample,
            &self.stream,
            longest_s,
        );
        let mut aligned = None;
        while let Some(event) = alignment.next_event() {
            match event {
                AlignmentEvent::Estimate(estimate)
                    if estimate.duration_s >= self.settings.alignment_s =>
                {
                    aligned = Some(estimate);
                }
                AlignmentEvent::AlignmentFailed { stamp, reason } => self
                    .events
                    .push_back(NavigatorEvent::AlignmentFailed { stamp, reason }),
                _ => {}
            }
        }
        let Some(estimate) = aligned else {
            return;
        };
        // The alignment's own small corrections belong to its attitude; without them its level would not hold.
        let mut errors = *compensation.errors();
        errors.gyroscope_drift +=
            estimate.gyroscope_drift() + errors.gyroscope_matrix * estimate.gyroscope_drift();
        errors.accelerometer_bias += estimate.accelerometer_bias()
            + errors.accelerometer_matrix * estimate.accelerometer_bias();
        match self.channels(estimate.navigation, &errors, &estimate.covariance) {
            Ok(channels) => self.stage = Stage::Navigating(channels),
            Err(error) => self.fail(sample.stamp, &error),
        }
    }
}

/// Feeds an alignment with compensated samples. A hole longer than an alignment bridges begins it anew.
fn take_compensated(
    alignment: &mut Estimator,
    compensation: &Compensation,
    interval: Option<Interval>,
    sample: &ImuSample,
    stream: &Stream,
    longest_s: f64,
) {
    let (angular_rate, specific_force) =
        compensation.apply(&sample.angular_rate, &sample.specific_force);
    let sample = ImuSample {
        angular_rate,
        specific_force,
        ..*sample
    };
    let Some(mut interval) = interval else {
        return alignment.begin(sample.stamp, EpochCause::First, stream);
    };
    let seconds = interval.increment.interval_s;
    if seconds > longest_s && interval.hole.as_ref().is_some_and(|h| h.turned.is_none()) {
        return alignment.begin(sample.stamp, EpochCause::Hole { seconds }, stream);
    }
    interval.increment = compensated_increment(compensation, &interval.increment);
    alignment.take(Item::Interval(interval, sample), stream);
}

fn compensated_increment(compensation: &Compensation, increment: &Increment) -> Increment {
    let seconds = increment.interval_s;
    let (rate, force) = compensation.apply(
        &(increment.angle / seconds),
        &(increment.velocity / seconds),
    );
    Increment {
        interval_s: seconds,
        angle: rate * seconds,
        velocity: force * seconds,
    }
}
