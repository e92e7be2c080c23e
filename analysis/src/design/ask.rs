//! Goals as a person writes them: `STATES=VALUE` and `STATES<LIMIT@HOURS`, each with `*WEIGHT` or without.

use sins::estimation::state::StateLabel;
use sins::studies::design::{Goal, Measure};

use crate::Error;

/// What a good two-axis scheme shows of the whole sensor in four hours with encoders, and after one.
pub const WHOLE: [&str; 12] = [
    "misalignment_up=10.7",
    "accelerometer_bias=0.34",
    "gyroscope_drift=0.00078",
    "gyroscope_scale_factor=0.15",
    "gyroscope_installation=0.11",
    "accelerometer_scale_factor=0.31",
    "accelerometer_installation=0.16",
    "accelerometer_quadratic=0.6",
    "accelerometer_arm=4",
    "accelerometer_delay=0.0055",
    "accelerometer_bias<1@1",
    "gyroscope_scale_factor<0.4@1",
];

/// Reads a goal. STATES is a name or its beginning (`gyroscope_drift` is all three); values are in the states' field unit. `=` asks
/// for the sigma at the end, `<` for the time from which all of them stay below LIMIT.
///
/// # Errors
/// [`sins::Error::Setting`] that names the text.
pub fn goal(text: &str, labels: &[&'static StateLabel]) -> Result<Goal, Error> {
    let fail = |expected: String| Error::from(sins::Error::setting("goal", text, expected));
    let form =
        || fail("STATES=VALUE or STATES<LIMIT@HOURS, with *WEIGHT where it is not 1".to_owned());
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| form());
    let (asked, weight) = match text.split_once('*') {
        Some((asked, weight)) => (asked, number(weight)?),
        None => (text, 1.0),
    };
    let (name, rest, is_time) = match (asked.split_once('='), asked.split_once('<')) {
        (Some((name, rest)), None) => (name, rest, false),
        (None, Some((name, rest))) => (name, rest, true),
        _ => return Err(form()),
    };
    let name = name.trim();
    let chosen: Vec<&StateLabel> = labels
        .iter()
        .copied()
        .filter(|label| !name.is_empty() && label.name.starts_with(name))
        .collect();
    let Some(first) = chosen.first() else {
        let known: Vec<&str> = labels.iter().map(|label| label.name).collect();
        return Err(fail(format!(
            "the beginning of one of {}",
            known.join(", ")
        )));
    };
    if chosen.iter().any(|label| label.unit != first.unit) {
        return Err(fail(format!(
            "states of one unit, not all that begin with {name}"
        )));
    }
    let measure = if is_time {
        let (limit, hours) = rest.split_once('@').ok_or_else(form)?;
        Measure::TimeBelow {
            limit: number(limit)? * first.scale,
            one_s: number(hours)? * 3600.0,
        }
    } else {
        Measure::SigmaAtEnd(number(rest)? * first.scale)
    };
    Ok(Goal {
        states: chosen.iter().map(|label| label.name.to_owned()).collect(),
        measure,
        weight,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use sins::studies::stretch::Physics;

    /// The paper's goals in words are the paper's goals; what is none is refused with its text.
    #[test]
    fn goals_are_read() {
        let labels = Physics::default().labels().unwrap();
        let read: Vec<Goal> = [
            "misalignment_up=11",
            "gyroscope_drift<0.002@0.82",
            "accelerometer_bias<10@0.45*1",
        ]
        .iter()
        .map(|text| goal(text, &labels).unwrap())
        .collect();
        for (one, other) in read.iter().zip(Goal::paper()) {
            assert_eq!(one.states, other.states);
            let numbers = |measure: Measure| match measure {
                Measure::SigmaAtEnd(one) => [one, 0.0],
                Measure::TimeBelow { limit, one_s } => [limit, one_s],
            };
            for (a, b) in numbers(one.measure).into_iter().zip(numbers(other.measure)) {
                assert!((a - b).abs() <= 1e-12 * b.abs(), "{one:?}");
            }
        }
        for bad in [
            "misalignment_up",
            "nonsense=1",
            "misalignment_up=x",
            "gyroscope_drift<0.002",
            "=1",
            "a=1<2",
        ] {
            let told = goal(bad, &labels).unwrap_err().to_string();
            assert!(told.contains(bad), "{told}");
        }
    }
}
