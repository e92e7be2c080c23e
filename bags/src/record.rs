//! MCAP records in memory: framing, the few fields that reading needs, and how to find the next good record after
//! damage. Nothing here trusts a length that it reads.

use std::collections::BTreeMap;

/// First and last bytes of a file.
pub(crate) const MAGIC: &[u8] = mcap::MAGIC;
/// Opcode and length in front of every record.
const HEAD: usize = 9;

pub(crate) use mcap::records::op;

/// Reads fields off the front of a slice; `None` where it is too short.
pub(crate) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(length)?;
        self.0 = tail;
        Some(head)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(usize::try_from(length).ok()?)
    }

    pub fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }

    /// A name that people see: what a terminal would obey, or what would turn the order of a line round, is shown as unknown.
    pub fn name(&mut self) -> Option<String> {
        let is_seen = |c: char| {
            !c.is_control()
                && !matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
        };
        let shown = |c| {
            if is_seen(c) {
                c
            } else {
                char::REPLACEMENT_CHARACTER
            }
        };
        Some(self.text()?.chars().map(shown).collect())
    }

    pub fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut inner = Fields(self.bytes()?);
        let mut map = BTreeMap::new();
        while !inner.0.is_empty() {
            map.insert(inner.text()?.to_owned(), inner.text()?.to_owned());
        }
        Some(map)
    }
}

/// A record where it stands.
#[derive(Clone, Copy)]
pub(crate) struct Record<'a> {
    pub opcode: u8,
    /// Where its opcode stands.
    pub offset: usize,
    pub body: &'a [u8],
}

impl Record<'_> {
    /// Where the next record begins.
    pub fn end(&self) -> usize {
        self.offset + HEAD + self.body.len()
    }
}

/// The record that begins at `offset`, where it is whole.
pub(crate) fn record_at(data: &[u8], offset: usize) -> Option<Record<'_>> {
    let mut fields = Fields(data.get(offset..)?);
    let opcode = fields.take(1)?[0];
    let length = fields.u64()?;
    let body = fields.take(usize::try_from(length).ok()?)?;
    Some(Record {
        opcode,
        offset,
        body,
    })
}

/// The records of a slice, until one is not whole.
pub(crate) struct Records<'a> {
    data: &'a [u8],
    offset: usize,
}

impl<'a> Records<'a> {
    pub fn new(data: &'a [u8], offset: usize) -> Self {
        Self { data, offset }
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Record<'a>;

    fn next(&mut self) -> Option<Record<'a>> {
        let record = record_at(self.data, self.offset)?;
        self.offset = record.end();
        Some(record)
    }
}

/// A message, without a copy of its data.
#[derive(Clone, Copy)]
pub(crate) struct Message<'a> {
    pub channel: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    pub data: &'a [u8],
}

pub(crate) fn message(body: &[u8]) -> Option<Message<'_>> {
    let mut fields = Fields(body);
    Some(Message {
        channel: fields.u16()?,
        sequence: fields.u32()?,
        log_time: fields.u64()?,
        publish_time: fields.u64()?,
        data: fields.0,
    })
}

/// A schema record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Schema {
    pub name: String,
    pub encoding: String,
    pub text: String,
}

pub(crate) fn schema(body: &[u8]) -> Option<(u16, Schema)> {
    let mut fields = Fields(body);
    let id = fields.u16()?;
    let name = fields.name()?;
    let encoding = fields.name()?;
    let text = String::from_utf8_lossy(fields.bytes()?).into_owned();
    Some((
        id,
        Schema {
            name,
            encoding,
            text,
        },
    ))
}

/// A channel record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub schema: u16,
    pub topic: String,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

pub(crate) fn channel(body: &[u8]) -> Option<(u16, Channel)> {
    let mut fields = Fields(body);
    let id = fields.u16()?;
    let schema = fields.u16()?;
    let topic = fields.name()?;
    let encoding = fields.name()?;
    Some((
        id,
        Channel {
            schema,
            topic,
            encoding,
            metadata: fields.map()?,
        },
    ))
}

/// The head of a chunk, and its packed records as far as they are there.
#[derive(Clone, Copy)]
pub(crate) struct Chunk<'a> {
    pub first_time: u64,
    pub last_time: u64,
    pub unpacked_length: u64,
    pub crc: u32,
    pub compression: &'a str,
    pub packed_length: u64,
    pub packed: &'a [u8],
}

pub(crate) fn chunk(body: &[u8]) -> Option<Chunk<'_>> {
    let mut fields = Fields(body);
    Some(Chunk {
        first_time: fields.u64()?,
        last_time: fields.u64()?,
        unpacked_length: fields.u64()?,
        crc: fields.u32()?,
        compression: fields.text()?,
        packed_length: fields.u64()?,
        packed: fields.0,
    })
}

