//! The declared parameters with their values.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use crate::error::{Error, Result};
use crate::names::short;
use crate::ros_args::Override;

use super::declaration::Parameter;
use super::value::{FromValue, Value};

/// Name of the standard parameter that makes a node live in the time of `/clock`.
pub const USE_SIM_TIME: &str = "use_sim_time";

/// Name of the parameter that names the device a node's diagnostics speak of.
pub(crate) const HARDWARE_ID: &str = "hardware_id";

/// Heading of the parameters that every node has.
pub(crate) const NODE: &str = "Node";

/// Parameters of this prefix are declared with the endpoint they belong to.
pub(crate) const QOS_OVERRIDES: &str = "qos_overrides.";

/// The standard parameter that every node has.
pub(crate) fn use_sim_time() -> Parameter {
    Parameter::new(USE_SIM_TIME, false)
        .group(NODE)
        .describe("Take the time from /clock instead of the system")
        .changeable()
}

/// All parameters of a node.
#[derive(Debug)]
pub struct Parameters {
    store: Mutex<Store>,
    // Counts the sets, so that one can wait for them.
    sets: watch::Sender<u64>,
}

#[derive(Debug)]
struct Store {
    declared: BTreeMap<String, Parameter>,
    values: BTreeMap<String, Value>,
    /// Values for parameters that are declared later.
    waiting: Vec<Override>,
}

impl Parameters {
    /// The declarations, and `use_sim_time`, with the values given on the command line and in files.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`] and [`Error::ParameterValue`], naming key, value and origin; of faulty declarations,
    /// [`Error::DeclaredTwice`], and [`Error::ParameterValue`] where a default is out of its own range.
    pub(crate) fn new(declarations: Vec<Parameter>, overrides: &[Override]) -> Result<Self> {
        let mut store = Store {
            declared: BTreeMap::new(),
            values: BTreeMap::new(),
            waiting: Vec::new(),
        };
        for parameter in std::iter::once(use_sim_time()).chain(declarations) {
            let (name, value) = (parameter.name.clone(), parameter.default.clone());
            if let Err(expected) = parameter.check(&value) {
                return Err(Error::ParameterValue {
                    name,
                    origin: "default".to_owned(),
                    value: value.to_string(),
                    expected,
                });
            }
            store.values.insert(name.clone(), value);
            if store.declared.insert(name.clone(), parameter).is_some() {
                return Err(Error::DeclaredTwice(name));
            }
        }
        for given in overrides {
            match store.declared.get(&given.name) {
                Some(parameter) => {
                    let value = given.typed(parameter)?;
                    store.values.insert(given.name.clone(), value);
                }
                None if given.name.starts_with(QOS_OVERRIDES) => store.waiting.push(given.clone()),
                None => return Err(given.unknown(store.declared.keys())),
            }
        }
        Ok(Self {
            store: Mutex::new(store),
            sets: watch::Sender::new(0),
        })
    }

    /// The declarations with their defaults, outside of a node: for tests of what a node makes of them.
    ///
    /// # Errors
    /// As at the start of a node.
    pub fn defaults(declarations: Vec<Parameter>) -> Result<Self> {
        Self::new(declarations, &[])
    }

    /// Declares a parameter while the node runs; it takes the value that was given for it at the start. Declaring it
    /// again changes nothing.
    ///
    /// # Errors
    /// [`Error::ParameterValue`] for the value that was given at the start.
    pub(crate) fn declare(&self, parameter: Parameter) -> Result<()> {
        let mut store = self.store();
        if store.declared.contains_key(&parameter.name) {
            return Ok(());
        }
        let (ours, others) = std::mem::take(&mut store.waiting)
            .into_iter()
            .partition(|given| given.name == parameter.name);
        store.waiting = others;
        let ours: Vec<Override> = ours;
        let mut value = parameter.default.clone();
        for given in &ours {
            value = given.typed(&parameter)?;
        }
        store.values.insert(parameter.name.clone(), value);
        store.declared.insert(parameter.name.clone(), parameter);
        Ok(())
    }

    /// Values that were given for parameters that nobody has declared yet, an error for each.
    pub(crate) fn undeclared(&self) -> Vec<Error> {
        let mut store = self.store();
        let waiting = std::mem::take(&mut store.waiting);
        let like = store
            .declared
            .keys()
            .filter(|name| name.starts_with(QOS_OVERRIDES));
        waiting
            .iter()
            .map(|given| given.unknown(like.clone()))
            .collect()
    }

