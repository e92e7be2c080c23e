//! The sensors of a bag, one sample after the other, for the commands that drive a state machine with them.

use std::{ops::ControlFlow, path::PathBuf, sync::mpsc};

use analysis::{Notes, SensorSource};
use anyhow::{Context, bail};
use bags::{Bag, Sample, SensorOptions, SensorStream};
use clap::Args;
use ros_node::ParameterSet;
use ros2_interfaces::{RosMessage, sensor_msgs::NavSatFix};
use rotary_sins_msgs::interfaces::topics::FIX;
use sins::{earth::Position, machines::self_calibration::Event, stream::Reading, table::Turntable};

use crate::{
    parameter_options::{Given, Group},
    progress::SecondsBar,
};

/// Samples handed over at once ...
const BATCH: usize = 1024;
/// ... and so many times read ahead.
const BATCHES: usize = 8;

/// Which bag, which part of it, and what it does not say itself.
#[derive(Args)]
pub struct SensorInput {
    /// MCAP file or rosbag2 directory
    bag: PathBuf,
    /// Begin so many seconds after the start of the bag
    #[arg(long, value_name = "SECONDS")]
    start_offset: Option<f64>,
    /// Read so many seconds
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Topic of the IMU (default: /imu/data_raw, else the only one of its type)
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// Topic of the joints (default: /turntable/joint_states, else the only one of its type)
    #[arg(long, value_name = "TOPIC")]
    joints_topic: Option<String>,
    /// Topic of the position (default: /fix, else the only one of its type)
    #[arg(long, value_name = "TOPIC")]
    fix_topic: Option<String>,
    /// Latitude, instead of the bag's
    #[arg(
        long,
        value_name = "DEG",
        requires = "longitude_deg",
        allow_negative_numbers = true
    )]
    latitude_deg: Option<f64>,
    /// Longitude, instead of the bag's
    #[arg(
        long,
        value_name = "DEG",
        requires = "latitude_deg",
        allow_negative_numbers = true
    )]
    longitude_deg: Option<f64>,
    /// Height above the ellipsoid, with --latitude-deg and --longitude-deg
    #[arg(
        long,
        value_name = "M",
        requires = "latitude_deg",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    height_m: f64,
    #[command(flatten)]
    axes: Given<Axes>,
}

/// Parameters of the table, as the nodes have them.
#[derive(Clone, Debug)]
struct Axes;

impl Group for Axes {
    type Settings = Turntable;
    const HEADING: &'static str = "Table";

    fn set() -> ParameterSet<Turntable> {
        node_parameters::axes()
    }
}

impl SensorInput {
    /// The table.
    pub fn turntable(&self) -> anyhow::Result<Turntable> {
        let Turntable { outer, inner } = self.axes.settings()?;
        Ok(Turntable::new(outer, inner)?)
    }

    /// Opens the bag and says what of it cannot be read.
    pub fn open(&self) -> anyhow::Result<Bag> {
        for (name, value) in [
            ("--start-offset", self.start_offset),
            ("--duration", self.duration),
        ] {
            if value.is_some_and(|value| !value.is_finite() || value < 0.0) {
                bail!(
                    "{name} is {}, expected a number of seconds that is not negative",
                    value.unwrap_or_default()
                );
            }
        }
        Ok(Bag::open(&self.bag)?)
    }

    /// The position of the command line.
    fn given_position(&self) -> Option<Position> {
        Some(Position {
            latitude_rad: self.latitude_deg?.to_radians(),
            longitude_rad: self.longitude_deg?.to_radians(),
            height_m: self.height_m,
        })
    }

    /// The bag, and where the position should have come from: what stands in front of the reason why there is no estimate.
    pub fn what_is_missing(&self, bag: &Bag) -> String {
        let path = bag.path().display();
        if self.given_position().is_some() {
            return path.to_string();
        }
        let instead = "or give --latitude-deg and --longitude-deg";
        let topic = match bag.find_topic(
            NavSatFix::TYPE_NAME,
            &FIX.within(""),
            self.fix_topic.as_deref(),
        ) {
            Ok(topic) => topic,
            Err(error) => return format!("{error}; {instead}"),
        };
        if let Ok(Some(_)) = bags::last_position_before(bag, topic, u64::MAX) {
            return path.to_string();
        }
        let topic = &bag.topics()[topic];
        format!(
            "{path}: none of the {} messages of {} has a position; {instead}",
            topic.count, topic.name
        )
    }

    /// What was asked for, for the reader of bags.
    pub fn options(&self) -> SensorOptions {
        SensorOptions {
            imu_topic: self.imu_topic.clone(),
            joints_topic: self.joints_topic.clone(),
            fix_topic: self.fix_topic.clone(),
            velocity_topic: None,
            start_offset: self.start_offset,
            duration: self.duration,
        }
    }

