//! The navigator with its inputs and outputs as messages. No DDS in here.

use std::time::Duration;

use imu_input::samples_report;
use ros_node::{InputWatch, Level, Report, StreamMonitor};
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use ros2_interfaces::tf2_msgs::TFMessage;
use rotary_sins_msgs::Calibration;
use rotary_sins_msgs::convert::{FromMessage, position_from_fix, stamp_from_time};
use ship_sentences::Motion;
use sins::earth::Position;
use sins::machines::navigator::{Navigator, NavigatorOutput, NavigatorPhase, Solution};
use sins::machines::odometry::vehicle_motion;
use sins::sensor::sample::ImuSample;
use sins::stream::joint_history::JointHistory;
use sins::stream::stamp_order::{InOrder, StampOrder};
use sins::table::JointSample;
use sins::{Error, Stamp};

use crate::parameters::NodeSettings;
use crate::{instruments, transforms, translation};

/// Topics of the node, as they are named before remapping.
pub mod topic {
    /// Samples of the IMU.
    pub const IMU: &str = "imu/data_raw";
    /// Encoders of the table.
    pub const JOINTS: &str = "turntable/joint_states";
    /// Position of the ship.
    pub const FIX: &str = "fix";
    /// Calibrations.
    pub const CALIBRATION: &str = "self_calibration/calibration";
}

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
    calibration: InputWatch,
}

/// Compensation and navigation between messages.
#[derive(Debug)]
pub struct Compensator {
    settings: NodeSettings,
    navigator: Navigator,
    inputs: Inputs,
    imu_stamps: StreamMonitor,
    order: StampOrder,
    joints: JointHistory,
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
    /// A calibration of a time whose samples are still to come.
    early: Option<Calibration>,
    navigated: Option<Stamp>,
}

