//! What the nodes that take the samples of an IMU on a table have in common: how the samples come.

use ros_node::{InputWatch, Level, Report, StreamMonitor};
use sins::Stamp;
use sins::stream::sampling::StreamCounts;

/// How the samples come: their arrival, their rate, and what the machine counts of them.
pub fn samples_report(
    watch: &InputWatch,
    stamps: &StreamMonitor,
    counts: StreamCounts,
    not_finite: u64,
    restarts: u64,
) -> Report {
    let report = watch
        .report()
        .with("rate [Hz]", format!("{:.3}", stamps.rate().unwrap_or(0.0)))
        .with("samples", counts.samples)
        .with("gaps", counts.gaps)
        .with("lost", counts.lost)
        .with("repeated", counts.repeated)
        .with("backward", counts.backward)
        .with("not finite", not_finite)
        .with("restarts", restarts)
        .with("zero stamps", stamps.zero())
        .with("jitter [ms]", milliseconds(stamps.jitter_nanos()))
        .with(
            "longest interval [ms]",
            milliseconds(Some(stamps.longest_nanos())),
        )
        .with("last good stamp [s]", seconds(stamps.last_nanos()));
    // One is where a simulated clock begins.
    if stamps.zero() > 1 {
        let (topic, zero) = (watch.topic(), stamps.zero());
        return report.worsened(
            Level::Error,
            &format!(
                "{topic}: {zero} messages without a stamp: the driver does not set header.stamp"
            ),
        );
    }
    if counts.gaps == 0 {
        return report;
    }
    let (topic, gaps, lost) = (watch.topic(), counts.gaps, counts.lost);
    report.worsened(
        Level::Warn,
        &format!("{topic}: {gaps} gaps, {lost} samples lost"),
    )
}

fn milliseconds(nanos: Option<i64>) -> String {
    nanos.map_or_else(
        || "unknown".to_owned(),
        |nanos| format!("{:.3}", nanos as f64 * 1e-6),
    )
}

/// Seconds and nanoseconds, as the log has them.
fn seconds(nanos: Option<i64>) -> String {
    nanos.map_or_else(
        || "none".to_owned(),
        |nanos| {
            let (seconds, rest) = Stamp::from_nanos(nanos).sec_nanosec();
            format!("{seconds}.{rest:09}")
        },
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// A driver that never sets the stamp is told as what it is, not as repeated samples.
    #[test]
    fn missing_stamps_are_an_error() {
        let watch = InputWatch::required("imu/data_raw", Duration::from_secs(2));
        let mut stamps = StreamMonitor::default();
        for nanos in [5_000_000, 15_000_000, 26_000_000, 35_000_000] {
            stamps.ingest(nanos);
        }
        let report =
            |stamps: &StreamMonitor| samples_report(&watch, stamps, StreamCounts::default(), 0, 0);
        let good = report(&stamps);
        assert_eq!(good.level(), Level::Ok);
        assert_eq!(good.value("jitter [ms]"), Some("2.000"));
        assert_eq!(good.value("last good stamp [s]"), Some("0.035000000"));
        stamps.ingest(0);
        assert_eq!(report(&stamps).level(), Level::Ok);
        stamps.ingest(0);
        assert_eq!(report(&stamps).level(), Level::Error);
        assert_eq!(report(&stamps).value("zero stamps"), Some("2"));
    }
}
