//! A small bag, and a way to list what is in one.
#![allow(
    clippy::unwrap_used,
    dead_code,
    reason = "not every test uses all of it"
)]

use std::path::Path;

use bags::{
    Bag, BagSummary, BagWriter, Compression, NewTopic, Qos, Selection, Warning, WriteOptions,
};
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use rotary_sins_msgs::convert::{ToMessage, header};
use sins::{Stamp, table::JointSample};

/// Start of the bags \[ns\].
pub const START: i64 = 1_760_000_000_000_000_000;

/// `count` Imus (rate x counts them) and joints at 100 Hz, a fix every second.
pub fn write(path: &Path, count: u64, compression: Compression, chunk_bytes: u64) -> BagSummary {
    let mut bag = BagWriter::create(
        path,
        WriteOptions {
            compression,
            chunk_bytes,
            ..WriteOptions::default()
        },
    )
    .unwrap();
    let imu = bag
        .add_topic(NewTopic::of::<Imu>("/imu/data_raw", Qos::reliable(1000)))
        .unwrap();
    let joints = bag
        .add_topic(NewTopic::of::<JointState>(
            "/turntable/joint_states",
            Qos::reliable(1000),
        ))
        .unwrap();
    let fix = bag
        .add_topic(NewTopic::of::<NavSatFix>("/fix", Qos::latched(1)))
        .unwrap();
    for i in 0..count {
        let stamp = Stamp::from_nanos(START).plus_nanos(i64::try_from(i).unwrap() * 10_000_000);
        let time = u64::try_from(stamp.nanos()).unwrap();
        let mut message = Imu {
            header: header(stamp, "imu_link"),
            ..Imu::default()
        };
        message.angular_velocity.x = i as f64;
        message.linear_acceleration.z = 9.8;
        bag.write(imu, time, &message).unwrap();
        let sample = JointSample {
            stamp,
            position: [i as f64, -1.0],
            velocity: [0.0; 2],
        };
        bag.write(joints, time, &ToMessage::<JointState>::to_message(&sample))
            .unwrap();
        if i % 100 == 0 {
            let header = header(stamp, "gnss");
            let message = NavSatFix {
                header,
                latitude: 45.0,
                longitude: 126.0,
                altitude: 100.0,
                ..NavSatFix::default()
            };
            bag.write(fix, time, &message).unwrap();
        }
    }
    bag.finish().unwrap()
}

/// What a reader gets: `(topic name, log time, payload length)` of every message, and every warning.
pub struct Contents {
    pub messages: Vec<(String, u64, usize)>,
    pub warnings: Vec<Warning>,
}

pub fn read(path: &Path, selection: &Selection) -> Contents {
    let bag = Bag::open(path).unwrap();
    let mut reader = bag.messages(selection);
    let mut messages = Vec::new();
    while let Some(message) = reader.next() {
        messages.push((
            bag.topics()[message.topic].name.clone(),
            message.log_time,
            message.data.len(),
        ));
    }
    let warnings = bag
        .warnings()
        .iter()
        .chain(reader.warnings())
        .cloned()
        .collect();
    Contents { messages, warnings }
}

pub fn read_all(path: &Path) -> Contents {
    read(path, &Selection::default())
}

pub fn warning_lines(contents: &Contents) -> Vec<String> {
    contents.warnings.iter().map(ToString::to_string).collect()
}
