//! What is written is read, in every packing and from files and directories alike.
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;

use bags::{
    Bag, BagWriter, Compression, Error, NewTopic, Qos, Sample, Selection, SensorOptions,
    SensorStream, WriteOptions,
};
use proptest::prelude::*;
use ros2_interfaces::{sensor_msgs::Imu, std_msgs};
use rotary_sins_msgs::known_type;
use support::{START, read, read_all, write};

const FIRST: u64 = START.unsigned_abs();

/// Every packing gives every message back in order, without a warning.
#[test]
fn every_packing() {
    let directory = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let path = directory.path().join(format!("{compression:?}.mcap"));
        write(&path, 1000, compression, 20_000);
        let contents = read_all(&path);
        assert_eq!(contents.messages.len(), 2010, "{compression:?}");
        assert!(contents.messages.is_sorted_by_key(|(_, time, _)| *time));
        assert_eq!(contents.warnings, []);
    }
}

/// Samples come out to the last bit, joints by name, the fix in radians.
#[test]
fn samples_come_back() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    write(&path, 150, Compression::Zstd, 1 << 20);
    let bag = Bag::open(&path).unwrap();
    let mut stream = SensorStream::new(&bag, &SensorOptions::default()).unwrap();
    let (mut rates, mut fixes) = (Vec::new(), Vec::new());
    while let Some(sample) = stream.next().unwrap() {
        match sample {
            Sample::Imu(imu) => rates.push(imu.angular_rate.x),
            Sample::Joints(joints) => assert_eq!(joints.position[0], *rates.last().unwrap()),
            Sample::Velocity(..) => {}
            Sample::Fix(fix) => fixes.push(fix.position.unwrap().latitude_rad),
        }
    }
    assert_eq!(rates, (0..150).map(f64::from).collect::<Vec<_>>());
    assert_eq!(fixes, [45f64.to_radians(); 2]);
}

/// A rotary bag without `.mcap` at its end is a rosbag2 directory with its metadata, and opens with and without them.
#[test]
fn directory_bag() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run");
    write(&path, 10, Compression::Zstd, 1 << 20);
    assert!(path.join("run_0.mcap").is_file());
    assert_eq!(read_all(&path).messages.len(), 21);
    let yaml = path.join("metadata.yaml");
    assert!(fs::read_to_string(&yaml).unwrap().contains("version: 9"));
    fs::remove_file(yaml).unwrap();
    assert_eq!(read_all(&path).messages.len(), 21);
}

/// A second bag in the same directory is refused; a bag that stands alone is not described by another's metadata.
#[test]
fn bags_do_not_mix() {
    let directory = tempfile::tempdir().unwrap();
    write(
        &directory.path().join("a.mcap"),
        10,
        Compression::None,
        1 << 20,
    );
    let error = BagWriter::create(directory.path(), WriteOptions::default())
        .err()
        .unwrap();
    assert!(error.to_string().contains("already holds a bag"), "{error}");
    write(
        &directory.path().join("b.mcap"),
        10,
        Compression::None,
        1 << 20,
    );
    let yaml = fs::read_to_string(directory.path().join("metadata.yaml")).unwrap();
    assert!(yaml.contains("a.mcap") && !yaml.contains("b.mcap"));
}

/// A split bag is one stream, in the order of time whatever the names say; one that lacks a part is refused by its name.
#[test]
fn split_bag() {
    let directory = tempfile::tempdir().unwrap();
    for (name, count) in [("z_first.mcap", 50), ("a_second.mcap", 100)] {
        write(
            &directory.path().join(name),
            count,
            Compression::Zstd,
            10_000,
        );
    }
    let describe = |files: &str| {
        let yaml = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  \
             relative_file_paths: [{files}]\n"
        );
        fs::write(directory.path().join("metadata.yaml"), yaml).unwrap();
    };
    describe("z_first.mcap, a_second.mcap");
    let contents = read_all(directory.path());
    assert_eq!(contents.messages.len(), 50 * 2 + 1 + 100 * 2 + 1);
    assert!(contents.messages.is_sorted_by_key(|(_, time, _)| *time));
    assert!(contents.warnings.is_empty());
    describe("z_first.mcap, gone.mcap, a_second.mcap");
    let error = Bag::open(directory.path()).err().unwrap().to_string();
    assert!(
        error.contains("gone.mcap: not there, but") && !error.contains('\n'),
        "{error}"
    );
}

