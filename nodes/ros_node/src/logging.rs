//! Log lines as ROS users know them, on standard error and on `/rosout`.
//!
//! Nodes use the macros of `tracing`; this gives them their form: `[INFO] [2026-03-01T07:30:00.123456Z] [name]: text`. The
//! stamp is a date in UTC, as people and other logs of a ship have it; on `/rosout` it is the message's own.

use std::fmt::{self, Write as _};
use std::io::Write as _;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use chrono::{DateTime, SecondsFormat};
use ros2_interfaces::builtin_interfaces::Time;
use ros2_interfaces::rcl_interfaces::Log;
use tokio::sync::mpsc;
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

use crate::clock::system_nanos;

/// Lines that wait for `/rosout`; what comes while it is full is only on standard error.
const ROSOUT_BACKLOG: usize = 1000;

static ROSOUT: OnceLock<mpsc::Sender<Log>> = OnceLock::new();
static ROSOUT_OVERFLOW: AtomicU64 = AtomicU64::new(0);
static LOGGER: OnceLock<Logger> = OnceLock::new();

#[derive(Debug)]
struct Logger {
    name: String,
    console: bool,
}

/// Sends the process's log lines to standard error under this name. Only the first call has an effect.
pub fn install(name: &str, level: Level, console: bool) {
    if LOGGER
        .set(Logger {
            name: name.to_owned(),
            console,
        })
        .is_err()
    {
        return;
    }
    // The middleware's own remarks are for its developers; its errors are for everybody.
    let targets = ["rustdds", "ros2_client", "mio", "mio_extras", "polling"]
        .iter()
        .fold(
            Targets::new().with_default(LevelFilter::from_level(level)),
            |targets, name| targets.with_target(*name, LevelFilter::ERROR),
        );
    // A subscriber that is there already (a test's) stays.
    tracing_subscriber::registry()
        .with(RosLayer.with_filter(targets))
        .try_init()
        .ok();
}

/// Where lines for `/rosout` come out; once in a process.
pub(crate) fn rosout_lines() -> Option<mpsc::Receiver<Log>> {
    let (sender, receiver) = mpsc::channel(ROSOUT_BACKLOG);
    ROSOUT.set(sender).ok().map(|()| receiver)
}

/// Lines that had no room on their way to `/rosout`.
pub(crate) fn rosout_overflow() -> u64 {
    ROSOUT_OVERFLOW.load(Ordering::Relaxed)
}

/// A line at the level FATAL, which `tracing` does not have.
pub fn fatal(text: &str) {
    emit("FATAL", Log::FATAL, text.to_owned(), ("", "", 0));
}

struct RosLayer;

impl<S: Subscriber> Layer<S> for RosLayer {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let mut text = Text::default();
        event.record(&mut text);
        let metadata = event.metadata();
        let (label, level) = match *metadata.level() {
            Level::ERROR => ("ERROR", Log::ERROR),
            Level::WARN => ("WARN", Log::WARN),
            Level::INFO => ("INFO", Log::INFO),
            Level::DEBUG | Level::TRACE => ("DEBUG", Log::DEBUG),
        };
        let place = (
            metadata.file().unwrap_or(""),
            metadata.target(),
            metadata.line().unwrap_or(0),
        );
        emit(label, level, text.0, place);
    }
}

fn emit(label: &str, level: u8, msg: String, (file, function, line): (&str, &str, u32)) {
    let now = system_nanos();
    let stamp = Time::from_nanos(now);
    let logger = LOGGER.get();
    let name = logger.map_or("ros_node", |logger| logger.name.as_str());
    if logger.is_none_or(|logger| logger.console) {
        // Standard error that is gone leaves nowhere to tell it.
        writeln!(
            std::io::stderr().lock(),
            "[{label}] [{}] [{name}]: {msg}",
            date(now)
        )
        .ok();
    }
    if let Some(rosout) = ROSOUT.get() {
        let log = Log {
            stamp,
            level,
            name: name.to_owned(),
            msg,
            file: file.to_owned(),
            function: function.to_owned(),
            line,
        };
        // The line is on standard error all the same, and a remark on that would not get further.
        if rosout.try_send(log).is_err() {
            ROSOUT_OVERFLOW.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Date and time in UTC, to the microsecond.
fn date(nanos: i64) -> String {
    DateTime::from_timestamp_nanos(nanos).to_rfc3339_opts(SecondsFormat::Micros, true)
}

/// The message of an event, its other fields behind it.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0.insert_str(0, &format!("{value:?}"));
        } else if !field.name().starts_with("log.") {
            write!(self.0, " {}={value:?}", field.name()).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    /// A stamp is a date that a person reads.
    #[test]
    fn stamps_are_dates() {
        assert_eq!(
            super::date(1_760_000_000_123_456_789),
            "2025-10-09T08:53:20.123456Z"
        );
    }
}
