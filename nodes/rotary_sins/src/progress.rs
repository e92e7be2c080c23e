//! SecondsBar on standard error, where a person sees it.

use std::time::Duration;

use analysis::Listener;
use indicatif::{ProgressBar, ProgressStyle};

/// A bar that counts seconds of recorded or simulated time; nothing where standard error is no terminal.
pub struct SecondsBar {
    bar: ProgressBar,
}

impl SecondsBar {
    /// A bar of this length \[s\].
    pub fn new(title: &str, length_s: f64) -> Self {
        let bar = ProgressBar::new(length_s.max(0.0) as u64);
        let template = "{prefix:>10} {bar:32} {pos}/{len} s  {wide_msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_prefix(title.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    /// Where it stands \[s\].
    pub fn set(&self, seconds: f64) {
        self.bar.set_position(seconds.max(0.0) as u64);
    }

    /// What is going on.
    pub fn message(&self, text: String) {
        self.bar.set_message(text);
    }

    /// Says a line above the bar, or just says it.
    pub fn note(&self, text: impl std::fmt::Display) {
        self.bar.suspend(|| crate::output::note(text));
    }
}

impl Drop for SecondsBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Listener for SecondsBar {
    fn task(&self, name: &str) {
        self.message(name.to_owned());
    }

    fn reached(&self, seconds: f64) {
        self.set(seconds);
    }

    fn note(&self, line: &str) {
        SecondsBar::note(self, line);
    }
}

/// A bar that counts units of work.
pub struct CountBar {
    bar: ProgressBar,
}

impl CountBar {
    /// A bar of this template and length.
    pub fn new(template: &str, length: u64) -> Self {
        let bar = ProgressBar::new(length);
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar }
    }
}

impl Listener for CountBar {
    fn task(&self, name: &str) {
        self.bar.set_message(name.to_owned());
    }

    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }
}

impl Drop for CountBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
