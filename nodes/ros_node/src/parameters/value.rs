//! Values of parameters, their types, and their way to and from messages.

use std::fmt;

use ros2_client::parameters::raw;

use crate::yaml::Yaml;

/// Types of parameters, with the numbers of `rcl_interfaces/msg/ParameterType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterType {
    /// `bool`.
    Bool = 1,
    /// `i64`.
    Integer = 2,
    /// `f64`.
    Double = 3,
    /// `String`.
    String = 4,
    /// `Vec<bool>`.
    BoolArray = 6,
    /// `Vec<i64>`.
    IntegerArray = 7,
    /// `Vec<f64>`.
    DoubleArray = 8,
    /// `Vec<String>`.
    StringArray = 9,
}

impl ParameterType {
    /// Its name for a person.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Integer => "integer",
            Self::Double => "double",
            Self::String => "string",
            Self::BoolArray => "array of bool",
            Self::IntegerArray => "array of integer",
            Self::DoubleArray => "array of double",
            Self::StringArray => "array of string",
        }
    }
}

/// A value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A switch.
    Bool(bool),
    /// A count or a choice.
    Integer(i64),
    /// A quantity.
    Double(f64),
    /// A name.
    String(String),
    /// Switches.
    BoolArray(Vec<bool>),
    /// Counts.
    IntegerArray(Vec<i64>),
    /// Quantities.
    DoubleArray(Vec<f64>),
    /// Names.
    StringArray(Vec<String>),
}

impl Value {
    /// Its type.
    pub const fn kind(&self) -> ParameterType {
        match self {
            Self::Bool(_) => ParameterType::Bool,
            Self::Integer(_) => ParameterType::Integer,
            Self::Double(_) => ParameterType::Double,
            Self::String(_) => ParameterType::String,
            Self::BoolArray(_) => ParameterType::BoolArray,
            Self::IntegerArray(_) => ParameterType::IntegerArray,
            Self::DoubleArray(_) => ParameterType::DoubleArray,
            Self::StringArray(_) => ParameterType::StringArray,
        }
    }

    /// A YAML value as the declared type; integers serve as doubles. `None` where the type is another.
    pub(crate) fn from_yaml(yaml: &Yaml, kind: ParameterType) -> Option<Self> {
        let double = |yaml: &Yaml| match yaml {
            Yaml::Double(value) => Some(*value),
            Yaml::Int(value) => Some(*value as f64),
            _ => None,
        };
        let integer = |yaml: &Yaml| {
            if let Yaml::Int(value) = yaml {
                Some(*value)
            } else {
                None
            }
        };
        let boolean = |yaml: &Yaml| {
            if let Yaml::Bool(value) = yaml {
                Some(*value)
            } else {
                None
            }
        };
        let string = |yaml: &Yaml| {
            if let Yaml::String(value) = yaml {
                Some(value.clone())
            } else {
                None
            }
        };
        let sequence = if let Yaml::Sequence(values) = yaml {
            Some(values)
        } else {
            None
        };
        match kind {
            ParameterType::Bool => boolean(yaml).map(Self::Bool),
            ParameterType::Integer => integer(yaml).map(Self::Integer),
            ParameterType::Double => double(yaml).map(Self::Double),
            ParameterType::String => string(yaml).map(Self::String),
            ParameterType::BoolArray => sequence?
                .iter()
                .map(boolean)
                .collect::<Option<_>>()
                .map(Self::BoolArray),
            ParameterType::IntegerArray => sequence?
                .iter()
                .map(integer)
                .collect::<Option<_>>()
                .map(Self::IntegerArray),
            ParameterType::DoubleArray => sequence?
                .iter()
                .map(double)
                .collect::<Option<_>>()
                .map(Self::DoubleArray),
            ParameterType::StringArray => sequence?
                .iter()
                .map(string)
                .collect::<Option<_>>()
                .map(Self::StringArray),
        }
    }

    /// From a message; `None` for a type that no parameter of ours has (byte arrays, not set).
    pub(crate) fn from_message(message: &raw::ParameterValue) -> Option<Self> {
        Some(match message.ptype {
            raw::ParameterType::BOOL => Self::Bool(message.boolean_value),
            raw::ParameterType::INTEGER => Self::Integer(message.int_value),
            raw::ParameterType::DOUBLE => Self::Double(message.double_value),
            raw::ParameterType::STRING => Self::String(message.string_value.clone()),
            raw::ParameterType::BOOL_ARRAY => Self::BoolArray(message.bool_array.clone()),
            raw::ParameterType::INTEGER_ARRAY => Self::IntegerArray(message.int_array.clone()),
            raw::ParameterType::DOUBLE_ARRAY => Self::DoubleArray(message.double_array.clone()),
            raw::ParameterType::STRING_ARRAY => Self::StringArray(message.string_array.clone()),
            _ => return None,
        })
    }

    pub(crate) fn to_message(&self) -> raw::ParameterValue {
        let mut message = not_set();
        message.ptype = self.kind() as u8;
        match self.clone() {
            Self::Bool(value) => message.boolean_value = value,
            Self::Integer(value) => message.int_value = value,
            Self::Double(value) => message.double_value = value,
            Self::String(value) => message.string_value = value,
            Self::BoolArray(values) => message.bool_array = values,
            Self::IntegerArray(values) => message.int_array = values,
            Self::DoubleArray(values) => message.double_array = values,
            Self::StringArray(values) => message.string_array = values,
        }
        message
    }
}

/// The value of a parameter that does not exist.
pub(crate) fn not_set() -> raw::ParameterValue {
    raw::ParameterValue {
        ptype: raw::ParameterType::NOT_SET,
        boolean_value: false,
        int_value: 0,
        double_value: 0.0,
        string_value: String::new(),
        byte_array: Vec::new(),
        bool_array: Vec::new(),
        int_array: Vec::new(),
        double_array: Vec::new(),
        string_array: Vec::new(),
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Double(value) => write!(f, "{value:?}"),
            Self::String(value) => write!(f, "'{value}'"),
            Self::BoolArray(values) => write!(f, "{values:?}"),
            Self::IntegerArray(values) => write!(f, "{values:?}"),
            Self::DoubleArray(values) => write!(f, "{values:?}"),
            Self::StringArray(values) => write!(f, "{values:?}"),
        }
    }
}

/// Rust types that parameters are read as.
pub trait FromValue: Sized {
    /// Its name for a person.
    const EXPECTED: &'static str;
    /// `None` where the value is of another type.
    fn from_value(value: &Value) -> Option<Self>;
}

macro_rules! from_value {
    ($($type:ty, $variant:ident, $name:literal);* $(;)?) => {$(
        impl FromValue for $type {
            const EXPECTED: &'static str = $name;
            fn from_value(value: &Value) -> Option<Self> {
                if let Value::$variant(value) = value { Some(value.clone()) } else { None }
            }
        }
        impl From<$type> for Value {
            fn from(value: $type) -> Self {
                Self::$variant(value)
            }
        }
    )*};
}

from_value! {
    bool, Bool, "bool";
    i64, Integer, "integer";
    f64, Double, "double";
    String, String, "string";
    Vec<bool>, BoolArray, "array of bool";
    Vec<i64>, IntegerArray, "array of integer";
    Vec<f64>, DoubleArray, "array of double";
    Vec<String>, StringArray, "array of string";
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::String(value.to_owned())
    }
}

impl From<Vec<&str>> for Value {
    fn from(values: Vec<&str>) -> Self {
        Self::StringArray(values.into_iter().map(str::to_owned).collect())
    }
}
