//! The page about a run.

use bags::Bag;
use report::{Cell, Figure, Page, Table, Verdict};
use rotary_sins_msgs::SelfCalibrationEstimate;
use sins::estimation::model;
use sins::machines::self_calibration::TestResult;
use sins::time::Stamp;

use crate::Error;
use crate::words::{decimals, significant};

use super::{
    estimates::{History, phase_name},
    faults::faults,
    figures::Clock,
    gather::{GatheredRun, Source},
    groups,
    scheme::RecordedStep,
    verdict::{Angle, End, Finding, StateAtEnd},
};

/// Steps in the table.
const STEPS: usize = 300;
/// Phases in the table.
const PHASES: usize = 40;

/// What stands in the head of the page.
pub struct Head<'a> {
    /// The bag.
    pub bag: &'a Bag,
    /// The command that gives the page again.
    pub command: &'a str,
    /// Time of the run.
    pub clock: Clock,
    /// Its end.
    pub end: Stamp,
}

impl Head<'_> {
    /// When the run began.
    fn start_utc(&self) -> String {
        let start = chrono::DateTime::from_timestamp_nanos(self.clock.start.nanos());
        start.format("%Y-%m-%d %H:%M:%S%.3f UTC").to_string()
    }
}

/// The page.
pub fn page(
    head: &Head<'_>,
    run: &GatheredRun,
    end: &End,
    findings: &[Finding],
    figures: &[Figure],
) -> Result<Page, Error> {
    let mut page = Page::new("Rotary SINS: one run");
    page.subtitle(subtitle(head, run));
    let (profile, library) = head.bag.written_by();
    page.meta("command", head.command)
        .meta("bag", head.bag.path().display().to_string())
        .meta("start", head.start_utc())
        .meta(
            "duration",
            duration(head.end.seconds_since(head.clock.start)),
        )
        .meta("version", env!("CARGO_PKG_VERSION"))
        .meta("bag written by", format!("{library} (profile {profile})"));
    for finding in findings {
        page.badge(finding.verdict, &finding.text);
    }
    page.paragraph(match run.source {
        Source::Recorded => "The estimates are those that the run's own calibrator published, as the bag has them.".to_owned(),
        Source::Own => format!(
            "The bag has no estimates. Those of this page were made from its samples by rotary-sins {}, as calibrate makes them.",
            env!("CARGO_PKG_VERSION")
        ),
    });

    page.section(2, "At the end");
    if end.states.is_empty() {
        page.note("There is no estimate with numbers: the alignment did not come to its end.");
    } else {
        page.table(state_table(&end.states));
        page.table(angle_table(&end.angles));
    }
    page.table(phase_table(head, run));
    judge_section(&mut page, &run.history);
    groups::section(&mut page, &groups::groups(run));
    if !figures.is_empty() {
        page.section(2, "In the course of time");
    }
    for figure in figures {
        page.figure(figure)?;
    }
    scheme_section(&mut page, head, run);
    fault_section(&mut page, head, run);
    page.section(2, "Topics");
    page.table(topic_table(head, run));
    Ok(page)
}

fn subtitle(head: &Head<'_>, run: &GatheredRun) -> String {
    let name = head.bag.path().file_name().map_or_else(
        || head.bag.path().display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    );
    let scheme = &run.scheme.name;
    if scheme.is_empty() {
        name
    } else {
        format!("{name}, scheme {scheme}")
    }
}

/// `4 h 00 min 02.0 s`.
fn duration(seconds: f64) -> String {
    let tenths = (seconds.max(0.0) * 10.0).round() as u64;
    let (hours, minutes, rest) = (tenths / 36_000, tenths / 600 % 60, tenths % 600);
    let rest = format!("{}.{} s", rest / 10, rest % 10);
    match (hours, minutes) {
        (0, 0) => rest,
        (0, _) => format!("{minutes} min {rest}"),
        _ => format!("{hours} h {minutes:02} min {rest}"),
    }
}