    /// Length of the chosen part by log times \[s\].
    pub fn length_s(&self, bag: &Bag) -> f64 {
        let length_s = bag
            .time_range()
            .map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9);
        (length_s - self.start_offset.unwrap_or(0.0)).min(self.duration.unwrap_or(f64::INFINITY))
    }

    /// The samples that were asked for.
    pub fn source(&self) -> anyhow::Result<SensorSource> {
        Ok(SensorSource {
            options: self.options(),
            given_position: self.given_position(),
            turntable: self.turntable()?,
        })
    }

    /// Hands every sample to `take`, a position of the command line first, until it breaks. What `take` refuses is noted
    /// and left aside, as a node does.
    pub fn feed(
        &self,
        bag: &Bag,
        title: &str,
        mut take: impl FnMut(Sample, &mut Told<'_>) -> Result<ControlFlow<()>, sins::Error>,
    ) -> anyhow::Result<Notes> {
        let mut stream = SensorStream::new(bag, &self.options())?;
        let progress = SecondsBar::new(title, self.length_s(bag));
        let mut notes = Notes::default();
        for warning in bag.warnings() {
            notes.say(&progress, warning.to_string());
        }
        let names = TopicNames::new(bag, &stream);
        let source = self.source()?;
        let is_given = source.has_given_position();
        if let Some(sample) = source.first_position(bag, stream.fix_topic())? {
            // The position of the command line is an argument: if it means nothing, the command is at an end.
            let mut told = Told {
                progress: &progress,
                notes: &mut notes,
                topic: names.fix,
            };
            let flow = take(sample, &mut told).context("position")?;
            if flow.is_break() {
                return Ok(notes);
            }
        }
        let mut first_stamp = None;
        let mut count = 0_u64;
        // Unpacking and decoding have a thread of their own; the machine gets every sample in the order of the bag.
        let warnings = std::thread::scope(|scope| {
            let (sender, batches) = mpsc::sync_channel(BATCHES);
            let reader = scope.spawn(move || {
                read_ahead(&mut stream, &sender);
                stream.warnings().to_vec()
            });
            'samples: for batch in &batches {
                for sample in batch {
                    let sample = match sample {
                        Ok(sample) => sample,
                        Err(error) => {
                            notes.undecodable(&progress, &error);
                            continue;
                        }
                    };
                    if let Sample::Imu(imu) = &sample {
                        let first = *first_stamp.get_or_insert(imu.stamp);
                        count += 1;
                        if count.is_multiple_of(10_000) {
                            progress.set(imu.stamp.seconds_since(first));
                        }
                    }
                    if is_given && matches!(sample, Sample::Fix(_)) {
                        continue;
                    }
                    let topic = names.of(&sample);
                    let mut told = Told {
                        progress: &progress,
                        notes: &mut notes,
                        topic,
                    };
                    match take(sample, &mut told) {
                        Ok(ControlFlow::Continue(())) => {}
                        Ok(ControlFlow::Break(())) => break 'samples,
                        Err(error) => notes.error(&progress, topic, &error),
                    }
                }
            }
            drop(batches);
            reader.join()
        });
        let Ok(warnings) = warnings else {
            bail!("{}: reading broke down", bag.path().display())
        };
        for warning in warnings {
            notes.say(&progress, warning.to_string());
        }
        notes.sum_up(&progress);
        drop(progress);
        if count == 0 {
            bail!(
                "{}: no message of {} could be read in the chosen part",
                bag.path().display(),
                names.imu
            );
        }
        Ok(notes)
    }

    /// Hands every reading to `take` once more, as [`Self::feed`] did, until it breaks. What cannot be read has been said then.
    pub fn again(
        &self,
        bag: &Bag,
        title: &str,
        mut take: impl FnMut(&Reading) -> ControlFlow<()>,
    ) -> anyhow::Result<()> {
        let mut stream = SensorStream::new(bag, &self.options())?;
        let progress = SecondsBar::new(title, self.length_s(bag));
        let source = self.source()?;
        let mut next = source.first_position(bag, stream.fix_topic())?;
        let mut first_stamp = None;
        let mut count = 0_u64;
        loop {
            if let Some(reading) = next.take().as_ref().and_then(Sample::reading)
                && take(&reading).is_break()
            {
                return Ok(());
            }
            next = match stream.next() {
                Ok(None) => return Ok(()),
                Ok(Some(Sample::Fix(_))) if source.has_given_position() => None,
                Ok(sample) => sample,
                Err(_) => None,
            };
            if let Some(Sample::Imu(imu)) = &next {
                let first = *first_stamp.get_or_insert(imu.stamp);
                count += 1;
                if count.is_multiple_of(10_000) {
                    progress.set(imu.stamp.seconds_since(first));
                }
            }
        }
    }
}

/// Where a command tells what its machine told.
pub struct Told<'a> {
    /// The person at the screen.
    pub progress: &'a SecondsBar,
    /// What goes into the result.
    pub notes: &'a mut Notes,
    /// The topic that this sample came from.
    pub topic: &'a str,
}

impl Told<'_> {
    /// What self-calibration told.
    pub fn event(&mut self, event: &Event) {
        self.notes.event(self.progress, self.topic, event);
    }
}

/// Names of the topics that samples come from.
struct TopicNames<'b> {
    imu: &'b str,
    joints: &'b str,
    fix: &'b str,
    velocity: &'b str,
}

impl<'b> TopicNames<'b> {
    fn new(bag: &'b Bag, stream: &SensorStream<'_>) -> Self {
        let name = |topic: Option<usize>| topic.map_or("", |at| bag.topics()[at].name.as_str());
        Self {
            imu: name(Some(stream.imu_topic())),
            joints: name(stream.joints_topic()),
            fix: name(stream.fix_topic()),
            velocity: name(stream.velocity_topic()),
        }
    }

    fn of(&self, sample: &Sample) -> &'b str {
        match sample {
            Sample::Imu(_) => self.imu,
            Sample::Joints(_) => self.joints,
            Sample::Fix(_) => self.fix,
            Sample::Velocity(..) => self.velocity,
        }
    }
}

type Batch = Vec<Result<Sample, bags::Error>>;

/// Decodes to the end of the stream, or until nobody takes the samples any more.
fn read_ahead(stream: &mut SensorStream<'_>, sender: &mpsc::SyncSender<Batch>) {
    loop {
        let mut batch = Batch::with_capacity(BATCH);
        while batch.len() < BATCH
            && let Some(sample) = stream.next().transpose()
        {
            batch.push(sample);
        }
        if batch.is_empty() || sender.send(batch).is_err() {
            return;
        }
    }
}
