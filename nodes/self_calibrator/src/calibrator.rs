//! The machine with its inputs and outputs as messages. No DDS in here: what the node task receives is put in, what comes
//! out is to be published.

use std::path::Path;
use std::time::Duration;

use imu_input::{Publishers, samples_report};
use ros_node::{InputWatch, Level, Report, StreamMonitor};
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use ros2_interfaces::std_srvs::TriggerResponse;
use rotary_sins_msgs::convert::{
    FromMessage, fix_from_message, stamp_from_time, velocity_from_twist,
};
use rotary_sins_msgs::interfaces::topics;
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use sins::machines::self_calibration::{
    Estimate, Event, Phase, Reference, SelfCalibration, Settings, Thresholds,
};
use sins::sensor::sample::ImuSample;
use sins::table::JointSample;
use sins::time::seconds_to_nanos;
use sins::units::ARC_SECOND;
use sins::{Error, Stamp};

use crate::kept::Waking;
use crate::{phase, storage, translation};

/// What is to be published.
#[derive(Debug, Default)]
pub struct Output {
    /// On [`topics::ESTIMATE`].
    pub estimate: Option<SelfCalibrationEstimate>,
    /// On [`topics::CALIBRATION`].
    pub calibration: Option<Calibration>,
}

/// The inputs, watched.
#[derive(Debug)]
struct Inputs {
    imu: InputWatch,
    joints: InputWatch,
    fix: InputWatch,
    velocity: InputWatch,
}

/// Self-calibration between messages.
#[derive(Debug)]
pub struct Calibrator {
    pub(crate) machine: SelfCalibration,
    /// A state that waits for the first samples.
    pub(crate) waking: Option<Box<Waking>>,
    source: String,
    inputs: Inputs,
    imu_stamps: StreamMonitor,
    publishers: Publishers,
    pub(crate) frame_id: String,
    /// The newest estimate of the running filter; none before it runs.
    pub(crate) latest: Option<Estimate>,
    /// The newest estimate that agreed with its samples; it outlives a restart.
    pub(crate) good: Option<Estimate>,
    /// What the parameters ask for.
    pub(crate) own_thresholds: Thresholds,
    pub(crate) phase: Phase,
    /// Why the last alignment failed, until one succeeds.
    problem: Option<String>,
    noise_told: bool,
    pub(crate) converged_published: bool,
    scheme_status: Option<SchemeStatus>,
    /// The scheme has finished at this time; the calibration for it is due.
    pub(crate) finish: Option<Stamp>,
    next_progress: Option<Stamp>,
    /// The state has changed so that it should be kept now.
    pub(crate) hurries: bool,
    /// How often the state has been kept, and why it could not be the last time; none where nobody keeps it.
    pub(crate) kept: Option<(u64, Option<String>)>,
}

