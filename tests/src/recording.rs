//! What a bag holds, as messages; and bags with something wrong in them.

use std::path::Path;

use bags::{Bag, BagWriter, NewTopic, Selection, WriteOptions, cdr};
use ros2_interfaces::RosMessage;
use ros2_interfaces::sensor_msgs::Imu;
use rotary_sins_msgs::SelfCalibrationEstimate;

/// All messages of one topic, in the order of the bag. A damaged bag is a failure.
pub fn messages<M: RosMessage>(bag: &Path, topic: &str) -> Vec<M> {
    let bag = Bag::open(bag).unwrap();
    let topic = bag.find_topic(M::TYPE_NAME, topic, Some(topic)).unwrap();
    let mut reader = bag.messages(&Selection::topics([topic]));
    let mut all = Vec::new();
    while let Some(message) = reader.next() {
        all.push(cdr::decode(message.data).unwrap());
    }
    assert!(reader.warnings().is_empty(), "{:?}", reader.warnings());
    all
}

/// All estimates of a recording.
pub fn estimates(bag: &Path) -> Vec<SelfCalibrationEstimate> {
    messages(bag, "/self_calibration/estimate")
}

/// Copies a bag without one topic.
pub fn without_topic(bag: &Path, to: &Path, topic: &str) {
    copy_messages(bag, to, |name, data| {
        (name != topic).then(|| data.to_owned())
    });
}

/// Copies a bag as the run of a ship of this namespace would have been recorded.
pub fn within_namespace(bag: &Path, to: &Path, namespace: &str) {
    let bag = Bag::open(bag).unwrap();
    let mut writer = BagWriter::create(to, WriteOptions::default()).unwrap();
    let mut reader = bag.messages(&Selection::default());
    while let Some(message) = reader.next() {
        let topic = &bag.topics()[message.topic];
        let name = format!("{namespace}{}", topic.name);
        let new = NewTopic::named(&name, &topic.type_name, topic.qos.clone());
        let id = writer.add_topic(new).unwrap();
        writer
            .write_payload(id, message.log_time, message.publish_time, message.data)
            .unwrap();
    }
    writer.finish().unwrap();
}

/// Copies a bag with its Imu messages changed; the change is told which one it has, from 0.
pub fn alter_imu(bag: &Path, to: &Path, change: impl FnMut(usize, &mut Imu)) {
    alter(bag, to, "/imu/data_raw", change);
}

/// Copies a bag with the messages of one topic changed; the change is told which one it has, from 0.
pub fn alter<M: RosMessage>(
    bag: &Path,
    to: &Path,
    topic: &str,
    mut change: impl FnMut(usize, &mut M),
) {
    let mut index = 0;
    copy_messages(bag, to, |name, data| {
        let mut payload = data.to_owned();
        if name == topic {
            let mut message: M = cdr::decode(data).unwrap();
            change(index, &mut message);
            index += 1;
            cdr::encode(&message, &mut payload).unwrap();
        }
        Some(payload)
    });
}

fn copy_messages(bag: &Path, to: &Path, mut copy: impl FnMut(&str, &[u8]) -> Option<Vec<u8>>) {
    let bag = Bag::open(bag).unwrap();
    let mut writer = BagWriter::create(to, WriteOptions::default()).unwrap();
    let mut reader = bag.messages(&Selection::default());
    while let Some(message) = reader.next() {
        let topic = &bag.topics()[message.topic];
        if let Some(payload) = copy(&topic.name, message.data) {
            let new = NewTopic::named(&topic.name, &topic.type_name, topic.qos.clone());
            let id = writer.add_topic(new).unwrap();
            writer
                .write_payload(id, message.log_time, message.publish_time, &payload)
                .unwrap();
        }
    }
    writer.finish().unwrap();
}
