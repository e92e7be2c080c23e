//! From the text of a `.msg` file to the description that REP-2016 tools ask for.

use std::fmt::Write;

use sha2::{Digest, Sha256};

use crate::Registry;
use crate::type_description_interfaces::{
    Field, FieldType, IndividualTypeDescription, TypeDescription, TypeSource,
};

/// Of `type_description_interfaces/msg/FieldType`.
const NESTED: u8 = 1;
const FLOAT: u8 = 10;
const DOUBLE: u8 = 11;
const STRING: u8 = 17;
const BOUNDED_STRING: u8 = 21;
const ARRAY: u8 = 48;
const BOUNDED_SEQUENCE: u8 = 96;
const UNBOUNDED_SEQUENCE: u8 = 144;

impl Registry {
    /// Description of a type and all it is made of; `None` where one of them is not registered.
    pub fn description(&self, type_name: &str) -> Option<TypeDescription> {
        Some(TypeDescription {
            type_description: self.individual(type_name)?,
            referenced_type_descriptions: self
                .parts(type_name)?
                .iter()
                .map(|part| self.individual(part))
                .collect::<Option<_>>()?,
        })
    }

    /// The texts of a type and of all it is made of; `None` where one of them is not registered.
    pub fn sources(&self, type_name: &str) -> Option<Vec<TypeSource>> {
        let mut names = vec![type_name.to_owned()];
        names.extend(self.parts(type_name)?);
        let source = |name: String| {
            let definition = self.get(&name)?.definition;
            Some(TypeSource {
                type_name: name,
                encoding: "msg".to_owned(),
                raw_file_contents: definition.to_owned(),
            })
        };
        names.into_iter().map(source).collect()
    }

    /// Names of all types that this one is made of, sorted.
    fn parts(&self, type_name: &str) -> Option<Vec<String>> {
        let mut found: Vec<String> = Vec::new();
        let mut open = vec![type_name.to_owned()];
        while let Some(name) = open.pop() {
            for field in self.individual(&name)?.fields {
                let nested = field.r#type.nested_type_name;
                if !nested.is_empty() && !found.contains(&nested) {
                    found.push(nested.clone());
                    open.push(nested);
                }
            }
        }
        found.sort();
        Some(found)
    }

    fn individual(&self, type_name: &str) -> Option<IndividualTypeDescription> {
        let known = self.get(type_name)?;
        let fields = known.definition.lines().filter_map(field).collect();
        Some(IndividualTypeDescription {
            type_name: type_name.to_owned(),
            fields,
        })
    }
}

/// The REP-2011 hash of a description, `RIHS01_` and 64 hexadecimal digits.
pub fn type_hash(description: &TypeDescription) -> String {
    let digest = Sha256::digest(hashed_text(description).as_bytes());
    digest.iter().fold("RIHS01_".to_owned(), |mut hash, byte| {
        // Writing into a text does not fail.
        let _ = write!(hash, "{byte:02x}");
        hash
    })
}

/// The text that REP-2011 hashes: the description as JSON, without defaults.
fn hashed_text(description: &TypeDescription) -> String {
    let individual = |d: &IndividualTypeDescription| {
        let fields: Vec<String> = d.fields.iter().map(|field| {
            let t = &field.r#type;
            format!(
                r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}}"#,
                field.name, t.type_id, t.capacity, t.string_capacity, t.nested_type_name
            )
        }).collect();
        format!(
            r#"{{"type_name": "{}", "fields": [{}]}}"#,
            d.type_name,
            fields.join(", ")
        )
    };
    let parts: Vec<String> = description
        .referenced_type_descriptions
        .iter()
        .map(individual)
        .collect();
    format!(
        r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
        individual(&description.type_description),
        parts.join(", ")
    )
}

/// The field of a line; `None` for comments, constants and empty lines.
fn field(line: &str) -> Option<Field> {
    let line = line.split('#').next().unwrap_or_default();
    let mut words = line.split_whitespace();
    let (kind, name) = (words.next()?, words.next()?);
    let default = words.collect::<Vec<_>>().join(" ");
    if name.contains('=') || default.starts_with('=') {
        return None;
    }
    let r#type = field_type(kind);
    // rosidl writes defaults of floating-point numbers as such.
    let default_value = match (r#type.type_id, default.parse::<f64>()) {
        (FLOAT | DOUBLE, Ok(value)) => format!("{value:?}"),
        _ => default,
    };
    Some(Field {
        name: name.to_owned(),
        r#type,
        default_value,
    })
}

fn field_type(text: &str) -> FieldType {
    let (element, extent) = text
        .split_once('[')
        .map_or((text, None), |(element, rest)| {
            (element, Some(rest.trim_end_matches(']')))
        });
    let (offset, capacity) = match extent {
        None => (0, 0),
        Some("") => (UNBOUNDED_SEQUENCE, 0),
        Some(extent) => match extent.strip_prefix("<=") {
            Some(bound) => (BOUNDED_SEQUENCE, number(bound)),
            None => (ARRAY, number(extent)),
        },
    };
    let (kind, string_capacity) = match element.split_once("<=") {
        Some((_, bound)) => (BOUNDED_STRING, number(bound)),
        None => (primitive(element).unwrap_or(NESTED), 0),
    };
    FieldType {
        type_id: kind + offset,
        capacity,
        string_capacity,
        nested_type_name: if kind == NESTED {
            element.replacen('/', "/msg/", 1)
        } else {
            String::new()
        },
    }
}

/// Bounds are digits in every definition of this crate, which its tests see to by the hashes.
fn number(text: &str) -> u64 {
    text.parse().unwrap_or(0)
}

fn primitive(name: &str) -> Option<u8> {
    Some(match name {
        "int8" => 2,
        "uint8" | "char" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => FLOAT,
        "float64" => DOUBLE,
        "bool" => 15,
        "byte" => 16,
        "string" => STRING,
        "wstring" => 18,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The hash of every description is the one that `rosbags` and rosidl give the type: no field, bound or part of it
    /// can be otherwise.
    #[test]
    fn descriptions_have_the_hashes_of_their_types() {
        let registry = Registry::standard();
        for known in registry.iter() {
            let description = registry.description(known.name).unwrap();
            assert_eq!(type_hash(&description), known.hash, "{}", known.name);
        }
    }

    /// Sources come with all parts; a type of somebody else is not known.
    #[test]
    fn sources_are_complete() {
        let registry = Registry::standard();
        let names: Vec<String> = registry
            .sources("sensor_msgs/msg/Imu")
            .unwrap()
            .into_iter()
            .map(|source| source.type_name)
            .collect();
        assert_eq!(
            names,
            [
                "sensor_msgs/msg/Imu",
                "builtin_interfaces/msg/Time",
                "geometry_msgs/msg/Quaternion",
                "geometry_msgs/msg/Vector3",
                "std_msgs/msg/Header"
            ]
        );
        assert_eq!(registry.description("sensor_msgs/msg/Image"), None);
    }
}
