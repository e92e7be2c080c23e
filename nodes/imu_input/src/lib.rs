//! What the nodes that take the samples of an IMU on a table have in common: how the samples come.

use ros_node::{InputWatch, Level, Report, StreamMonitor};
use sins::Stamp;
use sins::stream::counts::StreamCounts;

/// Names of frames are no longer.
const LONGEST_FRAME: usize = 256;

/// Whether the name of a frame is taken over into what is published: there is one, and no message grows large by it.
pub fn is_frame(name: &str) -> bool {
    (1..=LONGEST_FRAME).contains(&name.len())
}

/// How the samples come: their arrival, their rate, and what the machine counts of them.
pub fn samples_report(
    watch: &InputWatch,
    stamps: &StreamMonitor,
    counts: StreamCounts,
    publishers: &Publishers,
) -> Report {
    let report = watch
        .report()
        .with("rate [Hz]", format!("{:.3}", stamps.rate().unwrap_or(0.0)))
        .with("samples", counts.samples)
        .with("gaps", counts.gaps)
        .with("lost", counts.lost)
        .with("repeated", counts.repeated)
        .with("backward", counts.backward)
        .with("stamps alone", counts.alone)
        .with("not finite", counts.not_finite)
        .with("beyond range", counts.beyond_range)
        .with("spikes", counts.spikes)
        .with("put in order", counts.reordered)
        .with("restarts", counts.restarts)
        .with("publishers", publishers.names.join(", "))
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
    let topic = watch.topic();
    let gaps = format!(
        "{topic}: {} gaps, {} samples lost",
        counts.gaps, counts.lost
    );
    let refused = format!("{topic}: {} samples refused", counts.refused());
    let restarts = format!("{topic}: the clock was broken {} times", counts.restarts);
    let report = report
        .counted(Level::Warn, "gaps", counts.gaps, &gaps)
        .counted(Level::Warn, "refused", counts.refused(), &refused)
        .counted(Level::Warn, "restarts", counts.restarts, &restarts);
    match publishers.several() {
        Some(several) => report.worsened(Level::Warn, &format!("{topic}: {several}")),
        None => report,
    }
}

/// Who publishes on the topic of the samples; says it once where it is more than one.
#[derive(Clone, Debug, Default)]
pub struct Publishers {
    names: Vec<String>,
}

impl Publishers {
    /// Takes the full names of the nodes that publish now.
    pub fn take(&mut self, topic: &str, names: Vec<String>) {
        if names == self.names {
            return;
        }
        self.names = names;
        if let Some(several) = self.several() {
            tracing::warn!("{topic}: {several}");
        }
    }

    /// What to say where there is more than one.
    fn several(&self) -> Option<String> {
        (self.names.len() > 1).then(|| {
            format!(
                "{} publishers, expected one ({}): the samples of several units cannot be told apart",
                self.names.len(),
                self.names.join(", ")
            )
        })
    }
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
        let report = |stamps: &StreamMonitor| {
            samples_report(&watch, stamps, StreamCounts::default(), &one())
        };
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

    fn one() -> Publishers {
        let mut publishers = Publishers::default();
        publishers.take("imu/data_raw", vec!["/imu_simulator".to_owned()]);
        publishers
    }

    /// Two publishers are a warning that names their nodes; samples that were refused are one too.
    #[test]
    fn two_publishers_are_told() {
        let watch = InputWatch::required("imu/data_raw", Duration::from_secs(2));
        let stamps = StreamMonitor::default();
        let report = |counts, publishers: &_| samples_report(&watch, &stamps, counts, publishers);
        let counts = StreamCounts::default();
        let alone = report(counts, &one());
        assert_eq!(alone.value("publishers"), Some("/imu_simulator"));
        assert!(!format!("{alone:?}").contains("publishers, expected one"));
        let mut two = one();
        two.take(
            "imu/data_raw",
            vec!["/imu_driver".to_owned(), "/imu_simulator".to_owned()],
        );
        let two = format!("{:?}", report(counts, &two));
        assert!(
            two.contains("imu/data_raw: 2 publishers, expected one (/imu_driver, /imu_simulator)"),
            "{two}"
        );
        let refused = StreamCounts {
            repeated: 7,
            ..counts
        };
        assert!(format!("{:?}", report(refused, &one())).contains("7 samples refused"));
    }
}
