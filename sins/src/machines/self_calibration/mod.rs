//! Self-calibration: the state machine that both the node and the command line drive.
//!
//! Samples in, estimates out. Everything it does depends on the stamps and values of the samples alone, never on when they
//! arrive, so a bag gives the same numbers to the last bit through DDS and without it.
//!
//! 1. Samples are gathered while [`coarse alignment`](crate::mechanization::coarse_alignment) works on them.
//! 2. Its attitude is the point about which the 13-state filter is linear. The filter starts at the **first** sample with a
//!    misalignment prior so wide that it says nothing, and goes over everything gathered with its loop open. What it holds
//!    at the end is the coarse alignment's uncertainty as the samples really gave it, with the level error's correlation
//!    with the accelerometer biases and the azimuth error's with the east gyroscope drift: the P0 of what follows.
//! 3. The loop is closed and the filter goes on with every new sample.

mod estimate;
mod settings;

use std::collections::VecDeque;

pub use estimate::{Calibration, Estimate, InnovationReport, Phase, SampleReport};
use nalgebra::{UnitQuaternion, Vector3};
pub use settings::{Reference, Settings, Thresholds, default_noise};

use crate::earth::Position;
use crate::earth::rotation::HeadingPitchRoll;
use crate::error::Error;
use crate::estimation::consistency::InnovationWindow;
use crate::estimation::error_state::{StateMatrix, StateVector};
use crate::estimation::filter::{Loop, VelocityMeasurement};
use crate::estimation::measurement::{Innovation, Outcome};
use crate::estimation::model::{Model, PaperFilter};
use crate::mechanization::coarse_alignment::CoarseAlignment;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::{ImuSample, NoiseDensity};
use crate::stream::joint_history::JointHistory;
use crate::stream::stepper::{Arrival, Step, Stepper};
use crate::table::JointSample;
use crate::time::{Stamp, seconds_to_nanos};

/// The filter once it runs, with its own clock and test.
#[derive(Clone, Debug)]
struct Run {
    filter: PaperFilter,
    next_step: Stamp,
    window: InnovationWindow,
    last_normalized: f64,
    failures: u64,
    /// Attitude when fine alignment began; the turn from it begins calibration.
    reference_attitude: UnitQuaternion<f64>,
    turned: bool,
    /// Attitude of the ship when fine alignment began, by the joints and the table's axes as they are set.
    reference_vehicle: UnitQuaternion<f64>,
}

/// What is gathered before the filter can start.
#[derive(Clone, Debug, Default)]
struct Gathering {
    coarse: CoarseAlignment,
    backlog: Vec<Step>,
    /// Σ variance · interval, and Σ interval, for the noise densities.
    gyroscope_noise: Vector3<f64>,
    accelerometer_noise: Vector3<f64>,
}

#[derive(Clone, Debug)]
enum Stage {
    Gathering(Box<Gathering>),
    Running(Box<Run>),
}

/// The state machine.
#[derive(Clone, Debug)]
pub struct SelfCalibration {
    settings: Settings,
    stepper: Stepper,
    start: Option<Stamp>,
    position: Option<Position>,
    joints: JointHistory,
    velocities: Velocities,
    waiting: VecDeque<ImuSample>,
    stage: Stage,
    last: Option<Estimate>,
}

impl SelfCalibration {
    /// A machine that waits for its first sample.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting is out of range.
    pub fn new(settings: Settings) -> Result<Self, Error> {
        settings.check()?;
        Ok(Self {
            settings,
            stepper: Stepper::new(settings.restart_gap_s),
            start: None,
            position: None,
            joints: JointHistory::default(),
            velocities: Velocities::default(),
            waiting: VecDeque::new(),
            stage: Stage::Gathering(Box::default()),
            last: None,
        })
    }

    /// The settings it works with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Asks for other sigmas from now on. The estimate does not depend on them; only its phase does.
    pub fn set_thresholds(&mut self, thresholds: Thresholds) {
        self.settings.thresholds = thresholds;
    }

    /// Takes a position. The first one counts; the ship lies at her mooring.
    ///
    /// # Errors
    /// As [`Position::checked`].
    pub fn ingest_position(&mut self, fix: Position) -> Result<(), Error> {
        let checked = fix.checked()?;
        self.position.get_or_insert(checked);
        Ok(())
    }

