//! `/diagnostics`: how the node is, part by part, once a second.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ros2_interfaces::builtin_interfaces::Time;
use ros2_interfaces::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use ros2_interfaces::std_msgs::Header;

use crate::clock::Clock;
use crate::lifecycle::Gate;
use crate::publisher::Publisher;
use stream_monitor::StreamMonitor;

/// Wall time between two reports.
const PERIOD: Duration = Duration::from_secs(1);
/// What happened longer ago is a thing of the past.
const PAST: Duration = Duration::from_secs(60);

/// How a part of the node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Well.
    Ok = 0,
    /// A person should look.
    Warn = 1,
    /// It does not do its work.
    Error = 2,
    /// Nothing was heard of it.
    Stale = 3,
}

/// What a task reports. Two are equal where they say the same.
#[derive(Clone, Debug)]
pub struct Report {
    level: Level,
    message: String,
    faults: Vec<Fault>,
    values: Vec<(String, String)>,
}

impl PartialEq for Report {
    fn eq(&self, other: &Self) -> bool {
        self.said(|_| true) == other.said(|_| true) && self.values == other.values
    }
}

/// Something that makes a report worse.
#[derive(Clone, Debug)]
struct Fault {
    level: Level,
    message: String,
    /// Where it is a thing of the past that is counted: what it is, and how often it has happened.
    count: Option<(String, u64)>,
}

impl Report {
    /// Level and one line.
    pub fn new(level: Level, message: impl Into<String>) -> Self {
        Self {
            level,
            message: message.into(),
            faults: Vec::new(),
            values: Vec::new(),
        }
    }

    /// All is well.
    pub fn ok(message: impl Into<String>) -> Self {
        Self::new(Level::Ok, message)
    }

    /// A person should look.
    pub fn warn(message: impl Into<String>) -> Self {
        Self::new(Level::Warn, message)
    }

    /// It does not do its work.
    pub fn error(message: impl Into<String>) -> Self {
        Self::new(Level::Error, message)
    }

    /// Nothing was heard.
    pub fn stale(message: impl Into<String>) -> Self {
        Self::new(Level::Stale, message)
    }

    /// Adds a value.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl fmt::Display) -> Self {
        self.values.push((key.to_owned(), value.to_string()));
        self
    }

    /// How it is.
    pub fn level(&self) -> Level {
        self.said(|_| true).0
    }

    /// The value of this key.
    pub fn value(&self, key: &str) -> Option<&str> {
        let found = self.values.iter().find(|(known, _)| known == key);
        found.map(|(_, value)| value.as_str())
    }

    /// Raises the level, and takes this message where it is worse than before. A fault as bad as the one before is said
    /// behind it: neither hides the other.
    #[must_use]
    pub fn worsened(self, level: Level, message: &str) -> Self {
        self.faulty(level, message, None)
    }

    /// As [`Self::worsened`], by something that has happened so often up to now; nothing, where that is never. It is said for a minute
    /// after it has happened last: whoever looks later sees by the values that it did, and by the level that it is over.
    #[must_use]
    pub fn counted(self, level: Level, what: &str, count: u64, message: &str) -> Self {
        if count == 0 {
            return self;
        }
        self.faulty(level, message, Some((what.to_owned(), count)))
    }

    fn faulty(mut self, level: Level, message: &str, count: Option<(String, u64)>) -> Self {
        let message = message.to_owned();
        self.faults.push(Fault {
            level,
            message,
            count,
        });
        self
    }

    /// Level and line, by the faults that still hold.
    fn said(&self, mut holds: impl FnMut(&Fault) -> bool) -> (Level, String) {
        let mut said = (self.level, self.message.clone());
        for fault in &self.faults {
            if !holds(fault) {
                continue;
            }
            match fault.level.cmp(&said.0) {
                Ordering::Greater => said = (fault.level, fault.message.clone()),
                Ordering::Equal if fault.level > Level::Ok => {
                    said.1.push_str("; ");
                    said.1.push_str(&fault.message);
                }
                Ordering::Equal | Ordering::Less => {}
            }
        }
        said
    }
}

/// When what is counted has happened last.
#[derive(Default)]
struct Counts(BTreeMap<String, (u64, Instant)>);

impl Counts {
    /// Whether it has happened within [`PAST`].
    fn is_fresh(&mut self, what: &str, count: u64, now: Instant) -> bool {
        let last = self.0.entry(what.to_owned()).or_insert((0, now));
        if count != last.0 {
            *last = (count, now);
        }
        now.saturating_duration_since(last.1) < PAST
    }
}

