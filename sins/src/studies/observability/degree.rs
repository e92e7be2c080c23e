//! Degrees of observability of a whole run, from the singular values of all its measurements.
//!
//! Every velocity measurement is a row H Φ(t, 0) on the initial state. Rows are divided by the measurement's sigma and
//! columns are multiplied by the sigma that the state had before, so that states of different units can be compared: a
//! singular value s says that the measurements know that combination s times better than it was known before.
//! Process noise is left out here; it stands in the [`bound`](super::bound).

use nalgebra::{DMatrix, SMatrix, SVector};

use super::Setting;
use super::path::Path;
use super::stripped::{MEASURED, STATES, StateMatrix, singular, triangle};
use crate::error::Error;
use crate::estimation::model::{Model, Paper};
use crate::estimation::state::{StateLabel, StateValues};
use crate::table::scheme::Program;

/// Steps whose rows are gathered before they are made a triangle again.
const GATHERED: usize = 120;
/// A part of a hidden direction above this hides the state.
const HIDDEN_PART: f64 = 1e-6;

/// One singular value and its direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// How much better the measurements know it than it was known before.
    pub value: f64,
    /// The right singular vector, in units of the sigmas before.
    pub vector: StateValues,
    /// The state it is counted for: every state has one, the assignment that goes from the largest part down.
    pub state: &'static StateLabel,
}

/// What the measurements say of one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degree {
    /// The state.
    pub state: &'static StateLabel,
    /// How much the state alone moves the measurements: the norm of its column.
    pub signal: f64,
    /// What is left of that once all other states are unknown as well: 1/√ of the inverse's diagonal. The state's sigma before,
    /// over its sigma from the measurements alone. Zero where it is hidden.
    pub degree: f64,
}

/// Degrees of observability.
#[derive(Clone, Debug, PartialEq)]
pub struct Degrees {
    /// As many as there are states, from the best shown to the least.
    pub directions: Vec<Direction>,
    /// One for every state.
    pub states: Vec<Degree>,
}

impl Degrees {
    /// That of a state.
    pub fn of(&self, name: &str) -> Option<&Degree> {
        self.states.iter().find(|degree| degree.state.name == name)
    }

    /// The singular value that is counted for a state.
    pub fn singular_value(&self, name: &str) -> Option<f64> {
        let own = self.directions.iter().find(|d| d.state.name == name);
        own.map(|direction| direction.value)
    }
}

/// Degrees of observability of a run.
///
/// # Errors
/// [`Error`] where the ship or the program means nothing.
pub fn degrees(program: &Program, setting: &Setting) -> Result<Degrees, Error> {
    setting.ship.validate()?;
    let before = setting.initial.model().prior(&setting.place());
    let scale = StateMatrix::from_diagonal(&(before / setting.velocity_sigma_m_s));
    let mut transition = StateMatrix::identity();
    let mut seen = DMatrix::<f64>::zeros(0, STATES);
    let mut rows: Vec<SMatrix<f64, 2, STATES>> = Vec::with_capacity(GATHERED);
    for step in Path::new(program, &setting.ship, setting.duration_s) {
        let step = step?;
        if step.time_s > setting.duration_s + 0.5 {
            break;
        }
        transition = setting.dynamics(&step.mean).transition().dense() * transition;
        rows.push(transition.select_rows(&MEASURED).fixed_rows::<2>(0) * scale);
        if rows.len() == GATHERED {
            seen = gather(&seen, &mut rows);
        }
    }
    seen = gather(&seen, &mut rows);
    let singular = singular(&seen);
    let largest = singular[0].0.max(f64::MIN_POSITIVE);
    let hidden = |value: f64| value < super::stripped::RANK_TOLERANCE * largest;
    let degree = |(state, label): (usize, &'static StateLabel)| {
        let variance: f64 = singular
            .iter()
            .map(|(value, v)| {
                if hidden(*value) {
                    if v[state].abs() > HIDDEN_PART {
                        f64::INFINITY
                    } else {
                        0.0
                    }
                } else {
                    (v[state] / value).powi(2)
                }
            })
            .sum();
        Degree {
            state: label,
            signal: seen.column(state).norm(),
            degree: variance.sqrt().recip(),
        }
    };
    Ok(Degrees {
        directions: assign(&singular),
        states: Paper::LIST.iter().enumerate().map(degree).collect(),
    })
}

fn gather(seen: &DMatrix<f64>, rows: &mut Vec<SMatrix<f64, 2, STATES>>) -> DMatrix<f64> {
    let above = seen.nrows();
    let mut stacked = DMatrix::zeros(above + 2 * rows.len(), STATES);
    stacked.rows_mut(0, above).copy_from(seen);
    for (k, row) in rows.drain(..).enumerate() {
        stacked.rows_mut(above + 2 * k, 2).copy_from(&row);
    }
    triangle(&stacked)
}

/// One state for every direction, the largest parts first.
fn assign(singular: &[(f64, SVector<f64, STATES>)]) -> Vec<Direction> {
    let mut parts: Vec<(f64, usize, usize)> = (0..STATES)
        .flat_map(|k| (0..STATES).map(move |i| (k, i)))
        .map(|(k, i)| (singular[k].1[i].abs(), k, i))
        .collect();
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut of_direction, mut taken) = ([None; STATES], [false; STATES]);
    for (_, k, i) in parts {
        if of_direction[k].is_none() && !taken[i] {
            of_direction[k] = Some(i);
            taken[i] = true;
        }
    }
    singular
        .iter()
        .zip(of_direction)
        .map(|((value, vector), state)| Direction {
            value: *value,
            vector: StateValues::of(Paper::LIST, vector),
            state: &Paper::LIST[state.unwrap_or(0)],
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
    use crate::estimation::groups::navigation::{MISALIGNMENT, POSITION};
    use crate::table::scheme::Scheme;

    fn of(scheme: &Scheme) -> Degrees {
        let program = scheme.program(scheme.default_table()).unwrap();
        degrees(&program, &Setting::default()).unwrap()
    }

    /// Longitude is hidden whatever the table does; at rest so are the level errors behind the biases; the eight positions
    /// show all nine better than they were known before.
    #[test]
    fn degrees_follow_the_scheme() {
        let (still, eight) = (of(&Scheme::stationary()), of(&Scheme::eight_position()));
        let degree = |of: &Degrees, state: &str| of.of(state).unwrap().degree;
        let longitude = POSITION[1];
        assert!(degree(&still, longitude) == 0.0 && degree(&eight, longitude) == 0.0);
        let [_, by, bz] = ACCELEROMETER_BIAS;
        for state in [MISALIGNMENT[0], by, GYROSCOPE_DRIFT[0], bz] {
            assert!(degree(&still, state) < 1e-3, "{state}");
        }
        for state in [MISALIGNMENT, ACCELEROMETER_BIAS, GYROSCOPE_DRIFT].concat() {
            assert!(degree(&eight, state) > 5.0, "{state}");
        }
    }

    /// Every direction has its own state, and the sum of the squares is that of the columns.
    #[test]
    fn directions_are_complete() {
        let d = of(&Scheme::eight_position());
        for label in Paper::LIST {
            let own = d.directions.iter().filter(|x| x.state == label);
            assert_eq!(own.count(), 1, "{}", label.name);
        }
        let total: f64 = d.directions.iter().map(|x| x.value.powi(2)).sum();
        let columns: f64 = d.states.iter().map(|s| s.signal.powi(2)).sum();
        assert!((total / columns - 1.0).abs() < 1e-9);
    }
}
