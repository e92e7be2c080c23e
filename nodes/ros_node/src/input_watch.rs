//! Watches one input topic: what came, what was refused and why, and whether it has fallen silent.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::{Duration, Instant};

use crate::clock::system_nanos;
use crate::diagnostics::{Level, Report};
use crate::lifecycle::Gate;
use crate::node::Node;

/// Counters of one input of a node. What is refused is logged once for each kind of reason and counted after that.
#[derive(Clone, Debug)]
pub struct InputWatch {
    topic: String,
    patience: Duration,
    required: bool,
    since: Instant,
    last_arrival: Option<Instant>,
    received: u64,
    refused: BTreeMap<&'static str, u64>,
    /// While the node was not active nothing could come: silence counts from its activation.
    gate: Option<Gate>,
}

impl InputWatch {
    /// An input that the node cannot work without; silent for longer than `patience` is a warning, for longer than
    /// three times that an error. Silence is measured in the system's time: it is about arrival.
    pub fn required(topic: &str, patience: Duration) -> Self {
        Self {
            topic: topic.to_owned(),
            patience,
            required: true,
            since: Instant::now(),
            last_arrival: None,
            received: 0,
            refused: BTreeMap::new(),
            gate: None,
        }
    }

    /// The input of a node: by its name after remapping, and silent only while the node is active.
    ///
    /// # Errors
    /// [`crate::Error::Name`].
    pub fn of(mut self, node: &Node) -> crate::Result<Self> {
        self.topic = node.resolve_topic(&self.topic)?;
        self.gate = Some(node.gate().clone());
        Ok(self)
    }

    /// Another silence that is no fault.
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// An input that may be absent: only one that came and then fell silent is a warning.
    pub fn optional(topic: &str, patience: Duration) -> Self {
        Self {
            required: false,
            ..Self::required(topic, patience)
        }
    }

    /// Counts messages that arrived now.
    pub fn arrived(&mut self, messages: usize) {
        self.received += messages as u64;
        self.last_arrival = Some(Instant::now());
    }

    /// Counts a message that cannot be used; the first of its `kind` is logged with its reason.
    pub fn refuse(&mut self, kind: &'static str, reason: impl Display) {
        let count = self.refused.entry(kind).or_default();
        *count += 1;
        if *count == 1 {
            tracing::warn!(
                "{}: {reason}; the message is left out (said once)",
                self.topic
            );
        }
    }

    /// Its topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Messages that arrived.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Messages that could not be used.
    pub fn refused(&self) -> u64 {
        self.refused.values().sum()
    }

    /// Whether nothing has come for longer than the patience.
    pub fn is_silent(&self) -> bool {
        self.silent_for(Instant::now()) > self.patience
    }

    /// Time since the last message, or since the watch began.
    pub fn silence(&self) -> Duration {
        self.silent_for(Instant::now())
    }

    /// Silence that is no fault.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    fn silent_for(&self, now: Instant) -> Duration {
        let silent = now.saturating_duration_since(self.last_arrival.unwrap_or(self.since));
        let active = self.gate.as_ref().map_or(0, Gate::opened_nanos);
        if active == 0 {
            return silent;
        }
        let since = u64::try_from(system_nanos().saturating_sub(active)).unwrap_or(0);
        silent.min(Duration::from_nanos(since))
    }

    /// How the input is.
    pub fn report(&self) -> Report {
        self.report_at(Instant::now())
    }

    fn report_at(&self, now: Instant) -> Report {
        let silent = self.silent_for(now);
        let mut report = Report::ok(format!("{}: {} messages", self.topic, self.received))
            .with("received", self.received);
        for (kind, count) in &self.refused {
            report = report
                .counted(
                    Level::Warn,
                    kind,
                    *count,
                    &format!("{}: messages refused, {kind}", self.topic),
                )
                .with(&format!("refused, {kind}"), count);
        }
        if silent > self.patience && (self.required || self.last_arrival.is_some()) {
            let level = if self.required && silent > 3 * self.patience {
                Level::Error
            } else {
                Level::Warn
            };
            let text = format!("no {} for {:.0} s", self.topic, silent.as_secs_f64());
            report = report
                .worsened(level, &text)
                .with("silent [s]", format!("{:.1}", silent.as_secs_f64()));
        }
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_secs(3);

    /// A required input that is silent is first a warning, then an error.
    #[test]
    fn silence_grows_worse() {
        let watch = InputWatch::required("imu/data_raw", PATIENCE);
        let after = |seconds| watch.report_at(watch.since + Duration::from_secs(seconds));
        assert_eq!(
            after(2),
            Report::ok("imu/data_raw: 0 messages").with("received", 0)
        );
        assert_eq!(
            after(4),
            Report::warn("no imu/data_raw for 4 s")
                .with("received", 0)
                .with("silent [s]", "4.0")
        );
        assert_eq!(
            after(10),
            Report::error("no imu/data_raw for 10 s")
                .with("received", 0)
                .with("silent [s]", "10.0")
        );
    }

    /// A node that has just become active has not waited yet.
    #[test]
    fn silence_begins_with_activity() {
        let mut watch = InputWatch::required("imu/data_raw", PATIENCE);
        let later = watch.since + Duration::from_secs(100);
        assert_eq!(watch.report_at(later).level(), Level::Error);
        let gate = Gate::opened();
        gate.set(false);
        gate.set(true);
        watch.gate = Some(gate);
        assert_eq!(watch.report_at(later).level(), Level::Ok);
    }

    /// An optional input that never came is no fault.
    #[test]
    fn optional_may_be_absent() {
        let watch = InputWatch::optional("fix", PATIENCE);
        let report = watch.report_at(watch.since + Duration::from_secs(100));
        assert_eq!(report, Report::ok("fix: 0 messages").with("received", 0));
    }

    /// Refused messages are counted by kind.
    #[test]
    fn refusals_are_counted() {
        let mut watch = InputWatch::required("fix", PATIENCE);
        watch.refuse("no fix", "status -1");
        watch.refuse("no fix", "status -1");
        watch.refuse("not finite", "latitude NaN");
        assert_eq!(watch.refused(), 3);
    }
}
