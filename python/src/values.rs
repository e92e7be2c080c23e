//! Values of Rust as Python has them: mappings, texts, and arrays of numbers as numpy's.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString};
use serde::Serialize;
use serde_json::{Map, Number, Value};

use crate::errors::Error;

/// Anything that JSON can hold, as mappings, lists and arrays of `float64`. A number that is none in an array is NaN.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let value = serde_json::to_value(value).map_err(|error| Error::File(error.to_string()))?;
    python_of(py, &value)
}

fn python_of<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(value) => PyBool::new(py, *value).to_owned().into_any(),
        Value::Number(number) => number_of(py, number),
        Value::String(text) => PyString::new(py, text).into_any(),
        Value::Array(items) => list_of(py, items)?,
        Value::Object(fields) => {
            let mapping = PyDict::new(py);
            for (key, value) in fields {
                mapping.set_item(key, python_of(py, value)?)?;
            }
            mapping.into_any()
        }
    })
}

fn number_of<'py>(py: Python<'py>, number: &Number) -> Bound<'py, PyAny> {
    match (number.as_i64(), number.as_u64()) {
        (Some(value), _) => PyInt::new(py, value).into_any(),
        (None, Some(value)) => PyInt::new(py, value).into_any(),
        (None, None) => PyFloat::new(py, number.as_f64().unwrap_or(f64::NAN)).into_any(),
    }
}

fn list_of<'py>(py: Python<'py>, items: &[Value]) -> PyResult<Bound<'py, PyAny>> {
    if let Some(row) = floats(items) {
        return Ok(PyArray1::from_vec(py, row).into_any());
    }
    let rows: Option<Vec<Vec<f64>>> = items.iter().map(|v| floats(v.as_array()?)).collect();
    if let Some(rows) = rows
        && let Some(first) = rows.first()
        && rows.iter().all(|row| row.len() == first.len())
    {
        return Ok(PyArray2::from_vec2(py, &rows)
            .map_err(|error| Error::File(error.to_string()))?
            .into_any());
    }
    let list = PyList::empty(py);
    for item in items {
        list.append(python_of(py, item)?)?;
    }
    Ok(list.into_any())
}

/// Numbers with at least one that is not whole by its kind; counts stay a list.
fn floats(items: &[Value]) -> Option<Vec<f64>> {
    items.iter().any(Value::is_f64).then_some(())?;
    let number = |item: &Value| match item {
        Value::Null => Some(f64::NAN),
        item => item.as_f64(),
    };
    items.iter().map(number).collect()
}

/// What Python gives, as JSON: numbers, texts, truth values, mappings, sequences and arrays.
pub fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::Null);
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Bool(value.extract()?));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(Value::String(text));
    }
    if let Ok(mapping) = value.cast::<PyDict>() {
        let mut fields = Map::new();
        for (key, value) in mapping {
            fields.insert(key.extract()?, from_python(&value)?);
        }
        return Ok(Value::Object(fields));
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(Value::from(value.extract::<i64>()?));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Number::from_f64(number)
            .map(Value::Number)
            .ok_or_else(|| Error::Setting(format!("{number} is no finite number")).into());
    }
    let items: PyResult<Vec<Value>> = value.try_iter()?.map(|item| from_python(&item?)).collect();
    Ok(Value::Array(items?))
}

/// An array of rows.
pub fn rows<const N: usize>(
    py: Python<'_>,
    rows: impl IntoIterator<Item = [f64; N]>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let flat: Vec<f64> = rows.into_iter().flatten().collect();
    let count = flat.len() / N;
    PyArray1::from_vec(py, flat).reshape([count, N])
}

/// A 3 × 3 matrix.
pub fn matrix<'py>(
    py: Python<'py>,
    matrix: &nalgebra::Matrix3<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    rows(py, matrix.row_iter().map(|row| [row[0], row[1], row[2]]))
}
