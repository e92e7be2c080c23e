//! Parameters that make up a struct: each is declared once, with the place in the struct that it stands for.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::sync::Arc;

use crate::error::{Error, Result};

use super::declaration::Parameter;
use super::store::Parameters;
use super::unit::Unit;
use super::value::{FromValue, Value};

/// Puts a value where it belongs; the error says what was wrong with it.
type Put<S> = Arc<dyn Fn(&mut S, &Value) -> Result<(), String> + Send + Sync>;

/// Reads a value from where it stands.
type Get<S, V> = fn(&S) -> V;
/// Writes a value to where it stands.
type Set<S, V> = fn(&mut S, V);

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

    /// A quantity.
    #[must_use]
    pub fn number(
        self,
        key: &str,
        unit: Unit,
        range: RangeInclusive<f64>,
        place: fn(&mut S) -> &mut f64,
        words: &str,
    ) -> Self {
        let default = unit.from_si(*place(&mut self.base.clone()));
        self.quantity(key, unit, default, range, words, move |s, value: f64| {
            *place(s) = unit.to_si(value);
            Ok(())
        })
    }

    /// A quantity that may be left open, which the number `none` says.
    #[must_use]
    pub fn optional(
        self,
        key: &str,
        unit: Unit,
        (range, none): (RangeInclusive<f64>, f64),
        place: fn(&mut S) -> &mut Option<f64>,
        words: &str,
    ) -> Self {
        let default = place(&mut self.base.clone()).map_or(none, |si| unit.from_si(si));
        self.quantity(key, unit, default, range, words, move |s, value: f64| {
            *place(s) = (value != none).then(|| unit.to_si(value));
            Ok(())
        })
    }

    /// One quantity for all elements.
    #[must_use]
    pub fn uniform(
        self,
        key: &str,
        unit: Unit,
        range: RangeInclusive<f64>,
        place: fn(&mut S) -> &mut [f64],
        words: &str,
    ) -> Self {
        let first = place(&mut self.base.clone()).first().copied();
        let default = unit.from_si(first.unwrap_or_default());
        self.quantity(key, unit, default, range, words, move |s, value: f64| {
            place(s).fill(unit.to_si(value));
            Ok(())
        })
    }

    /// Quantities, as many as stand in that place.
    #[must_use]
    pub fn numbers(
        self,
        key: &str,
        unit: Unit,
        range: RangeInclusive<f64>,
        place: fn(&mut S) -> &mut [f64],
        words: &str,
    ) -> Self {
        let default: Vec<f64> = place(&mut self.base.clone())
            .iter()
            .map(|si| unit.from_si(*si))
            .collect();
        let length = default.len();
        self.quantity(
            key,
            unit,
            default,
            range,
            words,
            move |s, values: Vec<f64>| {
                let to = place(s).iter_mut();
                to.zip(values)
                    .for_each(|(si, value)| *si = unit.to_si(value));
                Ok(())
            },
        )
        .length(length)
    }

    /// Quantities that do not stand side by side, by what reads and writes them in SI.
    #[must_use]
    pub fn array<const N: usize>(
        self,
        key: &str,
        unit: Unit,
        range: RangeInclusive<f64>,
        (get, set): (Get<S, [f64; N]>, Set<S, [f64; N]>),
        words: &str,
    ) -> Self {
        let default: Vec<f64> = get(&self.base).map(|si| unit.from_si(si)).to_vec();
        self.quantity(
            key,
            unit,
            default,
            range,
            words,
            move |s, values: Vec<f64>| {
                let values: [f64; N] = values
                    .try_into()
                    .map_err(|_| format!("expected {N} elements"))?;
                set(s, values.map(|value| unit.to_si(value)));
                Ok(())
            },
        )
        .length(N)
    }

    /// A whole number.
    #[must_use]
    pub fn count<T>(
        self,
        key: &str,
        range: RangeInclusive<i64>,
        place: fn(&mut S) -> &mut T,
        words: &str,
    ) -> Self
    where
        T: Copy + TryFrom<i64> + TryInto<i64> + 'static,
    {
        let default = *place(&mut self.base.clone());
        // What does not fit is out of range, and refused as such.
        let default: i64 = default.try_into().unwrap_or(i64::MAX);
        self.value(key, default, words, move |s, value: i64| {
            *place(s) = T::try_from(value).map_err(|_| format!("{value} is out of range"))?;
            Ok(())
        })
        .range(*range.start() as f64..=*range.end() as f64)
    }

    /// A switch.
    #[must_use]
    pub fn switch(self, key: &str, place: fn(&mut S) -> &mut bool, words: &str) -> Self {
        let default = *place(&mut self.base.clone());
        self.value(key, default, words, move |s, value: bool| {
            *place(s) = value;
            Ok(())
        })
    }

    /// A text.
    #[must_use]
    pub fn text(self, key: &str, place: fn(&mut S) -> &mut String, words: &str) -> Self {
        let default = place(&mut self.base.clone()).clone();
        self.value(key, default, words, move |s, value: String| {
            *place(s) = value;
            Ok(())
        })
    }

    /// Any number of texts.
    #[must_use]
    pub fn texts(self, key: &str, place: fn(&mut S) -> &mut Vec<String>, words: &str) -> Self {
        let default = place(&mut self.base.clone()).clone();
        self.value(key, default, words, move |s, value: Vec<String>| {
            *place(s) = value;
            Ok(())
        })
    }

    /// One of a few names.
    #[must_use]
    pub fn choice<T>(
        self,
        key: &str,
        allowed: &[&str],
        place: fn(&mut S) -> &mut T,
        words: &str,
    ) -> Self
    where
        T: Display + FromStr<Err: Display> + 'static,
    {
        let default = place(&mut self.base.clone()).to_string();
        self.value(key, default, words, move |s, value: String| {
            *place(s) = value.parse().map_err(|e: T::Err| e.to_string())?;
            Ok(())
        })
        .one_of(allowed)
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

    fn quantity<V: FromValue + Into<Value>>(
        self,
        key: &str,
        unit: Unit,
        default: V,
        range: RangeInclusive<f64>,
        words: &str,
        put: impl Fn(&mut S, V) -> Result<(), String> + Send + Sync + 'static,
    ) -> Self {
        self.value(key, default, words, put).unit(unit).range(range)
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
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::ros_args::Override;
    use crate::yaml::Yaml;

    const DEGREE: Unit = Unit::new("deg", std::f64::consts::PI / 180.0);

    #[derive(Clone, Debug, Default, PartialEq)]
    struct Inner {
        angle_rad: f64,
        sides: [f64; 2],
        noise: [f64; 3],
    }

    #[derive(Clone, Debug, Default, PartialEq)]
    struct Outer {
        inner: Inner,
        window: u16,
        end_s: Option<f64>,
        heard: bool,
        name: String,
        port: u16,
    }

    fn inner() -> ParameterSet<Inner> {
        let base = Inner {
            // Not the double that is nearest to 0.3 deg times PI / 180.
            angle_rad: 0.3 * std::f64::consts::PI / 180.0,
            sides: [1.0, 2.0],
            noise: [0.5; 3],
        };
        ParameterSet::new("Inner", base)
            .number(
                "angle_deg",
                DEGREE,
                -180.0..=180.0,
                |s| &mut s.angle_rad,
                "Angle",
            )
            .numbers("sides_m", Unit::METRE, 0.0..=9.0, |s| &mut s.sides, "Sides")
            .uniform("noise", Unit::NONE, 0.0..=1.0, |s| &mut s.noise, "Noise")
    }

    fn outer() -> ParameterSet<Outer> {
        let base = Outer {
            window: 30,
            name: "a".to_owned(),
            port: 80,
            ..Outer::default()
        };
        ParameterSet::new("Outer", base)
            .include(inner(), |s| &mut s.inner)
            .count("window", 1..=1000, |s| &mut s.window, "Window")
            .optional(
                "end_s",
                Unit::SECOND,
                (-1.0..=1e6, -1.0),
                |s| &mut s.end_s,
                "End; -1: none",
            )
            .switch("heard", |s| &mut s.heard, "Heard")
            .changeable()
            .text("name", |s| &mut s.name, "Name")
            .choice("port", &["80", "443"], |s| &mut s.port, "Port")
    }

    fn with(given: &[(&str, &str)]) -> Result<Outer> {
        let overrides: Vec<_> = given
            .iter()
            .map(|(name, yaml)| Override {
                name: (*name).to_owned(),
                value: Yaml::parse(yaml).unwrap(),
                origin: "-p".to_owned(),
            })
            .collect();
        outer().read(&Parameters::new(outer().declarations(), &overrides)?)
    }

    /// Defaults are those of the struct to the last bit, and those of an included part are the part's.
    #[test]
    fn defaults_stand_in_the_struct() {
        let set = outer();
        let read = set
            .read(&Parameters::defaults(set.declarations()).unwrap())
            .unwrap();
        assert_eq!(&read, set.base());
        assert_eq!(&read.inner, inner().base());
        assert_eq!(set.declarations()[0].default, Value::Double(0.3));
    }

    /// Every kind of value comes to its place, in the unit that the program works with.
    #[test]
    fn values_come_to_their_places() {
        let read = with(&[
            ("angle_deg", "90"),
            ("sides_m", "[3.0, 4.0]"),
            ("noise", "0.25"),
            ("window", "7"),
            ("end_s", "0.0"),
            ("heard", "true"),
            ("name", "b"),
            ("port", "'443'"),
        ])
        .unwrap();
        let expected = Outer {
            inner: Inner {
                angle_rad: std::f64::consts::FRAC_PI_2,
                sides: [3.0, 4.0],
                noise: [0.25; 3],
            },
            window: 7,
            end_s: Some(0.0),
            heard: true,
            name: "b".to_owned(),
            port: 443,
        };
        assert_eq!(read, expected);
    }

    /// A declaration has its group, unit, range, length and choice, and only what is changeable may be set.
    #[test]
    fn declarations_say_everything() {
        let all = outer().declarations();
        let told = |name: &str| {
            let parameter = all.iter().find(|p| p.name() == name).unwrap();
            (
                parameter.expected(),
                parameter.group.clone(),
                parameter.read_only,
            )
        };
        assert_eq!(
            told("sides_m"),
            (
                "array of double of 2 elements from 0.0 to 9.0 [m]".to_owned(),
                "Inner".to_owned(),
                true
            )
        );
        assert_eq!(told("window").0, "integer from 1 to 1000");
        assert_eq!(
            told("port"),
            (
                "string, one of 80, 443".to_owned(),
                "Outer".to_owned(),
                true
            )
        );
        assert!(!told("heard").2);
    }

    /// A default that its own range refuses is a fault of the declaration, and so is a key that stands twice.
    #[test]
    fn faulty_declarations_are_errors() {
        let wide = ParameterSet::new("", 5.0).number("n", Unit::NONE, 0.0..=1.0, |s| s, "");
        let error = Parameters::defaults(wide.declarations()).unwrap_err();
        assert!(
            error.to_string().contains("default: parameter 'n' is 5.0"),
            "{error}"
        );
        let twice = inner().include(inner(), |s| s).declarations();
        let error = Parameters::defaults(twice).unwrap_err().to_string();
        assert!(error.contains("'angle_deg' is declared twice"), "{error}");
    }
}