impl Compensator {
    /// Waits for a calibration.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(settings: NodeSettings) -> Result<Self, Error> {
        let silence = Duration::from_secs_f64(settings.silence_s);
        let navigator = Navigator::new(settings.navigator)?;
        Ok(Self {
            phase: navigator.phase(),
            navigator,
            inputs: Inputs {
                imu: InputWatch::required(topic::IMU, silence),
                joints: InputWatch::optional(topic::JOINTS, silence),
                fix: InputWatch::optional(topic::FIX, silence),
                calibration: InputWatch::optional(topic::CALIBRATION, silence),
            },
            imu_stamps: StreamMonitor::default(),
            order: StampOrder::new(settings.joint_patience_s),
            joints: JointHistory::default(),
            frame_id: "imu_link".to_owned(),
            origin: None,
            problem: None,
            navigation_due: Decimation::new(settings.output_rate_hz),
            imu_due: Decimation::new(settings.imu_output_rate_hz),
            transforms_due: Decimation::or_never(settings.tf_rate_hz),
            motion_due: Decimation::new(settings.nmea_rate_hz),
            fixed_for: None,
            calibrations: 0,
            early: None,
            navigated: None,
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
        match self.navigator.ingest_position(position) {
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
        let ahead_s = self.navigated.map_or(0.0, |navigated| {
            stamp_from_time(message.header.stamp).seconds_since(navigated)
        });
        if ahead_s > 0.0 && ahead_s <= self.settings.navigator.history_s {
            self.early = Some(message.clone());
        } else {
            self.early = None;
            self.take_calibration(message);
        }
    }

    fn take_calibration(&mut self, message: &Calibration) {
        let calibration = match translation::calibration(message) {
            Ok(calibration) => calibration,
            Err(reason) => {
                self.inputs.calibration.refuse("unusable", reason);
                return;
            }
        };
        let place = Position {
            latitude_rad: calibration.position.latitude_rad,
            longitude_rad: calibration.position.longitude_rad,
            height_m: calibration.position.height_m,
        };
        match self.navigator.ingest_calibration(calibration) {
            Ok(()) => {
                self.calibrations += 1;
                self.origin.get_or_insert(place);
                tracing::info!(
                    "calibration from {} ({:.0} s, {} samples, {} gaps)",
                    message.source,
                    message.duration,
                    message.samples,
                    message.gaps
                );
            }
            Err(error) => self.inputs.calibration.refuse("unusable", error),
        }
        self.follow_phase();
    }

    /// A reading of the joints. Samples that waited for it go on.
    pub fn joints(&mut self, message: &JointState, publish: &mut impl FnMut(Output)) {
        self.inputs.joints.arrived(1);
        match JointSample::from_message(message) {
            Ok(sample) => self.order.push_joints(sample),
            Err(error) => self.inputs.joints.refuse("other joints", error),
        }
        self.advance(publish);
    }

    /// Whether samples wait for a joint state.
    pub fn is_waiting(&self) -> bool {
        self.order.waiting() > 0
    }

    /// A sample; it goes on when its joint state is there.
    pub fn imu(&mut self, imu: &Imu, publish: &mut impl FnMut(Output)) {
        self.inputs.imu.arrived(1);
        match ImuSample::from_message(imu) {
            Ok(sample) => {
                self.imu_stamps.ingest(sample.stamp.nanos());
                if self.frame_id != imu.header.frame_id && !imu.header.frame_id.is_empty() {
                    self.frame_id.clone_from(&imu.header.frame_id);
                }
                self.order.push_sample(sample);
                self.advance(publish);
            }
            Err(error) => self.inputs.imu.refuse("stamp", error),
        }
    }

    /// The samples that still wait for a joint state go on without: no more will come.
    pub fn flush(&mut self, publish: &mut impl FnMut(Output)) {
        for sample in self.order.flush() {
            if let Some(output) = self.navigate(&sample) {
                publish(output);
            }
        }
    }

    fn advance(&mut self, publish: &mut impl FnMut(Output)) {
        while let Some(next) = self.order.next() {
            match next {
                InOrder::Joints(joints) => {
                    let taken = self.joints.push(joints);
                    if let Err(error) = taken.and_then(|()| self.navigator.ingest_joints(joints)) {
                        self.inputs.joints.refuse("not finite", error);
                    }
                }
                InOrder::Sample(sample) => {
                    if let Some(output) = self.navigate(&sample) {
                        publish(output);
                    }
                }
            }
        }
    }

    fn navigate(&mut self, sample: &ImuSample) -> Option<Output> {
        let result = self.navigator.ingest_imu(sample);
        let output = match result {
            Ok(output) => output,
            Err(error @ Error::NotFinite { .. }) => {
                self.inputs.imu.refuse("not finite", error);
                None
            }
            Err(error) => {
                tracing::error!("{}: {error}", topic::IMU);
                self.problem = Some(error.to_string());
                None
            }
        };
        self.navigated = Some(sample.stamp);
        let is_due = |early: &mut Calibration| stamp_from_time(early.header.stamp) <= sample.stamp;
        if let Some(calibration) = self.early.take_if(is_due) {
            self.take_calibration(&calibration);
        }
        self.follow_phase();
        let solution = output.as_ref().map(|output| &output.compensated);
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
            motion: motion.then(|| self.motion(&output, sample)),
            ..self.messages(&output, sample, navigation, imu)
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
            self.joints.angles_at(stamp),
            solution.zip(self.origin.as_ref()),
            &settings.odometry_frame_id,
            &settings.base_frame_id,
        );
        (fixed, Some(moving))
    }

    fn motion(&self, output: &NavigatorOutput, sample: &ImuSample) -> Motion {
        let motion = vehicle_motion(
            &output.compensated,
            &self.settings.navigator.alignment.turntable,
            &self.joints.at(output.stamp),
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
            &self.joints.at(stamp),
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
        let stream = self.navigator.stream();
        samples_report(
            &self.inputs.imu,
            &self.imu_stamps,
            stream.counts(),
            stream.not_finite(),
            stream.jumps(),
        )
    }

    /// How the joint states come.
    pub fn joints_report(&self) -> Report {
        self.inputs
            .joints
            .report()
            .with("samples waiting", self.order.waiting())
    }

    /// Where navigation stands.
    pub fn navigation_report(&self) -> Report {
        let mut report = Report::ok(self.phase.name().replace('_', " "))
            .with("phase", self.phase.name())
            .with("calibrations", self.calibrations)
            .with("calibrations refused", self.inputs.calibration.refused())
            .with("fixes refused", self.inputs.fix.refused());
        if self.phase == NavigatorPhase::Aligning && self.origin.is_none() {
            report = report.worsened(Level::Warn, "aligning waits for a valid position on fix");
        }
        if let Some(problem) = &self.problem {
            report = report.worsened(Level::Error, problem);
        }
        report
    }
}

#[cfg(test)]
#[path = "compensator_tests.rs"]
mod tests;
