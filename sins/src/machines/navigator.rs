//! Compensation and free-inertial navigation, with the calibration and without it side by side.
//!
//! Both solutions start from the same attitude and run the same mechanization; the one takes the calibrated sensor errors
//! out of every sample, the other does not (the paper's Figure 14). The start is the attitude that came with the
//! calibration where the samples since then are still at hand, and otherwise an alignment of its own on compensated samples.
//! The covariance of each solution is that of the 13-state error model, propagated without updates.

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector3};

use crate::earth::Position;
use crate::earth::rotation::base_link_to_block;
use crate::error::Error;
use crate::estimation::error_state::{BIAS, DRIFT, StateMatrix};
use crate::estimation::filter::Loop;
use crate::estimation::model::{Model, Paper, PaperFilter};
use crate::machines::self_calibration::{Calibration, SelfCalibration, Settings, default_noise};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::{Compensation, SensorErrors};
use crate::sensor::sample::{ImuSample, NoiseDensity};
use crate::stream::joint_history::JointHistory;
use crate::stream::stepper::{Arrival, Step, Stepper};
use crate::table::JointSample;
use crate::time::Stamp;

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
}

impl Default for NavigatorSettings {
    fn default() -> Self {
        Self {
            alignment: Settings::default(),
            alignment_s: 900.0,
            history_s: 60.0,
            start_from_calibration: true,
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

/// One mechanization with its covariance.
#[derive(Clone, Debug)]
struct Channel {
    filter: PaperFilter,
}

impl Channel {
    fn advance(&mut self, step: &Step) -> Result<(), Error> {
        if let Some([angle, velocity]) = step.bridged {
            self.filter.bridge(angle, velocity);
        }
        self.filter.propagate(&step.increment);
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
    Aligning(Box<SelfCalibration>),
    Navigating(Box<[Channel; 2]>),
}

/// The state machine.
#[derive(Clone, Debug)]
pub struct Navigator {
    settings: NavigatorSettings,
    stepper: Stepper,
    history: VecDeque<(ImuSample, Option<Step>)>,
    joints: JointHistory,
    position: Option<Position>,
    calibration: Option<(Calibration, Compensation)>,
    stage: Stage,
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
        ] {
            if !value.is_finite() || value < 0.0 {
                return Err(Error::setting(name, value, "a number that is not negative"));
            }
        }
        Ok(Self {
            settings,
            stepper: Stepper::new(settings.alignment.restart_gap_s),
            history: VecDeque::new(),
            joints: JointHistory::default(),
            position: None,
            calibration: None,
            stage: Stage::Waiting,
        })
    }

    /// Where it stands.
    pub fn phase(&self) -> NavigatorPhase {
        match self.stage {
            Stage::Waiting => NavigatorPhase::WaitingForCalibration,
            Stage::Aligning(_) => NavigatorPhase::Aligning,
            Stage::Navigating(_) => NavigatorPhase::Navigating,
        }
    }

    /// Forms of the stream: gaps, repeats, jumps.
    pub fn stream(&self) -> &Stepper {
        &self.stepper
    }

    /// Takes a position; its own alignment needs one.
    ///
    /// # Errors
    /// As [`Position::checked`].
    pub fn ingest_position(&mut self, fix: Position) -> Result<(), Error> {
        let checked = fix.checked()?;
        self.position.get_or_insert(checked);
        if let Stage::Aligning(alignment) = &mut self.stage {
            alignment.ingest_position(checked)?;
        }
        Ok(())
    }

    /// Takes a reading of the joints.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn ingest_joints(&mut self, joints: JointSample) -> Result<(), Error> {
        self.joints.push(joints)
    }

    /// Takes a calibration. The first one starts the navigation, from its own attitude where the samples since then are at
    /// hand and by an alignment where they are not. Later ones refine the compensation of the solution that runs.
    ///
    /// # Errors
    /// [`Error::Setting`] where the sensor errors cannot be inverted or are not finite.
    pub fn ingest_calibration(&mut self, calibration: Calibration) -> Result<(), Error> {
        let compensation = calibration.errors.compensation()?;
        match &mut self.stage {
            Stage::Navigating(channels) => {
                channels[0].filter.set_sensor_errors(&calibration.errors)?;
            }
            Stage::Waiting | Stage::Aligning(_) => {
                let covered = self
                    .history
                    .front()
                    .is_some_and(|(s, _)| s.stamp <= calibration.stamp)
                    && self
                        .history
                        .back()
                        .is_some_and(|(s, _)| s.stamp >= calibration.stamp);
                if covered && self.settings.start_from_calibration {
                    self.start_from(&calibration)?;
                } else {
                    self.align(&calibration, &compensation)?;
                }
            }
        }
        self.calibration = Some((calibration, compensation));
        Ok(())
    }

    /// Takes a sample. Returns both solutions at its stamp while navigating.
    ///
    /// # Errors
    /// [`Error::NotFinite`] (the sample is left out and counted), [`Error::Alignment`] (a jump of the stamps that cannot be
    /// bridged, or samples that cannot be aligned on; the navigator aligns itself anew).
    pub fn ingest_imu(&mut self, sample: &ImuSample) -> Result<Option<NavigatorOutput>, Error> {
        let step = match self.stepper.take(sample)? {
            Arrival::LeftOut => return Ok(None),
            Arrival::Start => None,
            Arrival::Step(step) => Some(step),
            Arrival::Jump { from, to } => {
                self.history.clear();
                if let Some((calibration, compensation)) = self.calibration.clone() {
                    self.align(&calibration, &compensation)?;
                }
                return Err(Error::Alignment {
                    reason: format!(
                        "stamps jumped from {} ns to {} ns: navigation cannot go on and aligns itself anew",
                        from.nanos(),
                        to.nanos()
                    ),
                });
            }
        };
        self.history.push_back((*sample, step));
        while self
            .history
            .front()
            .is_some_and(|(s, _)| sample.stamp.seconds_since(s.stamp) > self.settings.history_s)
        {
            self.history.pop_front();
        }
        match &mut self.stage {
            Stage::Waiting => Ok(None),
            Stage::Aligning(_) => {
                self.continue_alignment(sample)?;
                Ok(None)
            }
            Stage::Navigating(channels) => {
                if let Some(step) = step {
                    for channel in channels.iter_mut() {
                        channel.advance(&step)?;
                    }
                }
                let table = self
                    .settings
                    .alignment
                    .turntable
                    .attitude(self.joints.angles_at(sample.stamp));
                Ok(Some(NavigatorOutput {
                    stamp: sample.stamp,
                    compensated: channels[0].solution(&table, sample),
                    uncompensated: channels[1].solution(&table, sample),
                }))
            }
        }
    }

    /// Starts at the calibration's stamp and catches up through the samples since.
    fn start_from(&mut self, calibration: &Calibration) -> Result<(), Error> {
        let start = NavigationState {
            attitude: calibration.attitude,
            velocity: Vector3::zeros(),
            position: calibration.position,
        };
        let mut channels = self.channels(start, &calibration.errors, &calibration.covariance)?;
        for step in self
            .history
            .iter()
            .filter_map(|(_, step)| *step)
            .filter(|s| s.stamp > calibration.stamp)
        {
            for channel in channels.iter_mut() {
                channel.advance(&step)?;
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
            let interval = self.stepper.usual_interval_s().unwrap_or(0.0);
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
        let mut alignment = SelfCalibration::new(settings)?;
        if let Some(fix) = self.position {
            alignment.ingest_position(fix)?;
        }
        for (sample, _) in &self.history {
            alignment.ingest_imu(&compensated(compensation, sample))?;
        }
        self.stage = Stage::Aligning(Box::new(alignment));
        Ok(())
    }

    fn continue_alignment(&mut self, sample: &ImuSample) -> Result<(), Error> {
        let (Stage::Aligning(alignment), Some((_, compensation))) =
            (&mut self.stage, &self.calibration)
        else {
            return Ok(());
        };
        let Some(estimate) = alignment.ingest_imu(&compensated(compensation, sample))? else {
            return Ok(());
        };
        if estimate.duration_s < self.settings.alignment_s {
            return Ok(());
        }
        // The alignment's own small corrections belong to its attitude; without them its level would not hold.
        let mut errors = *compensation.errors();
        errors.gyroscope_drift +=
            estimate.gyroscope_drift() + errors.gyroscope_matrix * estimate.gyroscope_drift();
        errors.accelerometer_bias += estimate.accelerometer_bias()
            + errors.accelerometer_matrix * estimate.accelerometer_bias();
        let channels = self.channels(estimate.navigation, &errors, &estimate.covariance)?;
        self.stage = Stage::Navigating(channels);
        Ok(())
    }
}

fn compensated(compensation: &Compensation, sample: &ImuSample) -> ImuSample {
    let (angular_rate, specific_force) =
        compensation.apply(&sample.angular_rate, &sample.specific_force);
    ImuSample {
        angular_rate,
        specific_force,
        ..*sample
    }
}
