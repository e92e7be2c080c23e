//! What all commands write alike: JSON on standard output, notes on standard error.

use std::io::Write;

use analysis::Listener;
use anyhow::Context;
use serde::Serialize;

/// Writes one JSON object and ends the line. A reader that has gone away is no error.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    let text =
        serde_json::to_string_pretty(value).context("the result cannot be written as JSON")?;
    text_line(&text)
}

/// Writes a text and ends the line.
pub fn text_line(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result.context("standard output"),
    }
}

/// Says something on standard error that is not the result.
pub fn note(text: impl std::fmt::Display) {
    eprintln!("rotary-sins: {text}");
}

/// Nanoseconds as seconds with all digits.
pub fn seconds(nanos: u64) -> String {
    format!("{}.{:09}", nanos / 1_000_000_000, nanos % 1_000_000_000)
}

/// Says what it is told to say, and shows no progress.
pub struct Screen;

impl Listener for Screen {
    fn note(&self, line: &str) {
        note(line);
    }
}
