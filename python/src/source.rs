//! Where samples come from: a bag, which is read as it goes, or a record in memory.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

use bags::{Bag, Sample, SensorOptions, SensorStream};
use pyo3::prelude::*;
use pyo3::types::PyAny;

use crate::errors::{Error, Result};
use crate::record::Record;

/// A bag or a record.
pub enum Source {
    /// A bag by its path.
    Bag(PathBuf),
    /// Samples, with what they are called.
    Samples(String, Arc<Vec<Sample>>),
}

impl Source {
    /// What stands in front of an error about it.
    pub fn name(&self) -> String {
        match self {
            Self::Bag(path) => path.display().to_string(),
            Self::Samples(name, _) => name.clone(),
        }
    }

    /// Hands every sample to `take`, until it breaks. What it refuses is left aside, as a node does it.
    pub fn feed(
        &self,
        mut take: impl FnMut(&Sample) -> std::result::Result<ControlFlow<()>, sins::Error>,
    ) -> Result<()> {
        match self {
            Self::Samples(_, samples) => {
                for sample in &**samples {
                    if matches!(take(sample), Ok(ControlFlow::Break(()))) {
                        break;
                    }
                }
            }
            Self::Bag(path) => {
                let bag = Bag::open(path)?;
                let mut stream = SensorStream::new(&bag, &SensorOptions::default())?;
                loop {
                    match stream.next() {
                        Ok(None) => break,
                        Ok(Some(sample)) => {
                            if matches!(take(&sample), Ok(ControlFlow::Break(()))) {
                                break;
                            }
                        }
                        // One message that cannot be decoded is left aside.
                        Err(bags::Error::Message { .. }) => {}
                        Err(error) => return Err(Error::Bag(error)),
                    }
                }
            }
        }
        Ok(())
    }
}

impl<'py> FromPyObject<'_, 'py> for Source {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(record) = object.cast::<Record>() {
            let record = record.get();
            return Ok(Self::Samples(record.name().to_owned(), record.samples()));
        }
        Ok(Self::Bag(object.extract()?))
    }
}
