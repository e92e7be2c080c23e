//! The sensors of a bag as one stream of samples in the order of log time.

use nalgebra::Vector3;
use ros2_interfaces::{
    Interface, RosMessage,
    geometry_msgs::TwistWithCovarianceStamped,
    sensor_msgs::{Imu, NavSatFix},
};
use rotary_sins_msgs::convert::{
    fix_from_message, position_from_fix, stamp_from_time, velocity_from_twist,
};
use rotary_sins_msgs::interfaces::topics;
use sins::{
    earth::Position, estimation::filter::VelocityMeasurement, sensor::PositionMeasurement,
    sensor::sample::ImuSample, stream::Reading, table::JointSample, time::Stamp,
};

use crate::{
    bag::Bag,
    cdr,
    error::{Error, Warning},
    messages::{Messages, RawMessage, Selection},
    samples,
};

/// A position with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// When.
    pub stamp: Stamp,
    /// Where; `None` where the receiver had none.
    pub position: Option<Position>,
    /// One-sigma east, north, up \[m\]; zero where the receiver does not say.
    pub sigma_m: Vector3<f64>,
}

/// One message of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sample {
    /// Of the inertial measurement unit.
    Imu(ImuSample),
    /// Of the turntable's encoders.
    Joints(JointSample),
    /// Of the satellite receiver.
    Fix(Fix),
    /// Velocity over ground, with its time.
    Velocity(Stamp, VelocityMeasurement),
}

impl Sample {
    /// What a machine takes of it; none where the receiver had no position.
    pub fn reading(&self) -> Option<Reading> {
        Some(match self {
            Self::Imu(imu) => Reading::Imu(*imu),
            Self::Joints(joints) => Reading::Joints(*joints),
            Self::Fix(fix) => Reading::Fix(PositionMeasurement {
                stamp: fix.stamp,
                position: fix.position?,
                sigma_m: fix.sigma_m,
            }),
            Self::Velocity(stamp, velocity) => Reading::Velocity(*stamp, *velocity),
        })
    }
}

/// Which topics, and which part of the bag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorOptions {
    /// Topic of the Imu; else `/imu/data_raw`, else the only one of its type.
    pub imu_topic: Option<String>,
    /// Topic of the joints; else `/turntable/joint_states`, else the only one of its type, else none.
    pub joints_topic: Option<String>,
    /// Topic of the position; else `/fix`, else the only one of its type, else none.
    pub fix_topic: Option<String>,
    /// Topic of the velocity over ground; else `/aiding/velocity`, else none.
    pub velocity_topic: Option<String>,
    /// Begin so long after the first message \[s\].
    pub start_offset: Option<f64>,
    /// Read so much \[s\].
    pub duration: Option<f64>,
}

/// Which topics of a bag the samples are in.
#[derive(Clone, Debug)]
pub struct SensorTopics {
    /// Of the Imu, where there is one.
    pub imu: Option<usize>,
    /// Of the joints, where there is one.
    pub joints: Option<usize>,
    /// Of the position, where there is one.
    pub fix: Option<usize>,
    /// Of the velocity, where there is one.
    pub velocity: Option<usize>,
    read: [u64; 4],
}

impl SensorTopics {
    /// Finds the topics.
    ///
    /// # Errors
    /// [`Error::MissingTopic`] without a topic that was asked for by name.
    pub fn find(bag: &Bag, options: &SensorOptions) -> Result<Self, Error> {
        let optional = |usual: Interface, wanted: Option<&str>| match bag.find_topic(
            usual.type_name,
            &usual.within(""),
            wanted,
        ) {
            Err(error) if wanted.is_some() => Err(error),
            found => Ok(found.ok()),
        };
        // By its name alone: what a compensator puts out is of the same type.
        let velocity = match options.velocity_topic.as_deref() {
            Some(name) => {
                Some(bag.find_topic(TwistWithCovarianceStamped::TYPE_NAME, name, Some(name))?)
            }
            None => bag
                .topic(&topics::AIDING_VELOCITY.within(""))
                .filter(|&at| bag.topics()[at].type_name == TwistWithCovarianceStamped::TYPE_NAME),
        };
        Ok(Self {
            imu: optional(topics::IMU_DATA_RAW.row(), options.imu_topic.as_deref())?,
            joints: optional(topics::JOINT_STATES.row(), options.joints_topic.as_deref())?,
            fix: optional(topics::FIX.row(), options.fix_topic.as_deref())?,
            velocity,
            read: [0; 4],
        })
    }

