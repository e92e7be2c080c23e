//! One pass over the framing of a file: where its messages are, without unpacking them.
//!
//! The summary at the end of a file is used for its schemas and channels only; the places of the chunks come from the
//! framing itself, so that files without an index, cut off or damaged, are read by the same code as good ones.

use std::{collections::BTreeMap, ops::Range, path::Path};

use crate::{
    chunk::Unpacker,
    error::{Damage, Error, Warning},
    record::{self, Channel, Fields, MAGIC, Record, Records, Schema, op},
};

/// Messages outside of chunks are taken together up to this many bytes.
const LOOSE_RUN: usize = 4 << 20;

/// A stretch of the file that holds messages.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    pub kind: SegmentKind,
    /// Of the chunk's record, or of the loose records.
    pub range: Range<usize>,
    pub first_time: u64,
    pub last_time: u64,
    /// Messages by channel, where it is known without unpacking.
    pub counts: Option<BTreeMap<u16, u64>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SegmentKind {
    Chunk,
    /// The end of the file is inside of it.
    CutChunk,
    Loose,
}

/// What one file holds.
#[derive(Debug, Default)]
pub(crate) struct FileIndex {
    pub profile: String,
    pub library: String,
    pub segments: Vec<Segment>,
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, Channel>,
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
    pub warnings: Vec<Warning>,
    /// Packed and unpacked bytes of the chunks by compression.
    pub compression: BTreeMap<String, (u64, u64)>,
}

impl FileIndex {
    /// Scans a file. Damage inside becomes warnings; a file that is no MCAP at all is an error.
    pub fn scan(path: &Path, data: &[u8]) -> Result<Self, Error> {
        check_magic(path, data)?;
        let mut scan = Scan {
            path,
            data,
            index: Self::default(),
            cut_off: None,
            run_is_closed: false,
        };
        scan.walk();
        let mut index = scan.index;
        if let Some(offset) = scan.cut_off {
            let inside = inside(data, offset);
            let log_time = index.last_time();
            index.warnings.push(Warning {
                path: path.to_owned(),
                offset: data.len() as u64,
                log_time,
                what: Damage::CutShort { inside },
            });
        }
        index.look_into_chunks(path, data);
        Ok(index)
    }

    fn last_time(&self) -> Option<u64> {
        self.segments
            .iter()
            .filter(|s| s.kind != SegmentKind::CutChunk)
            .map(|s| s.last_time)
            .max()
    }

    /// Log time of the newest message in the segments before one \[ns\].
    fn last_time_before(&self, at: usize) -> Option<u64> {
        let before = self.segments[..at].iter();
        let with_messages =
            before.filter(|s| s.counts.as_ref().is_none_or(|counts| !counts.is_empty()));
        with_messages.map(|s| s.last_time).max()
    }

    /// Unpacks the chunks of which the framing did not say what is in them: schemas, channels and counts.
    fn look_into_chunks(&mut self, path: &Path, data: &[u8]) {
        let mut damaged = Vec::new();
        let mut unpacker = Unpacker::default();
        for at in 0..self.segments.len() {
            let segment = &self.segments[at];
            let is_clear = match &segment.counts {
                Some(counts) => counts.keys().all(|id| self.channels.contains_key(id)),
                None => false,
            };
            if is_clear || segment.kind == SegmentKind::Loose {
                continue;
            }
            let Some(chunk) = chunk_of(data, segment) else {
                continue;
            };
            let records = match segment.kind {
                SegmentKind::CutChunk => Unpacker::salvage(&chunk).into(),
                _ => match unpacker.unpack(&chunk, Vec::new()) {
                    Ok(records) => records,
                    Err(reason) => {
                        // Nobody knows what topics are in it, so it is told to everybody, now.
                        damaged.push(Warning {
                            path: path.to_owned(),
                            offset: segment.range.start as u64,
                            log_time: self.last_time_before(at),
                            what: Damage::ChunkSkipped { reason },
                        });
                        self.segments[at].counts = Some(BTreeMap::new());
                        continue;
                    }
                },
            };
            let mut counts = BTreeMap::new();
            let mut last_time = None;
            for record in Records::new(&records, 0) {
                self.definition(&record);
                if record.opcode == op::MESSAGE
                    && let Some(message) = record::message(record.body)
                {
                    *counts.entry(message.channel).or_insert(0) += 1;
                    last_time = last_time.max(Some(message.log_time));
                }
            }
            self.segments[at].counts = Some(counts);
            if self.segments[at].kind == SegmentKind::CutChunk
                && let Some(last_time) = last_time
            {
                self.segments[at].last_time = last_time;
                if let Some(warning) = self.warnings.last_mut() {
                    warning.log_time = warning.log_time.max(Some(last_time));
                }
            }
        }
        self.warnings.extend(damaged);
    }

