//! How the messages of each topic come: rate, gaps, first and last.

use bags::{RawMessage, Topic};
use ros_node::StreamMonitor;
use rotary_sins_msgs::{KnownType, known_type};
use sins::{
    sampling::{Interval, SampleClock},
    time::Stamp,
};

/// Gaps of one topic that are listed.
const LISTED: usize = 20;
/// A stream with fewer messages has no usual interval.
const FEWEST: u64 = 20;
/// Of the intervals of a regular stream at least so many are usual ones.
const USUAL_SHARE: f64 = 0.9;

/// A hole in a stream.
#[derive(Clone, Copy, Debug)]
pub struct Gap {
    /// The last message before it.
    pub from: Stamp,
    /// Its length \[s\].
    pub length_s: f64,
    /// Messages missing, by the usual interval.
    pub lost: u64,
}

/// The messages of one topic.
pub struct Stream {
    /// Name of the topic.
    pub name: String,
    /// Its type.
    pub type_name: String,
    /// Times are the stamps of the messages, not those of the recorder.
    pub by_stamp: bool,
    /// Messages.
    pub count: u64,
    /// Time of the first message.
    pub first: Option<Stamp>,
    /// Time of the last message.
    pub last: Option<Stamp>,
    /// Its first gaps.
    pub gaps: Vec<Gap>,
    monitor: StreamMonitor,
    usual: u64,
    /// Counts as the machines count, for the samples that they take.
    clock: Option<SampleClock>,
}

impl Stream {
    /// No message yet. Samples of the IMU are counted as the state machines count them.
    pub fn new(topic: &Topic, is_imu: bool) -> Self {
        Self {
            name: topic.name.clone(),
            type_name: topic.type_name.clone(),
            by_stamp: known_type(&topic.type_name).is_some_and(KnownType::begins_with_stamp),
            count: 0,
            first: None,
            last: None,
            gaps: Vec::new(),
            monitor: StreamMonitor::default(),
            usual: 0,
            clock: is_imu.then(SampleClock::default),
        }
    }

    /// Takes a message.
    pub fn take(&mut self, message: &RawMessage<'_>) {
        let stamp = self
            .by_stamp
            .then(|| stamp_in_front(message.data))
            .flatten();
        if self.count == 0 && stamp.is_none_or(|stamp| stamp.nanos() == 0) {
            // Nobody filled the stamp in.
            self.by_stamp = false;
        }
        self.count += 1;
        let time = match stamp {
            Some(stamp) if self.by_stamp => stamp,
            _ if self.by_stamp => return,
            _ => Stamp::from_nanos(message.log_time.cast_signed()),
        };
        let before = self.last;
        let (lost_before, usual_ns) = (self.lost(), self.monitor.interval_nanos());
        let mut is_gap = self.monitor.ingest(time.nanos());
        if let Some(clock) = &mut self.clock {
            is_gap = matches!(clock.classify(time), Interval::Gap { .. });
        }
        self.first.get_or_insert(time);
        self.last = Some(time);
        let Some(before) = before else { return };
        let length_s = time.seconds_since(before);
        if is_gap {
            if self.gaps.len() < LISTED {
                self.gaps.push(Gap {
                    from: before,
                    length_s,
                    lost: self.lost() - lost_before,
                });
            }
        } else if usual_ns.is_none_or(|usual| length_s > 0.5e-9 * usual as f64) {
            self.usual += 1;
        }
    }

    /// Whether it comes at a rate, so that gaps mean something.
    pub fn is_regular(&self) -> bool {
        self.clock.is_some()
            || (self.count >= FEWEST && self.usual as f64 >= USUAL_SHARE * (self.count - 1) as f64)
    }

    /// Holes.
    pub fn gap_count(&self) -> u64 {
        self.clock
            .as_ref()
            .map_or(self.monitor.gaps(), |clock| clock.counts().gaps)
    }

    /// Messages missing in them.
    pub fn lost(&self) -> u64 {
        self.clock
            .as_ref()
            .map_or(self.monitor.lost(), |clock| clock.counts().lost)
    }

    /// Stamps that came twice, and stamps that ran back.
    pub fn repeated_backward(&self) -> (u64, u64) {
        (self.monitor.repeated(), self.monitor.backward())
    }

    /// The longest time between two messages \[s\].
    pub fn longest_s(&self) -> f64 {
        self.monitor.longest_nanos() as f64 * 1e-9
    }

    /// Messages a second, from the first to the last.
    pub fn rate_hz(&self) -> Option<f64> {
        let length_s = self.last?.seconds_since(self.first?);
        (self.count > 1 && length_s > 0.0).then(|| (self.count - 1) as f64 / length_s)
    }
}

/// The stamp that a message begins with.
fn stamp_in_front(payload: &[u8]) -> Option<Stamp> {
    let (head, fields) = payload.split_first_chunk::<4>()?;
    let [a, b, c, d, e, f, g, h] = *fields.first_chunk::<8>()?;
    let (sec, nanosec) = if head[1] & 1 == 1 {
        (
            i32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, g, h]),
        )
    } else {
        (
            i32::from_be_bytes([a, b, c, d]),
            u32::from_be_bytes([e, f, g, h]),
        )
    };
    Some(Stamp::from_sec_nanosec(sec, nanosec))
}