    /// Their numbers.
    pub fn all(&self) -> Vec<usize> {
        [self.imu, self.joints, self.fix, self.velocity]
            .into_iter()
            .flatten()
            .collect()
    }

    /// The sample of a message; `None` where the message is of another topic.
    pub fn sample(&mut self, bag: &Bag, message: &RawMessage<'_>) -> Option<Result<Sample, Error>> {
        let topic = Some(message.topic);
        let (slot, sample) = if topic == self.imu {
            (0, samples::imu(message.data).map(Sample::Imu))
        } else if topic == self.joints {
            (1, samples::joints(message.data).map(Sample::Joints))
        } else if topic == self.fix {
            (2, fix(message.data).map(Sample::Fix))
        } else if topic == self.velocity {
            (3, velocity(message.data))
        } else {
            return None;
        };
        let index = self.read[slot];
        self.read[slot] += 1;
        Some(sample.map_err(|reason| bag.message_error(message.topic, index, reason)))
    }
}

/// Reads samples one by one.
pub struct SensorStream<'b> {
    bag: &'b Bag,
    messages: Messages<'b>,
    topics: SensorTopics,
    imu: usize,
}

impl<'b> SensorStream<'b> {
    /// Finds the topics.
    ///
    /// # Errors
    /// [`Error::MissingTopic`] without an Imu, or without a topic that was asked for by name.
    pub fn new(bag: &'b Bag, options: &SensorOptions) -> Result<Self, Error> {
        let imu = bag.find_topic(
            Imu::TYPE_NAME,
            &topics::IMU_DATA_RAW.within(""),
            options.imu_topic.as_deref(),
        )?;
        let topics = SensorTopics::find(bag, options)?;
        let selection =
            Selection::topics(topics.all()).window(bag, options.start_offset, options.duration);
        Ok(Self {
            bag,
            messages: bag.messages(&selection),
            topics,
            imu,
        })
    }

    /// Number of the Imu's topic in the bag.
    pub fn imu_topic(&self) -> usize {
        self.imu
    }

    /// Number of the joints' topic, where there is one.
    pub fn joints_topic(&self) -> Option<usize> {
        self.topics.joints
    }

    /// Number of the position's topic, where there is one.
    pub fn fix_topic(&self) -> Option<usize> {
        self.topics.fix
    }

    /// Number of the velocity's topic, where there is one.
    pub fn velocity_topic(&self) -> Option<usize> {
        self.topics.velocity
    }

    /// What could not be read so far.
    pub fn warnings(&self) -> &[Warning] {
        self.messages.warnings()
    }

    /// The next sample; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Message`] where a message does not hold what its type says. The stream can be read on.
    #[allow(
        clippy::should_implement_trait,
        reason = "an Iterator of Results invites to stop at the first error unseen"
    )]
    pub fn next(&mut self) -> Result<Option<Sample>, Error> {
        let Some(message) = self.messages.next() else {
            return Ok(None);
        };
        self.topics.sample(self.bag, &message).transpose()
    }
}

fn velocity(payload: &[u8]) -> Result<Sample, String> {
    let message: TwistWithCovarianceStamped =
        cdr::decode(payload).map_err(|error| error.to_string())?;
    Ok(Sample::Velocity(
        stamp_from_time(message.header.stamp),
        velocity_from_twist(&message),
    ))
}

fn fix(payload: &[u8]) -> Result<Fix, String> {
    let message: NavSatFix = cdr::decode(payload).map_err(|error| error.to_string())?;
    Ok(Fix {
        stamp: stamp_from_time(message.header.stamp),
        position: position_from_fix(&message),
        sigma_m: fix_from_message(&message).map_or_else(Vector3::zeros, |fix| fix.sigma_m),
    })
}

/// The last position of a topic before a log time \[ns\], as a latched topic would give it to a late subscriber.
///
/// # Errors
/// [`Error::Message`] where a message is no fix.
pub fn last_position_before(bag: &Bag, topic: usize, end: u64) -> Result<Option<Position>, Error> {
    let mut messages = bag.messages(&Selection {
        end: Some(end),
        ..Selection::topics([topic])
    });
    let (mut last, mut index) = (None, 0);
    while let Some(message) = messages.next() {
        let fix = fix(message.data).map_err(|reason| bag.message_error(topic, index, reason))?;
        last = fix.position.or(last);
        index += 1;
    }
    Ok(last)
}
