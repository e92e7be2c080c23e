//! The messages of a bag in the order of their log time.

use std::{borrow::Cow, collections::VecDeque};

use crate::{
    bag::Bag,
    chunk::Unpacker,
    error::{Damage, Warning},
    index::{Segment, SegmentKind, chunk_of},
    record::{self, Records, op},
};

/// So many chunks that overlap in time are put in order; beyond that the order is that of the chunks. (rosbag2 writes
/// chunks that do not overlap at all, or by the few messages that were under way between threads.)
const LARGEST_OVERLAP: usize = 16;
/// And so many bytes of them at once; a chunk more may be opened beside.
const MOST_BYTES: usize = 128 << 20;

/// Which messages are wanted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Numbers of the topics; `None` means all.
    pub topics: Option<Vec<usize>>,
    /// Not before this log time \[ns\].
    pub start: Option<u64>,
    /// Before this log time \[ns\].
    pub end: Option<u64>,
}

impl Selection {
    /// All messages of these topics.
    pub fn topics(topics: impl Into<Vec<usize>>) -> Self {
        Self {
            topics: Some(topics.into()),
            ..Self::default()
        }
    }

    /// Only from `start_offset` seconds after the first message of the bag, for `duration` seconds.
    #[must_use]
    pub fn window(mut self, bag: &Bag, start_offset: Option<f64>, duration: Option<f64>) -> Self {
        let nanos = |seconds: f64| (seconds * 1e9).round() as u64;
        let first = bag.time_range().map_or(0, |(first, _)| first);
        let start = first.saturating_add(start_offset.map_or(0, nanos));
        self.start = start_offset.map(|_| start);
        self.end = duration.map(|seconds| start.saturating_add(nanos(seconds)));
        self
    }

    fn has_topic(&self, topic: usize) -> bool {
        self.topics
            .as_ref()
            .is_none_or(|topics| topics.contains(&topic))
    }

    fn has_time(&self, time: u64) -> bool {
        self.start.is_none_or(|start| time >= start) && self.end.is_none_or(|end| time < end)
    }
}

/// A message as the bag has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawMessage<'a> {
    /// Number of its topic in [`Bag::topics`].
    pub topic: usize,
    /// When it was recorded \[ns\].
    pub log_time: u64,
    /// When it was published \[ns\].
    pub publish_time: u64,
    /// Its number among those of its channel, where the recorder counted.
    pub sequence: u32,
    /// The payload, encapsulation included.
    pub data: &'a [u8],
}

/// Where a message stands in its segment.
#[derive(Clone, Copy)]
struct Entry {
    log_time: u64,
    publish_time: u64,
    sequence: u32,
    topic: usize,
    offset: usize,
    length: usize,
}

struct OpenSegment<'b> {
    /// File number and offset: of equal times, what stands first in the files comes first.
    place: (usize, usize),
    records: Cow<'b, [u8]>,
    /// In the order of log time; of equal times, in the order of the file.
    entries: Vec<Entry>,
    next: usize,
}

/// Reads messages one by one: `while let Some(message) = messages.next() { .. }`. (No `Iterator`, because a message
/// borrows the chunk that it is in.)
pub struct Messages<'b> {
    bag: &'b Bag,
    selection: Selection,
    /// File number and segment, in the order of first log time.
    waiting: VecDeque<(usize, &'b Segment)>,
    open: Vec<OpenSegment<'b>>,
    unpacker: Unpacker,
    spare: Vec<Vec<u8>>,
    spare_entries: Vec<Vec<Entry>>,
    warnings: Vec<Warning>,
    newest: Option<u64>,
}

impl<'b> Messages<'b> {
    pub(crate) fn new(bag: &'b Bag, selection: &Selection) -> Self {
        let mut waiting = Vec::new();
        for (number, file) in bag.files.iter().enumerate() {
            for segment in &file.index.segments {
                let wanted = |id: &u16| {
                    file.topic_of
                        .get(id)
                        .is_some_and(|&topic| selection.has_topic(topic))
                };
                let has_topic = segment
                    .counts
                    .as_ref()
                    .is_none_or(|counts| counts.keys().any(wanted));
                let is_over = selection
                    .start
                    .is_some_and(|start| segment.last_time < start);
                let is_to_come = selection.end.is_some_and(|end| segment.first_time >= end);
                if has_topic && !is_over && !is_to_come {
                    waiting.push((number, segment));
                }
            }
        }
        waiting.sort_by_key(|(_, segment)| segment.first_time);
        Self {
            bag,
            selection: selection.clone(),
            waiting: waiting.into(),
            open: Vec::new(),
            unpacker: Unpacker::default(),
            spare: Vec::new(),
            spare_entries: Vec::new(),
            warnings: Vec::new(),
            newest: None,
        }
    }