fn state_table(states: &[StateAtEnd]) -> Table {
    let with_truth = states.iter().any(|state| state.error.is_some());
    let mut header = vec!["state", "unit", "estimate", "1 sigma"];
    if with_truth {
        header.extend(["truth", "error", "error / sigma"]);
    }
    let caption = if with_truth {
        "Errors of the sensors and of the attitude at the end, against the recorded truth."
    } else {
        "Errors of the sensors at the end, and how well the attitude is known."
    };
    let mut table = Table::new(caption, header);
    for state in states {
        let label = state.label;
        let digits = decimals(label.unit);
        let number = |value: Option<f64>| {
            Cell::number(
                value.map_or_else(String::new, |v| format!("{:.digits$}", v / label.scale)),
            )
        };
        let mut row = vec![
            Cell::text(format!("{} {}", label.symbol, label.words)),
            Cell::text(label.unit),
            number(state.estimate),
            number(Some(state.sigma)),
        ];
        if with_truth {
            let error = state
                .error
                .map_or_else(String::new, |e| format!("{:+.digits$}", e / label.scale));
            row.extend([number(state.truth), Cell::number(error)]);
            row.push(match state.sigmas() {
                None => Cell::text(""),
                Some(sigmas) if state.is_good() == Some(true) => {
                    Cell::number(format!("{sigmas:+.2}"))
                }
                Some(sigmas) => Cell::Bad(format!("{sigmas:+.2}")),
            });
        }
        table = table.row(row);
    }
    table
}

fn angle_table(angles: &[Angle]) -> Table {
    let with_truth = angles.iter().any(|angle| angle.truth.is_some());
    let mut header = vec!["ship", "deg", "1 sigma, deg"];
    if with_truth {
        header.extend(["truth, deg", "error, deg"]);
    }
    let mut table = Table::new(
        "Attitude of the ship at the end; heading clockwise from true north.",
        header,
    );
    for angle in angles {
        let number = |radians: f64| Cell::number(format!("{:.5}", tidy(radians.to_degrees())));
        let mut row = vec![
            Cell::text(angle.name),
            number(angle.estimate),
            number(angle.sigma),
        ];
        if let Some(truth) = angle.truth {
            let error = angle.estimate - truth;
            let error = error.sin().atan2(error.cos());
            row.push(number(truth));
            row.push(Cell::number(format!("{:+.5}", error.to_degrees())));
        }
        table = table.row(row);
    }
    table
}

/// Without the sign of a zero.
fn tidy(degrees: f64) -> f64 {
    if degrees.abs() < 5e-6 { 0.0 } else { degrees }
}

/// What the judge tested: figures of our own estimates, the words of recorded ones.
fn judge_section(page: &mut Page, history: &History) {
    page.section(2, "What the judge tested");
    if history.tests.is_empty() {
        page.paragraph(match (&history.recorded_words, history.phase) {
            (Some(words), Some(SelfCalibrationEstimate::INCONSISTENT)) => {
                format!("The record has no tests; its last estimate says: {words}.")
            }
            (Some(_), _) => {
                "The record has no tests, and its last estimate was not inconsistent.".to_owned()
            }
            (None, _) => "Nothing could be tested yet.".to_owned(),
        });
    } else {
        page.table(test_table(&history.tests));
    }
}

fn test_table(tests: &[TestResult]) -> Table {
    let mut table = Table::new(
        "Tests of the judge at the end. A figure beyond its bound makes the run inconsistent.",
        ["test", "result", "figure", "bound", "state", "sentence"],
    );
    for test in tests {
        let (verdict, result) = if test.passed {
            (Verdict::Good, "passed")
        } else {
            (Verdict::Bad, "failed")
        };
        let state = test.state.and_then(model::label);
        table = table.row([
            Cell::text(test.name),
            Cell::verdict(verdict, result),
            Cell::number(significant(test.figure)),
            Cell::number(significant(test.bound)),
            Cell::text(state.map_or("", |label| label.words)),
            Cell::text(test.sentence.as_deref().unwrap_or_default()),
        ]);
    }
    table
}

