//! The kinds of parameters that a [`ParameterSet`] has calls for: quantities, counts, switches, texts, choices.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use super::set::ParameterSet;
use super::unit::Unit;
use super::value::{FromValue, Value};

/// Reads a value from where it stands.
type Get<S, V> = fn(&S) -> V;
/// Writes a value to where it stands.
type Set<S, V> = fn(&mut S, V);

impl<S: Clone + 'static> ParameterSet<S> {
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
        let default = unit.from_si(*place(&mut self.base().clone()));
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
        let default = place(&mut self.base().clone()).map_or(none, |si| unit.from_si(si));
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
        let first = place(&mut self.base().clone()).first().copied();
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
        let default: Vec<f64> = place(&mut self.base().clone())
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
        let default: Vec<f64> = get(self.base()).map(|si| unit.from_si(si)).to_vec();
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
        let default = *place(&mut self.base().clone());
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
        let default = *place(&mut self.base().clone());
        self.value(key, default, words, move |s, value: bool| {
            *place(s) = value;
            Ok(())
        })
    }

    /// A text.
    #[must_use]
    pub fn text(self, key: &str, place: fn(&mut S) -> &mut String, words: &str) -> Self {
        let default = place(&mut self.base().clone()).clone();
        self.value(key, default, words, move |s, value: String| {
            *place(s) = value;
            Ok(())
        })
    }

    /// Any number of texts.
    #[must_use]
    pub fn texts(self, key: &str, place: fn(&mut S) -> &mut Vec<String>, words: &str) -> Self {
        let default = place(&mut self.base().clone()).clone();
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
        let default = place(&mut self.base().clone()).to_string();
        self.value(key, default, words, move |s, value: String| {
            *place(s) = value.parse().map_err(|e: T::Err| e.to_string())?;
            Ok(())
        })
        .one_of(allowed)
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
}