/// Overlapping chunks are put in the order of log time; messages of one time stay in the order of the file.
#[test]
fn messages_out_of_order() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    let mut bag = BagWriter::create(
        &path,
        WriteOptions {
            compression: Compression::None,
            chunk_bytes: 200,
            ..WriteOptions::default()
        },
    )
    .unwrap();
    let topic = bag
        .add_topic(NewTopic::of::<std_msgs::String>("/text", Qos::reliable(1)))
        .unwrap();
    for time in [5, 1, 3, 4, 2, 6, 9, 8, 7, 7, 1] {
        bag.write(
            topic,
            time,
            &std_msgs::String {
                data: "x".repeat(90),
            },
        )
        .unwrap();
    }
    bag.finish().unwrap();
    let times: Vec<u64> = read_all(&path)
        .messages
        .iter()
        .map(|(_, time, _)| *time)
        .collect();
    assert_eq!(times, [1, 1, 2, 3, 4, 5, 6, 7, 7, 8, 9]);
}

/// Topics and times can be chosen.
#[test]
fn selection() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    write(&path, 300, Compression::Zstd, 5_000);
    let bag = Bag::open(&path).unwrap();
    let fix = bag.topic("fix").unwrap();
    assert_eq!(read(&path, &Selection::topics([fix])).messages.len(), 3);
    let window = Selection::topics([fix]).window(&bag, Some(0.5), Some(1.5));
    let times: Vec<u64> = read(&path, &window)
        .messages
        .iter()
        .map(|(_, time, _)| *time)
        .collect();
    assert_eq!(
        times,
        [FIRST + 1_000_000_000],
        "the end is not part of the window"
    );
}

/// Topics carry schema, hash, quality of service and count.
#[test]
fn topics() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    write(&path, 200, Compression::Zstd, 5_000);
    let bag = Bag::open(&path).unwrap();
    let imu = &bag.topics()[bag.topic("/imu/data_raw").unwrap()];
    let known = known_type("sensor_msgs/msg/Imu").unwrap();
    assert_eq!(
        (imu.type_name.as_str(), imu.encoding.as_str(), imu.count),
        (known.name, "cdr", 200)
    );
    assert_eq!(
        (&imu.schema, imu.type_hash.as_deref()),
        (&(known.schema)(), Some(known.hash))
    );
    assert_eq!(imu.qos, [Qos::reliable(1000)]);
    assert_eq!(bag.time_range(), Some((FIRST, FIRST + 1_990_000_000)));
}

/// A topic of a type that nobody knows is carried as bytes.
#[test]
fn unknown_types_are_carried() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    let mut bag = BagWriter::create(&path, WriteOptions::default()).unwrap();
    let topic = bag
        .add_topic(NewTopic::named("/sonar", "acme_msgs/msg/Ping", vec![]))
        .unwrap();
    bag.write_payload(topic, 1, 1, &[0, 1, 0, 0, 42]).unwrap();
    bag.finish().unwrap();
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.topics()[0].type_name, "acme_msgs/msg/Ping");
    assert_eq!(
        bag.messages(&Selection::default()).next().unwrap().data,
        [0, 1, 0, 0, 42]
    );
}