    /// Takes a schema or a channel. The first definition of a number counts.
    fn definition(&mut self, record: &Record<'_>) {
        match record.opcode {
            op::SCHEMA => {
                if let Some((id, schema)) = record::schema(record.body) {
                    self.schemas.entry(id).or_insert(schema);
                }
            }
            op::CHANNEL => {
                if let Some((id, channel)) = record::channel(record.body) {
                    self.channels.entry(id).or_insert(channel);
                }
            }
            _ => {}
        }
    }
}

/// The chunk of a segment.
pub(crate) fn chunk_of<'a>(data: &'a [u8], segment: &Segment) -> Option<record::Chunk<'a>> {
    let body = data.get(segment.range.start + 9..segment.range.end)?;
    record::chunk(body)
}

fn check_magic(path: &Path, data: &[u8]) -> Result<(), Error> {
    if data.starts_with(MAGIC) {
        return Ok(());
    }
    let reason = if data.is_empty() {
        "the file is empty, expected an MCAP file"
    } else if data.starts_with(b"SQLite format 3") {
        "this is an SQLite bag, expected MCAP (convert it with: ros2 bag convert)"
    } else if data.starts_with(b"#ROSBAG V2") {
        "this is a ROS 1 bag, expected MCAP"
    } else if data.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        "the file is packed with zstd as a whole, expected MCAP (unpack it with: zstd -d)"
    } else {
        "not an MCAP file (it does not begin with the MCAP magic)"
    };
    Err(Error::not_a_bag(path, reason))
}

/// What stands at the end of a file that was cut off.
fn inside(data: &[u8], offset: usize) -> &'static str {
    match data.get(offset) {
        None => "the data, before the end marker",
        Some(&op::CHUNK) => "a chunk",
        Some(&op::MESSAGE) => "a message",
        Some(_) => "a record",
    }
}

struct Scan<'a> {
    path: &'a Path,
    data: &'a [u8],
    index: FileIndex,
    /// Where the last, incomplete record of a file that was cut off begins.
    cut_off: Option<usize>,
    /// The next loose message begins a segment of its own.
    run_is_closed: bool,
}

