//! The page: everything on 80 columns and 24 lines; a larger terminal gives its lines to the faults and its columns to the curves.

use std::time::Instant;

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style},
    text::{Line, Span},
    widgets::{Paragraph, Wrap},
};
use rotary_sins_msgs::interfaces::topics::{ESTIMATE, SCHEME_STATUS};
use rotary_sins_msgs::{SchemeStatus, SelfCalibrationEstimate};
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

use super::state::{MonitorState, NINE, SILENCE, is_known, sigmas, thresholds};
use analysis::significant;

/// Names, units and SI of a unit of the nine.
const ROWS: [(&str, &str, f64); NINE] = [
    ("misalignment E", "arcsec", ARC_SECOND),
    ("misalignment N", "arcsec", ARC_SECOND),
    ("misalignment U", "arcsec", ARC_SECOND),
    ("gyro drift x", "deg/h", DEG_PER_HOUR),
    ("gyro drift y", "deg/h", DEG_PER_HOUR),
    ("gyro drift z", "deg/h", DEG_PER_HOUR),
    ("acc bias x", "ug", MICRO_G),
    ("acc bias y", "ug", MICRO_G),
    ("acc bias z", "ug", MICRO_G),
];
/// Lines for the reason of an inconsistent run.
const REASON_LINES: u16 = 2;
/// Columns of a row before its curve.
const BEFORE_CURVE: usize = 52;
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// How the page looks: colours, or none of them (NO_COLOR). Words always say the same.
#[derive(Clone, Copy)]
pub struct Look {
    /// Whether colours are used.
    pub colour: bool,
}

impl Look {
    fn of(self, colour: Color) -> Style {
        if self.colour {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }
}

/// Draws the page.
pub fn page(frame: &mut Frame, state: &MonitorState, now: Instant, look: Look) {
    let why = reason(state);
    let ahead = outlook_lines(state, usize::from(frame.area().width));
    let [
        title,
        scheme,
        outlook,
        table,
        groups,
        numbers,
        because,
        faults,
        foot,
    ] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(3),
        Constraint::Length(ahead.len() as u16),
        Constraint::Length(NINE as u16 + 1),
        Constraint::Length(1),
        Constraint::Length(3),
        Constraint::Length(if why.is_some() { REASON_LINES } else { 0 }),
        Constraint::Min(3),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    frame.render_widget(Paragraph::new(title_line(state, now, look)), title);
    frame.render_widget(
        Paragraph::new(scheme_lines(state, now, look, scheme.width)),
        scheme,
    );
    frame.render_widget(Paragraph::new(ahead), outlook);
    frame.render_widget(
        Paragraph::new(estimate_lines(state, now, look, table)),
        table,
    );
    let known = fit(&groups_line(state), usize::from(groups.width));
    frame.render_widget(Paragraph::new(known), groups);
    frame.render_widget(Paragraph::new(number_lines(state, look)), numbers);
    let why = Paragraph::new(why.unwrap_or_default()).style(look.of(Color::Red));
    frame.render_widget(why.wrap(Wrap { trim: true }), because);
    frame.render_widget(
        Paragraph::new(fault_lines(state, now, look, faults)),
        faults,
    );
    frame.render_widget(
        Paragraph::new("q quits   ✓ sigma below its threshold   curves: log sigma since start"),
        foot,
    );
}

fn bold(text: impl Into<String>) -> Span<'static> {
    Span::styled(text.into(), Style::new().add_modifier(Modifier::BOLD))
}

/// Cuts a text to a width, with an ellipsis where something is missing.
fn fit(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let mut cut: String = text.chars().take(width.saturating_sub(1)).collect();
    cut.push('…');
    cut
}

fn title_line(state: &MonitorState, now: Instant, look: Look) -> Line<'static> {
    let mut spans = vec![bold("Rotary SINS  ")];
    match state.newest(now) {
        None => spans.push(Span::styled("nothing heard yet", look.of(Color::Yellow))),
        Some(age) if age > SILENCE => spans.push(Span::styled(
            format!("NO DATA for {} s", age.as_secs()),
            look.of(Color::Red).add_modifier(Modifier::BOLD),
        )),
        Some(_) => {
            let phase = state
                .estimate
                .as_ref()
                .map_or("no estimate yet", |e| e.message.phase_name.as_str());
            let colour = match phase {
                "converged" => Color::Green,
                "inconsistent" => Color::Red,
                _ => Color::Cyan,
            };
            let style = look.of(colour).add_modifier(Modifier::BOLD);
            spans.push(Span::styled(phase.replace('_', " "), style));
        }
    }
    if let Some(estimate) = &state.estimate {
        spans.push(Span::raw(format!(
            "   {} since the first sample",
            clock(estimate.message.duration)
        )));
    }
    Line::from(spans)
}

fn clock(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "-:--:--".to_owned();
    }
    let s = seconds as u64;
    format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

fn stale(text: &str, at: Instant, now: Instant, look: Look) -> Option<Span<'static>> {
    let age = now.saturating_duration_since(at);
    (age > SILENCE).then(|| {
        Span::styled(
            format!("  {text}: no data for {} s", age.as_secs()),
            look.of(Color::Red),
        )
    })
}

