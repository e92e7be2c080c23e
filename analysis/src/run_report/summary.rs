//! The numbers behind the page, as JSON; SI units.

use std::path::{Path, PathBuf};

use report::{Figure, Verdict};
use rotary_sins_msgs::SelfCalibrationEstimate;
use serde::Serialize;
use sins::{
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    estimation::groups::navigation::MISALIGNMENT,
    time::Stamp,
    units::NAUTICAL_MILE_M,
};

use super::{
    estimates::{Point, phase_name},
    faults::faults,
    gather::{GatheredRun, Source, Track},
    groups::{GroupState, groups},
    page::Head,
    verdict::{End, Finding, StateAtEnd, gaps},
};

/// The whole result.
#[derive(Serialize)]
pub struct Summary {
    bag: PathBuf,
    page: PathBuf,
    /// `converged`, or the first fault.
    verdict: &'static str,
    findings: Vec<FindingJson>,
    /// `recorded` or `made_from_samples`.
    estimates: &'static str,
    phase: &'static str,
    start_ns: i64,
    duration_s: f64,
    estimate_stamp_ns: Option<i64>,
    estimate_count: u64,
    gyroscope_drift_rad_s: Option<[f64; 3]>,
    gyroscope_drift_std_rad_s: Option<[f64; 3]>,
    gyroscope_drift_truth_rad_s: Option<[f64; 3]>,
    accelerometer_bias_m_s2: Option<[f64; 3]>,
    accelerometer_bias_std_m_s2: Option<[f64; 3]>,
    accelerometer_bias_truth_m_s2: Option<[f64; 3]>,
    states: Vec<StateJson>,
    /// States that kept their prior.
    unobservable: Vec<&'static str>,
    misalignment_std_rad: Option<[f64; 3]>,
    misalignment_error_rad: Option<[f64; 3]>,
    largest_error_sigmas: Option<f64>,
    angles: Vec<AngleJson>,
    nis_window_mean: Option<f64>,
    nis_upper_bound: Option<f64>,
    nis_failures: u64,
    samples: u64,
    gaps: u64,
    lost_samples: u64,
    restarts: u64,
    gated_measurements: Option<u64>,
    refused_measurements: Option<u64>,
    phases: Vec<PhaseJson>,
    steps: Vec<StepJson>,
    position_error: Option<PositionJson>,
    topics: Vec<TopicJson>,
    faults: Vec<FaultJson>,
    more_faults: u64,
    diagnostics: Vec<DiagnosticJson>,
    warnings: Vec<String>,
    /// Anchors of the figures, in their order.
    figures: Vec<String>,
}

#[derive(Serialize)]
struct FindingJson {
    name: &'static str,
    verdict: &'static str,
    text: String,
}

/// A state that the whole model has beyond drifts, biases and attitude.
#[derive(Serialize)]
struct StateJson {
    name: &'static str,
    estimate: f64,
    std: f64,
    prior_std: Option<f64>,
    truth: Option<f64>,
}

impl From<GroupState> for StateJson {
    fn from(group: GroupState) -> Self {
        Self {
            name: group.label.name,
            estimate: group.state.value,
            std: group.state.sigma,
            prior_std: group.state.prior,
            truth: group.truth,
        }
    }
}

#[derive(Serialize)]
struct AngleJson {
    name: &'static str,
    deg: f64,
    deg_std: f64,
    deg_truth: Option<f64>,
}

#[derive(Serialize)]
struct PhaseJson {
    phase: &'static str,
    stamp_ns: i64,
}

#[derive(Serialize)]
struct StepJson {
    cycle: u32,
    step: u32,
    position: String,
    rotation: String,
    start_ns: i64,
    duration_s: f64,
}

#[derive(Serialize)]
struct PositionJson {
    compensated: Option<ErrorJson>,
    uncompensated: Option<ErrorJson>,
}

#[derive(Serialize)]
struct ErrorJson {
    max_nmi: f64,
    final_nmi: f64,
}

#[derive(Serialize)]
struct TopicJson {
    name: String,
    #[serde(rename = "type")]
    type_name: String,
    by_stamp: bool,
    messages: u64,
    rate_hz: Option<f64>,
    gaps: Option<u64>,
    missing: Option<u64>,
    longest_s: f64,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
}

#[derive(Serialize)]
struct FaultJson {
    stamp_ns: Option<i64>,
    place: String,
    text: String,
}

#[derive(Serialize)]
struct DiagnosticJson {
    name: String,
    level: u8,
    message: String,
    first_ns: i64,
    count: u64,
}

/// The faults of the estimates, else that it converged.
pub fn verdict(findings: &[Finding]) -> &'static str {
    let fault = findings.iter().find(|f| f.verdict == Verdict::Bad);
    fault.map_or("converged", |fault| fault.name)
}

/// Three states that belong together.
fn triple(
    end: &End,
    names: [&str; 3],
    of: impl Fn(&StateAtEnd) -> Option<f64>,
) -> Option<[f64; 3]> {
    let mut values = [0.0; 3];
    for (value, name) in values.iter_mut().zip(names) {
        let state = end.states.iter().find(|state| state.label.name == name)?;
        *value = of(state)?;
    }
    Some(values)
}

fn largest_error_sigmas(end: &End) -> Option<f64> {
    let sigmas = end.states.iter().filter_map(StateAtEnd::sigmas);
    sigmas.map(f64::abs).reduce(f64::max)
}

