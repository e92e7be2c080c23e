//! Log lines and parameter events, as the topics `/rosout` and `/parameter_events` carry them.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;
use crate::ros_message;

/// A line of a node's log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Log {
    /// When.
    pub stamp: Time,
    /// One of `DEBUG`, `INFO`, `WARN`, `ERROR`, `FATAL`.
    pub level: u8,
    /// The logger.
    pub name: String,
    /// The line.
    pub msg: String,
    /// Source file.
    pub file: String,
    /// Source function.
    pub function: String,
    /// Source line.
    pub line: u32,
}

impl Log {
    /// For the developer.
    pub const DEBUG: u8 = 10;
    /// For the record.
    pub const INFO: u8 = 20;
    /// Something is odd.
    pub const WARN: u8 = 30;
    /// Something failed.
    pub const ERROR: u8 = 40;
    /// The node ends.
    pub const FATAL: u8 = 50;
}

/// A value of any of the parameter types.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Which of the fields counts (rcl_interfaces/ParameterType).
    pub r#type: u8,
    /// Type 1.
    pub bool_value: bool,
    /// Type 2.
    pub integer_value: i64,
    /// Type 3.
    pub double_value: f64,
    /// Type 4.
    pub string_value: String,
    /// Type 5.
    pub byte_array_value: Vec<u8>,
    /// Type 6.
    pub bool_array_value: Vec<bool>,
    /// Type 7.
    pub integer_array_value: Vec<i64>,
    /// Type 8.
    pub double_array_value: Vec<f64>,
    /// Type 9.
    pub string_array_value: Vec<String>,
}

/// A named parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: ParameterValue,
}

/// What changed among a node's parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterEvent {
    /// When.
    pub stamp: Time,
    /// Full name of the node.
    pub node: String,
    /// Declared.
    pub new_parameters: Vec<Parameter>,
    /// Set.
    pub changed_parameters: Vec<Parameter>,
    /// Undeclared.
    pub deleted_parameters: Vec<Parameter>,
}

ros_message!(
    Log,
    "rcl_interfaces/msg/Log",
    include_str!("../definitions/rcl_interfaces/Log.msg"),
    "RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac",
    [Time]
);
ros_message!(
    ParameterValue,
    "rcl_interfaces/msg/ParameterValue",
    include_str!("../definitions/rcl_interfaces/ParameterValue.msg"),
    "RIHS01_115fc089a387e23c7ecd3525c9189c379109119d6ab82e8dfbde0fdf6a7f9b68",
    []
);
ros_message!(
    Parameter,
    "rcl_interfaces/msg/Parameter",
    include_str!("../definitions/rcl_interfaces/Parameter.msg"),
    "RIHS01_ddfe6442cffc462317adb5c92536a7b6dd55858c5c3e1e328165a6b73c2831af",
    [ParameterValue]
);
ros_message!(
    ParameterEvent,
    "rcl_interfaces/msg/ParameterEvent",
    include_str!("../definitions/rcl_interfaces/ParameterEvent.msg"),
    "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204",
    [Time, Parameter]
);
