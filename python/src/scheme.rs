//! Rotation schemes as objects.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sins::table::scheme::{About, BUILTIN_NAMES, SegmentKind};
use sins::table::{Axis, Turntable, scheme};

use crate::errors::{Error, Result};

/// Names that ``Scheme(name)`` knows.
#[pyfunction]
pub fn scheme_names() -> Vec<&'static str> {
    BUILTIN_NAMES.to_vec()
}

/// A rotation scheme: ``Scheme("eight-position")`` is a built-in one, ``Scheme.from_yaml(text)`` one of your own, in the format of
/// the manual's page on schemes.
///
/// Raises SchemeError.
#[pyclass(module = "rotary_sins", frozen, eq)]
#[derive(Clone, Debug, PartialEq)]
pub struct Scheme {
    scheme: scheme::Scheme,
}

impl Scheme {
    /// As `sins` has it.
    pub fn inner(&self) -> &scheme::Scheme {
        &self.scheme
    }

    /// The paper's own.
    pub fn eight_position() -> Self {
        Self {
            scheme: scheme::Scheme::eight_position(),
        }
    }

    fn builtin(name: &str) -> Result<Self> {
        let scheme = scheme::Scheme::builtin(name).ok_or_else(|| {
            Error::Sins(sins::Error::Scheme {
                name: name.to_owned(),
                reason: format!("not known, expected one of {}", BUILTIN_NAMES.join(", ")),
            })
        })?;
        Ok(Self { scheme })
    }

    /// The table that was asked for by its axes, or the scheme's own.
    pub fn table(&self, axes: Option<(String, String)>) -> Result<Turntable> {
        let Some((outer, inner)) = axes else {
            return Ok(self.scheme.default_table());
        };
        let axis = |name: &str| name.parse::<Axis>().map_err(Error::Sins);
        Ok(Turntable::new(axis(&outer)?, axis(&inner)?)?)
    }
}

#[pymethods]
impl Scheme {
    #[new]
    fn new(name: &str) -> PyResult<Self> {
        Ok(Self::builtin(name)?)
    }

    /// A scheme from the text of a scheme file; ``name`` is what it is called where the text does not say.
    #[staticmethod]
    #[pyo3(signature = (text, *, name="scheme"))]
    fn from_yaml(text: &str, name: &str) -> PyResult<Self> {
        let scheme = scheme::Scheme::from_yaml(name, text).map_err(Error::Sins)?;
        Ok(Self { scheme })
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.scheme.name
    }

    /// The rotations of one cycle, a mapping each: ``about`` (an axis or a joint) and ``angle_rad``, counter-clockwise positive.
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let mapping = |rotation: &scheme::Rotation| {
            let mapping = PyDict::new(py);
            let about = match rotation.about {
                About::Axis(axis) => axis.to_string(),
                About::Joint(joint) => joint.name().to_owned(),
            };
            mapping.set_item("about", about)?;
            mapping.set_item("angle_rad", rotation.angle_rad)?;
            Ok(mapping)
        };
        self.scheme.rotations.iter().map(mapping).collect()
    }

    /// The time line up to ``duration_s``, a mapping each: ``kind`` (``dwell`` or ``rotation``), ``start_s``, ``end_s``,
    /// ``position``. axes: of the outer and the inner joint, such as ``("x", "y")``.
    #[pyo3(signature = (duration_s, *, axes=None))]
    fn timeline<'py>(
        &self,
        py: Python<'py>,
        duration_s: f64,
        axes: Option<(String, String)>,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let program = self
            .scheme
            .program(self.table(axes)?)
            .map_err(Error::Sins)?;
        let mut timeline = Vec::new();
        for segment in program.segments() {
            let start_s = segment.start_nanos as f64 / 1e9;
            if start_s >= duration_s {
                break;
            }
            let mapping = PyDict::new(py);
            let kind = match segment.kind {
                SegmentKind::Dwell => "dwell",
                SegmentKind::Rotation => "rotation",
            };
            mapping.set_item("kind", kind)?;
            mapping.set_item("start_s", start_s)?;
            mapping.set_item("end_s", segment.end_nanos as f64 / 1e9)?;
            mapping.set_item("position", program.position(segment.step))?;
            timeline.push(mapping);
        }
        Ok(timeline)
    }

    fn __repr__(&self) -> String {
        format!(
            "<Scheme {}: {} rotations>",
            self.scheme.name,
            self.scheme.rotations.len()
        )
    }
}

/// A scheme by its object or its name.
pub struct AnyScheme(pub Scheme);

impl<'py> FromPyObject<'_, 'py> for AnyScheme {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(scheme) = object.cast::<Scheme>() {
            return Ok(Self(scheme.get().clone()));
        }
        Ok(Self(Scheme::builtin(&object.extract::<String>()?)?))
    }
}
