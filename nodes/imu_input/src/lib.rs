//! What the nodes that take the samples of an IMU on a table have in common: parameters, and how the samples come.

mod parameters;

use ros_node::{InputWatch, Level, Report, StreamMonitor};
use sins::sampling::StreamCounts;

pub use parameters::{Number, declarations, noise, numbers, queue_depth, turntable};

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
        .with("restarts", restarts);
    if counts.gaps == 0 {
        return report;
    }
    let (topic, gaps, lost) = (watch.topic(), counts.gaps, counts.lost);
    report.worsened(
        Level::Warn,
        &format!("{topic}: {gaps} gaps, {lost} samples lost"),
    )
}
