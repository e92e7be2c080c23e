//! The navigator with its inputs and outputs as messages. No DDS in here.

use std::time::Duration;

use imu_input::{Publishers, is_frame, samples_report};
use ros_node::{InputWatch, Level, Node, Report, StreamMonitor};
use ros2_interfaces::compass_interfaces::Azimuth;
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use ros2_interfaces::tf2_msgs::TFMessage;
use rotary_sins_msgs::Calibration;
use rotary_sins_msgs::convert::{
    FromMessage, position_from_fix, stamp_from_time, velocity_from_twist,
};
use rotary_sins_msgs::interfaces::topics;
use ship_sentences::Motion;
use sins::earth::Position;
use sins::machines::navigator::{
    Navigator, NavigatorEvent, NavigatorOutput, NavigatorPhase, Solution,
};
use sins::machines::odometry::vehicle_motion;
use sins::sensor::sample::ImuSample;
use sins::table::JointSample;
use sins::{Error, Stamp};

use crate::parameters::NodeSettings;
use crate::{instruments, transforms, translation};

/// One solution as messages.
#[derive(Clone, Debug, Default)]
pub struct SolutionMessages {
    /// The compensated sample with its attitude.
    pub imu: Option<Imu>,
    /// Pose and twist, position, velocity.
    pub navigation: Option<(Odometry, NavSatFix, TwistWithCovarianceStamped)>,
}

/// What is to be published: with the calibration and without.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// With the calibration.
    pub compensated: SolutionMessages,
    /// Without it.
    pub uncompensated: SolutionMessages,
    /// Frames that move.
    pub transforms: Option<TFMessage>,
    /// Frames that do not, where they are new.
    pub fixed_transforms: Option<TFMessage>,
    /// What other instruments aboard are told.
    pub motion: Option<Motion>,
    /// Heading of the ship from East and from North, where it is asked for.
    pub azimuths: Option<[Azimuth; 2]>,
}

/// Says which samples are due at a rate, by their stamps alone.
#[derive(Clone, Copy, Debug)]
struct Decimation {
    period_nanos: Option<i64>,
    last: Option<i64>,
}

impl Decimation {
    fn new(rate_hz: f64) -> Self {
        Self {
            period_nanos: (rate_hz > 0.0)
                .then(|| sins::time::seconds_to_nanos(1.0 / rate_hz).max(1)),
            last: None,
        }
    }

    /// Never due at a rate of zero.
    fn or_never(rate_hz: f64) -> Option<Self> {
        (rate_hz > 0.0).then(|| Self::new(rate_hz))
    }

    fn is_due(&mut self, stamp: Stamp) -> bool {
        let Some(period) = self.period_nanos else {
            return true;
        };
        let slot = stamp.nanos().div_euclid(period);
        self.last.replace(slot) != Some(slot)
    }
}

#[derive(Debug)]
struct Inputs {
    imu: InputWatch,
    joints: InputWatch,
    fix: InputWatch,
    velocity: InputWatch,
    calibration: InputWatch,
}

impl Inputs {
    fn all(&mut self) -> [&mut InputWatch; 5] {
        [
            &mut self.imu,
            &mut self.joints,
            &mut self.fix,
            &mut self.velocity,
            &mut self.calibration,
        ]
    }
}

/// Compensation and navigation between messages.
#[derive(Debug)]
pub struct Compensator {
    settings: NodeSettings,
    navigator: Navigator,
    inputs: Inputs,
    imu_stamps: StreamMonitor,
    publishers: Publishers,
    /// The joints at the newest sample.
    joints: JointSample,
    frame_id: String,
    origin: Option<Position>,
    phase: NavigatorPhase,
    problem: Option<String>,
    navigation_due: Decimation,
    imu_due: Decimation,
    transforms_due: Option<Decimation>,
    motion_due: Decimation,
    /// Block frame and origin that the fixed transforms were last made of.
    fixed_for: Option<(String, Option<Position>)>,
    calibrations: u64,
}