    /// The value of a parameter.
    ///
    /// # Errors
    /// [`Error::NotDeclared`] where the node has not declared it, or as another type: a fault of the program.
    pub fn get<T: FromValue>(&self, name: &str) -> Result<T> {
        self.store()
            .values
            .get(name)
            .and_then(T::from_value)
            .ok_or_else(|| Error::NotDeclared {
                name: name.to_owned(),
                expected: T::EXPECTED,
            })
    }

    /// The value, whatever its type.
    pub fn value(&self, name: &str) -> Option<Value> {
        self.store().values.get(name).cloned()
    }

    /// All declarations in order of their names.
    pub fn declarations(&self) -> Vec<Parameter> {
        self.store().declared.values().cloned().collect()
    }

    /// The declaration of one.
    pub(crate) fn declaration(&self, name: &str) -> Option<Parameter> {
        self.store().declared.get(name).cloned()
    }

    /// Waits until any parameter is set, from the moment of the call on.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.sets.subscribe()
    }

    /// Checks all, then sets all or none. The error is the reason, for the one who asked.
    pub(crate) fn set(&self, changes: &[(String, Option<Value>)]) -> Result<(), String> {
        let mut store = self.store();
        for (name, value) in changes {
            let parameter = store.declared.get(name).ok_or_else(|| {
                format!(
                    "unknown parameter '{}'; {}",
                    short(name),
                    hint(name, store.declared.keys())
                )
            })?;
            if parameter.read_only {
                return Err(format!(
                    "parameter '{name}' is read-only: it is read when the node starts"
                ));
            }
            match value {
                Some(value) => parameter.check(value).map_err(|expected| {
                    let value = value.to_string();
                    format!(
                        "parameter '{name}' is {}, expected {expected}",
                        short(&value)
                    )
                })?,
                None => {
                    return Err(format!(
                        "parameter '{name}' cannot be unset, expected {}",
                        parameter.expected()
                    ));
                }
            }
        }
        for (name, value) in changes {
            if let Some(value) = value {
                store.values.insert(name.clone(), value.clone());
            }
        }
        drop(store);
        self.sets.send_modify(|count| *count += 1);
        Ok(())
    }

    // A panic elsewhere while the lock was held leaves whole values behind: insertions are single steps.
    fn store(&self) -> MutexGuard<'_, Store> {
        self.store.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Override {
    /// The value as the parameter wants it.
    fn typed(&self, parameter: &Parameter) -> Result<Value> {
        let wrong = |expected| Error::ParameterValue {
            name: self.name.clone(),
            origin: self.origin.clone(),
            value: short(&self.value.to_string()).into_owned(),
            expected,
        };
        let typed = Value::from_yaml(&self.value, parameter.kind())
            .ok_or_else(|| wrong(parameter.expected()))?;
        parameter.check(&typed).map_err(wrong)?;
        Ok(typed)
    }

    fn unknown<'a>(&self, known: impl Iterator<Item = &'a String> + Clone) -> Error {
        Error::UnknownParameter {
            name: short(&self.name).into_owned(),
            origin: self.origin.clone(),
            hint: hint(&self.name, known),
        }
    }
}

/// No parameter has a longer name.
const LONGEST_NAME: usize = 256;

/// Near matches, or everything there is.
fn hint<'a>(name: &str, known: impl Iterator<Item = &'a String> + Clone) -> String {
    // Comparing costs the product of the lengths, and one that is much longer is near to none.
    let comparable = name.len() <= LONGEST_NAME;
    let mut near: Vec<(usize, &String)> = known
        .clone()
        .filter(|_| comparable)
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|(distance, candidate)| *distance <= 1 + candidate.len() / 4)
        .collect();
    near.sort();
    if near.is_empty() {
        format!(
            "known are {}",
            known.map(String::as_str).collect::<Vec<_>>().join(", ")
        )
    } else {
        let names: Vec<_> = near
            .iter()
            .take(3)
            .map(|(_, name)| format!("'{name}'"))
            .collect();
        format!("did you mean {}?", names.join(" or "))
    }
}