fn scheme_lines(state: &MonitorState, now: Instant, look: Look, width: u16) -> Vec<Line<'static>> {
    let Some(heard) = &state.scheme else {
        return vec![
            Line::raw(""),
            Line::raw(format!(
                "{}: nothing heard; is a sequencer running?",
                SCHEME_STATUS.name
            )),
        ];
    };
    let s = &heard.message;
    let doing = match s.state {
        SchemeStatus::IDLE => "idle",
        SchemeStatus::WAITING_FOR_TABLE => "waiting for the table",
        SchemeStatus::DWELLING => "dwelling",
        SchemeStatus::ROTATING => "rotating",
        SchemeStatus::PAUSED => "paused",
        SchemeStatus::ABORTED => "aborted",
        SchemeStatus::FINISHED => "finished",
        SchemeStatus::FAULT => "FAULT",
        _ => "unknown state",
    };
    let mut first = vec![
        bold(fit(&s.scheme, 24)),
        Span::raw(format!(
            "  cycle {} step {} of {}  position {}  ",
            s.cycle + 1,
            s.step,
            s.steps_per_cycle,
            fit(&s.position, 10)
        )),
        bold(doing),
        Span::raw(format!(
            " for {:.0} s",
            (s.elapsed - state.place_since_s).max(0.0)
        )),
    ];
    first.extend(stale("scheme", heard.at, now, look));
    let next = if s.rotation_axis.is_empty() {
        String::new()
    } else {
        format!(
            "   {} {:+.0} deg about {}",
            if s.state == SchemeStatus::ROTATING {
                "now"
            } else {
                "next"
            },
            s.rotation_angle_rad.to_degrees(),
            s.rotation_axis
        )
    };
    let remaining = if s.remaining < 0.0 {
        "until stopped".to_owned()
    } else {
        format!("{} left", clock(s.remaining))
    };
    vec![
        Line::from(first),
        Line::raw(format!("{} elapsed, {remaining}{next}", clock(s.elapsed))),
        Line::raw(fit(&s.message, usize::from(width))),
    ]
}

/// What the calibrator says of the thresholds and of the rotation that would bring most, and what the end of the scheme brings:
/// two lines; one where there is no more to say, none where nothing was heard.
fn outlook_lines(state: &MonitorState, width: usize) -> Vec<Line<'static>> {
    let Some(heard) = &state.outlook else {
        return Vec::new();
    };
    // Its parts are thresholds, end, rotation, doubt. What may be cut off comes last.
    let parts = heard.message.message.split("; ");
    let (end, mut others): (Vec<&str>, Vec<&str>) =
        parts.partition(|part| part.contains("'s end ("));
    others.sort_by_key(|part| !part.starts_with("best next"));
    let lines = [others.join("; "), end.join("; ")].into_iter();
    let told = lines.filter(|line| !line.is_empty());
    told.map(|line| Line::raw(fit(&line, width))).collect()
}

fn estimate_lines(
    state: &MonitorState,
    now: Instant,
    look: Look,
    area: Rect,
) -> Vec<Line<'static>> {
    let mut head = vec![bold(format!(
        "{:<16}{:>11}{:>11}   {:<8}",
        "", "estimate", "1 sigma", ""
    ))];
    let Some(heard) = &state.estimate else {
        return vec![
            Line::from(head),
            Line::raw(format!(
                "{}: nothing heard; is a calibrator running?",
                ESTIMATE.name
            )),
        ];
    };
    head.extend(stale("estimate", heard.at, now, look));
    let estimate = &heard.message;
    let curve = usize::from(area.width).saturating_sub(BEFORE_CURVE);
    let mut lines = vec![Line::from(head)];
    for (index, (name, unit, scale)) in ROWS.into_iter().enumerate() {
        let sigma = sigmas(estimate)[index];
        let value = match index {
            0..3 => "-".to_owned(),
            3..6 => significant(estimate.gyroscope_drift[index - 3] / scale),
            _ => significant(estimate.accelerometer_bias[index - 6] / scale),
        };
        let limit = thresholds(estimate)[index];
        let mark = match (limit.is_finite(), is_known(sigma) && sigma <= limit) {
            (false, _) => ' ',
            (true, true) => '✓',
            (true, false) => '·',
        };
        let style = look.of(if mark == '✓' {
            Color::Green
        } else {
            Color::Reset
        });
        lines.push(Line::from(vec![
            Span::raw(format!("{name:<16}{value:>11}")),
            Span::styled(format!("{:>11} {mark}", sigma_text(sigma / scale)), style),
            Span::raw(format!(" {unit:<7}  ")),
            Span::styled(sparkline(state.history(index), curve), look.of(Color::Cyan)),
        ]));
    }
    lines
}

