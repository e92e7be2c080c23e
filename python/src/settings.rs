//! Settings from keyword arguments: the names of the structures in `sins`, in SI units, over a default.
//!
//! A group of settings is a mapping, of which only what differs has to be given. One number for an array stands for all of its
//! elements. A matrix is given row by row.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::errors::{Error, Result};
use crate::values::from_python;

/// The default with what was given in its place.
///
/// # Errors
/// [`Error::Setting`] that names the key: one that is not known, or a value of the wrong kind.
pub fn with<T: Serialize + DeserializeOwned>(
    default: &T,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<T> {
    let broken = |error: serde_json::Error| Error::Setting(error.to_string());
    let mut value = serde_json::to_value(default).map_err(broken)?;
    for (key, given) in given.into_iter().flatten() {
        let key: String = key.extract()?;
        put(&mut value, &key, &key, from_python(&given)?)?;
    }
    Ok(serde_json::from_value(value).map_err(broken)?)
}

/// Puts one value into a mapping; `path` is what a person calls it.
fn put(mapping: &mut Value, key: &str, path: &str, given: Value) -> Result<()> {
    let Some(fields) = mapping.as_object_mut() else {
        return Err(Error::Setting(format!(
            "{path} is not known: nothing stands below"
        )));
    };
    if !fields.contains_key(key) {
        let known: Vec<_> = fields.keys().map(String::as_str).collect();
        return Err(Error::Setting(format!(
            "{path} is not known, expected one of {}",
            known.join(", ")
        )));
    }
    let place = &mut fields[key];
    let is_whole = is_choice(place);
    match (&mut *place, given) {
        (Value::Object(_), Value::Object(inner)) if !is_whole => {
            for (key, value) in inner {
                put(place, &key, &format!("{path}.{key}"), value)?;
            }
        }
        (Value::Array(items), Value::Number(number)) => {
            items.fill(Value::Number(number));
        }
        (Value::Array(items), Value::Array(given)) => {
            let flat = by_columns(given);
            if flat.len() != items.len() {
                return Err(Error::Setting(format!(
                    "{path} has {} numbers, expected {}",
                    flat.len(),
                    items.len()
                )));
            }
            *items = flat;
        }
        (place, given) => *place = given,
    }
    Ok(())
}

/// One of several kinds, each with its own fields: `{"Moored": {"sigma_m_s": 0.01}}`. It is given as a whole.
fn is_choice(value: &Value) -> bool {
    let key = value.as_object().filter(|fields| fields.len() == 1);
    key.and_then(|fields| fields.keys().next())
        .is_some_and(|key| key.starts_with(char::is_uppercase))
}

/// A matrix that is given row by row, as `sins` keeps it: column by column.
fn by_columns(given: Vec<Value>) -> Vec<Value> {
    let rows: Option<Vec<&Vec<Value>>> = given.iter().map(Value::as_array).collect();
    match rows {
        Some(rows) if !rows.is_empty() && rows.iter().all(|row| row.len() == rows[0].len()) => (0
            ..rows[0].len())
            .flat_map(|column| rows.iter().map(move |row| row[column].clone()))
            .collect(),
        _ => given,
    }
}
