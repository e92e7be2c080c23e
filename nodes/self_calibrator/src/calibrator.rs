//! The machine with its inputs and outputs as messages. No DDS in here: what the node task receives is put in, what comes
//! out is to be published.

mod aiding;
mod events;
mod reports;

use std::time::Duration;

use imu_input::{Publishers, is_frame};
use ros_node::{InputWatch, Node, StreamMonitor};
use ros2_interfaces::sensor_msgs::Imu;
use ros2_interfaces::std_srvs::TriggerResponse;
use rotary_sins_msgs::convert::{FromMessage, stamp_from_time};
use rotary_sins_msgs::interfaces::topics;
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use sins::machines::self_calibration::{Estimate, Phase, SelfCalibration, Settings, Thresholds};
use sins::sensor::sample::ImuSample;
use sins::time::seconds_to_nanos;
use sins::{Error, Stamp};

use crate::kept::Waking;
use crate::outlook::Scheme;
use crate::translation;

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
    /// The samples do not say how noisy they are, nor do the parameters. None before the first sample.
    noise_is_assumed: Option<bool>,
    pub(crate) converged_published: bool,
    scheme_status: Option<SchemeStatus>,
    /// The scheme, for what it will still bring.
    pub(crate) scheme: Scheme,
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
            noise_is_assumed: None,
            converged_published: false,
            scheme_status: None,
            scheme: Scheme::default(),
            finish: None,
            next_progress: None,
            hurries: false,
            kept: None,
        })
    }

    /// The inputs are those of a node: by their names after remapping, and silent only while it is active.
    ///
    /// # Errors
    /// A name that is none.
    pub fn listen_as(&mut self, node: &Node) -> ros_node::Result<()> {
        let Inputs {
            imu,
            joints,
            fix,
            velocity,
        } = &mut self.inputs;
        for input in [imu, joints, fix, velocity] {
            *input = input.clone().of(node)?;
        }
        Ok(())
    }

    /// What may change while the node runs: the sigmas that its parameters ask for, and the silence that is no fault. A goal that
    /// is under way keeps its own sigmas.
    pub fn change(&mut self, thresholds: Thresholds, silence: Duration, goal_is_under_way: bool) {
        for input in [
            &mut self.inputs.imu,
            &mut self.inputs.joints,
            &mut self.inputs.fix,
            &mut self.inputs.velocity,
        ] {
            input.set_patience(silence);
        }
        if thresholds != self.own_thresholds {
            tracing::info!("the thresholds were changed");
            self.own_thresholds = thresholds;
            if !goal_is_under_way {
                self.ask_for(None);
            }
        }
    }

    /// The nodes that publish on the topic of the samples.
    pub fn publishers(&mut self, names: Vec<String>) {
        self.publishers.take(self.inputs.imu.topic(), names);
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
        let frame_id = &imu.header.frame_id;
        if self.frame_id != *frame_id && is_frame(frame_id) {
            self.frame_id.clone_from(frame_id);
        }
        self.look_at_noise(&sample);
        if self.waking.is_some() {
            self.wake(&sample);
        } else {
            self.machine.push_imu(&sample);
        }
        let mut outputs = self.outputs();
        if outputs.is_empty() {
            outputs.extend(self.progress(sample.stamp));
        }
        outputs
    }

    /// What everything that has come gives to publish. After joint states, fixes and velocities too: samples may wait for one, and
    /// of the last samples of all nobody else would ask.
    pub fn outputs(&mut self) -> Vec<Output> {
        let mut outputs = Vec::new();
        while let Some(event) = self.machine.poll() {
            outputs.extend(self.follow(event));
        }
        outputs
    }

    /// What the scheme reports. A calibration is due when it has finished and the samples have come as far.
    pub fn scheme(&mut self, status: &SchemeStatus) -> Option<Calibration> {
        self.scheme.follow(status);
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

    /// What is to be saved: the newest estimate, and whose it is.
    pub fn to_save(&self) -> (Option<Estimate>, String) {
        (self.latest.clone(), self.source.clone())
    }

    /// The frame that the samples are of.
    pub fn frame_id(&self) -> &str {
        &self.frame_id
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

    /// What the judge has against the newest estimate, the worst first; nothing where it converged.
    pub fn reasons(&self) -> Vec<String> {
        let of = |latest: &Estimate| latest.verdict(self.machine.settings()).reasons;
        self.latest.as_ref().map(of).unwrap_or_default()
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
                .map(|estimate| self.told_noise(self.told_estimate(estimate))),
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
            estimate: Some(self.told_noise(estimate)),
            calibration: None,
        })
    }

    fn told_estimate(&self, estimate: &Estimate) -> SelfCalibrationEstimate {
        translation::estimate(estimate, self.machine.settings(), &self.frame_id)
    }

    /// Whoever reads an estimate reads that its sigmas stand on noise that nobody told.
    fn told_noise(&self, mut estimate: SelfCalibrationEstimate) -> SelfCalibrationEstimate {
        if self.noise_is_assumed == Some(true) {
            estimate.message.push_str(events::NOISE_IN_AN_ESTIMATE);
        }
        estimate
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
        self.scheme.forget_what_was_asked();
        self.converged_published = false;
        self.finish = None;
        self.next_progress = None;
        self.follow_phase();
    }
}

#[cfg(test)]
mod tests;