/// How a sampled stream is: stale before the first sample, a warning once its stamps were not as they should be.
impl From<&StreamMonitor> for Report {
    fn from(monitor: &StreamMonitor) -> Self {
        let (gaps, lost) = (monitor.gaps(), monitor.lost());
        let (repeated, backward) = (monitor.repeated(), monitor.backward());
        let report = match monitor.rate() {
            Some(rate) => Self::ok(format!("{rate:.2} Hz")).with("rate_hz", format!("{rate:.3}")),
            None if monitor.received() == 0 => Self::stale("no sample yet"),
            None => Self::ok("the rate is not known yet"),
        };
        let report = if gaps + repeated + backward > 0 {
            let text = format!(
                "{gaps} gaps with {lost} samples lost, {repeated} repeated and {backward} backward stamps"
            );
            let count = gaps + repeated + backward;
            report.counted(Level::Warn, "stamps", count, &text)
        } else {
            report
        };
        report
            .with("received", monitor.received())
            .with("gaps", gaps)
            .with("lost", lost)
            .with("repeated_stamps", repeated)
            .with("backward_stamps", backward)
            .with("zero_stamps", monitor.zero())
            .with("longest_interval_s", monitor.longest_nanos() as f64 * 1e-9)
    }
}

type Check = Box<dyn FnMut() -> Report + Send>;

struct Task {
    name: String,
    check: Check,
    last: Option<Level>,
    counts: Counts,
    /// Asked whether the node is active or not, and kept when its main function is dropped.
    built_in: bool,
}

/// The tasks of a node. Clones share them.
#[derive(Clone, Default)]
pub struct Diagnostics {
    shared: Arc<Mutex<Shared>>,
}

#[derive(Default)]
struct Shared {
    tasks: Vec<Task>,
    hardware_id: String,
}

impl fmt::Debug for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Diagnostics")
            .field("tasks", &self.lock().tasks.len())
            .finish()
    }
}

impl Diagnostics {
    /// Adds a task; it is asked once a second, so it must not block.
    pub fn add(&self, name: &str, check: impl FnMut() -> Report + Send + 'static) {
        self.push(name, check, false);
    }

    /// Adds a task of the node itself, which also reports while the node is not active.
    pub(crate) fn add_built_in(&self, name: &str, check: impl FnMut() -> Report + Send + 'static) {
        self.push(name, check, true);
    }

    fn push(&self, name: &str, check: impl FnMut() -> Report + Send + 'static, built_in: bool) {
        self.lock().tasks.push(Task {
            name: name.to_owned(),
            check: Box::new(check),
            last: None,
            counts: Counts::default(),
            built_in,
        });
    }

    /// Drops the tasks that the main function added.
    pub(crate) fn clear(&self) {
        self.lock().tasks.retain(|task| task.built_in);
    }

    /// Names the device that all tasks speak of.
    pub fn set_hardware_id(&self, hardware_id: &str) {
        hardware_id.clone_into(&mut self.lock().hardware_id);
    }

    /// Asks every task; a change of its level is logged, once.
    pub(crate) fn check(&self, node: &str, active: bool) -> Vec<DiagnosticStatus> {
        self.check_at(node, active, Instant::now())
    }

    fn check_at(&self, node: &str, active: bool, now: Instant) -> Vec<DiagnosticStatus> {
        let mut shared = self.lock();
        let hardware_id = shared.hardware_id.clone();
        let statuses = shared.tasks.iter_mut().map(|task| {
            let report = if active || task.built_in {
                (task.check)()
            } else {
                Report::ok("inactive")
            };
            let (level, message) = task.said(&report, now);
            task.log_change(level, &message);
            task.last = Some(level);
            DiagnosticStatus {
                level: level as u8,
                name: format!("{node}: {}", task.name),
                message,
                hardware_id: hardware_id.clone(),
                values: report
                    .values
                    .into_iter()
                    .map(|(key, value)| KeyValue { key, value })
                    .collect(),
            }
        });
        statuses.collect()
    }

