//! One pass over the bag: everything that the page needs, and no more memory for a longer run.

use bags::{Bag, RawMessage, Sample, Selection, cdr};
use ros2_interfaces::{
    RosMessage, diagnostic_msgs::DiagnosticArray, nav_msgs::Odometry, sensor_msgs::NavSatFix,
};
use rotary_sins_msgs::convert::{position_from_fix, stamp_from_time};
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use sins::{
    earth::Position,
    machines::self_calibration::{Event, SelfCalibration},
    time::Stamp,
};

use super::{
    diagnostics::Diagnostics,
    estimates::{Counts, History, Point, own_states, phase_number, recorded_states},
    scheme::Scheme,
    streams::Stream,
    thin::{Corners, POINTS, Thinned},
    topics::{Role, Topics},
    truth::Truth,
};
use crate::{Error, Listener, Notes, SensorSource};

/// A true position this old says nothing of the present one \[ns\].
const POSITION_AGE_NS: u64 = 2_000_000_000;

/// Where the estimates come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The bag has them.
    Recorded,
    /// They were made from the samples.
    Own,
}

/// Position errors of one solution.
pub struct Track {
    /// Thinned \[m\].
    pub points: Thinned<f64>,
    /// The greatest \[m\].
    pub greatest_m: f64,
    /// The newest \[m\].
    pub last_m: f64,
}

impl Default for Track {
    fn default() -> Self {
        Self {
            points: Thinned::new(POINTS),
            greatest_m: 0.0,
            last_m: 0.0,
        }
    }
}

impl Track {
    fn push(&mut self, stamp: Stamp, metres: f64) {
        self.greatest_m = self.greatest_m.max(metres);
        self.last_m = metres;
        self.points.push(stamp, metres);
    }

    /// Whether there was no error to be told.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

/// Everything that is known of the run.
pub struct GatheredRun {
    /// Where the estimates come from.
    pub source: Source,
    /// The estimates.
    pub history: History,
    /// What the simulator knew.
    pub truth: Truth,
    /// The scheme, where its sequencer was recorded.
    pub scheme: Scheme,
    /// Joint angles.
    pub joints: Corners,
    /// Of the topics in their order.
    pub streams: Vec<Stream>,
    /// Number of the IMU's topic.
    pub imu: Option<usize>,
    /// Number of the estimates' topic.
    pub estimate: Option<usize>,
    /// Diagnostics above OK.
    pub diagnostics: Diagnostics,
    /// Position errors with and without the calibration, local.
    pub odometry: [Track; 2],
    /// The same, from positions on the globe.
    pub fixes: [Track; 2],
    /// What was wrong on the way.
    pub notes: Notes,
    /// Parts of the bag that could not be read.
    pub damage: Vec<String>,
}

impl GatheredRun {
    /// First and last time of the run: of its samples and estimates, by their stamps, else of the whole bag.
    pub fn span(&self) -> (Stamp, Stamp) {
        let of = |streams: &mut dyn Iterator<Item = &Stream>| {
            streams
                .filter_map(Stream::span)
                .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        let main = [self.imu, self.estimate];
        of(&mut main.into_iter().flatten().map(|at| &self.streams[at]))
            .or_else(|| of(&mut self.streams.iter()))
            .unwrap_or_default()
    }

    /// Position errors with and without the calibration: local ones where there are any, else those on the globe.
    pub fn tracks(&self) -> &[Track; 2] {
        if self.odometry.iter().all(Track::is_empty) {
            &self.fixes
        } else {
            &self.odometry
        }
    }
}

/// Reads the bag. `calibrator` makes estimates where none were recorded.
pub fn gather(
    source: &SensorSource,
    bag: &Bag,
    calibrator: SelfCalibration,
    listener: &dyn Listener,
) -> Result<GatheredRun, Error> {
    let topics = Topics::find(bag, &source.options)?;
    let estimate = topics.of(Role::Estimate);
    let recorded = estimate.is_some_and(|at| bag.topics()[at].count > 0);
    if estimate.is_none() && topics.sensors.imu.is_none() {
        // Says what was looked for and what the bag has.
        bags::SensorStream::new(bag, &source.options)?;
    }
    let imu = topics.sensors.imu;
    let mut gathering = Gathering {
        bag,
        listener,
        calibrator: (!recorded && imu.is_some()).then_some(calibrator),
        own: History::default(),
        made: 0,
        is_position_given: source.has_given_position(),
        run: GatheredRun {
            source: Source::Recorded,
            history: History::default(),
            truth: Truth::new(source.turntable),
            scheme: Scheme::default(),
            joints: Corners::default(),
            streams: bag
                .topics()
                .iter()
                .enumerate()
                .map(|(at, topic)| Stream::new(topic, Some(at) == imu))
                .collect(),
            imu,
            estimate,
            diagnostics: Diagnostics::default(),
            odometry: Default::default(),
            fixes: Default::default(),
            notes: Notes::default(),
            damage: Vec::new(),
        },
        topics,
    };
    gathering.read(source)?;
    gathering.end()
}

struct Gathering<'b> {
    bag: &'b Bag,
    listener: &'b dyn Listener,
    topics: Topics,
    calibrator: Option<SelfCalibration>,
    /// Estimates made from the samples.
    own: History,
    made: u64,
    is_position_given: bool,
    run: GatheredRun,
}

impl Gathering<'_> {
    fn read(&mut self, source: &SensorSource) -> Result<(), Error> {
        let listener = self.listener;
        for warning in self.bag.warnings() {
            self.damaged(warning);
        }
        let options = &source.options;
        if let Some(sample) = source.first_position(self.bag, self.topics.sensors.fix)?
            && let Some(calibrator) = &mut self.calibrator
            && let Some(reading) = sample.reading()
        {
            calibrator.push(&reading).map_err(Error::Position)?;
        }
        if options.start_offset.is_some() {
            self.latched_truth()?;
        }
        let selection =
            Selection::default().window(self.bag, options.start_offset, options.duration);
        let mut messages = self.bag.messages(&selection);
        let (mut first, mut count) = (None, 0_u64);
        while let Some(message) = messages.next() {
            let first = *first.get_or_insert(message.log_time);
            count += 1;
            if count.is_multiple_of(10_000) {
                listener.reached((message.log_time - first) as f64 * 1e-9);
            }
            self.run.streams[message.topic].take(&message);
            if let Some(sample) = self.topics.sensors.sample(self.bag, &message) {
                match sample {
                    Ok(sample) => self.take_sample(message.topic, sample),
                    Err(error) => self.run.notes.undecodable(listener, &error),
                }
            }
            if let Some(role) = self.topics.roles[message.topic]
                && let Err(reason) = self.take_message(role, &message)
            {
                let index = self.run.streams[message.topic].count - 1;
                let error = self
                    .bag
                    .message_error(message.topic, index, reason.to_string());
                self.run.notes.undecodable(listener, &error);
            }
        }
        for warning in messages.warnings() {
            self.damaged(warning);
        }
        self.run.notes.sum_up(listener);
        self.run.notes.tell(listener);
        Ok(())
    }

