//! Tests that cannot run here: seen, counted, and a failure where nothing may be missing.

use std::fs::File;
use std::io::Write as _;

use crate::isolation::{current_test, is_inside};

/// Where this is set nothing may be missing.
const REQUIRED: &str = "CI";
/// A file that gets a line for every test that is skipped: its name, a tab, the reason.
const LIST: &str = "ROTARY_SINS_SKIPPED";

/// Says in one line that this test is skipped, and why; the test is to return then. Fails instead where `CI` is set.
///
/// # Panics
///
/// Inside of [`crate::isolated`]: a test that has entered its namespace has begun, and a skip would go down as a success.
pub fn skip(reason: &str) {
    let name = current_test();
    assert!(!is_inside(), "{name} skips within its namespace: {reason}");
    assert!(
        std::env::var_os(REQUIRED).is_none(),
        "{REQUIRED} is set, but {reason}"
    );
    // Past the test harness, which shows what a passing test prints to nobody.
    writeln!(std::io::stderr(), "skipped: {name}: {reason}").ok();
    if let Some(list) = std::env::var_os(LIST) {
        let mut list = File::options()
            .create(true)
            .append(true)
            .open(list)
            .unwrap();
        // One write, so that lines of tests side by side do not mix.
        list.write_all(format!("{name}\t{reason}\n").as_bytes())
            .unwrap();
    }
}
