//! Parameters that make up a struct: each is declared once, with the place in the struct that it stands for.

use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::error::{Error, Result};

use super::declaration::Parameter;
use super::store::Parameters;
use super::unit::Unit;
use super::value::{FromValue, Value};

/// Puts a value where it belongs; the error says what was wrong with it.
type Put<S> = Arc<dyn Fn(&mut S, &Value) -> Result<(), String> + Send + Sync>;

/// The parameters that make up an `S`.
///
/// A declaration is one call: key, unit, range, place, words. Its default is what stands in that place of the `S` that
/// the set is made of, so that every number stands once. What a node, `--help`, a parameter file, a table or a command
/// line wants to know of it is in [`Self::declarations`]; [`Self::read`] makes the struct, after which nobody looks
/// anything up by name.
///
/// ```
/// use ros_node::{ParameterSet, Parameters, Unit};
///
/// #[derive(Clone)]
/// struct Settings { turn_rad: f64, window: usize }
///
/// let set = ParameterSet::new("Test", Settings { turn_rad: 0.1_f64.to_radians(), window: 300 })
///     .number("turn_deg", Unit::new("deg", 1_f64.to_radians()), 0.1..=180.0, |s| &mut s.turn_rad, "Turn that counts")
///     .count("window_updates", 10..=100_000, |s| &mut s.window, "Length of the test");
/// assert!(set.declarations()[0].usage().contains("turn_deg (default 0.1): double from 0.1 to 180.0 [deg]"));
/// let settings = set.read(&Parameters::defaults(set.declarations())?)?;
/// assert_eq!(settings.window, 300);
/// # Ok::<(), ros_node::Error>(())
/// ```
#[derive(Clone)]
pub struct ParameterSet<S> {
    base: S,
    group: &'static str,
    entries: Vec<Entry<S>>,
}

#[derive(Clone)]
struct Entry<S> {
    parameter: Parameter,
    put: Put<S>,
}

impl<S: Clone + 'static> ParameterSet<S> {
    /// No parameters yet; `base` holds their defaults, `group` is the heading above those that follow.
    pub fn new(group: &'static str, base: S) -> Self {
        Self {
            base,
            group,
            entries: Vec::new(),
        }
    }

    /// Another heading for what follows.
    #[must_use]
    pub fn group(mut self, group: &'static str) -> Self {
        self.group = group;
        self
    }

    /// Anything else: its default as people write it, and what puts a value where it belongs.
    #[must_use]
    pub fn value<V>(
        mut self,
        key: &str,
        default: V,
        words: &str,
        put: impl Fn(&mut S, V) -> Result<(), String> + Send + Sync + 'static,
    ) -> Self
    where
        V: FromValue + Into<Value>,
    {
        let parameter = Parameter::new(key, default)
            .describe(words)
            .group(self.group);
        self.entries.push(Entry {
            parameter,
            put: Arc::new(move |s, value| {
                let value = V::from_value(value).ok_or_else(|| format!("expected {}", V::EXPECTED));
                put(s, value?)
            }),
        });
        self
    }

    /// Smallest and largest value of the last parameter.
    #[must_use]
    pub fn range(self, range: RangeInclusive<f64>) -> Self {
        self.last(|parameter| parameter.range(*range.start(), *range.end()))
    }

    /// Unit of the last parameter, which is not converted.
    #[must_use]
    pub fn unit(self, unit: Unit) -> Self {
        self.last(|parameter| parameter.unit(unit.symbol()))
    }

    /// The only texts that the last parameter, or its elements, may be.
    #[must_use]
    pub fn one_of(self, allowed: &[&str]) -> Self {
        self.last(|parameter| parameter.one_of(allowed))
    }

    /// Number of elements of the last parameter.
    #[must_use]
    pub fn length(self, length: usize) -> Self {
        self.last(|parameter| parameter.length(length))
    }

    /// The last parameter may be set while the node runs; the node reads the set again whenever it needs it.
    #[must_use]
    pub fn changeable(self) -> Self {
        self.last(Parameter::changeable)
    }

    /// The parameters of another set, for a part of this one. Their defaults become those of the part.
    #[must_use]
    pub fn include<T: Clone + 'static>(
        mut self,
        other: ParameterSet<T>,
        part: fn(&mut S) -> &mut T,
    ) -> Self {
        *part(&mut self.base) = other.base;
        for Entry { parameter, put } in other.entries {
            self.entries.push(Entry {
                parameter,
                put: Arc::new(move |s, value| put(part(s), value)),
            });
        }
        self
    }

    /// Without these parameters; what they stand for keeps its default.
    #[must_use]
    pub fn without(mut self, keys: &[&str]) -> Self {
        self.entries
            .retain(|entry| !keys.contains(&entry.parameter.name()));
        self
    }

    /// What the parameters are by default.
    pub fn base(&self) -> &S {
        &self.base
    }

    /// The parameters, for [`crate::NodeBuilder::parameters`] and everything that shows them.
    pub fn declarations(&self) -> Vec<Parameter> {
        self.entries
            .iter()
            .map(|entry| entry.parameter.clone())
            .collect()
    }

    /// The struct that the values of a node amount to. What has its default is the base's to the last bit.
    ///
    /// # Errors
    /// [`Error::NotDeclared`] where the node did not declare them; [`Error::ParameterMeaning`] for a value that means
    /// nothing.
    pub fn read(&self, parameters: &Parameters) -> Result<S> {
        let mut result = self.base.clone();
        for entry in &self.entries {
            let name = entry.parameter.name();
            let value = parameters.value(name).ok_or_else(|| Error::NotDeclared {
                name: name.to_owned(),
                expected: entry.parameter.kind().name(),
            })?;
            entry.put(&mut result, &value)?;
        }
        Ok(result)
    }

    /// Puts one value where it belongs, whatever the rest is.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn put(&self, to: &mut S, name: &str, value: &Value) -> Result<()> {
        let entry = self.entries.iter().find(|e| e.parameter.name() == name);
        let entry = entry.ok_or_else(|| Error::NotDeclared {
            name: name.to_owned(),
            expected: value.kind().name(),
        })?;
        (entry.put)(to, value).map_err(|reason| entry.meaning(reason))
    }

    fn last(mut self, change: impl FnOnce(Parameter) -> Parameter) -> Self {
        if let Some(entry) = self.entries.last_mut() {
            entry.parameter = change(entry.parameter.clone());
        }
        self
    }
}

impl<S> Entry<S> {
    /// A value that is not the default: that one stands in the base already, without a rounded conversion.
    fn put(&self, to: &mut S, value: &Value) -> Result<()> {
        if *value == self.parameter.default {
            return Ok(());
        }
        (self.put)(to, value).map_err(|reason| self.meaning(reason))
    }

    fn meaning(&self, reason: String) -> Error {
        Error::ParameterMeaning {
            name: self.parameter.name.clone(),
            reason,
        }
    }
}

#[cfg(test)]
#[path = "set_tests.rs"]
mod tests;