    /// Takes a reading of the joints.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn ingest_joints(&mut self, joints: JointSample) -> Result<(), Error> {
        self.joints.push(joints)
    }

    /// Takes a velocity over ground (reference `Measured`; otherwise it is left aside).
    ///
    /// # Errors
    /// [`Error::NotFinite`], or [`Error::Setting`] where a sigma is not positive.
    pub fn ingest_velocity(
        &mut self,
        stamp: Stamp,
        measurement: VelocityMeasurement,
    ) -> Result<(), Error> {
        if !measurement.east_north.iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite {
                what: "aiding velocity",
                stamp,
            });
        }
        if !measurement.sigma.iter().all(|v| v.is_finite() && *v > 0.0) {
            return Err(Error::setting(
                "one-sigma of the aiding velocity in m/s",
                format!("{:?}", measurement.sigma),
                "positive numbers",
            ));
        }
        if matches!(self.settings.reference, Reference::Measured { .. }) {
            self.velocities.push(stamp, measurement);
        }
        Ok(())
    }

    /// Takes a sample. Returns the estimate when this sample completes a covariance step.
    ///
    /// # Errors
    /// [`Error::NotFinite`] (the sample is left out and counted), [`Error::Alignment`] (coarse alignment failed; it has
    /// started anew). After an error the machine goes on with the next sample.
    pub fn ingest_imu(&mut self, sample: &ImuSample) -> Result<Option<Estimate>, Error> {
        let Reference::Measured { patience_s } = self.settings.reference else {
            return self.process(sample);
        };
        self.waiting.push_back(*sample);
        let mut latest = None;
        while let Some(first) = self.waiting.front() {
            let covered = self.velocities.last.is_some_and(|last| last >= first.stamp);
            if !covered && sample.stamp.seconds_since(first.stamp) <= patience_s {
                break;
            }
            let Some(next) = self.waiting.pop_front() else {
                break;
            };
            latest = self.process(&next)?.or(latest);
        }
        Ok(latest)
    }

    /// Says that no more samples will come: an alignment that has gathered enough is finished with what there is.
    /// Returns the last estimate.
    ///
    /// # Errors
    /// [`Error::Alignment`] where there never was one, with what was missing.
    pub fn finish(&mut self) -> Result<Estimate, Error> {
        for sample in std::mem::take(&mut self.waiting) {
            self.process(&sample)?;
        }
        if let Stage::Gathering(gathering) = &self.stage {
            let seconds = gathering.coarse.seconds();
            if self.position.is_none() {
                return Err(Error::Alignment {
                    reason: "no position: expected a valid fix before the samples ended".into(),
                });
            }
            if seconds < self.settings.coarse_alignment_min_s && self.last.is_none() {
                return Err(Error::Alignment {
                    reason: format!(
                        "{seconds:.1} s of samples, expected at least {} s",
                        self.settings.coarse_alignment_min_s
                    ),
                });
            }
            if seconds >= self.settings.coarse_alignment_min_s {
                self.start_filter()?;
            }
        }
        let samples = self.samples();
        let mut last = self.last.clone().ok_or_else(|| Error::Alignment {
            reason: "the samples ended before the first estimate".into(),
        })?;
        // The estimate stands at the last covariance step; the samples after it have been looked at all the same.
        last.samples = samples;
        Ok(last)
    }

    /// Where the machine stands now.
    pub fn phase(&self) -> Phase {
        match &self.stage {
            Stage::Gathering(_) if self.position.is_none() => Phase::WaitingForPosition,
            Stage::Gathering(_) => Phase::CoarseAlignment,
            Stage::Running(run) => self.phase_of(run),
        }
    }

    /// How much of coarse alignment is done, 0..1; 1 when the filter runs.
    pub fn coarse_progress(&self) -> f64 {
        match &self.stage {
            Stage::Gathering(g) => (g.coarse.seconds() / self.settings.coarse_alignment_s).min(1.0),
            Stage::Running(_) => 1.0,
        }
    }

    /// What happened to the samples so far.
    pub fn samples(&self) -> SampleReport {
        SampleReport {
            counts: self.stepper.counts(),
            not_finite: self.stepper.not_finite(),
            restarts: self.stepper.jumps(),
            missing_velocities: self.velocities.missing,
        }
    }

    /// The last estimate.
    pub fn last(&self) -> Option<&Estimate> {
        self.last.as_ref()
    }

    /// Forgets all that was estimated and gathered and starts anew with the next sample; counts and position stay.
    pub fn restart(&mut self) {
        self.stepper.restart();
        self.start = None;
        self.stage = Stage::Gathering(Box::default());
    }

    fn process(&mut self, sample: &ImuSample) -> Result<Option<Estimate>, Error> {
        let step = match self.stepper.take(sample)? {
            Arrival::LeftOut => return Ok(None),
            Arrival::Start => {
                self.start = Some(sample.stamp);
                return Ok(None);
            }
            Arrival::Jump { from, to } => {
                self.start = Some(to);
                self.stage = Stage::Gathering(Box::default());
                return Err(Error::Alignment {
                    reason: format!(
                        "stamps jumped from {} ns to {} ns, more than {} s: alignment starts anew",
                        from.nanos(),
                        to.nanos(),
                        self.settings.restart_gap_s
                    ),
                });
            }
            Arrival::Step(step) => step,
        };
        match &mut self.stage {
            Stage::Running(run) => {
                let advanced = run.advance(&step, &self.settings, &mut self.velocities);
                if advanced.is_err() {
                    // Numbers that are none do not come back: everything is found anew.
                    self.restart();
                }
                if !advanced? {
                    return Ok(None);
                }
                if let Stage::Running(run) = &self.stage {
                    self.last = Some(self.estimate(run, step.stamp));
                }
                Ok(self.last.clone())
            }
            Stage::Gathering(gathering) => {
                gathering.coarse.ingest(&step.increment);
                gathering.backlog.push(step);
                let weight = step.increment.interval_s.powi(2);
                gathering.gyroscope_noise += sample.angular_rate_variance * weight;
                gathering.accelerometer_noise += sample.specific_force_variance * weight;
                let seconds = gathering.coarse.seconds();
                if self.position.is_some() && seconds >= self.settings.coarse_alignment_s {
                    self.start_filter()?;
                    return Ok(self.last.clone());
                }
                if seconds >= 2.0 * self.settings.coarse_alignment_s {
                    // Still no position: gather afresh rather than without end.
                    self.stage = Stage::Gathering(Box::default());
                    self.start = Some(sample.stamp);
                }
                Ok(None)
            }
        }
    }

    /// Solves the coarse alignment and takes the filter over everything gathered.
    fn start_filter(&mut self) -> Result<(), Error> {
        let gathered = std::mem::replace(&mut self.stage, Stage::Gathering(Box::default()));
        let (Stage::Gathering(gathering), Some(fix), Some(start)) =
            (gathered, self.position, self.start)
        else {
            return Ok(());
        };
        self.start = self.stepper.last();
        let coarse = gathering.coarse.solve(
            fix.latitude_rad,
            fix.height_m,
            self.settings.coarse_residual_limit_m_s,
        )?;
        self.start = Some(start);
        let place = NavigationState {
            attitude: coarse.at_start,
            velocity: Vector3::zeros(),
            position: fix,
        };
        let model = self.settings.prior.model();
        let covariance = model.initial_covariance(&place);
        let noise = self.settings.noise.unwrap_or_else(|| gathering.noise());
        let mut run = Run {
            filter: PaperFilter::new(
                model,
                place,
                &SensorErrors::default(),
                covariance,
                noise,
                Loop::Open,
            )?,
            next_step: start.plus_nanos(seconds_to_nanos(self.settings.step_s)),
            window: InnovationWindow::new(
                self.settings.window_updates,
                self.settings.window_false_alarm,
            ),
            last_normalized: 0.0,
            failures: 0,
            reference_attitude: coarse.at_start,
            turned: false,
            reference_vehicle: coarse.at_start,
        };
        let mut last_update = None;
        for step in &gathering.backlog {
            if run.advance(step, &self.settings, &mut self.velocities)? {
                last_update = Some(step.stamp);
            }
        }
        run.filter.close_loop();
        run.reference_attitude = run.filter.navigation().attitude;
        if let Some(stamp) = last_update {
            run.reference_vehicle = self.vehicle_attitude(&run, stamp);
        }
        self.last = last_update.map(|stamp| self.estimate(&run, stamp));
        self.stage = Stage::Running(Box::new(run));
        Ok(())
    }

    fn phase_of(&self, run: &Run) -> Phase {
        let below = |sigma: &StateVector| {
            sigma
                .iter()
                .zip(&self.settings.thresholds.sigma)
                .all(|(s, limit)| s <= limit)
        };
        if !run.window.passes() {
            Phase::Inconsistent
        } else if run.window.is_full() && run.turned && below(&run.filter.sigma()) {
            Phase::Converged
        } else if run.turned {
            Phase::Calibrating
        } else {
            Phase::FineAlignment
        }
    }

    /// The block's attitude with both joints turned back to zero.
    fn vehicle_attitude(&self, run: &Run, stamp: Stamp) -> UnitQuaternion<f64> {
        let angles = self.joints.angles_at(stamp);
        run.filter.navigation().attitude * self.settings.turntable.attitude(angles).inverse()
    }

    fn estimate(&self, run: &Run, stamp: Stamp) -> Estimate {
        let navigation = *run.filter.navigation();
        let covariance: StateMatrix = *run.filter.covariance();
        let vehicle = self.vehicle_attitude(run, stamp);
        Estimate {
            stamp,
            phase: self.phase_of(run),
            vehicle: HeadingPitchRoll::from_attitude(&vehicle),
            vehicle_turn_rad: vehicle.angle_to(&run.reference_vehicle),
            navigation,
            state: run.filter.state(),
            covariance,
            innovations: InnovationReport {
                last: run.last_normalized,
                window_mean: run.window.mean().unwrap_or(0.0),
                window_bound: run.window.upper_mean(),
                failures: run.failures,
            },
            samples: self.samples(),
            duration_s: self.start.map_or(0.0, |start| stamp.seconds_since(start)),
        }
    }
}

