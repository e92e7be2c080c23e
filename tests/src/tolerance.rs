//! Estimates against truth.

use serde_json::Value;

/// A number of JSON.
pub fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// The numbers of a JSON array.
pub fn numbers(array: &Value) -> Vec<f64> {
    let values = array
        .as_array()
        .unwrap_or_else(|| panic!("{array} is no array"));
    values.iter().map(number).collect()
}

/// The numbers of a JSON array, by its key.
pub fn vector(json: &Value, key: &str) -> Vec<f64> {
    assert!(json[key].is_array(), "no array '{key}' in {json}");
    numbers(&json[key])
}

/// Fails unless each estimate lies within `limit` of its own sigmas from the truth.
pub fn assert_within_sigmas(
    what: &str,
    estimate: &[f64],
    truth: &[f64],
    sigma: &[f64],
    limit: f64,
) {
    assert_eq!(estimate.len(), truth.len(), "{what}: {estimate:?}");
    assert_eq!(sigma.len(), truth.len(), "{what}: {sigma:?}");
    for i in 0..truth.len() {
        let error = (estimate[i] - truth[i]) / sigma[i];
        assert!(
            sigma[i] > 0.0 && error.abs() <= limit,
            "{what}[{i}]: estimate {:e}, truth {:e}, sigma {:e}: {error:.2} sigma, at most {limit} expected",
            estimate[i],
            truth[i],
            sigma[i]
        );
    }
}