/// Gathers the numbers.
pub fn summary(
    head: &Head<'_>,
    run: &GatheredRun,
    end: &End,
    findings: &[Finding],
    figures: &[Figure],
    last: Option<&Point>,
    path: &Path,
) -> Summary {
    let (gaps, lost_samples) = gaps(run);
    let (faults, more_faults) = faults(run);
    let nanos = Stamp::nanos;
    let groups: Vec<GroupState> = groups(run).into_iter().flat_map(|(_, s)| s).collect();
    Summary {
        bag: head.bag.path().to_owned(),
        page: path.to_owned(),
        verdict: verdict(findings),
        findings: findings
            .iter()
            .map(|finding| FindingJson {
                name: finding.name,
                verdict: match finding.verdict {
                    Verdict::Good => "good",
                    Verdict::Warn => "warning",
                    Verdict::Bad => "bad",
                },
                text: finding.text.clone(),
            })
            .collect(),
        estimates: match run.source {
            Source::Recorded => "recorded",
            Source::Own => "made_from_samples",
        },
        phase: phase_name(
            run.history
                .phase
                .unwrap_or(SelfCalibrationEstimate::WAITING_FOR_POSITION),
        ),
        start_ns: head.clock.start.nanos(),
        duration_s: head.end.seconds_since(head.clock.start),
        estimate_stamp_ns: last.map(|point| point.stamp.nanos()),
        estimate_count: run.history.taken,
        gyroscope_drift_rad_s: triple(end, GYROSCOPE_DRIFT, |s| s.estimate),
        gyroscope_drift_std_rad_s: triple(end, GYROSCOPE_DRIFT, |s| Some(s.sigma)),
        gyroscope_drift_truth_rad_s: triple(end, GYROSCOPE_DRIFT, |s| s.truth),
        accelerometer_bias_m_s2: triple(end, ACCELEROMETER_BIAS, |s| s.estimate),
        accelerometer_bias_std_m_s2: triple(end, ACCELEROMETER_BIAS, |s| Some(s.sigma)),
        accelerometer_bias_truth_m_s2: triple(end, ACCELEROMETER_BIAS, |s| s.truth),
        unobservable: groups
            .iter()
            .filter(|state| state.is_hidden())
            .map(|state| state.label.name)
            .collect(),
        states: groups.into_iter().map(StateJson::from).collect(),
        misalignment_std_rad: triple(end, MISALIGNMENT, |s| Some(s.sigma)),
        misalignment_error_rad: triple(end, MISALIGNMENT, |s| s.error),
        largest_error_sigmas: largest_error_sigmas(end),
        angles: end
            .angles
            .iter()
            .map(|angle| AngleJson {
                name: angle.name,
                deg: angle.estimate.to_degrees(),
                deg_std: angle.sigma.to_degrees(),
                deg_truth: angle.truth.map(f64::to_degrees),
            })
            .collect(),
        nis_window_mean: last.map(|point| point.nis_mean),
        nis_upper_bound: last.map(|point| point.nis_bound),
        nis_failures: run.history.failures,
        samples: run.history.counts.samples,
        gaps,
        lost_samples,
        restarts: run.history.restarts.len() as u64,
        gated_measurements: run.history.counts.gated,
        refused_measurements: run.history.counts.refused,
        phases: run
            .history
            .phases
            .iter()
            .map(|change| PhaseJson {
                phase: phase_name(change.phase),
                stamp_ns: change.stamp.nanos(),
            })
            .collect(),
        steps: steps(head, run),
        position_error: position_error(run.tracks()),
        topics: topics(run),
        faults: faults
            .into_iter()
            .map(|fault| FaultJson {
                stamp_ns: fault.stamp.map(nanos),
                place: fault.place,
                text: fault.text,
            })
            .collect(),
        more_faults,
        diagnostics: diagnostics(run),
        warnings: run.damage.iter().chain(&run.notes.lines).cloned().collect(),
        figures: figures.iter().map(|figure| figure.id.clone()).collect(),
    }
}

fn diagnostics(run: &GatheredRun) -> Vec<DiagnosticJson> {
    let list = run.diagnostics.list().into_iter();
    list.map(|diagnostic| DiagnosticJson {
        name: diagnostic.name.clone(),
        level: diagnostic.level,
        message: diagnostic.message.clone(),
        first_ns: diagnostic.first.nanos(),
        count: diagnostic.count,
    })
    .collect()
}

fn steps(head: &Head<'_>, run: &GatheredRun) -> Vec<StepJson> {
    run.scheme
        .steps
        .iter()
        .map(|step| StepJson {
            cycle: step.cycle,
            step: step.number,
            position: step.position.clone(),
            rotation: step.turn.clone(),
            start_ns: step.start.nanos(),
            duration_s: step.end.unwrap_or(head.end).seconds_since(step.start),
        })
        .collect()
}

fn position_error(tracks: &[Track; 2]) -> Option<PositionJson> {
    let [compensated, uncompensated] = tracks.each_ref().map(|track| {
        (!track.is_empty()).then(|| ErrorJson {
            max_nmi: track.greatest_m / NAUTICAL_MILE_M,
            final_nmi: track.last_m / NAUTICAL_MILE_M,
        })
    });
    (compensated.is_some() || uncompensated.is_some()).then_some(PositionJson {
        compensated,
        uncompensated,
    })
}

fn topics(run: &GatheredRun) -> Vec<TopicJson> {
    run.streams
        .iter()
        .map(|stream| TopicJson {
            name: stream.name.clone(),
            type_name: stream.type_name.clone(),
            by_stamp: stream.by_stamp(),
            messages: stream.count,
            rate_hz: stream.rate_hz(),
            gaps: stream.is_regular().then(|| stream.gap_count()),
            missing: stream.is_regular().then(|| stream.lost()),
            longest_s: stream.longest_s(),
            first_ns: stream.span().map(|span| span.0.nanos()),
            last_ns: stream.span().map(|span| span.1.nanos()),
        })
        .collect()
}