/// Levenshtein distance in characters.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::yaml::Yaml;

    fn declared() -> Vec<Parameter> {
        vec![
            Parameter::new("rate", 100.0).unit("Hz").range(1.0, 400.0),
            Parameter::new("axes", vec!["x", "y"])
                .one_of(&["x", "y", "z"])
                .length(2),
            Parameter::new("seed", 1_i64).range(0.0, 1e9),
            Parameter::new("gain", 1.0).range(0.0, 2.0).changeable(),
        ]
    }

    fn with(name: &str, yaml: &str) -> Result<Parameters> {
        let value = Yaml::parse(yaml).unwrap();
        Parameters::new(
            declared(),
            &[Override {
                name: name.into(),
                value,
                origin: "-p".into(),
            }],
        )
    }

    /// Defaults hold where nothing is given; an integer serves as a double; the later override wins.
    #[test]
    fn values_are_typed() {
        assert_eq!(
            with("rate", "200").unwrap().get::<f64>("rate").unwrap(),
            200.0
        );
        assert_eq!(with("rate", "200").unwrap().get::<i64>("seed").unwrap(), 1);
        let both = ["50.0", "60.0"].map(|v| Override {
            name: "rate".into(),
            value: Yaml::parse(v).unwrap(),
            origin: "-p".into(),
        });
        assert_eq!(
            Parameters::new(declared(), &both)
                .unwrap()
                .get::<f64>("rate")
                .unwrap(),
            60.0
        );
        assert!(
            !with("rate", "1")
                .unwrap()
                .get::<bool>(USE_SIM_TIME)
                .unwrap()
        );
        assert!(with("rate", "1").unwrap().get::<i64>("rate").is_err());
    }

    /// A quality of service may be given before its endpoint is declared; then it is checked as any other.
    #[test]
    fn overrides_of_qos_wait_for_their_endpoint() {
        let depth = "qos_overrides./x.publisher.depth";
        let later = |value: &str| {
            let parameters = with(depth, value).unwrap();
            let declared = Parameter::new(depth, 10_i64).range(1.0, 100.0);
            parameters.declare(declared).map(|()| parameters)
        };
        assert_eq!(later("7").unwrap().get::<i64>(depth).unwrap(), 7);
        assert_eq!(
            later("0").unwrap_err().to_string(),
            format!("-p: parameter '{depth}' is 0, expected integer from 1 to 100")
        );
        let never = with("qos_overrides./y.publisher.depth", "7").unwrap();
        never.declare(Parameter::new(depth, 10_i64)).unwrap();
        assert_eq!(
            never.undeclared()[0].to_string(),
            format!(
                "-p: unknown parameter 'qos_overrides./y.publisher.depth'; did you mean '{depth}'?"
            )
        );
        assert!(never.undeclared().is_empty());
    }

    /// An unknown key is an error that names it and what was probably meant.
    #[test]
    fn unknown_keys_are_errors_with_near_matches() {
        assert_eq!(
            with("rat", "1").unwrap_err().to_string(),
            "-p: unknown parameter 'rat'; did you mean 'rate'?"
        );
        let far = with("temperature", "1").unwrap_err().to_string();
        assert!(
            far.contains("known are axes, gain, rate, seed, use_sim_time"),
            "{far}"
        );
    }

    /// Wrong type, range, choice and length name key, value and what was expected.
    #[test]
    fn unusable_values_are_errors() {
        for (name, yaml, told) in [
            (
                "rate",
                "fast",
                "-p: parameter 'rate' is 'fast', expected double from 1.0 to 400.0 [Hz]",
            ),
            (
                "rate",
                "0.5",
                "-p: parameter 'rate' is 0.5, expected double from 1.0 to 400.0 [Hz]",
            ),
            (
                "seed",
                "1.5",
                "-p: parameter 'seed' is 1.5, expected integer from 0 to 1000000000",
            ),
            (
                "axes",
                "[x, w]",
                "-p: parameter 'axes' is ['x', 'w'], expected array of string of 2 elements, one of x, y, z",
            ),
            (
                "axes",
                "[x]",
                "-p: parameter 'axes' is ['x'], expected array of string of 2 elements, one of x, y, z",
            ),
        ] {
            assert_eq!(with(name, yaml).unwrap_err().to_string(), told);
        }
    }

    /// A read-only parameter refuses with its reason; an atomic set that fails changes nothing.
    #[test]
    fn sets_are_all_or_nothing() {
        let parameters = with("rate", "10").unwrap();
        let change = |name: &str, value: Value| (name.to_owned(), Some(value));
        let refused = parameters
            .set(&[change("gain", 1.5.into()), change("rate", 5.0.into())])
            .unwrap_err();
        assert!(refused.contains("'rate' is read-only"), "{refused}");
        assert_eq!(parameters.get::<f64>("gain").unwrap(), 1.0);
        parameters.set(&[change("gain", 1.5.into())]).unwrap();
        assert_eq!(parameters.get::<f64>("gain").unwrap(), 1.5);
        assert!(parameters.set(&[change("gain", 3.0.into())]).is_err());
        assert!(parameters.set(&[change("gain", f64::NAN.into())]).is_err());
        assert!(
            parameters
                .set(&[change("gain", Value::Integer(1))])
                .is_err()
        );
    }
}