    fn damaged(&mut self, warning: &bags::Warning) {
        let line = warning.to_string();
        self.listener.note(&line);
        self.run.damage.push(line);
    }

    /// The truth is told once, at the start, which a part of the bag may leave out.
    fn latched_truth(&mut self) -> Result<(), Error> {
        let topics: Vec<_> = self.topics.of(Role::TrueCalibration).into_iter().collect();
        let mut messages = self.bag.messages(&Selection::topics(topics.clone()));
        while let Some(message) = messages.next() {
            self.take_message(Role::TrueCalibration, &message)
                .map_err(|reason| self.bag.message_error(topics[0], 0, reason.to_string()))?;
        }
        Ok(())
    }

    fn take_sample(&mut self, topic: usize, sample: Sample) {
        if let Sample::Joints(joints) = &sample {
            self.run.truth.take_joints(joints.stamp, joints.position);
            self.run.joints.push(joints.stamp, joints.position);
        }
        let Some(calibrator) = &mut self.calibrator else {
            return;
        };
        if self.is_position_given && matches!(sample, Sample::Fix(_)) {
            return;
        }
        let name = &self.bag.topics()[topic].name;
        let pushed = sample.reading().map(|reading| calibrator.push(&reading));
        if let Some(Err(error)) = pushed {
            self.run.notes.error(self.listener, name, &error);
        }
        while let Some(event) = calibrator.poll() {
            if let Event::Estimate(estimate) = &event {
                let attitude = estimate.navigation.attitude;
                self.run.truth.take_estimate(estimate.stamp, attitude);
                let counts = Counts::from(&**estimate);
                self.own.failures = estimate.innovations.failures;
                self.own
                    .take(Point::from(&**estimate), estimate.innovations.last, counts);
                self.own.states = own_states(estimate);
                self.made += 1;
                if self.made.is_multiple_of(60) {
                    self.listener.task(estimate.phase.name());
                }
            }
            self.run.notes.event(self.listener, name, &event);
        }
        if let Sample::Imu(imu) = &sample {
            let phase = phase_number(calibrator.phase());
            self.own.take_phase(imu.stamp, phase);
        }
    }