/// The chunk that begins at `offset`, where its head is good and the end of the data is inside of it.
pub(crate) fn cut_chunk_at(data: &[u8], offset: usize) -> Option<Chunk<'_>> {
    let mut fields = Fields(data.get(offset..)?);
    let opcode = fields.take(1)?[0];
    let length = fields.u64()?;
    let body = fields.0;
    let chunk = chunk(body).filter(|_| opcode == op::CHUNK)?;
    let head = (body.len() - chunk.packed.len()) as u64;
    let is_cut = head.checked_add(chunk.packed_length)? == length && length > body.len() as u64;
    (is_cut && chunk.has_sense()).then_some(chunk)
}

impl Chunk<'_> {
    /// Whether the lengths in the head agree with the length of the record.
    pub fn is_whole(&self) -> bool {
        self.packed.len() as u64 == self.packed_length && self.has_sense()
    }

    fn has_sense(&self) -> bool {
        matches!(self.compression, "" | "zstd" | "lz4") && self.first_time <= self.last_time
    }
}

/// The channel and the number of messages of a message index.
pub(crate) fn message_index(body: &[u8]) -> Option<(u16, u64)> {
    let mut fields = Fields(body);
    let channel = fields.u16()?;
    let entries = fields.bytes()?;
    (fields.0.is_empty() && entries.len().is_multiple_of(16))
        .then_some((channel, entries.len() as u64 / 16))
}

/// Whether a record with this opcode may have this body.
fn has_its_shape(record: &Record<'_>) -> bool {
    let body = record.body;
    match record.opcode {
        op::FOOTER => body.len() == 20,
        op::SCHEMA => schema(body).is_some(),
        op::CHANNEL => channel(body).is_some(),
        op::MESSAGE => body.len() >= 22,
        op::CHUNK => chunk(body).is_some_and(|chunk| chunk.is_whole()),
        op::MESSAGE_INDEX => message_index(body).is_some(),
        op::CHUNK_INDEX | op::ATTACHMENT | op::STATISTICS => body.len() >= 40,
        op::HEADER | op::ATTACHMENT_INDEX | op::METADATA | op::METADATA_INDEX => body.len() >= 8,
        op::SUMMARY_OFFSET => body.len() == 17,
        op::DATA_END => body.len() == 4,
        _ => false,
    }
}

/// Whether a record begins at `offset` beyond reasonable doubt: a whole chunk, or three records in a row (fewer where
/// the file ends behind them).
pub(crate) fn is_plausible(data: &[u8], offset: usize) -> bool {
    let mut at = offset;
    for _ in 0..3 {
        let Some(record) = record_at(data, at) else {
            return false;
        };
        if !has_its_shape(&record) {
            return false;
        }
        if record.opcode == op::CHUNK {
            return true;
        }
        at = record.end();
        if at == data.len() || (record.opcode == op::FOOTER && data[at..].starts_with(MAGIC)) {
            return true;
        }
    }
    true
}

/// The first plausible record at or behind `offset`.
pub(crate) fn resynchronise(data: &[u8], offset: usize) -> Option<usize> {
    (offset..data.len().saturating_sub(HEAD)).find(|&at| is_plausible(data, at))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn footer() -> Vec<u8> {
        let mut bytes = vec![op::FOOTER];
        bytes.extend(20u64.to_le_bytes());
        bytes.extend([0; 20]);
        bytes
    }

    /// What a terminal would obey is not in a name; everything else is as it was written.
    #[test]
    fn names_move_no_terminal() {
        let told = |name: &str| {
            let length = u32::try_from(name.len()).unwrap().to_le_bytes();
            Fields(&[&length[..], name.as_bytes()].concat())
                .name()
                .unwrap()
        };
        assert_eq!(told("/imu/data_raw Ω"), "/imu/data_raw Ω");
        assert_eq!(told("/a\u{1b}[2J\u{7}\n"), "/a\u{fffd}[2J\u{fffd}\u{fffd}");
        assert_eq!(told("/a\u{202e}b\u{9b}"), "/a\u{fffd}b\u{fffd}");
    }

    /// A length beyond the end of the data is no record, however large it is.
    #[test]
    fn lengths_are_not_trusted() {
        for length in [21, u64::MAX, u64::MAX - 8] {
            let mut bytes = footer();
            bytes[1..9].copy_from_slice(&length.to_le_bytes());
            assert!(record_at(&bytes, 0).is_none());
        }
    }

    /// Behind garbage the next record is found where it is.
    #[test]
    fn resynchronises_behind_garbage() {
        let mut bytes = vec![0xff; 100];
        bytes.extend(footer());
        bytes.extend(MAGIC);
        assert_eq!(resynchronise(&bytes, 1), Some(100));
        assert_eq!(resynchronise(&bytes, 101), None);
    }
}
