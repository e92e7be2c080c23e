//! The structures are what rosidl makes of the definitions.
#![allow(clippy::unwrap_used)]

use std::process::Command;

use ros2_interfaces::{Registry, RosMessage, control_msgs, sensor_msgs, type_hash};
use rotary_sins_msgs::{
    KNOWN_TYPES, SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult, known_type,
    register, registry, with_known_types,
};
use serde::Deserialize;
use serde::de::{Deserializer, Error as _, Visitor, value::Error};

/// Stops at the first structure, with the names of its fields as the error.
struct FieldNames;

impl<'de> Deserializer<'de> for FieldNames {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(Error::custom("not a structure"))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Error> {
        Err(Error::custom(fields.join(" ")))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

/// Names of the fields (constants left out) in a definition.
fn fields_of(definition: &str) -> String {
    definition
        .lines()
        .map(|line| line.split('#').next().unwrap_or_default())
        .filter(|line| !line.contains('='))
        .filter_map(|line| line.split_whitespace().nth(1))
        .collect::<Vec<_>>()
        .join(" ")
}

fn assert_fields<M: RosMessage>() -> &'static str {
    let fields = M::deserialize(FieldNames).err().unwrap().to_string();
    assert_eq!(fields, fields_of(M::DEFINITION), "{}", M::TYPE_NAME);
    M::TYPE_NAME
}

macro_rules! assert_fields {
    ($($type:ty),* $(,)?) => { [$(assert_fields::<$type>()),*] };
}

/// Every structure has the fields of its definition in their order, and every known type is looked at here.
#[test]
fn fields_follow_the_definitions() {
    let checked = with_known_types!(assert_fields);
    assert_eq!(
        checked.to_vec(),
        KNOWN_TYPES
            .iter()
            .map(|known| known.name)
            .collect::<Vec<_>>()
    );
}

/// The same for the parts of actions.
#[test]
fn fields_of_action_parts_follow_the_definitions() {
    let mut checked = assert_fields![
        SelfCalibrateGoal,
        SelfCalibrateResult,
        SelfCalibrateFeedback,
        control_msgs::FollowJointTrajectoryGoal,
        control_msgs::FollowJointTrajectoryResult,
        control_msgs::FollowJointTrajectoryFeedback,
    ];
    checked.sort_unstable();
    let parts = registry().iter().map(|known| known.name);
    let parts: Vec<&str> = parts.filter(|name| name.contains("/action/")).collect();
    assert_eq!(checked.to_vec(), parts);
}

/// What every version of control_msgs begins the feedback with is the beginning of ours, byte for byte.
#[test]
fn progress_is_the_head_of_the_feedback() {
    let head = control_msgs::FollowJointTrajectoryProgress::deserialize(FieldNames);
    let head = head.err().unwrap().to_string();
    let whole = fields_of(control_msgs::FollowJointTrajectoryFeedback::DEFINITION);
    assert!(whole.starts_with(&format!("{head} ")), "{head} / {whole}");
}

/// Every type that a schema mentions is defined in it, exactly once.
#[test]
fn schemas_are_complete() {
    for known in registry().iter() {
        let schema = (known.schema)();
        let parts: Vec<&str> = schema
            .lines()
            .filter_map(|line| line.strip_prefix("MSG: "))
            .collect();
        let mut mentioned: Vec<&str> = schema
            .lines()
            .filter(|line| !line.starts_with(['#', '=', 'M']))
            .filter_map(|line| {
                line.split([' ', '['])
                    .next()
                    .filter(|word| word.contains('/'))
            })
            .collect();
        mentioned.sort_unstable();
        mentioned.dedup();
        let mut sorted = parts.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, mentioned, "{}", known.name);
    }
}

/// The registry of the suite has every type that topics carry, and no hash but that of the definition.
#[test]
fn the_registry_is_whole() {
    let mut own = Registry::standard();
    register(&mut own).unwrap();
    for known in KNOWN_TYPES {
        let description = own.description(known.name).unwrap();
        assert_eq!(type_hash(&description), known.hash, "{}", known.name);
    }
    assert_eq!(own.iter().count(), KNOWN_TYPES.len() + 6);
    assert_eq!(registry().iter().count(), own.iter().count());
}

/// The schema of an Imu has its parts behind lines of 80 `=`, as rosbag2 wants them.
#[test]
fn schema_of_an_imu() {
    let schema = sensor_msgs::Imu::schema();
    let parts: Vec<&str> = schema
        .split(&format!("{}\nMSG: ", "=".repeat(80)))
        .collect();
    let names: Vec<&str> = parts
        .iter()
        .skip(1)
        .map(|part| part.lines().next().unwrap())
        .collect();
    assert_eq!(
        names,
        [
            "std_msgs/Header",
            "builtin_interfaces/Time",
            "geometry_msgs/Quaternion",
            "geometry_msgs/Vector3"
        ]
    );
    assert!(parts[0].starts_with("std_msgs/Header header\n"));
}

/// The hash of every type is the one that another implementation computes from its definition, and the standard
/// definitions are those of ROS 2 Jazzy. Needs Python with `rosbags` (ROTARY_SINS_PYTHON, else python3).
#[test]
fn type_hashes_match_rosbags() {
    let python = std::env::var("ROTARY_SINS_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_rosbags = Command::new(&python)
        .args(["-c", "import rosbags"])
        .output()
        .is_ok_and(|o| o.status.success());
    if !has_rosbags {
        println!("skipped: {python} has no rosbags");
        return;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/type_hashes.py");
    let output = Command::new(&python).arg(script).output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), KNOWN_TYPES.len());
    for line in text.lines() {
        let (name, hash) = line.split_once(' ').unwrap();
        assert_eq!(known_type(name).unwrap().hash, hash, "{name}");
    }
}
