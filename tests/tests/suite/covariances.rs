//! Covariances as REP-145 wants them: never zero where they are known.

use serde_json::Value;
use suite_tests::RecordedRun;

/// Every covariance below a value, by its path.
fn covariances(path: &str, value: &Value, found: &mut Vec<(String, Vec<f64>)>) {
    match value {
        Value::Object(fields) => {
            for (name, field) in fields {
                covariances(&format!("{path}.{name}"), field, found);
            }
        }
        Value::Array(elements) if path.ends_with("covariance") => {
            let numbers = elements.iter().map(|element| element.as_f64().unwrap());
            found.push((path.to_owned(), numbers.collect()));
        }
        _ => {}
    }
}

fn diagonal(covariance: &[f64]) -> Vec<f64> {
    let size = covariance.len().isqrt();
    assert_eq!(size * size, covariance.len());
    covariance.iter().step_by(size + 1).copied().collect()
}

/// In everything that the nodes publish but the truth, every variance is above zero; what is not measured says so by
/// -1: the orientation of raw samples, the rates of turn of an aiding velocity.
#[test]
fn no_known_covariance_is_zero() {
    let run = RecordedRun::of_the_nodes();
    let mut found = Vec::new();
    for (topic, (_, message)) in &run.topics {
        if !topic.starts_with("/ground_truth/") {
            covariances(topic, message, &mut found);
        }
    }
    for (path, covariance) in &found {
        let diagonal = diagonal(covariance);
        let known = match path.as_str() {
            "/imu/data_raw.orientation_covariance" => {
                assert_eq!(diagonal[0], -1.0, "{path}");
                continue;
            }
            // A log or a GNSS receiver knows nothing of the rates of turn.
            "/aiding/velocity.twist.covariance" => {
                assert_eq!(diagonal[3..], [-1.0; 3], "{path}");
                &diagonal[..3]
            }
            _ => &diagonal[..],
        };
        assert!(known.iter().all(|v| *v > 0.0), "{path}: {diagonal:?}");
    }
    let paths: Vec<&str> = found.iter().map(|(path, _)| path.as_str()).collect();
    for expected in [
        "/imu/data.orientation_covariance",
        "/imu/data.angular_velocity_covariance",
        "/imu/data.linear_acceleration_covariance",
        "/imu/data_raw.angular_velocity_covariance",
        "/odometry.pose.covariance",
        "/odometry.twist.covariance",
        "/uncompensated/odometry.pose.covariance",
        "/fix_ins.position_covariance",
        "/velocity.twist.covariance",
        "/fix.position_covariance",
        "/self_calibration/estimate.covariance",
    ] {
        assert!(paths.contains(&expected), "{expected} in {paths:?}");
    }
}