impl Run {
    /// Propagates, and at the end of a covariance step updates. Says whether the step ended.
    fn advance(
        &mut self,
        step: &Step,
        settings: &Settings,
        velocities: &mut Velocities,
    ) -> Result<bool, Error> {
        if let Some([angle, velocity]) = step.bridged {
            self.filter.bridge(angle, velocity);
        }
        self.filter.propagate(&step.increment);
        let half_sample = seconds_to_nanos(0.5 * step.increment.interval_s);
        let due = step.stamp.plus_nanos(half_sample) >= self.next_step;
        let measurement = match settings.reference {
            Reference::Moored { sigma_m_s } => due.then_some(VelocityMeasurement {
                east_north: [0.0; 2],
                sigma: [sigma_m_s; 2],
            }),
            Reference::Measured { .. } => velocities.take_until(step.stamp),
        };
        if !due && measurement.is_none() {
            return Ok(false);
        }
        self.filter.step()?;
        if let Some(measurement) = measurement {
            let outcomes = self.filter.update_velocity(&measurement, None);
            let innovations: Vec<_> = outcomes.iter().filter_map(Outcome::innovation).collect();
            if innovations.len() == outcomes.len() {
                self.last_normalized = innovations.iter().map(Innovation::normalized_squared).sum();
                self.window.push(self.last_normalized);
                self.failures += u64::from(!self.window.passes());
            }
        } else {
            velocities.missing += 1;
        }
        let period = seconds_to_nanos(settings.step_s);
        while self.next_step <= step.stamp.plus_nanos(half_sample) {
            self.next_step = self.next_step.plus_nanos(period);
        }
        let attitude = self.filter.navigation().attitude;
        self.turned |= attitude.angle_to(&self.reference_attitude) > settings.turn_rad;
        Ok(true)
    }
}

