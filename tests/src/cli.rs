//! The command line, run to its end.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::process::Program;

/// What a run of `rotary-sins` left.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Exit status; −1 where a signal ended it.
    pub status: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

/// Runs `rotary-sins` with these arguments.
pub fn rotary_sins<S: AsRef<str>>(arguments: &[S]) -> Answer {
    let program = arguments
        .iter()
        .fold(Program::new("rotary-sins"), |program, argument| {
            program.arg(argument.as_ref())
        });
    let output = program.command().output().unwrap();
    Answer::from(output)
}

/// `rotary-sins calibrate BAG --json`.
pub fn calibrate(bag: &Path) -> Answer {
    rotary_sins(&["calibrate", text(bag), "--json"])
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

impl From<Output> for Answer {
    fn from(output: Output) -> Self {
        Self {
            status: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Answer {
    /// Fails unless it ended with this status.
    #[must_use]
    pub fn expect_status(self, status: i32) -> Self {
        assert_eq!(
            self.status, status,
            "standard output:\n{}\nstandard error:\n{}",
            self.stdout, self.stderr
        );
        self
    }

    /// Standard output as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| {
            panic!(
                "no JSON: {error}\nstandard output:\n{}\nstandard error:\n{}",
                self.stdout, self.stderr
            )
        })
    }

    /// Fails unless it refused its input: status 2, nothing on standard output, and one line on standard error, without a
    /// panic, that has all of these words.
    pub fn expect_refusal(&self, words: &[&str]) {
        assert_eq!(
            self.status, 2,
            "standard output:\n{}\nstandard error:\n{}",
            self.stdout, self.stderr
        );
        assert_eq!(self.stdout.trim(), "", "standard output of a refusal");
        let lines: Vec<&str> = self
            .stderr
            .lines()
            .filter(|l| !l.trim().is_empty())
            .collect();
        assert_eq!(lines.len(), 1, "one line expected:\n{}", self.stderr);
        self.expect_words(words);
    }

    /// Fails unless one line of standard error has all of these words, and none speaks of a panic.
    pub fn expect_words(&self, words: &[&str]) {
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        assert!(
            self.stderr
                .lines()
                .any(|line| words.iter().all(|word| line.contains(word))),
            "no line with {words:?} in:\n{}",
            self.stderr
        );
    }
}
