//! Bags that were cut off or damaged are read as far as they are good, and say so; nothing panics.
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;

use bags::{Bag, Compression, Damage, SensorOptions, SensorStream};
use proptest::prelude::*;
use support::{START, read_all, warning_lines, write};

const COUNT: u64 = 500;
const MESSAGES: usize = 1005;

/// The bytes of a good bag.
fn good(compression: Compression) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    write(&path, COUNT, compression, 20_000);
    fs::read(path).unwrap()
}

/// The same without chunks and without a summary, as the smallest recorders write.
fn unindexed() -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .use_chunks(false)
        .emit_summary_records(false)
        .emit_summary_offsets(false);
    rewritten(options, "cdr")
}

/// In chunks, without the index of their messages.
fn without_message_index() -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .chunk_size(Some(20_000))
        .compression(None)
        .emit_message_indexes(false);
    rewritten(options, "cdr")
}

/// The good bag, written in another way.
fn rewritten(options: mcap::WriteOptions, encoding: &str) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    fs::write(&path, good(Compression::Zstd)).unwrap();
    let bag = Bag::open(&path).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = options.create(&mut bytes).unwrap();
    let mut messages = bag.messages(&bags::Selection::default());
    while let Some(message) = messages.next() {
        let topic = &bag.topics()[message.topic];
        let schema = writer
            .add_schema(&topic.type_name, "ros2msg", topic.schema.as_bytes())
            .unwrap();
        let channel_id = writer
            .add_channel(
                schema,
                &topic.name,
                encoding,
                &std::collections::BTreeMap::new(),
            )
            .unwrap();
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: 0,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        writer
            .write_to_known_channel(&header, message.data)
            .unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

struct File {
    _directory: tempfile::TempDir,
    path: std::path::PathBuf,
}

fn file(bytes: &[u8]) -> File {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    fs::write(&path, bytes).unwrap();
    File {
        _directory: directory,
        path,
    }
}

/// Where the record of the `n`-th chunk begins.
fn chunk_offset(bytes: &[u8], n: usize) -> usize {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    usize::try_from(summary.chunk_indexes[n].chunk_start_offset).unwrap()
}

/// Where the first record behind `offset` begins.
fn record_behind(bytes: &[u8], offset: usize) -> usize {
    let mut at = 8;
    while at < offset {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    at
}

/// A bag without chunks and index is read whole and says nothing.
#[test]
fn unindexed_is_no_damage() {
    let contents = read_all(&file(&unindexed()).path);
    assert_eq!(
        (contents.messages.len(), contents.warnings.len()),
        (MESSAGES, 0)
    );
}

/// Cut at every 997th byte: the messages before the cut come in order, never fewer for a later cut, and one line says
/// that the file ends there.
#[test]
fn cut_off_anywhere() {
    for bytes in [
        good(Compression::Zstd),
        good(Compression::Lz4),
        good(Compression::None),
        unindexed(),
    ] {
        let mut read_before = 0;
        for cut in (8..bytes.len()).step_by(997) {
            let contents = read_all(&file(&bytes[..cut]).path);
            let count = contents.messages.len();
            assert!(
                count >= read_before,
                "{count} messages at {cut}, {read_before} before"
            );
            assert!(contents.messages.is_sorted_by_key(|(_, time, _)| *time));
            let lines = warning_lines(&contents);
            assert!(
                lines.len() == 1 && lines[0].contains(&format!("ends at byte {cut}")),
                "{cut}: {lines:?}"
            );
            read_before = count;
        }
        assert!(read_before > MESSAGES * 3 / 4);
    }
}

/// A bag of eleven messages in small chunks, cut off at every byte: no panic, what is whole before the cut is read, in its order, and the
/// damage is told.
#[test]
fn cut_off_at_every_byte() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    write(&path, 5, Compression::None, 1000);
    let bytes = fs::read(&path).unwrap();
    let all = read_all(&path);
    assert_eq!((all.messages.len(), all.warnings.len()), (11, 0));
    // Where each chunk ends, and how many messages are whole then.
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut whole = Vec::new();
    let mut count = 0;
    for chunk in &summary.chunk_indexes {
        let messages = summary.stream_chunk(&bytes, chunk).unwrap();
        count += messages.map(Result::unwrap).count();
        let end = chunk.chunk_start_offset + chunk.chunk_length;
        whole.push((usize::try_from(end).unwrap(), count));
    }
    assert!(whole.len() > 2 && count == 11, "{whole:?}");
    let mut read_before = 0;
    for cut in 0..bytes.len() {
        fs::write(&path, &bytes[..cut]).unwrap();
        let name = format!("cut at {cut} of {}", bytes.len());
        if cut < mcap::MAGIC.len() {
            assert!(Bag::open(&path).is_err(), "{name}");
            continue;
        }
        let contents = read_all(&path);
        let read = contents.messages.len();
        let least = whole.iter().rev().find(|(end, _)| *end <= cut);
        assert!(
            read >= least.map_or(0, |(_, count)| *count),
            "{name}: {read}"
        );
        assert_eq!(contents.messages, all.messages[..read], "{name}");
        assert!(read >= read_before, "{name}: {read} after {read_before}");
        read_before = read;
        let lines = warning_lines(&contents);
        assert!(!lines.is_empty(), "{name}: nothing is told");
        assert!(
            lines[0].contains(&format!("ends at byte {cut}")),
            "{name}: {lines:?}"
        );
    }
    assert_eq!(read_before, 11);
}

/// Of the chunk that the end cuts off, what can be unpacked is read.
#[test]
fn the_last_chunk_is_salvaged() {
    let bytes = good(Compression::None);
    let whole = read_all(&file(&bytes[..chunk_offset(&bytes, 3)]).path)
        .messages
        .len();
    let contents = read_all(&file(&bytes[..chunk_offset(&bytes, 3) + 10_000]).path);
    assert!(
        contents.messages.len() > whole + 20,
        "{} against {whole}",
        contents.messages.len()
    );
    let last = contents.messages.last().unwrap().1;
    assert_eq!(
        contents.warnings[0].log_time,
        Some(last),
        "the line names the newest good message"
    );
}

/// A flipped byte in a chunk costs this chunk and no other; its offset and the reason are named.
#[test]
fn a_bad_chunk_is_left_out() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let mut bytes = good(compression);
        let offset = chunk_offset(&bytes, 2);
        bytes[offset + 500] ^= 0x55;
        let contents = read_all(&file(&bytes).path);
        let missing = MESSAGES - contents.messages.len();
        assert!(
            (1..MESSAGES / 4).contains(&missing),
            "{compression:?}: {missing} are missing"
        );
        assert_eq!(contents.warnings.len(), 1, "{:?}", warning_lines(&contents));
        assert_eq!(contents.warnings[0].offset, offset as u64);
        assert!(matches!(
            contents.warnings[0].what,
            Damage::ChunkSkipped { .. }
        ));
    }
}