/// Velocity measurements that wait for the samples of their time.
#[derive(Clone, Debug, Default)]
struct Velocities {
    queue: VecDeque<(Stamp, VelocityMeasurement)>,
    last: Option<Stamp>,
    missing: u64,
}

impl Velocities {
    /// Takes a measurement that is later than all before.
    fn push(&mut self, stamp: Stamp, measurement: VelocityMeasurement) {
        if self.last.is_none_or(|last| stamp > last) {
            self.queue.push_back((stamp, measurement));
            self.last = Some(stamp);
        }
    }

    /// The last measurement at or before `stamp` that has not been used.
    fn take_until(&mut self, stamp: Stamp) -> Option<VelocityMeasurement> {
        let mut found = None;
        while self.queue.front().is_some_and(|(t, _)| *t <= stamp) {
            found = self.queue.pop_front().map(|(_, m)| m);
        }
        found
    }
}

impl Gathering {
    /// Noise densities from the variances that came with the samples: density² = variance × interval.
    fn noise(&self) -> NoiseDensity {
        let seconds = self.coarse.seconds();
        let density = |sum: &Vector3<f64>, default: &Vector3<f64>| {
            Vector3::from_fn(|i, _| {
                if sum[i] > 0.0 {
                    (sum[i] / seconds).sqrt()
                } else {
                    default[i]
                }
            })
        };
        let default = default_noise();
        NoiseDensity {
            gyroscope: density(&self.gyroscope_noise, &default.gyroscope),
            accelerometer: density(&self.accelerometer_noise, &default.accelerometer),
        }
    }
}
