//! How the messages of each topic come: rate, gaps, first and last.

use bags::{RawMessage, Topic};
use ros2_interfaces::KnownType;
use rotary_sins_msgs::known_type;
use sins::{
    stream::sampling::{Interval, SampleClock},
    time::Stamp,
};
use stream_monitor::StreamMonitor;

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
    /// Messages.
    pub count: u64,
    /// Its first gaps.
    pub gaps: Vec<Gap>,
    has_stamp: bool,
    /// First and last, by the stamps where messages have them.
    times: Option<(Stamp, Stamp)>,
    /// First and last, by the recorder.
    logged: Option<(Stamp, Stamp)>,
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
            count: 0,
            gaps: Vec::new(),
            has_stamp: known_type(&topic.type_name).is_some_and(KnownType::begins_with_stamp),
            times: None,
            logged: None,
            monitor: StreamMonitor::default(),
            usual: 0,
            clock: is_imu.then(SampleClock::default),
        }
    }

    /// Takes a message. A stamp that nobody filled in says nothing.
    pub fn take(&mut self, message: &RawMessage<'_>) {
        self.count += 1;
        let logged = Stamp::from_nanos(message.log_time.cast_signed());
        let first = self.logged.map_or(logged, |logged| logged.0);
        self.logged = Some((first, logged));
        if !self.has_stamp {
            return self.follow(logged);
        }
        if let Some(stamp) = stamp_in_front(message.data).filter(|stamp| stamp.nanos() != 0) {
            self.follow(stamp);
        }
    }

    fn follow(&mut self, time: Stamp) {
        let before = self.times.map(|times| times.1);
        let (lost_before, usual_ns) = (self.lost(), self.monitor.interval_nanos());
        let mut is_gap = self.monitor.ingest(time.nanos());
        if let Some(clock) = &mut self.clock {
            is_gap = matches!(clock.classify(time), Interval::Gap { .. });
        }
        let first = self.times.map_or(time, |times| times.0);
        self.times = Some((first, time));
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

    /// Whether its times are the stamps of its messages, not those of the recorder.
    pub fn by_stamp(&self) -> bool {
        self.has_stamp && self.times.is_some()
    }

    /// Time of the first message and of the last.
    pub fn span(&self) -> Option<(Stamp, Stamp)> {
        self.times.or(self.logged)
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
        let (first, last) = self.span()?;
        let length_s = last.seconds_since(first);
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
