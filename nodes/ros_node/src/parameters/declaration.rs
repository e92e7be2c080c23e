//! A parameter as a node declares it, once: name, default, description, unit, range, allowed values.

use std::fmt::Write;

use ros2_client::parameters::raw;

use super::value::{ParameterType, Value};

/// A declared parameter.
///
/// ```
/// use ros_node::Parameter;
/// let rate = Parameter::new("rate", 100.0)
///     .describe("sampling rate of the IMU")
///     .unit("Hz")
///     .range(1.0, 400.0);
/// assert!(rate.usage().contains("100.0"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub(crate) name: String,
    pub(crate) group: String,
    pub(crate) default: Value,
    pub(crate) description: String,
    pub(crate) unit: String,
    pub(crate) range: Option<(f64, f64)>,
    pub(crate) allowed: Vec<String>,
    pub(crate) length: Option<usize>,
    pub(crate) read_only: bool,
}

impl Parameter {
    /// A parameter with this default, whose type is that of the default. It is read at the start and cannot be set
    /// later, unless it is [`Self::changeable`].
    pub fn new(name: &str, default: impl Into<Value>) -> Self {
        Self {
            name: name.to_owned(),
            group: String::new(),
            default: default.into(),
            description: String::new(),
            unit: String::new(),
            range: None,
            allowed: Vec::new(),
            length: None,
            read_only: true,
        }
    }

    /// What it is for, in one line.
    #[must_use]
    pub fn describe(mut self, description: &str) -> Self {
        description.clone_into(&mut self.description);
        self
    }

    /// The heading that it stands below, wherever parameters are listed.
    #[must_use]
    pub fn group(mut self, group: &str) -> Self {
        group.clone_into(&mut self.group);
        self
    }

    /// Its unit, e.g. `Hz`.
    #[must_use]
    pub fn unit(mut self, unit: &str) -> Self {
        unit.clone_into(&mut self.unit);
        self
    }

    /// Smallest and largest value of a number, or of every element of an array of numbers.
    #[must_use]
    pub fn range(mut self, from: f64, to: f64) -> Self {
        self.range = Some((from, to));
        self
    }

    /// The only strings it may be, or its elements may be.
    #[must_use]
    pub fn one_of(mut self, allowed: &[&str]) -> Self {
        self.allowed = allowed.iter().map(|&s| s.to_owned()).collect();
        self
    }

    /// Number of elements an array must have.
    #[must_use]
    pub fn length(mut self, length: usize) -> Self {
        self.length = Some(length);
        self
    }

    /// May be set while the node runs; the node reads it again whenever it needs it.
    #[must_use]
    pub fn changeable(mut self) -> Self {
        self.read_only = false;
        self
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The value that it has where nobody gives one.
    pub fn default(&self) -> &Value {
        &self.default
    }

    /// What it is for.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Symbol of its unit; empty where it has none.
    pub fn unit_symbol(&self) -> &str {
        &self.unit
    }

    /// Smallest and largest number that it, or an element of it, may be.
    pub fn bounds(&self) -> Option<(f64, f64)> {
        self.range
    }

    /// The only texts that it, or an element of it, may be; empty: any.
    pub fn choices(&self) -> &[String] {
        &self.allowed
    }

    /// Its type.
    pub fn kind(&self) -> ParameterType {
        self.default.kind()
    }

    /// A value as a command line gives it: elements of an array with commas between them, and one for all where their number is fixed.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(&self, text: &str) -> Result<Value, String> {
        let parts = || text.split(',').map(str::trim);
        let double = |text: &str| text.parse::<f64>().map_err(|_| self.expected());
        let value = match self.kind() {
            ParameterType::Bool => Value::Bool(text.parse().map_err(|_| self.expected())?),
            ParameterType::Integer => Value::Integer(text.parse().map_err(|_| self.expected())?),
            ParameterType::Double => Value::Double(double(text)?),
            ParameterType::String => Value::String(text.to_owned()),
            ParameterType::DoubleArray => {
                let values: Vec<f64> = parts().map(double).collect::<Result<_, _>>()?;
                Value::DoubleArray(match (values.as_slice(), self.length) {
                    (&[all], Some(length)) => vec![all; length],
                    _ => values,
                })
            }
            ParameterType::StringArray => Value::StringArray(parts().map(str::to_owned).collect()),
            ParameterType::BoolArray | ParameterType::IntegerArray => {
                return Err("an array that a command line cannot give".to_owned());
            }
        };
        self.check(&value).map(|()| value)
    }