    /// Publishes until the task is stopped.
    pub(crate) async fn run(
        self,
        node: String,
        clock: Clock,
        gate: Gate,
        publisher: Publisher<DiagnosticArray>,
    ) {
        let mut period = tokio::time::interval(PERIOD);
        period.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        period.tick().await;
        loop {
            period.tick().await;
            let header = Header {
                stamp: Time::from_nanos(clock.now_nanos()),
                frame_id: String::new(),
            };
            let status = self.check(&node, gate.is_open());
            // Its own refusals are told by the next one that gets through.
            publisher
                .publish(DiagnosticArray { header, status })
                .left_to_diagnostics();
        }
    }

    // A check that panicked leaves the list as it was.
    fn lock(&self) -> std::sync::MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Task {
    /// What a report says now: what is counted and long past is left out.
    fn said(&mut self, report: &Report, now: Instant) -> (Level, String) {
        report.said(|fault| {
            let count = fault.count.as_ref();
            count.is_none_or(|(what, count)| self.counts.is_fresh(what, *count, now))
        })
    }

    fn log_change(&self, level: Level, message: &str) {
        let before = self.last.unwrap_or(Level::Ok);
        if level == before {
            return;
        }
        let name = &self.name;
        match level {
            Level::Ok => tracing::info!("{name}: {message}"),
            Level::Warn | Level::Stale => tracing::warn!("{name}: {message}"),
            Level::Error => tracing::error!("{name}: {message}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is counted is said for a minute after it has happened last, and once more when it happens again; what holds on is said as
    /// long as it does.
    #[test]
    fn what_is_past_clears() {
        let diagnostics = Diagnostics::default();
        let gaps = Arc::new(std::sync::atomic::AtomicU64::new(0));
        let count = Arc::clone(&gaps);
        diagnostics.add("imu stream", move || {
            let gaps = count.load(std::sync::atomic::Ordering::Relaxed);
            Report::ok("100 Hz").counted(Level::Warn, "gaps", gaps, "gaps")
        });
        diagnostics.add("disk", || Report::ok("").worsened(Level::Error, "full"));
        let begun = Instant::now();
        let level = |seconds| {
            let now = begun + Duration::from_secs(seconds);
            let statuses = diagnostics.check_at("n", true, now);
            assert_eq!(statuses[1].level, Level::Error as u8);
            statuses[0].level
        };
        let happens = || gaps.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let (ok, warn) = (Level::Ok as u8, Level::Warn as u8);
        assert_eq!(level(0), ok);
        happens();
        assert_eq!(
            [level(1), level(60), level(61), level(500)],
            [warn, warn, ok, ok]
        );
        happens();
        assert_eq!([level(501), level(562)], [warn, ok]);
    }

    /// A report carries node, task, level and values in the form of diagnostic_updater.
    #[test]
    fn a_task_becomes_a_status() {
        let diagnostics = Diagnostics::default();
        diagnostics.set_hardware_id("rlg-1");
        diagnostics.add("imu stream", || {
            Report::ok("100 Hz")
                .with("gaps", 3)
                .worsened(Level::Warn, "3 gaps")
        });
        let status = &diagnostics.check("calibrator", true)[0];
        assert_eq!(
            (status.name.as_str(), status.level),
            ("calibrator: imu stream", DiagnosticStatus::WARN)
        );
        assert_eq!(
            (status.message.as_str(), status.hardware_id.as_str()),
            ("3 gaps", "rlg-1")
        );
        assert_eq!(
            (
                status.values[0].key.as_str(),
                status.values[0].value.as_str()
            ),
            ("gaps", "3")
        );
    }

    /// While the node is inactive nobody's silence is a fault; built-in tasks report all the same.
    #[test]
    fn inactive_nodes_report_no_faults() {
        let diagnostics = Diagnostics::default();
        diagnostics.add("imu stream", || Report::error("silent"));
        diagnostics.add_built_in("topics", || Report::warn("lost"));
        let told = |active| {
            let statuses = diagnostics.check("n", active);
            statuses.into_iter().map(|s| s.message).collect::<Vec<_>>()
        };
        assert_eq!(told(true), ["silent", "lost"]);
        assert_eq!(told(false), ["inactive", "lost"]);
        diagnostics.clear();
        assert_eq!(told(true), ["lost"]);
    }

    /// What is only a warning does not hide an error, and of two warnings none hides the other.
    #[test]
    fn worsened_keeps_the_worst() {
        assert_eq!(
            Report::error("a").worsened(Level::Warn, "b"),
            Report::error("a")
        );
        assert_eq!(
            Report::warn("a").worsened(Level::Warn, "b"),
            Report::warn("a; b")
        );
    }
}