/// The logarithm of positive values in eighths of a line, resampled to `width`; a space where a value is none.
pub fn sparkline(values: impl Iterator<Item = f64>, width: usize) -> String {
    let logs: Vec<f64> = values.map(f64::log10).collect();
    let finite = || logs.iter().copied().filter(|v| v.is_finite());
    let (low, high) = (
        finite().fold(f64::INFINITY, f64::min),
        finite().fold(f64::NEG_INFINITY, f64::max),
    );
    let columns = width.min(logs.len());
    (0..columns)
        .map(|column| {
            let value = logs[column * logs.len() / columns];
            if !value.is_finite() {
                return ' ';
            }
            let share = if high > low {
                (value - low) / (high - low)
            } else {
                0.0
            };
            BARS[((share * 7.0).round() as usize).min(7)]
        })
        .collect()
}

/// How well the groups of the whole model are known: nothing where none is estimated.
fn groups_line(state: &MonitorState) -> String {
    let groups = state.groups();
    let known = |(name, share): &(&str, f64)| format!("{name} {:.0}", 100.0 * share);
    if groups.is_empty() {
        return String::new();
    }
    format!(
        "learned %: {}",
        groups.iter().map(known).collect::<Vec<_>>().join(", ")
    )
}

/// A sigma with its significant digits, or a dash where it is not known.
fn sigma_text(sigma: f64) -> String {
    if is_known(sigma) {
        significant(sigma)
    } else {
        "-".to_owned()
    }
}

/// Why the run is inconsistent, as its message has it.
fn reason(state: &MonitorState) -> Option<String> {
    let e = &state.estimate.as_ref()?.message;
    (e.phase == SelfCalibrationEstimate::INCONSISTENT).then(|| format!("because: {}", e.words()))
}

/// What is thought of the innovations. The phase is the judge's word on the run: small innovations do not make it consistent.
fn agreement(e: &SelfCalibrationEstimate) -> (&'static str, Color) {
    match e.phase {
        SelfCalibrationEstimate::INCONSISTENT => ("INCONSISTENT", Color::Red),
        SelfCalibrationEstimate::WAITING_FOR_POSITION
        | SelfCalibrationEstimate::COARSE_ALIGNMENT => ("not judged yet", Color::Cyan),
        _ if e.nis_window_mean <= e.nis_upper_bound => ("consistent", Color::Green),
        _ => ("above its bound", Color::Red),
    }
}

fn number_lines(state: &MonitorState, look: Look) -> Vec<Line<'static>> {
    let Some(heard) = &state.estimate else {
        return Vec::new();
    };
    let e: &SelfCalibrationEstimate = &heard.message;
    let angle = |name: &str, value: f64, sigma: f64| {
        if !is_known(sigma) {
            return format!("{name} -");
        }
        format!(
            "{name} {:.4} ± {:.4}",
            value.to_degrees(),
            sigma.to_degrees()
        )
    };
    let (verdict, colour) = agreement(e);
    let of = |node: &str, key: &str| {
        state
            .value(&format!("{node}: imu samples"), key)
            .unwrap_or("-")
            .to_owned()
    };
    vec![
        Line::raw(format!(
            "{}  {}  {} deg",
            angle("heading", e.heading, e.heading_std),
            angle("roll", e.roll, e.roll_std),
            angle("pitch", e.pitch, e.pitch_std)
        )),
        Line::from(vec![
            Span::raw(format!(
                "NIS {:.2}, mean {:.2}, bound {:.2}: ",
                e.nis, e.nis_window_mean, e.nis_upper_bound
            )),
            Span::styled(verdict, look.of(colour)),
        ]),
        Line::raw(format!(
            "samples {}  gaps {}  lost {}  IMU {} Hz; compensator gaps {} lost {}",
            e.samples,
            e.gaps,
            e.lost_samples,
            of("self_calibrator", "rate [Hz]"),
            of("navigation_compensator", "gaps"),
            of("navigation_compensator", "lost"),
        )),
    ]
}

fn fault_lines(state: &MonitorState, now: Instant, look: Look, area: Rect) -> Vec<Line<'static>> {
    let faults = state.faults(now);
    let (width, height) = (usize::from(area.width), usize::from(area.height));
    if faults.is_empty() {
        let text = if state.diagnostics.is_empty() {
            "/diagnostics: nothing heard"
        } else {
            "diagnostics: no faults"
        };
        return vec![Line::raw(text)];
    }
    let shown = if faults.len() > height {
        height - 1
    } else {
        faults.len()
    };
    let mut lines: Vec<Line> = faults
        .iter()
        .take(shown)
        .map(|fault| {
            let (word, colour) = match fault.level {
                1 => ("WARN", Color::Yellow),
                2 => ("ERROR", Color::Red),
                _ => ("STALE", Color::Magenta),
            };
            let text = format!("{}: {}", fault.name, fault.message);
            Line::from(vec![
                Span::styled(format!("{word:<6}"), look.of(colour)),
                Span::raw(fit(&text, width.saturating_sub(6))),
            ])
        })
        .collect();
    if shown < faults.len() {
        lines.push(Line::raw(format!("and {} more", faults.len() - shown)));
    }
    lines
}

#[cfg(test)]
#[path = "draw_tests.rs"]
mod tests;
