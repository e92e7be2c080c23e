//! The groups for diagnostic_aggregator against what the nodes publish, by that package's rules.

use std::collections::BTreeMap;
use std::fs;

use serde_json::Value;
use suite_tests::{RecordedRun, repository};

const GENERIC: &str = "diagnostic_aggregator/GenericAnalyzer";

/// Paths of the analyzers, with the texts that each looks for.
fn analyzers(yaml: &str) -> BTreeMap<String, Vec<String>> {
    let file: Value = serde_saphyr::from_str(yaml).unwrap();
    // The aggregator's node has this name.
    let parameters = file["analyzers"]["ros__parameters"].as_object().unwrap();
    assert_eq!(parameters["path"], "Rotary SINS");
    let groups = parameters.values().filter(|value| value.is_object());
    groups
        .map(|group| {
            let keys: Vec<_> = group.as_object().unwrap().keys().collect();
            assert_eq!(keys, ["contains", "path", "type"]);
            assert_eq!(group["type"], GENERIC);
            let contains: Vec<String> = serde_json::from_value(group["contains"].clone()).unwrap();
            (group["path"].as_str().unwrap().to_owned(), contains)
        })
        .collect()
}

/// As GenericAnalyzer does it: a name matches where it has one of the texts in it, and every analyzer that matches takes it.
fn takers<'a>(analyzers: &'a BTreeMap<String, Vec<String>>, status: &str) -> Vec<&'a str> {
    let takes = |contains: &[String]| contains.iter().any(|text| status.contains(text));
    analyzers
        .iter()
        .filter(|(_, contains)| takes(contains))
        .map(|(path, _)| path.as_str())
        .collect()
}

/// Every status of a run stands in one group, under any name of its node; every text finds a status; without one of the texts that
/// is not so.
#[test]
fn every_status_has_one_group() {
    let run = RecordedRun::of_the_nodes();
    let file = repository().join("launch-scripts/config/diagnostics_analyzers.yaml");
    let yaml = fs::read_to_string(file).unwrap();
    let groups = analyzers(&yaml);
    assert_eq!(
        groups.keys().collect::<Vec<_>>(),
        [
            "IMU stream",
            "Middleware",
            "Navigation",
            "Self-calibration",
            "Turntable"
        ]
    );
    assert!(run.statuses.len() >= 14, "{:?}", run.statuses);
    for status in run.statuses.keys() {
        let taken = takers(&groups, status);
        assert_eq!(taken.len(), 1, "{status} is taken by {taken:?}");
        let (_, subject) = status.split_once(": ").unwrap();
        let renamed = format!("ship/topics_of_the_position: {subject}");
        assert_eq!(takers(&groups, &renamed), taken, "{renamed}");
    }
    for (path, contains) in &groups {
        for text in contains {
            let finds = |status: &&String| status.contains(text);
            assert!(
                run.statuses.keys().any(|s| finds(&s)),
                "{path}: nothing has '{text}'"
            );
            let fewer = analyzers(&yaml.replacen(text, "nothing", 1));
            let lost = |status: &&String| takers(&fewer, status).is_empty();
            assert!(
                run.statuses.keys().any(|s| lost(&s)),
                "{path}: '{text}' is not needed"
            );
        }
    }
}