fn phase_table(head: &Head<'_>, run: &GatheredRun) -> Table {
    let phases = &run.history.phases;
    let shown = phases.len().min(PHASES);
    let more = (phases.len() - shown) as u64 + run.history.more_phases;
    let caption = if more == 0 {
        "Phases of self-calibration.".to_owned()
    } else {
        format!("Phases of self-calibration: the first {shown}; {more} more are left out.")
    };
    let mut table = Table::new(caption, ["phase", "from, s", "for, s"]);
    for (at, change) in phases.iter().take(shown).enumerate() {
        let end = phases.get(at + 1).map_or(head.end, |next| next.stamp);
        table = table.row([
            Cell::text(phase_name(change.phase)),
            Cell::number(head.clock.seconds(change.stamp)),
            Cell::number(format!("{:.3}", end.seconds_since(change.stamp))),
        ]);
    }
    table
}

fn scheme_section(page: &mut Page, head: &Head<'_>, run: &GatheredRun) {
    let steps = &run.scheme.steps;
    page.section(2, "Steps of the scheme");
    if steps.is_empty() {
        page.paragraph("The bag has no status of a scheme.");
        return;
    }
    let shown = steps.len().min(STEPS);
    let more = (steps.len() - shown) as u64 + run.scheme.more_steps;
    let left_out = if more == 0 {
        String::new()
    } else {
        format!(": the first {shown}; {more} more are left out")
    };
    let mut table = Table::new(
        format!(
            "Steps of {}{left_out}. A step is a rotation and the dwell after it.",
            run.scheme.name
        ),
        [
            "cycle",
            "step",
            "position",
            "rotation",
            "start, s",
            "rotation, s",
            "dwell, s",
            "duration, s",
        ],
    );
    for step in steps.iter().take(shown) {
        table = table.row(step_row(step, head));
    }
    page.table(table);
}

fn step_row(step: &RecordedStep, head: &Head<'_>) -> Vec<Cell> {
    let end = step.end.unwrap_or(head.end);
    let between = |from: Option<Stamp>, to: Option<Stamp>| {
        Cell::number(from.zip(to).map_or_else(String::new, |(from, to)| {
            format!("{:.2}", to.seconds_since(from))
        }))
    };
    let turn_end = (!step.turn.is_empty()).then(|| step.dwell.unwrap_or(end));
    vec![
        Cell::number(step.cycle.to_string()),
        Cell::number(step.number.to_string()),
        Cell::text(&step.position),
        Cell::text(&step.turn),
        Cell::number(format!("{:.2}", step.start.seconds_since(head.clock.start))),
        between(Some(step.start), turn_end),
        between(step.dwell, Some(end)),
        between(Some(step.start), Some(end)),
    ]
}

fn fault_section(page: &mut Page, head: &Head<'_>, run: &GatheredRun) {
    page.section(2, "Gaps and faults");
    let (faults, more) = faults(run);
    if faults.is_empty() {
        page.paragraph("None: no gap in a regular topic, no damage, no fault of the scheme.");
    } else {
        let caption = if more == 0 {
            "What went wrong, in the order of time.".to_owned()
        } else {
            format!("What went wrong, in the order of time; {more} more are left out.")
        };
        let mut table = Table::new(caption, ["at, s", "where", "what"]);
        for fault in &faults {
            let at = fault
                .stamp
                .map_or_else(String::new, |stamp| head.clock.seconds(stamp));
            table = table.row([
                Cell::number(at),
                Cell::text(&fault.place),
                Cell::text(&fault.text),
            ]);
        }
        page.table(table);
    }
    let diagnostics = run.diagnostics.list();
    if diagnostics.is_empty() {
        return;
    }
    let left_out = match run.diagnostics.more {
        0 => String::new(),
        more => format!(" {more} messages of other kinds are left out."),
    };
    let caption = format!(
        "Diagnostics above OK, each once; those that differ in their numbers alone count as one.{left_out}"
    );
    let mut table = Table::new(caption, ["first at, s", "level", "of", "message", "times"]);
    for diagnostic in diagnostics {
        let (verdict, level) = match diagnostic.level {
            1 => (Verdict::Warn, "warning"),
            2 => (Verdict::Bad, "error"),
            _ => (Verdict::Warn, "stale"),
        };
        table = table.row([
            Cell::number(head.clock.seconds(diagnostic.first)),
            Cell::verdict(verdict, level),
            Cell::text(&diagnostic.name),
            Cell::text(&diagnostic.message),
            Cell::number(diagnostic.count.to_string()),
        ]);
    }
    page.table(table);
}

