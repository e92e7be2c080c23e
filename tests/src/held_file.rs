//! Files of the repository that are made by the programs, and held to what these make today.

use std::fs;

use crate::executables::repository;

/// Fails at the first line in which a file of the repository is not this text; writes the file instead where the environment
/// variable `update` is set.
pub fn hold_file(path: &str, text: &str, update: &str) {
    let file = repository().join(path);
    if std::env::var_os(update).is_some() {
        return fs::write(file, text).unwrap();
    }
    let held = fs::read_to_string(file).unwrap_or_default();
    for (number, (now, then)) in (1..).zip(text.lines().zip(held.lines())) {
        assert_eq!(
            now, then,
            "{path} line {number}: now (left) is not as in the repository (right); {update}=1 writes it anew"
        );
    }
    assert!(
        text == held,
        "{path} has {} lines now and {} in the repository; {update}=1 writes it anew",
        text.lines().count(),
        held.lines().count()
    );
}