impl Compensator {
    /// Waits for a calibration.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(settings: NodeSettings) -> Result<Self, Error> {
        let silence = Duration::from_secs_f64(settings.silence_s);
        let navigator = Navigator::new(settings.navigator.clone())?;
        Ok(Self {
            phase: navigator.phase(),
            navigator,
            inputs: Inputs {
                imu: InputWatch::required(topics::IMU_DATA_RAW.name, silence),
                joints: InputWatch::optional(topics::JOINT_STATES.name, silence),
                fix: InputWatch::optional(topics::FIX.name, silence),
                velocity: InputWatch::optional(topics::AIDING_VELOCITY.name, silence),
                calibration: InputWatch::optional(topics::CALIBRATION.name, silence),
            },
            imu_stamps: StreamMonitor::default(),
            publishers: Publishers::default(),
            joints: JointSample {
                stamp: Stamp::default(),
                position: [0.0; 2],
                velocity: [0.0; 2],
            },
            frame_id: "imu_link".to_owned(),
            origin: None,
            problem: None,
            navigation_due: Decimation::new(settings.output_rate_hz),
            imu_due: Decimation::new(settings.imu_output_rate_hz),
            transforms_due: Decimation::or_never(settings.tf_rate_hz),
            motion_due: Decimation::new(settings.nmea_rate_hz),
            fixed_for: None,
            calibrations: 0,
            settings,
        })
    }

    /// A position of the ship. The first one is the origin of the local frame.
    pub fn fix(&mut self, fix: &NavSatFix) {
        self.inputs.fix.arrived(1);
        let Some(position) = position_from_fix(fix) else {
            self.inputs.fix.refuse(
                "no fix",
                format!(
                    "status {}, latitude {}, longitude {}, altitude {}: expected status 0 or more and finite numbers",
                    fix.status.status, fix.latitude, fix.longitude, fix.altitude
                ),
            );
            return;
        };
        match self.navigator.push_position(position) {
            Ok(()) => {
                self.origin.get_or_insert(position);
            }
            Err(error) => self.inputs.fix.refuse("off the globe", error),
        }
    }

    /// A calibration. One that has overtaken its samples, which wait for their joint states, waits for them: navigation
    /// starts from it only where it has the samples around it.
    pub fn calibration(&mut self, message: &Calibration) {
        self.inputs.calibration.arrived(1);
        let calibration = match translation::calibration(message) {
            Ok(calibration) => calibration,
            Err(reason) => {
                self.inputs.calibration.refuse("unusable", reason);
                return;
            }
        };
        let place = calibration.position;
        match self.navigator.push_calibration(calibration) {
            Ok(()) => {
                self.calibrations += 1;
                self.origin.get_or_insert(place);
                tracing::info!(
                    "calibration from {} ({:.0} s, {} samples, {} gaps)",
                    ros_node::short(&message.source),
                    message.duration,
                    message.samples,
                    message.gaps
                );
            }
            Err(error) => self.inputs.calibration.refuse("unusable", error),
        }
        self.follow_phase();
    }

    /// A velocity over ground, for the node's own alignment where it is told that there are any. Samples that waited for it go on.
    pub fn velocity(
        &mut self,
        message: &TwistWithCovarianceStamped,
        publish: &mut impl FnMut(Output),
    ) {
        self.inputs.velocity.arrived(1);
        let measured = velocity_from_twist(message);
        let stamp = stamp_from_time(message.header.stamp);
        if let Err(error) = self.navigator.push_velocity(stamp, measured) {
            self.inputs.velocity.refuse("unusable", error);
        }
        self.advance(publish);
    }

    /// A reading of the joints. Samples that waited for it go on.
    pub fn joints(&mut self, message: &JointState, publish: &mut impl FnMut(Output)) {
        self.inputs.joints.arrived(1);
        match JointSample::from_message(message) {
            Ok(sample) => {
                if let Err(error) = self.navigator.push_joints(sample) {
                    self.inputs.joints.refuse("not finite", error);
                }
            }
            Err(error) => self.inputs.joints.refuse("other joints", error),
        }
        self.advance(publish);
    }

    /// Whether samples wait for a joint state.
    pub fn is_waiting(&self) -> bool {
        self.navigator.stream().waits_beside()
    }

    /// The inputs are those of a node: by their names after remapping, and silent only while it is active.
    ///
    /// # Errors
    /// A name that is none.
    pub fn listen_as(&mut self, node: &Node) -> ros_node::Result<()> {
        for input in self.inputs.all() {
            *input = input.clone().of(node)?;
        }
        Ok(())
    }

    /// What may change while the node runs: the silence that is no fault, and how often what is published.
    pub fn change(&mut self, settings: &NodeSettings) {
        let silence = Duration::from_secs_f64(settings.silence_s);
        for input in self.inputs.all() {
            input.set_patience(silence);
        }
        self.navigation_due = Decimation::new(settings.output_rate_hz);
        self.imu_due = Decimation::new(settings.imu_output_rate_hz);
        self.transforms_due = Decimation::or_never(settings.tf_rate_hz);
        self.motion_due = Decimation::new(settings.nmea_rate_hz);
    }

    /// The nodes that publish on the topic of the samples.
    pub fn publishers(&mut self, names: Vec<String>) {
        self.publishers.take(self.inputs.imu.topic(), names);
    }

    /// A sample; it goes on when its joint state is there.
    pub fn imu(&mut self, imu: &Imu, publish: &mut impl FnMut(Output)) {
        self.inputs.imu.arrived(1);
        match ImuSample::from_message(imu) {
            Ok(sample) => {
                self.imu_stamps.ingest(sample.stamp.nanos());
                let frame_id = &imu.header.frame_id;
                if self.frame_id != *frame_id && is_frame(frame_id) {
                    self.frame_id.clone_from(frame_id);
                }
                self.navigator.push_imu(&sample);
                self.advance(publish);
            }
            Err(error) => self.inputs.imu.refuse("stamp", error),
        }
    }

    /// The samples that still wait for a joint state go on without: no more will come.
    pub fn flush(&mut self, publish: &mut impl FnMut(Output)) {
        self.navigator.end();
        self.advance(publish);
    }

    fn advance(&mut self, publish: &mut impl FnMut(Output)) {
        while let Some(event) = self.navigator.poll() {
            match event {
                NavigatorEvent::Sample {
                    sample,
                    joints,
                    output,
                } => {
                    if let Some(output) = self.navigated(&sample, joints, output.as_deref()) {
                        publish(output);
                    }
                }
                NavigatorEvent::Refused(refused) => {
                    let stamp = refused.stamp.nanos();
                    let reason = format!("sample at {stamp} ns: {}", refused.why);
                    self.inputs.imu.refuse(refused.why.name(), reason);
                }
                NavigatorEvent::PhaseChanged { .. } => self.follow_phase(),
                NavigatorEvent::CalibrationTaken { restarted, .. } => {
                    if restarted {
                        tracing::warn!(
                            "{}: the calibration before had not converged: the solution that stood on it starts anew",
                            self.inputs.calibration.topic()
                        );
                    }
                }
                NavigatorEvent::CalibrationRefused { reason, .. } => {
                    self.inputs.calibration.refuse("unusable", reason);
                }
                NavigatorEvent::Restarted { stamp, cause } => {
                    let stamp = stamp.nanos();
                    self.trouble(format!(
                        "{cause} at {stamp} ns: navigation cannot go on and aligns itself anew"
                    ));
                }
                NavigatorEvent::HoleCrossed {
                    stamp,
                    seconds,
                    held,
                } => {
                    let how = if held {
                        "course and speed are kept, less certain"
                    } else {
                        "bridged"
                    };
                    let stamp = stamp.nanos();
                    tracing::warn!(
                        "{}: a hole of {seconds:.3} s up to {stamp} ns: {how}",
                        self.inputs.imu.topic()
                    );
                }
                NavigatorEvent::AlignmentFailed { reason, .. } => {
                    self.trouble(reason);
                }
            }
        }
    }

    fn trouble(&mut self, problem: String) {
        tracing::error!("{}: {problem}", self.inputs.imu.topic());
        self.problem = Some(problem);
    }

    fn navigated(
        &mut self,
        sample: &ImuSample,
        joints: JointSample,
        output: Option<&NavigatorOutput>,
    ) -> Option<Output> {
        self.joints = joints;
        let solution = output.map(|output| &output.compensated);
        let (fixed_transforms, transforms) = self.transforms(sample.stamp, solution);
        let Some(output) = output else {
            return transforms.is_some().then(|| Output {
                transforms,
                fixed_transforms,
                ..Output::default()
            });
        };
        self.problem = None;
        let (navigation, imu, motion) = (
            self.navigation_due.is_due(output.stamp),
            self.imu_due.is_due(output.stamp),
            self.motion_due.is_due(output.stamp),
        );
        (navigation || imu || motion || transforms.is_some()).then(|| Output {
            transforms,
            fixed_transforms,
            azimuths: (navigation && self.settings.azimuth_topics).then(|| self.azimuths(output)),
            motion: motion.then(|| self.motion(output, sample)),
            ..self.messages(output, sample, navigation, imu)
        })
    }

    /// Fixed transforms where they are new, and moving ones where they are due. Without a table the block is taken to stand
    /// at zero angles.
    fn transforms(
        &mut self,
        stamp: Stamp,
        solution: Option<&Solution>,
    ) -> (Option<TFMessage>, Option<TFMessage>) {
        let settings = &self.settings;
        let is_due = |due: &mut Decimation| due.is_due(stamp);
        if !self.transforms_due.as_mut().is_some_and(is_due) {
            return (None, None);
        }
        let made_of = (self.frame_id.clone(), self.origin);
        let fixed = (self.fixed_for.as_ref() != Some(&made_of)).then(|| {
            transforms::fixed(
                stamp,
                &self.frame_id,
                &settings.odometry_frame_id,
                self.origin.as_ref(),
            )
        });
        self.fixed_for = Some(made_of);
        let moving = transforms::moving(
            stamp,
            settings.navigator.alignment.turntable,
            self.joints.position,
            solution.zip(self.origin.as_ref()),
            &settings.odometry_frame_id,
            &settings.base_frame_id,
        );
        (fixed, Some(moving))
    }

    fn azimuths(&self, output: &NavigatorOutput) -> [Azimuth; 2] {
        translation::azimuths(
            output.stamp,
            &output.compensated,
            &self.settings.base_frame_id,
        )
    }

    fn motion(&self, output: &NavigatorOutput, sample: &ImuSample) -> Motion {
        let motion = vehicle_motion(
            &output.compensated,
            &self.settings.navigator.alignment.turntable,
            &self.joints,
            &sample.angular_rate_variance,
        );
        instruments::ship_motion(output.stamp, &output.compensated, &motion)
    }

    fn messages(
        &self,
        output: &NavigatorOutput,
        sample: &ImuSample,
        navigation: bool,
        imu: bool,
    ) -> Output {
        let messages = |solution: &Solution| SolutionMessages {
            imu: imu.then(|| translation::imu(output.stamp, solution, sample, &self.frame_id)),
            navigation: navigation
                .then(|| self.navigation(output.stamp, solution, sample))
                .flatten(),
        };
        Output {
            compensated: messages(&output.compensated),
            uncompensated: messages(&output.uncompensated),
            ..Output::default()
        }
    }

    fn navigation(
        &self,
        stamp: Stamp,
        solution: &Solution,
        sample: &ImuSample,
    ) -> Option<(Odometry, NavSatFix, TwistWithCovarianceStamped)> {
        let origin = self.origin.as_ref()?;
        let turntable = &self.settings.navigator.alignment.turntable;
        let motion = vehicle_motion(
            solution,
            turntable,
            &self.joints,
            &sample.angular_rate_variance,
        );
        let frames = [
            self.settings.odometry_frame_id.as_str(),
            self.settings.base_frame_id.as_str(),
        ];
        Some((
            translation::odometry(stamp, solution, &motion, origin, frames),
            translation::fix(stamp, solution, frames[1]),
            translation::velocity(stamp, solution, frames[0]),
        ))
    }

    /// Logs a change of phase, once.
    fn follow_phase(&mut self) {
        let now = self.navigator.phase();
        let before = std::mem::replace(&mut self.phase, now);
        if before != now {
            tracing::info!("{} -> {}", before.name(), now.name());
        }
    }

    /// How the samples come.
    pub fn imu_report(&self) -> Report {
        let counts = self.navigator.stream().counts();
        samples_report(&self.inputs.imu, &self.imu_stamps, counts, &self.publishers)
    }

    /// How the joint states come.
    pub fn joints_report(&self) -> Report {
        self.inputs
            .joints
            .report()
            .with("samples waiting", self.navigator.stream().waiting())
    }

    /// Where navigation stands.
    pub fn navigation_report(&self) -> Report {
        let mut report = Report::ok(self.phase.name().replace('_', " "))
            .with("phase", self.phase.name())
            .with("calibrations", self.calibrations)
            .with("calibrations refused", self.inputs.calibration.refused())
            .with("fixes refused", self.inputs.fix.refused())
            .with("velocities", self.inputs.velocity.received())
            .with("velocities refused", self.inputs.velocity.refused());
        // What it waits for stands beside what has thrown it back.
        let mut waiting = Level::Warn;
        if let Some(problem) = &self.problem {
            report = report.worsened(Level::Error, problem);
            waiting = Level::Error;
        }
        if self.navigator.waits_for_position() {
            report = report.worsened(
                waiting,
                &format!(
                    "aligning waits for a valid position on {}",
                    self.inputs.fix.topic()
                ),
            );
        }
        report
    }
}

#[cfg(test)]
#[path = "compensator_tests.rs"]
mod tests;
