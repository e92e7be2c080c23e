//! Whether a participant of Fast DDS that lives on comes to know every node that is started beside it.

use std::path::Path;

use suite_tests::{Peer, each_distribution, executable};

each_distribution!(starts_are_seen);

/// Rounds, where nobody asks for more.
const ROUNDS: &str = "3";
/// Names how many rounds are run: 50 rounds of four nodes are 200 starts.
const STARTS: &str = "ROTARY_SINS_STARTS";

/// Four nodes are started at once on a busy machine, again and again: 5 s later all of them are known, with their topics, to a
/// participant that has been there all the time. Says after how long they were.
fn starts_are_seen(python: &Path) {
    let rounds = std::env::var(STARTS).unwrap_or_else(|_| ROUNDS.to_owned());
    let nodes = [
        "imu_simulator",
        "scheme_sequencer",
        "self_calibrator",
        "navigation_compensator",
    ];
    let peer = Peer::new(python, "starts.py").arg(&rounds).arg("2");
    let answer = nodes
        .iter()
        .map(|node| format!("{node}={}", executable(node).display()))
        .fold(peer, Peer::arg)
        .ask();
    let seconds: Vec<f64> = answer["known_after_s"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(serde_json::Value::as_f64)
        .collect();
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
    println!("{rounds} rounds of four nodes: known after {mean:.2} s, at most {longest:.2} s");
    assert_eq!(answer["missing"], serde_json::json!([]), "{answer}");
}