    fn take_message(&mut self, role: Role, message: &RawMessage<'_>) -> Result<(), cdr::Error> {
        let run = &mut self.run;
        match role {
            Role::Estimate => {
                let estimate = SelfCalibrationEstimate::from_cdr(message.data)?;
                let stamp: Stamp = stamp_from_time(estimate.header.stamp);
                run.history.take_phase(stamp, estimate.phase);
                // Before the filter runs there are no numbers.
                if !estimate.state.is_empty() {
                    if let Some(attitude) = estimate.attitude.rotation() {
                        run.truth.take_estimate(stamp, attitude);
                    }
                    let counts = Counts {
                        samples: estimate.samples,
                        gaps: estimate.gaps,
                        lost: estimate.lost_samples,
                        duration_s: estimate.duration,
                        ..Counts::default()
                    };
                    let failed = estimate.phase == SelfCalibrationEstimate::INCONSISTENT;
                    run.history.failures += u64::from(failed);
                    run.history
                        .take(Point::from(&estimate), estimate.nis, counts);
                    run.history.states = recorded_states(&estimate);
                    run.history.recorded_words = Some(estimate.words().to_owned());
                }
            }
            Role::Scheme => run.scheme.take(&cdr::decode::<SchemeStatus>(message.data)?),
            Role::Diagnostics => {
                let array: DiagnosticArray = cdr::decode(message.data)?;
                run.diagnostics.take(&array);
            }
            Role::TrueCalibration => {
                let truth = Calibration::from_cdr(message.data)?;
                run.truth.take_calibration(truth);
            }
            Role::TruePose => {
                let pose: Odometry = cdr::decode(message.data)?;
                let place = &pose.pose.pose.position;
                let place = [place.x, place.y, place.z];
                if let Some(attitude) = pose.pose.pose.orientation.rotation() {
                    let stamp = stamp_from_time(pose.header.stamp);
                    run.truth.take_pose(stamp, attitude, place);
                }
            }
            Role::Odometry(which) => {
                let pose: Odometry = cdr::decode(message.data)?;
                let stamp: Stamp = stamp_from_time(pose.header.stamp);
                let place = &pose.pose.pose.position;
                if let Some((then, truth)) = run.truth.place()
                    && then.nanos().abs_diff(stamp.nanos()) < POSITION_AGE_NS
                {
                    let metres = (place.x - truth[0]).hypot(place.y - truth[1]);
                    run.odometry[which].push(stamp, metres);
                }
            }
            Role::Fix(which) => {
                let fix: NavSatFix = cdr::decode(message.data)?;
                if let (Some(truth), Some(place)) =
                    (&run.truth.calibration, position_from_fix(&fix))
                {
                    let origin = Position {
                        latitude_rad: truth.latitude_deg.to_radians(),
                        longitude_rad: truth.longitude_deg.to_radians(),
                        height_m: truth.height_m,
                    };
                    let offset = origin.offset_m(&place);
                    run.fixes[which]
                        .push(stamp_from_time(fix.header.stamp), offset.x.hypot(offset.y));
                }
            }
        }
        Ok(())
    }

    /// Decides where the estimates come from, and closes everything.
    fn end(mut self) -> Result<GatheredRun, Error> {
        if let (None, Some(calibrator)) = (self.run.history.phase, &mut self.calibrator) {
            let last = calibrator.finish().map_err(|source| Error::NoEstimate {
                path: self.bag.path().to_owned(),
                source,
            })?;
            self.own.take_phase(last.stamp, phase_number(last.phase));
            let verdict = last.verdict(calibrator.settings());
            self.own.reasons = verdict.reasons;
            self.own.tests = verdict.tests;
            self.own.failures = last.innovations.failures;
            if self.own.newest == Some(last.stamp) {
                // Samples behind the last estimate count too.
                self.own.counts = Counts::from(&last);
            } else {
                let counts = Counts::from(&last);
                let attitude = last.navigation.attitude;
                self.run.truth.take_estimate(last.stamp, attitude);
                self.own
                    .take(Point::from(&last), last.innovations.last, counts);
                self.own.states = own_states(&last);
            }
            if let Some(doubt) = last.axes_doubt() {
                self.listener.note(&doubt);
                self.run.notes.lines.push(doubt);
            }
            self.run.source = Source::Own;
            self.run.history = self.own;
        }
        if self.run.history.phase.is_none() {
            let name = self
                .run
                .estimate
                .map_or("", |at| self.bag.topics()[at].name.as_str());
            return Err(Error::NothingToReport {
                path: self.bag.path().to_owned(),
                type_name: SelfCalibrationEstimate::TYPE_NAME,
                topic: name.to_owned(),
            });
        }
        Ok(self.run)
    }
}
