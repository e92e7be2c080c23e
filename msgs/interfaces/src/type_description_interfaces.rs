//! What a node tells of its types: `~/get_type_description`.

use serde::{Deserialize, Serialize};

use crate::ros_service_part;

/// The type of a field.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldType {
    /// Kind, plus 48 for an array, 96 for a bounded and 144 for an unbounded sequence of it.
    pub type_id: u8,
    /// Elements of an array, most elements of a bounded sequence, else 0.
    pub capacity: u64,
    /// Most characters of a bounded string, else 0.
    pub string_capacity: u64,
    /// Full name of a type that is itself made of fields.
    pub nested_type_name: String,
}

/// A field.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its type.
    pub r#type: FieldType,
    /// Its default as text; empty where there is none.
    pub default_value: String,
}

/// A type without those it is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct IndividualTypeDescription {
    /// Full name, e.g. `sensor_msgs/msg/Imu`.
    pub type_name: String,
    /// In their order.
    pub fields: Vec<Field>,
}

/// A type with all it is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TypeDescription {
    /// The type.
    pub type_description: IndividualTypeDescription,
    /// Those it is made of, by name.
    pub referenced_type_descriptions: Vec<IndividualTypeDescription>,
}

/// The text a type was made from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TypeSource {
    /// Full name.
    pub type_name: String,
    /// `msg`.
    pub encoding: String,
    /// The text.
    pub raw_file_contents: String,
}

/// A remark of the node on its answer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// Its name.
    pub key: String,
    /// The value as text.
    pub value: String,
}

/// Request of `type_description_interfaces/srv/GetTypeDescription`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetTypeDescriptionRequest {
    /// Full name.
    pub type_name: String,
    /// REP-2011 hash of the type that is meant.
    pub type_hash: String,
    /// Whether the texts are wanted too.
    pub include_type_sources: bool,
}

/// Response of `type_description_interfaces/srv/GetTypeDescription`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetTypeDescriptionResponse {
    /// The type is known.
    pub successful: bool,
    /// Why not.
    pub failure_reason: String,
    /// The description.
    pub type_description: TypeDescription,
    /// The texts, where they were asked for.
    pub type_sources: Vec<TypeSource>,
    /// Remarks.
    pub extra_information: Vec<KeyValue>,
}

ros_service_part!(GetTypeDescriptionRequest);
ros_service_part!(GetTypeDescriptionResponse);