/// A record whose length was destroyed does not hide those behind it.
#[test]
fn a_bad_length_is_passed_over() {
    for bytes in [good(Compression::Zstd), unindexed()] {
        let mut bytes = bytes;
        let offset = record_behind(&bytes, bytes.len() / 3);
        bytes[offset..offset + 60].fill(0xff);
        let contents = read_all(&file(&bytes).path);
        assert!(
            contents.messages.len() > MESSAGES * 3 / 4,
            "{}",
            contents.messages.len()
        );
        let last = START.unsigned_abs() + (COUNT - 1) * 10_000_000;
        assert_eq!(
            contents.messages.last().unwrap().1,
            last,
            "reading goes on behind the damage"
        );
        assert!(!contents.warnings.is_empty());
    }
}

/// A file system that wrote zeros for the end: everything before is read.
#[test]
fn zeros_at_the_end() {
    let mut bytes = good(Compression::Zstd);
    let end = bytes.len();
    let from = chunk_offset(&bytes, 4);
    bytes[from..end].fill(0);
    let contents = read_all(&file(&bytes).path);
    assert!(contents.messages.len() > 300);
    assert!(warning_lines(&contents)[0].contains("ends at byte"));
}

/// Without an index of its messages a damaged chunk is told too: when the bag is opened, whatever topics are asked for, and once. What
/// stands around it is read.
#[test]
fn a_damaged_chunk_without_an_index_is_told() {
    let good = without_message_index();
    assert!(read_all(&file(&good).path).warnings.is_empty());
    let mut bytes = good.clone();
    let at = chunk_offset(&bytes, 2) + 5000;
    bytes[at..at + 4].copy_from_slice(&[0xff; 4]);
    let file = file(&bytes);
    let bag = Bag::open(&file.path).unwrap();
    let is_told = |warning: &bags::Warning| matches!(warning.what, Damage::ChunkSkipped { .. });
    assert_eq!(bag.warnings().len(), 1);
    assert!(is_told(&bag.warnings()[0]) && bag.warnings()[0].log_time.is_some());
    let contents = read_all(&file.path);
    assert_eq!(warning_lines(&contents).len(), 1);
    let count = contents.messages.len();
    assert!(count > MESSAGES / 2 && count < MESSAGES, "{count}");
}