impl Scan<'_> {
    fn walk(&mut self) {
        let mut offset = MAGIC.len();
        loop {
            match record::record_at(self.data, offset) {
                Some(record) if record.opcode == op::FOOTER && record.body.len() == 20 => {
                    if !self.data[record.end()..].starts_with(MAGIC) {
                        self.cut_off = Some(record.end());
                    }
                    return;
                }
                Some(record) if self.take(&record) => offset = record.end(),
                _ if self.take_cut_chunk(offset) => {
                    self.cut_off = Some(offset);
                    return;
                }
                _ => {
                    let Some(next) = record::resynchronise(self.data, offset + 1) else {
                        self.cut_off = Some(offset);
                        return;
                    };
                    self.passed_over(offset, next);
                    offset = next;
                }
            }
        }
    }

    /// Takes in a record; false where it is none that may stand here.
    fn take(&mut self, record: &Record<'_>) -> bool {
        match record.opcode {
            op::HEADER => {
                let mut fields = Fields(record.body);
                if let (Some(profile), Some(library)) = (fields.name(), fields.name()) {
                    self.index.profile = profile;
                    self.index.library = library;
                }
                true
            }
            op::SCHEMA | op::CHANNEL => {
                self.index.definition(record);
                true
            }
            op::MESSAGE => self.take_message(record),
            op::CHUNK => self.take_chunk(record),
            op::MESSAGE_INDEX => {
                if let (Some((channel, count)), Some(segment)) = (
                    record::message_index(record.body),
                    self.index.segments.last_mut(),
                ) && segment.kind == SegmentKind::Chunk
                {
                    *segment
                        .counts
                        .get_or_insert_default()
                        .entry(channel)
                        .or_insert(0) += count;
                }
                true
            }
            op::METADATA => {
                let mut fields = Fields(record.body);
                if let (Some(name), Some(map)) = (fields.text(), fields.map()) {
                    self.index.metadata.push((name.to_owned(), map));
                }
                true
            }
            op::FOOTER | 0 | 0x10..=0x7f => false,
            _ => true,
        }
    }

    fn take_message(&mut self, record: &Record<'_>) -> bool {
        let Some(message) = record::message(record.body) else {
            return false;
        };
        let range = record.offset..record.end();
        let open = self.index.segments.last_mut().filter(|segment| {
            segment.kind == SegmentKind::Loose
                && !self.run_is_closed
                && range.end - segment.range.start <= LOOSE_RUN
        });
        if let Some(segment) = open {
            segment.range.end = range.end;
            segment.first_time = segment.first_time.min(message.log_time);
            segment.last_time = segment.last_time.max(message.log_time);
            *segment
                .counts
                .get_or_insert_default()
                .entry(message.channel)
                .or_insert(0) += 1;
        } else {
            self.index.segments.push(Segment {
                kind: SegmentKind::Loose,
                range,
                first_time: message.log_time,
                last_time: message.log_time,
                counts: Some(BTreeMap::from([(message.channel, 1)])),
            });
            self.run_is_closed = false;
        }
        true
    }

    fn take_chunk(&mut self, record: &Record<'_>) -> bool {
        let Some(chunk) = record::chunk(record.body).filter(record::Chunk::is_whole) else {
            return false;
        };
        let sizes = self
            .index
            .compression
            .entry(chunk.compression.to_owned())
            .or_insert((0, 0));
        sizes.0 += chunk.packed_length;
        sizes.1 = sizes.1.saturating_add(chunk.unpacked_length);
        // An empty chunk has no times worth waiting for.
        if chunk.unpacked_length > 0 {
            self.index.segments.push(Segment {
                kind: SegmentKind::Chunk,
                range: record.offset..record.end(),
                first_time: chunk.first_time,
                last_time: chunk.last_time,
                counts: None,
            });
        }
        true
    }

    fn passed_over(&mut self, from: usize, to: usize) {
        // Loose messages before and behind the damage stay apart, so that a stretch is walked without stumbling.
        self.run_is_closed = true;
        self.index.warnings.push(Warning {
            path: self.path.to_owned(),
            offset: from as u64,
            log_time: self.index.last_time(),
            what: Damage::BytesSkipped {
                length: (to - from) as u64,
            },
        });
    }

    /// Takes the chunk at `offset` where the end of the file is inside of it: what is there can be used.
    fn take_cut_chunk(&mut self, offset: usize) -> bool {
        let Some(chunk) = record::cut_chunk_at(self.data, offset) else {
            return false;
        };
        self.index.segments.push(Segment {
            kind: SegmentKind::CutChunk,
            range: offset..self.data.len(),
            first_time: chunk.first_time,
            last_time: chunk.first_time,
            counts: None,
        });
        true
    }
}