/// The Imu is found by its type where its name is another; two of them need a choice; the error lists what there is.
#[test]
fn finding_the_imu() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.mcap");
    let mut bag = BagWriter::create(&path, WriteOptions::default()).unwrap();
    bag.add_topic(NewTopic::of::<Imu>("/phins/imu", Qos::reliable(1)))
        .unwrap();
    bag.add_topic(NewTopic::of::<std_msgs::String>("/text", Qos::reliable(1)))
        .unwrap();
    let find = |path, wanted: Option<&str>| {
        Bag::open(path)
            .unwrap()
            .find_topic("sensor_msgs/msg/Imu", "/imu/data_raw", wanted)
    };
    let second = bag
        .add_topic(NewTopic::of::<Imu>("/second/imu", Qos::reliable(1)))
        .unwrap();
    bag.write(second, 1, &Imu::default()).unwrap();
    bag.finish().unwrap();
    assert_eq!(find(&path, Some("second/imu")).unwrap(), 1);
    let error = find(&path, None).unwrap_err();
    assert!(matches!(error, Error::MissingTopic { .. }));
    assert!(error.to_string().ends_with(
        "no topic /imu/data_raw of type sensor_msgs/msg/Imu; the bag has /phins/imu (sensor_msgs/msg/Imu), \
         /second/imu (sensor_msgs/msg/Imu), /text (std_msgs/msg/String)"
    ));
}

/// What is no bag is refused in one line that says what it is.
#[test]
fn what_is_no_bag() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x.db3");
    for (bytes, reason) in [
        (&b""[..], "the file is empty"),
        (b"SQLite format 3\0", "SQLite bag"),
        (b"hello", "not an MCAP file"),
    ] {
        fs::write(&path, bytes).unwrap();
        let error = Bag::open(&path).err().unwrap().to_string();
        assert!(
            error.contains(reason) && error.contains("x.db3") && !error.contains('\n'),
            "{error}"
        );
    }
    let error = Bag::open(directory.path()).err().unwrap().to_string();
    assert!(error.contains("no MCAP file"), "{error}");
    assert!(matches!(
        Bag::open(directory.path().join("gone")),
        Err(Error::Io { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Whatever is written, on whichever topics, in whichever order and packing, is read: all payloads under their topics and times, in
    /// the order of time, and of one topic and time in the order in which they were written. (At most a dozen chunks overlap: so many
    /// the reader puts in order.)
    #[test]
    fn whatever_is_written_is_read(
        written in prop::collection::vec((0usize..3, 0u64..1000, prop::collection::vec(any::<u8>(), 0..200)), 0..80),
        packing in 0usize..3, chunk_bytes in 1500u64..8000,
    ) {
        const TOPICS: [&str; 3] = ["/a", "/b", "/c/d"];
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("any.mcap");
        let compression = [Compression::None, Compression::Lz4, Compression::Zstd][packing];
        let mut bag = BagWriter::create(&path, WriteOptions { compression, chunk_bytes, ..WriteOptions::default() }).unwrap();
        let ids = TOPICS.map(|name| bag.add_topic(NewTopic::of::<Imu>(name, Qos::reliable(1))).unwrap());
        for (topic, time, payload) in &written {
            bag.write_payload(ids[*topic], FIRST + time, FIRST + time, payload).unwrap();
        }
        let summary = bag.finish().unwrap();
        prop_assert_eq!(summary.counts.iter().map(|(_, count)| *count).sum::<u64>(), written.len() as u64);
        let mut expected: Vec<_> = written
            .iter()
            .map(|(topic, time, payload)| (FIRST + time, TOPICS[*topic].to_owned(), payload.clone()))
            .collect();
        let bag = Bag::open(&path).unwrap();
        let mut reader = bag.messages(&Selection::default());
        let mut read = Vec::new();
        while let Some(message) = reader.next() {
            read.push((message.log_time, bag.topics()[message.topic].name.clone(), message.data.to_vec()));
        }
        prop_assert!(reader.warnings().is_empty());
        prop_assert!(read.is_sorted_by_key(|(time, _, _)| *time));
        read.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
        expected.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
        prop_assert_eq!(read, expected);
    }
}