/// A chunk that claims more than the bound is not unpacked, and is told.
#[test]
fn a_bomb_is_not_unpacked() {
    let mut bytes = good(Compression::Zstd);
    let at = chunk_offset(&bytes, 1) + 9 + 16;
    bytes[at..at + 8].copy_from_slice(&(1_u64 << 30).to_le_bytes());
    let contents = read_all(&file(&bytes).path);
    let lines = warning_lines(&contents);
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(
        lines[0].contains("1073741824 bytes, expected at most"),
        "{lines:?}"
    );
}

/// Messages that are no CDR are refused by the name of their encoding.
#[test]
fn other_encodings_are_refused() {
    let file = file(&rewritten(mcap::WriteOptions::new(), "json"));
    let bag = Bag::open(&file.path).unwrap();
    let told = SensorStream::new(&bag, &SensorOptions::default())
        .err()
        .unwrap()
        .to_string();
    assert!(
        told.contains("/imu/data_raw: message encoding \"json\", expected \"cdr\""),
        "{told}"
    );
}

/// A device and a FIFO are no bags, and nothing is waited for.
#[test]
fn what_never_ends_is_no_bag() {
    let told = Bag::open("/dev/zero").err().unwrap().to_string();
    assert!(told.contains("/dev/zero: a device or a pipe"), "{told}");
}

/// A record that is there is not written over, unless that is asked for; nothing of it is lost by the question.
#[test]
fn a_record_is_not_written_over() {
    use bags::{BagWriter, WriteOptions};
    let bytes = good(Compression::Zstd);
    let file = file(&bytes);
    let told = BagWriter::create(&file.path, WriteOptions::default())
        .err()
        .unwrap()
        .to_string();
    assert!(told.contains("it is there already"), "{told}");
    assert_eq!(fs::read(&file.path).unwrap(), bytes);
    let options = WriteOptions {
        replaces: true,
        ..WriteOptions::default()
    };
    BagWriter::create(&file.path, options)
        .unwrap()
        .finish()
        .unwrap();
    assert!(fs::read(&file.path).unwrap().len() < bytes.len());
}

/// A message that is no Imu names file, topic and number, and the stream goes on behind it.
#[test]
fn a_bad_message_is_named() {
    use bags::{BagWriter, NewTopic, Qos, WriteOptions};
    use ros2_interfaces::sensor_msgs::Imu;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    let mut bag = BagWriter::create(&path, WriteOptions::default()).unwrap();
    let imu = bag
        .add_topic(NewTopic::of::<Imu>("/imu/data_raw", Qos::reliable(1)))
        .unwrap();
    bag.write(imu, 1, &Imu::default()).unwrap();
    bag.write_payload(imu, 2, 2, &[0, 1, 0, 0, 1, 2, 3])
        .unwrap();
    bag.write(imu, 3, &Imu::default()).unwrap();
    bag.finish().unwrap();
    let bag = Bag::open(&path).unwrap();
    let mut stream = SensorStream::new(&bag, &SensorOptions::default()).unwrap();
    assert!(stream.next().unwrap().is_some());
    let error = stream.next().unwrap_err().to_string();
    assert!(
        error.contains("x.mcap: /imu/data_raw: message 1: not a sensor_msgs/msg/Imu"),
        "{error}"
    );
    assert!(stream.next().unwrap().is_some());
    assert!(stream.next().unwrap().is_none());
}

/// Reads everything in every way and only has to come back.
fn survive(bytes: &[u8]) {
    let file = file(bytes);
    let Ok(bag) = Bag::open(&file.path) else {
        return;
    };
    let mut messages = bag.messages(&bags::Selection::default());
    while messages.next().is_some() {}
    let Ok(mut stream) = SensorStream::new(&bag, &SensorOptions::default()) else {
        return;
    };
    while !matches!(stream.next(), Ok(None)) {}
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Flipped bytes anywhere, in any packing, make no panic and no endless loop.
    #[test]
    fn flipped_bytes(packing in 0usize..4, flips in prop::collection::vec((any::<prop::sample::Index>(), 1u8..), 1..8)) {
        static BAGS: std::sync::LazyLock<[Vec<u8>; 4]> = std::sync::LazyLock::new(|| {
            [good(Compression::None), good(Compression::Lz4), good(Compression::Zstd), unindexed()]
        });
        let mut bytes = BAGS[packing].clone();
        for (at, flip) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= flip;
        }
        survive(&bytes);
    }

    /// Bytes that only begin like a bag make no panic.
    #[test]
    fn noise_behind_the_magic(noise in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut bytes = mcap::MAGIC.to_vec();
        bytes.extend(noise);
        survive(&bytes);
    }
}
