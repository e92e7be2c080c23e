//! Columns of numbers that Python gives.

use numpy::{AllowTypeChange, PyArrayLike1, PyArrayLike2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::time::Stamp;

use crate::errors::Error;

/// A table of columns by name, such as `{"stamp_ns": ..., "angular_rate": ...}`; `what` is what a person calls it.
pub struct Columns<'a, 'py> {
    what: &'static str,
    table: &'a Bound<'py, PyDict>,
}

impl<'a, 'py> Columns<'a, 'py> {
    /// A table with these columns, of which `stamp_ns` and the first must be there.
    ///
    /// # Errors
    /// Where there is a column of another name.
    pub fn new(
        what: &'static str,
        table: &'a Bound<'py, PyDict>,
        names: &[&str],
    ) -> PyResult<Self> {
        for key in table.keys() {
            let key: String = key.extract()?;
            if key != "stamp_ns" && !names.contains(&key.as_str()) {
                return Err(Error::Setting(format!(
                    "{what} has no column {key}, expected stamp_ns, {}",
                    names.join(", ")
                ))
                .into());
            }
        }
        Ok(Self { what, table })
    }

    fn missing(&self, name: &str, expected: &str) -> PyErr {
        let what = self.what;
        Error::Setting(format!("{what} column {name}: expected {expected}")).into()
    }

    /// The stamps.
    pub fn stamps(&self) -> PyResult<Vec<Stamp>> {
        let expected = "nanoseconds since 1970, int64, shape (n,)";
        let column = self.table.get_item("stamp_ns")?;
        let column = column.ok_or_else(|| self.missing("stamp_ns", expected))?;
        let column: PyArrayLike1<'_, i64> = column
            .extract()
            .map_err(|_| self.missing("stamp_ns", expected))?;
        Ok(column
            .as_array()
            .iter()
            .copied()
            .map(Stamp::from_nanos)
            .collect())
    }

    /// `count` rows of a column; `None` where it is not there.
    pub fn rows<const N: usize>(
        &self,
        name: &str,
        count: usize,
    ) -> PyResult<Option<Vec<[f64; N]>>> {
        let Some(column) = self
            .table
            .get_item(name)?
            .filter(|column| !column.is_none())
        else {
            return Ok(None);
        };
        let expected = || self.missing(name, &format!("float64, shape ({count}, {N})"));
        let column: PyArrayLike2<'_, f64, AllowTypeChange> =
            column.extract().map_err(|_| expected())?;
        let column = column.as_array();
        if column.shape() != [count, N] {
            return Err(expected());
        }
        let rows = column.rows().into_iter();
        Ok(Some(
            rows.map(|row| std::array::from_fn(|k| row[k])).collect(),
        ))
    }

    /// `count` rows of a column that must be there.
    pub fn needed<const N: usize>(&self, name: &str, count: usize) -> PyResult<Vec<[f64; N]>> {
        self.rows(name, count)?
            .ok_or_else(|| self.missing(name, &format!("float64, shape ({count}, {N})")))
    }
}