fn topic_table(head: &Head<'_>, run: &GatheredRun) -> Table {
    let mut table = Table::new(
        "Topics of the bag. Times are seconds from the start, by the stamps of the messages, or by the recorder's clock where they have none (r). Gaps are counted where messages come at a rate; longest is the longest time from one message to the next.",
        [
            "topic",
            "type",
            "messages",
            "Hz",
            "gaps",
            "missing",
            "longest, s",
            "first, s",
            "last, s",
        ],
    );
    for stream in &run.streams {
        let time = |stamp: Option<Stamp>| {
            Cell::number(stamp.map_or_else(String::new, |stamp| {
                let clock = if stream.by_stamp() { "" } else { " r" };
                format!("{}{clock}", head.clock.seconds(stamp))
            }))
        };
        let rate = stream
            .rate_hz()
            .map_or_else(String::new, |rate| format!("{rate:.3}"));
        let counted = |count: u64| {
            if stream.is_regular() {
                count.to_string()
            } else {
                "–".to_owned()
            }
        };
        let longest = if stream.count > 1 {
            format!("{:.3}", stream.longest_s())
        } else {
            String::new()
        };
        table = table.row([
            Cell::text(&stream.name),
            Cell::text(stream.type_name.replace("/msg/", "/")),
            Cell::number(stream.count.to_string()),
            Cell::number(rate),
            Cell::number(counted(stream.gap_count())),
            Cell::number(counted(stream.lost())),
            Cell::number(longest),
            time(stream.span().map(|span| span.0)),
            time(stream.span().map(|span| span.1)),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The section of the judge has a row for every test with its state in words and the sentence of one that failed; without tests
    /// it has the words of the record.
    #[test]
    fn the_judges_tests_are_a_table() {
        let mut history = History::default();
        history.take_phase(Stamp::default(), SelfCalibrationEstimate::INCONSISTENT);
        history.recorded_words = Some("words of the record".to_owned());
        let html = |history: &History| {
            let mut page = Page::new("");
            judge_section(&mut page, history);
            page.to_html()
        };
        assert!(html(&history).contains("words of the record"));
        history.tests = vec![
            TestResult {
                name: "white",
                passed: true,
                figure: 1.05,
                bound: 1.80,
                ..TestResult::default()
            },
            TestResult {
                name: "left_out_state",
                figure: 29.9,
                bound: 5.0,
                state: Some("gyroscope_scale_factor_x"),
                sentence: Some("the model paper does not hold it".to_owned()),
                ..TestResult::default()
            },
        ];
        let html = html(&history);
        for words in [
            "white",
            "passed",
            "left_out_state",
            "failed",
            "29.9",
            "gyroscope scale factor x",
            "the model paper does not hold it",
        ] {
            assert!(html.contains(words), "{words} in {html}");
        }
    }

    /// A duration is said as a person says it, and rounding carries.
    #[test]
    fn durations_are_readable() {
        assert_eq!(duration(14_402.0), "4 h 00 min 2.0 s");
        assert_eq!(duration(719.96), "12 min 0.0 s");
        assert_eq!(duration(3.25), "3.3 s");
    }
}
