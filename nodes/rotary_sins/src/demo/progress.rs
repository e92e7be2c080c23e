//! The run in place on the terminal; a line now and then where standard error is none.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use rotary_sins_msgs::{SchemeStatus, SelfCalibrationEstimate};
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

use super::Options;
use super::watch::{CONSUMERS, Seen};

/// Wall time between two lines where there is no terminal.
const LINE_PERIOD: Duration = Duration::from_secs(10);

/// Shows where the run stands.
pub struct DemoBar {
    bar: ProgressBar,
    lines: Vec<ProgressBar>,
    terminal: bool,
    next_line: Duration,
}

impl DemoBar {
    /// Nothing has happened yet.
    pub fn new(duration_s: f64) -> Self {
        let all = MultiProgress::new();
        let bar = all.add(ProgressBar::new(duration_s.ceil() as u64));
        // The templates are constants; a fault in them would leave the default style.
        if let Ok(style) = ProgressStyle::with_template("[{bar:40}] {percent:>3} %  {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        let lines = (0..5)
            .map(|_| {
                let line = all.add(ProgressBar::new_spinner());
                if let Ok(style) = ProgressStyle::with_template("{msg}") {
                    line.set_style(style);
                }
                line
            })
            .collect();
        Self {
            bar,
            lines,
            terminal: std::io::stderr().is_terminal(),
            next_line: Duration::ZERO,
        }
    }

    /// Shows the newest state.
    pub fn show(&mut self, seen: &Seen, args: &Options, wall: Duration) {
        let elapsed_s = seen.scheme.as_ref().map_or(0.0, |status| status.elapsed);
        let head = head(elapsed_s, args.duration_s(), wall);
        if self.terminal {
            self.bar.set_position(elapsed_s as u64);
            self.bar.set_message(head);
            for (line, text) in self.lines.iter().zip(lines(seen)) {
                line.set_message(text);
            }
        } else if wall >= self.next_line {
            self.next_line = wall + LINE_PERIOD;
            let [scheme, phase, ..] = lines(seen);
            eprintln!("{head} | {scheme} | {phase}");
        }
    }

    /// Leaves the last state on the terminal.
    pub fn finish(&self) {
        for bar in std::iter::once(&self.bar).chain(&self.lines) {
            bar.abandon();
        }
    }
}

/// Times: simulated, and on the wall.
fn head(elapsed_s: f64, duration_s: f64, wall: Duration) -> String {
    let remaining = if elapsed_s > 60.0 {
        let seconds = wall.as_secs_f64() * (duration_s - elapsed_s).max(0.0) / elapsed_s;
        format!("about {} left", clock(seconds))
    } else {
        "starting".to_owned()
    };
    format!(
        "{} of {} simulated, {} elapsed, {remaining}",
        clock(elapsed_s),
        clock(duration_s),
        clock(wall.as_secs_f64())
    )
}

fn clock(seconds: f64) -> String {
    let seconds = seconds.max(0.0) as u64;
    format!(
        "{}:{:02}:{:02}",
        seconds / 3600,
        seconds / 60 % 60,
        seconds % 60
    )
}

fn lines(seen: &Seen) -> [String; 5] {
    let scheme = seen
        .scheme
        .as_ref()
        .map_or_else(|| "waiting for the nodes".to_owned(), scheme_line);
    let Some(estimate) = &seen.estimate else {
        return [
            scheme,
            "no samples yet".to_owned(),
            String::new(),
            String::new(),
            String::new(),
        ];
    };
    let lost: Vec<_> = CONSUMERS
        .iter()
        .filter_map(|consumer| seen.counts(consumer).map(|counts| counts.lost))
        .collect();
    let phase = format!(
        "phase {}, {} samples, {} lost",
        estimate.phase_name.replace('_', " "),
        estimate.samples,
        lost.iter()
            .max()
            .copied()
            .unwrap_or(estimate.lost_samples)
            .max(estimate.lost_samples)
    );
    if estimate.state.is_empty() {
        return [
            scheme,
            phase,
            estimate.message.clone(),
            String::new(),
            String::new(),
        ];
    }
    [
        scheme,
        phase,
        triple(
            "drift   deg/h ",
            estimate.gyroscope_drift,
            estimate.gyroscope_drift_std,
            DEG_PER_HOUR,
            5,
        ),
        triple(
            "bias    ug    ",
            estimate.accelerometer_bias,
            estimate.accelerometer_bias_std,
            MICRO_G,
            2,
        ),
        attitude(estimate),
    ]
}

fn scheme_line(status: &SchemeStatus) -> String {
    let what = match status.state {
        SchemeStatus::DWELLING => "dwelling",
        SchemeStatus::ROTATING => "rotating",
        SchemeStatus::WAITING_FOR_TABLE => "waiting for the table",
        SchemeStatus::FINISHED => "finished",
        SchemeStatus::PAUSED => "paused",
        SchemeStatus::ABORTED => "aborted",
        SchemeStatus::FAULT => "fault",
        _ => "idle",
    };
    format!(
        "{}: cycle {}, step {} of {}, position {}, {what}",
        status.scheme,
        status.cycle + 1,
        status.step,
        status.steps_per_cycle,
        status.position
    )
}

fn triple(name: &str, values: [f64; 3], sigmas: [f64; 3], unit: f64, digits: usize) -> String {
    let axes = ["x", "y", "z"];
    let parts: Vec<_> = (0..3)
        .map(|i| {
            format!(
                "{} {:>10.digits$} ± {:<9.digits$}",
                axes[i],
                values[i] / unit,
                sigmas[i] / unit
            )
        })
        .collect();
    format!("{name}{}", parts.join(" "))
}

/// Heading, pitch and roll stand for the three misalignments, which are fed back and so zero.
fn attitude(estimate: &SelfCalibrationEstimate) -> String {
    let part = |name: &str, angle: f64, sigma: f64| {
        format!(
            "{name} {:.5} ± {:.1}\"",
            angle.to_degrees(),
            sigma / ARC_SECOND
        )
    };
    format!(
        "attitude deg  {}  {}  {}",
        part("heading", estimate.heading, estimate.heading_std),
        part("pitch", estimate.pitch, estimate.pitch_std),
        part("roll", estimate.roll, estimate.roll_std)
    )
}