impl Calibrator {
    /// Waits for its first sample. `source` is what the calibration messages name as their maker.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(settings: &Settings, source: &str, silence: Duration) -> Result<Self, Error> {
        let machine = SelfCalibration::new(settings.clone())?;
        Ok(Self {
            phase: machine.phase(),
            machine,
            waking: None,
            source: source.to_owned(),
            inputs: Inputs {
                imu: InputWatch::required(topics::IMU_DATA_RAW.name, silence),
                joints: InputWatch::optional(topics::JOINT_STATES.name, silence),
                fix: InputWatch::required(topics::FIX.name, silence),
                velocity: InputWatch::required(topics::AIDING_VELOCITY.name, silence),
            },
            imu_stamps: StreamMonitor::default(),
            publishers: Publishers::default(),
            frame_id: "imu_link".to_owned(),
            latest: None,
            good: None,
            own_thresholds: settings.thresholds.clone(),
            problem: None,
            noise_told: false,
            converged_published: false,
            scheme_status: None,
            finish: None,
            next_progress: None,
            hurries: false,
            kept: None,
        })
    }

    /// A position of the ship.
    pub fn fix(&mut self, fix: &NavSatFix) {
        self.inputs.fix.arrived(1);
        if let Some((kind, reason)) = translation::refusal(fix) {
            self.inputs.fix.refuse(kind, reason);
        } else if let Some(fix) = fix_from_message(fix)
            && let Err(error) = self.machine.push_fix(fix)
        {
            self.inputs.fix.refuse("off the globe", error);
        }
        self.follow_phase();
    }

    /// A reading of the joints.
    pub fn joints(&mut self, joints: &JointState) {
        self.inputs.joints.arrived(1);
        match JointSample::from_message(joints) {
            Ok(sample) => {
                if let Some(waking) = &mut self.waking {
                    waking.joints(sample);
                }
                if let Err(error) = self.machine.push_joints(sample) {
                    self.inputs.joints.refuse("not finite", error);
                }
            }
            Err(error) => self.inputs.joints.refuse("other joints", error),
        }
    }

    /// A velocity of the ship.
    pub fn velocity(&mut self, velocity: &TwistWithCovarianceStamped) {
        self.inputs.velocity.arrived(1);
        let measurement = velocity_from_twist(velocity);
        if let Err(error) = self
            .machine
            .push_velocity(stamp_from_time(velocity.header.stamp), measurement)
        {
            self.inputs.velocity.refuse("unusable", error);
        }
    }

    /// The nodes that publish on the topic of the samples.
    pub fn publishers(&mut self, names: Vec<String>) {
        self.publishers.take(topics::IMU_DATA_RAW.name, names);
    }

    /// A sample. Says what it gives to publish: mostly nothing, once a second an estimate.
    pub fn imu(&mut self, imu: &Imu) -> Vec<Output> {
        self.inputs.imu.arrived(1);
        let sample = match ImuSample::from_message(imu) {
            Ok(sample) => sample,
            Err(error) => {
                self.inputs.imu.refuse("stamp", error);
                return Vec::new();
            }
        };
        self.imu_stamps.ingest(sample.stamp.nanos());
        if self.frame_id != imu.header.frame_id && !imu.header.frame_id.is_empty() {
            self.frame_id.clone_from(&imu.header.frame_id);
        }
        self.tell_assumed_noise(&sample);
        if self.waking.is_some() {
            self.wake(&sample);
        } else {
            self.machine.push_imu(&sample);
        }
        let mut outputs = Vec::new();
        while let Some(event) = self.machine.poll() {
            outputs.extend(self.follow(event));
        }
        if outputs.is_empty() {
            outputs.extend(self.progress(sample.stamp));
        }
        outputs
    }

    /// What happened in the machine, and what it gives to publish.
    fn follow(&mut self, event: Event) -> Option<Output> {
        match event {
            Event::Estimate(estimate) => return Some(self.take(*estimate)),
            Event::PhaseChanged { .. } => self.follow_phase(),
            Event::Refused(refused) => {
                let stamp = refused.stamp.nanos();
                let reason = format!("sample at {stamp} ns: {}", refused.why);
                self.inputs.imu.refuse(refused.why.name(), reason);
            }
            Event::Restarted {
                stamp,
                cause,
                sensors_kept,
            } => {
                let kept = if sensors_kept {
                    "; what is known of the sensors is kept"
                } else {
                    ""
                };
                let stamp = stamp.nanos();
                tracing::error!(
                    "{}: {cause} at {stamp} ns: alignment starts anew{kept}",
                    topics::IMU_DATA_RAW.name
                );
                self.forget();
            }
            Event::HoleCrossed {
                stamp,
                seconds,
                sigma_rad,
                ..
            } => tracing::warn!(
                "{}: a hole of {seconds:.3} s up to {} ns; the attitude is less certain by {:.1} arcsec",
                topics::IMU_DATA_RAW.name,
                stamp.nanos(),
                sigma_rad / ARC_SECOND
            ),
            Event::AlignmentFailed { reason, .. } => {
                tracing::error!("{}: {reason}", topics::IMU_DATA_RAW.name);
                self.problem = Some(reason);
                self.forget();
            }
        }
        None
    }

    /// What the scheme reports. A calibration is due when it has finished and the samples have come as far.
    pub fn scheme(&mut self, status: &SchemeStatus) -> Option<Calibration> {
        let before = self.scheme_status.replace(status.clone());
        if status.state != SchemeStatus::FINISHED {
            self.finish = None;
            return None;
        }
        if before.is_some_and(|before| before.state == SchemeStatus::FINISHED) {
            return None;
        }
        let end: Stamp = stamp_from_time(status.header.stamp);
        let Some(latest) = &self.latest else {
            tracing::info!(
                "scheme {} is finished, but there is no estimate to publish",
                status.scheme
            );
            return None;
        };
        if latest.stamp >= end {
            return self.calibration("the scheme is finished");
        }
        self.finish = Some(end);
        None
    }

    /// Called now and then: where the samples have ended before the end of the scheme, the last estimate has to do.
    pub fn tick(&mut self) -> Option<Calibration> {
        if self.finish.is_none() || !self.inputs.imu.is_silent() {
            return None;
        }
        self.finish = None;
        self.calibration("the scheme is finished and no more samples come")
    }

    /// Answers the request for a calibration.
    pub fn publish_request(&mut self) -> (TriggerResponse, Option<Calibration>) {
        match self.calibration("asked by service") {
            Some(calibration) => (
                TriggerResponse {
                    success: true,
                    message: format!("calibration, phase {}", self.phase.name()),
                },
                Some(calibration),
            ),
            None => (
                TriggerResponse {
                    success: false,
                    message: format!(
                        "no estimate yet: phase {}, {:.0} % of coarse alignment{}",
                        self.phase.name(),
                        100.0 * self.machine.coarse_progress(),
                        self.problem
                            .as_ref()
                            .map_or_else(String::new, |problem| format!("; {problem}"))
                    ),
                },
                None,
            ),
        }
    }

    /// The samples, as they arrive.
    pub fn samples(&self) -> &InputWatch {
        &self.inputs.imu
    }

    /// Writes the calibration into a file.
    pub fn save(&self, path: &Path) -> TriggerResponse {
        storage::save(path, self.latest.as_ref(), &self.source)
    }

    /// Reads a calibration from a file, to be published; the estimate goes on beside it.
    pub fn load(&self, path: &Path) -> (TriggerResponse, Option<Calibration>) {
        storage::load(path, &self.frame_id)
    }

    /// Starts anew with the next sample.
    pub fn reset(&mut self) -> TriggerResponse {
        self.restart("reset by service");
        TriggerResponse {
            success: true,
            message: "alignment starts anew with the next sample".to_owned(),
        }
    }

    /// Starts anew with the next sample and forgets what is known of the sensors, for a reason.
    pub fn restart(&mut self, why: &str) {
        self.waking = None;
        self.hurries = true;
        self.machine.reset();
        self.forget();
        self.problem = None;
        tracing::info!("{why}: alignment starts anew");
    }

    /// What the parameters ask for.
    pub fn own_thresholds(&self) -> Thresholds {
        self.own_thresholds.clone()
    }

    /// Asks for other sigmas than the parameters do, or for those again. Convergence by them is news.
    pub fn ask_for(&mut self, thresholds: Option<Thresholds>) {
        self.machine
            .set_thresholds(thresholds.unwrap_or_else(|| self.own_thresholds.clone()));
        self.follow_phase();
        self.converged_published &= self.phase == Phase::Converged;
    }

    /// The newest calibration that agrees with its samples.
    pub fn last_good(&self) -> Option<Calibration> {
        let good = self.good.as_ref()?;
        Some(translation::calibration(
            &good.calibration(),
            Some(good),
            &self.frame_id,
            &self.source,
        ))
    }

    /// How far it has come, 0..1: of coarse alignment while it lasts, then of what is asked for.
    pub fn progress_share(&self) -> f64 {
        self.latest.as_ref().map_or_else(
            || self.machine.coarse_progress(),
            |latest| {
                let thresholds = &self.machine.settings().thresholds;
                thresholds.reached(latest.covariance())
            },
        )
    }

    /// What the scheme reported last.
    pub fn scheme_status(&self) -> Option<&SchemeStatus> {
        self.scheme_status.as_ref()
    }

    /// Whether the estimate has come to this time.
    pub fn has_come_to(&self, stamp: Stamp) -> bool {
        self.latest
            .as_ref()
            .is_some_and(|latest| latest.stamp >= stamp)
    }

    fn take(&mut self, estimate: Estimate) -> Output {
        self.problem = None;
        self.latest = Some(estimate);
        self.follow_phase();
        if self.phase != Phase::Inconsistent {
            self.good.clone_from(&self.latest);
        }
        let due = self
            .finish
            .take_if(|end| self.latest.as_ref().is_some_and(|e| e.stamp >= *end));
        let calibration = if self.phase == Phase::Converged && !self.converged_published {
            self.converged_published = true;
            self.calibration("converged")
        } else if due.is_some() {
            self.calibration("the scheme is finished")
        } else {
            None
        };
        Output {
            estimate: self
                .latest
                .as_ref()
                .map(|estimate| translation::estimate(estimate, &self.frame_id)),
            calibration,
        }
    }

    /// An estimate without numbers, once per covariance step, while there is no filter yet.
    fn progress(&mut self, stamp: Stamp) -> Option<Output> {
        if self.waking.is_some()
            || self.latest.is_some()
            || self.next_progress.is_some_and(|next| stamp < next)
        {
            return None;
        }
        let period = seconds_to_nanos(self.machine.settings().step_s);
        self.next_progress = Some(stamp.plus_nanos(period));
        self.follow_phase();
        let estimate = translation::progress(
            stamp,
            self.phase,
            self.machine.coarse_progress(),
            &self.machine.samples(),
            &self.frame_id,
        );
        Some(Output {
            estimate: Some(estimate),
            calibration: None,
        })
    }

    fn calibration(&self, why: &str) -> Option<Calibration> {
        let latest = self.latest.as_ref()?;
        tracing::info!(
            "calibration at {:.0} s, phase {}: {why}",
            latest.duration_s,
            latest.phase.name()
        );
        Some(translation::calibration(
            &latest.calibration(),
            Some(latest),
            &self.frame_id,
            &self.source,
        ))
    }

    fn forget(&mut self) {
        self.latest = None;
        self.converged_published = false;
        self.finish = None;
        self.next_progress = None;
        self.follow_phase();
    }

    /// Logs a change of phase, once, with its reason.
    fn follow_phase(&mut self) {
        if self.waking.is_some() {
            return;
        }
        let now = self.machine.phase();
        let before = std::mem::replace(&mut self.phase, now);
        if before == now {
            return;
        }
        self.hurries = true;
        let why = phase::reason(before, now, self.latest.as_ref(), self.machine.settings());
        let (from, to) = (before.name(), now.name());
        if now == Phase::Inconsistent {
            tracing::warn!("phase {from} -> {to}: {why}");
        } else {
            tracing::info!("phase {from} -> {to}: {why}");
        }
    }

    fn tell_assumed_noise(&mut self, sample: &ImuSample) {
        if self.noise_told {
            return;
        }
        self.noise_told = true;
        let known = |v: &nalgebra::Vector3<f64>| v.iter().all(|x| *x > 0.0);
        if self.machine.settings().noise.is_none()
            && !(known(&sample.angular_rate_variance) && known(&sample.specific_force_variance))
        {
            tracing::warn!(
                "{}: the covariances are not filled in; 0.001 deg/sqrt(h) and 10 ug/sqrt(Hz) are assumed (parameters \
                 angle_random_walk_deg_per_sqrt_hour and velocity_random_walk_ug_per_sqrt_hz tell better)",
                topics::IMU_DATA_RAW.name
            );
        }
    }

    /// How the samples come.
    pub fn imu_report(&self) -> Report {
        let samples = self.machine.samples();
        samples_report(
            &self.inputs.imu,
            &self.imu_stamps,
            samples.counts,
            &self.publishers,
        )
    }

    /// How the joint states come.
    pub fn joints_report(&self) -> Report {
        self.inputs.joints.report()
    }

    /// How the position comes; once it is known, silence is no fault.
    pub fn fix_report(&self) -> Report {
        if self.phase == Phase::WaitingForPosition {
            return self.inputs.fix.report();
        }
        quiet_report(&self.inputs.fix)
    }

    /// How the measured velocity comes, where it is asked for.
    pub fn velocity_report(&self) -> Report {
        let Reference::Measured { .. } = self.machine.settings().reference else {
            return Report::ok("not asked for: the ship is moored");
        };
        let missing = self.machine.samples().missing_velocities;
        self.inputs
            .velocity
            .report()
            .with("missing velocities", missing)
    }

    /// Whether the state is kept.
    pub fn checkpoint_report(&self) -> Report {
        let Some((written, problem)) = &self.kept else {
            return Report::ok("off");
        };
        let report = Report::ok(format!("written {written} times")).with("written", written);
        match problem {
            Some(problem) => report.worsened(Level::Error, problem),
            None => report,
        }
    }

    /// Where self-calibration stands.
    pub fn estimate_report(&self) -> Report {
        let mut report =
            Report::ok(format!("phase {}", self.phase.name())).with("phase", self.phase.name());
        if let Some(problem) = &self.problem {
            report = report.worsened(Level::Error, problem);
        }
        let Some(latest) = &self.latest else {
            return report.with(
                "coarse alignment [%]",
                format!("{:.0}", 100.0 * self.machine.coarse_progress()),
            );
        };
        let innovations = latest.innovations;
        report = report
            .with("duration [s]", format!("{:.3}", latest.duration_s))
            .with("NIS", format!("{:.3}", innovations.last))
            .with("NIS mean", format!("{:.4}", innovations.window_mean))
            .with("NIS bound", format!("{:.4}", innovations.window_bound))
            .with("NIS failures", innovations.failures);
        if let Some(doubt) = latest.axes_doubt() {
            report = report.worsened(Level::Warn, &doubt);
        }
        let verdict = latest.verdict(self.machine.settings());
        for (name, reason) in ["reason", "second reason", "third reason"]
            .into_iter()
            .zip(&verdict.reasons)
        {
            report = report.with(name, reason);
        }
        if self.phase == Phase::Inconsistent {
            let why = phase::reason(
                Phase::Calibrating,
                self.phase,
                Some(latest),
                self.machine.settings(),
            );
            report = report.worsened(Level::Warn, &why);
        }
        report
    }
}

/// How an input is whose silence is no fault.
fn quiet_report(watch: &InputWatch) -> Report {
    Report::ok(format!("{} messages", watch.received())).with("refused", watch.refused())
}

#[cfg(test)]
#[path = "calibrator_tests.rs"]
mod tests;
