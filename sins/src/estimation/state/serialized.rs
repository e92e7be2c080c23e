//! Named states as they are kept: by their names, so that a list that is read is one of ours again, and nothing is read that
//! is none.

use std::sync::Arc;

use nalgebra::DMatrix;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::super::model::{Inertial, Matrices, Model, Paper, Whole, label};
use super::{List, NamedCovariance, Shown, StateEstimate, StateLabel, StateList, StateValues};

impl Serialize for StateList {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for StateList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let names = Vec::<String>::deserialize(deserializer)?;
        let lists: [&'static [StateLabel]; 4] =
            [Paper::LIST, Matrices::LIST, Whole::LIST, Inertial::LIST];
        let same = |list: &&&'static [StateLabel]| list.iter().map(|l| l.name).eq(&names);
        if let Some(list) = lists.iter().find(same) {
            return Ok(Self::labels(list));
        }
        let labels: Option<Vec<StateLabel>> =
            names.iter().map(|name| label(name).copied()).collect();
        Ok(labels.map_or_else(|| Self::names(&names), Self::chosen))
    }
}

impl Serialize for StateValues {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&self.states, &self.values[..]).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for StateValues {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (states, values) = <(StateList, Vec<f64>)>::deserialize(deserializer)?;
        Self::new(states, &values).map_err(D::Error::custom)
    }
}

impl Serialize for NamedCovariance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&self.states, self.matrix.as_slice()).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for NamedCovariance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (states, elements) = <(StateList, Vec<f64>)>::deserialize(deserializer)?;
        let count = states.len();
        if elements.len() != count * count {
            let told = format!("{} elements of a covariance of {count}", elements.len());
            return Err(D::Error::custom(told));
        }
        let matrix = DMatrix::from_vec(count, count, elements);
        Self::new(states, matrix).map_err(D::Error::custom)
    }
}

impl Serialize for StateEstimate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.values.as_slice(), &self.covariance).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for StateEstimate {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (values, covariance) = <(Vec<f64>, NamedCovariance)>::deserialize(deserializer)?;
        Self::new(&values, covariance).map_err(D::Error::custom)
    }
}

impl Serialize for Shown {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&self.states, self.positions.as_deref()).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Shown {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (states, positions) = <(StateList, Option<Vec<usize>>)>::deserialize(deserializer)?;
        let positions: Option<Arc<[usize]>> = positions.map(Into::into);
        if positions.as_ref().is_some_and(|p| p.len() != states.len()) {
            return Err(D::Error::custom("as many positions as states"));
        }
        if !matches!(states.0, List::Labels(_) | List::Chosen(_)) {
            return Err(D::Error::custom("states of a model"));
        }
        Ok(Self { states, positions })
    }
}

/// A state that something is about, with two numbers, by the name of the state.
pub mod about {
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{StateLabel, label};

    type About = Option<(&'static StateLabel, f64, f64)>;

    /// By the name.
    ///
    /// # Errors
    /// Those of the serializer.
    #[allow(clippy::ref_option, reason = "serde hands in a reference to the field")]
    pub fn serialize<S: Serializer>(about: &About, serializer: S) -> Result<S::Ok, S::Error> {
        about
            .map(|(label, value, sigma)| (label.name, value, sigma))
            .serialize(serializer)
    }

    /// By the name.
    ///
    /// # Errors
    /// Those of the deserializer; a name that no model has.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<About, D::Error> {
        let Some((name, value, sigma)) = Option::<(String, f64, f64)>::deserialize(deserializer)?
        else {
            return Ok(None);
        };
        let label = label(&name)
            .ok_or_else(|| D::Error::custom(format!("{name}: no state of any model")))?;
        Ok(Some((label, value, sigma)))
    }
}

/// A list that is shared, as a list.
pub mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// As a list.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<T: Serialize, S: Serializer>(
        list: &Arc<[T]>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        list[..].serialize(serializer)
    }

    /// From a list.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<[T]>, D::Error> {
        Ok(Vec::deserialize(deserializer)?.into())
    }
}