    /// The next message; `None` at the end.
    #[allow(
        clippy::should_implement_trait,
        reason = "a message borrows from the reader"
    )]
    pub fn next(&mut self) -> Option<RawMessage<'_>> {
        let at = loop {
            let earliest = self.earliest();
            let is_due = self
                .waiting
                .front()
                .is_some_and(|(_, segment)| match earliest {
                    Some((time, _)) => {
                        segment.first_time <= time
                            && self.open.len() < LARGEST_OVERLAP
                            && self.unpacked_bytes() < MOST_BYTES
                    }
                    None => true,
                });
            if is_due {
                self.open_next();
            } else {
                break earliest?.1;
            }
        };
        let segment = &mut self.open[at];
        let entry = segment.entries[segment.next];
        segment.next += 1;
        self.newest = Some(entry.log_time);
        Some(RawMessage {
            topic: entry.topic,
            log_time: entry.log_time,
            publish_time: entry.publish_time,
            sequence: entry.sequence,
            data: &segment.records[entry.offset..entry.offset + entry.length],
        })
    }

    /// What could not be read so far. Complete after `next` returned `None`.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// What is unpacked now \[bytes\].
    fn unpacked_bytes(&self) -> usize {
        let open = self.open.iter().map(|segment| match &segment.records {
            Cow::Owned(records) => records.len(),
            Cow::Borrowed(_) => 0,
        });
        open.sum()
    }

    /// Log time and number of the open segment that has the earliest message. Segments that are done are put away.
    fn earliest(&mut self) -> Option<(u64, usize)> {
        let mut earliest: Option<(u64, usize)> = None;
        let mut at = 0;
        while at < self.open.len() {
            let segment = &self.open[at];
            if let Some(entry) = segment.entries.get(segment.next) {
                let comes_before = |(time, other): (u64, usize)| {
                    (entry.log_time, segment.place) < (time, self.open[other].place)
                };
                if earliest.is_none_or(comes_before) {
                    earliest = Some((entry.log_time, at));
                }
                at += 1;
            } else {
                let done = self.open.remove(at);
                self.spare_entries.push(done.entries);
                if let Cow::Owned(buffer) = done.records {
                    self.spare.push(buffer);
                }
            }
        }
        earliest
    }

    fn open_next(&mut self) {
        let Some((number, segment)) = self.waiting.pop_front() else {
            return;
        };
        let file = &self.bag.files[number];
        let records = match segment.kind {
            SegmentKind::Loose => Cow::Borrowed(&file.map[segment.range.clone()]),
            SegmentKind::CutChunk => chunk_of(&file.map, segment)
                .map(|chunk| Unpacker::salvage(&chunk).into())
                .unwrap_or_default(),
            SegmentKind::Chunk => {
                let Some(chunk) = chunk_of(&file.map, segment) else {
                    return;
                };
                match self
                    .unpacker
                    .unpack(&chunk, self.spare.pop().unwrap_or_default())
                {
                    Ok(records) => records,
                    Err(reason) => {
                        self.warnings.push(Warning {
                            path: file.path.clone(),
                            offset: segment.range.start as u64,
                            log_time: self.newest,
                            what: Damage::ChunkSkipped { reason },
                        });
                        return;
                    }
                }
            }
        };
        let mut entries = self.spare_entries.pop().unwrap_or_default();
        entries.clear();
        for record in Records::new(&records, 0) {
            if record.opcode == op::MESSAGE
                && let Some(message) = record::message(record.body)
                && let Some(&topic) = file.topic_of.get(&message.channel)
                && self.selection.has_topic(topic)
                && self.selection.has_time(message.log_time)
            {
                entries.push(Entry {
                    log_time: message.log_time,
                    publish_time: message.publish_time,
                    sequence: message.sequence,
                    topic,
                    offset: record.end() - message.data.len(),
                    length: message.data.len(),
                });
            }
        }
        if !entries.is_sorted_by_key(|entry| entry.log_time) {
            entries.sort_by_key(|entry| entry.log_time);
        }
        self.open.push(OpenSegment {
            place: (number, segment.range.start),
            records,
            entries,
            next: 0,
        });
    }
}