    /// What a value must be, for a person: type, range or choice, unit.
    pub fn expected(&self) -> String {
        let mut text = self.kind().name().to_owned();
        if let Some(length) = self.length {
            write!(text, " of {length} elements").ok();
        }
        if let Some((from, to)) = self.range {
            match self.kind() {
                ParameterType::Integer | ParameterType::IntegerArray => {
                    write!(text, " from {from} to {to}").ok()
                }
                _ => write!(text, " from {from:?} to {to:?}").ok(),
            };
        }
        if !self.allowed.is_empty() {
            write!(text, ", one of {}", self.allowed.join(", ")).ok();
        }
        if !self.unit.is_empty() {
            write!(text, " [{}]", self.unit).ok();
        }
        text
    }

    /// Whether a value of the right type also has the right size. The error is what was expected.
    pub(crate) fn check(&self, value: &Value) -> Result<(), String> {
        let within = |value: f64| match self.range {
            Some((from, to)) => value >= from && value <= to,
            None => true,
        };
        let allowed = |value: &String| self.allowed.is_empty() || self.allowed.contains(value);
        let of_length = |length: usize| self.length.is_none_or(|expected| expected == length);
        let good = value.kind() == self.kind()
            && match value {
                Value::Bool(_) => true,
                Value::Integer(value) => within(*value as f64),
                Value::Double(value) => value.is_finite() && within(*value),
                Value::String(value) => allowed(value),
                Value::BoolArray(values) => of_length(values.len()),
                Value::IntegerArray(values) => {
                    of_length(values.len()) && values.iter().all(|v| within(*v as f64))
                }
                Value::DoubleArray(values) => {
                    of_length(values.len()) && values.iter().all(|v| v.is_finite() && within(*v))
                }
                Value::StringArray(values) => of_length(values.len()) && values.iter().all(allowed),
            };
        if good { Ok(()) } else { Err(self.expected()) }
    }

    /// Its lines in the usage text.
    pub fn usage(&self) -> String {
        let mut text = format!(
            "  {} (default {}): {}",
            self.name,
            self.default,
            self.limits()
        );
        if !self.description.is_empty() {
            write!(text, "\n      {}", self.description).ok();
        }
        text
    }

    /// What a value must be, and whether it may change.
    pub(crate) fn limits(&self) -> String {
        let changeable = if self.read_only {
            ""
        } else {
            ", may be set while running"
        };
        format!("{}{changeable}", self.expected())
    }

    /// As `describe_parameters` answers.
    pub(crate) fn descriptor(&self) -> raw::ParameterDescriptor {
        let mut constraints = Vec::new();
        if !self.unit.is_empty() {
            constraints.push(format!("unit {}", self.unit));
        }
        if !self.allowed.is_empty() {
            constraints.push(format!("one of {}", self.allowed.join(", ")));
        }
        if let Some(length) = self.length {
            constraints.push(format!("{length} elements"));
        }
        let is_integer = matches!(
            self.kind(),
            ParameterType::Integer | ParameterType::IntegerArray
        );
        raw::ParameterDescriptor {
            name: self.name.clone(),
            r#type: self.kind() as u8,
            description: self.description.clone(),
            additional_constraints: constraints.join("; "),
            read_only: self.read_only,
            dynamic_typing: false,
            floating_point_range: self
                .range
                .filter(|_| !is_integer)
                .map(|(from_value, to_value)| raw::FloatingPointRange {
                    from_value,
                    to_value,
                    step: 0.0,
                })
                .into_iter()
                .collect(),
            integer_range: self
                .range
                .filter(|_| is_integer)
                .map(|(from, to)| raw::IntegerRange {
                    from_value: from as i64,
                    to_value: to as i64,
                    step: 1,
                })
                .into_iter()
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A command line gives numbers, words and lists; what does not fit is refused by what was expected.
    #[test]
    fn values_of_a_command_line() {
        let rate = Parameter::new("rate", 1.0).range(0.0, 10.0).unit("Hz");
        assert_eq!(rate.parse("3").unwrap(), Value::Double(3.0));
        for wrong in ["fast", "11", "NaN", ""] {
            assert_eq!(
                rate.parse(wrong).unwrap_err(),
                "double from 0.0 to 10.0 [Hz]"
            );
        }
        let axes = Parameter::new("axes", vec![0.0; 3]).length(3);
        assert_eq!(axes.parse("1,-2, 3").unwrap(), vec![1.0, -2.0, 3.0].into());
        assert_eq!(axes.parse("4").unwrap(), vec![4.0; 3].into());
        assert!(axes.parse("1,2").is_err());
        let name = Parameter::new("name", "a").one_of(&["a", "b"]);
        assert_eq!(name.parse("b").unwrap(), "b".into());
        assert!(name.parse("c").unwrap_err().contains("one of a, b"));
    }
}
