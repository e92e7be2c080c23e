//! What is thought of a run.

use report::Verdict;
use rotary_sins_msgs::SelfCalibrationEstimate;
use sins::{
    earth::rotation::HeadingPitchRoll,
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    estimation::groups::navigation::MISALIGNMENT,
    estimation::model,
    estimation::state::StateLabel,
};

use super::{
    estimates::{History, Point, phase_name},
    gather::GatheredRun,
};

/// How many sigmas an estimate may be off the truth.
pub const LIMIT_SIGMA: f64 = 3.5;

/// One estimated state at the end, SI.
#[derive(Clone, Copy, Debug)]
pub struct StateAtEnd {
    /// Which one.
    pub label: &'static StateLabel,
    /// The estimate; none of a misalignment, which has been fed back.
    pub estimate: Option<f64>,
    /// 1 sigma.
    pub sigma: f64,
    /// The truth, where the bag has it.
    pub truth: Option<f64>,
    /// Estimate minus truth, where that is known.
    pub error: Option<f64>,
}

impl StateAtEnd {
    /// The error in sigmas.
    pub fn sigmas(&self) -> Option<f64> {
        Some(self.error? / self.sigma)
    }

    /// Whether it is where its sigma says; `None` without a truth.
    pub fn is_good(&self) -> Option<bool> {
        // Not a number is not good.
        self.sigmas().map(|sigmas| sigmas.abs() <= LIMIT_SIGMA)
    }
}

/// Heading, roll or pitch at the end \[rad\].
#[derive(Clone, Copy, Debug)]
pub struct Angle {
    /// Its name.
    pub name: &'static str,
    /// The estimate.
    pub estimate: f64,
    /// 1 sigma.
    pub sigma: f64,
    /// The truth, where the bag has it.
    pub truth: Option<f64>,
}

/// The state of things at the end.
#[derive(Clone, Debug, Default)]
pub struct End {
    /// Drifts, biases, misalignments.
    pub states: Vec<StateAtEnd>,
    /// Heading, roll, pitch.
    pub angles: Vec<Angle>,
}

impl End {
    /// Of the last estimate.
    pub fn new(last: Option<&Point>, run: &GatheredRun) -> Self {
        let Some(last) = last else {
            return Self::default();
        };
        let truth = run.truth.calibration.as_ref();
        let vehicle = run.truth.vehicle();
        let error = run.truth.error_at(last.stamp);
        let mut states = Vec::new();
        let labels =
            |names: [&'static str; 3]| names.into_iter().filter_map(model::label).enumerate();
        for (names, [estimate, sigma], truth) in [
            (
                GYROSCOPE_DRIFT,
                last.drift,
                truth.map(|t| t.gyroscope_drift),
            ),
            (
                ACCELEROMETER_BIAS,
                last.bias,
                truth.map(|t| t.accelerometer_bias),
            ),
        ] {
            states.extend(labels(names).map(|(axis, label)| StateAtEnd {
                label,
                estimate: Some(estimate[axis]),
                sigma: sigma[axis],
                truth: truth.map(|truth| truth[axis]),
                error: truth.map(|truth| estimate[axis] - truth[axis]),
            }));
        }
        states.extend(labels(MISALIGNMENT).map(|(axis, label)| StateAtEnd {
            label,
            estimate: None,
            sigma: last.misalignment_sigma[axis],
            truth: None,
            error: error.map(|error| error[axis]),
        }));
        let angle = |name, of: fn(&HeadingPitchRoll) -> f64| Angle {
            name,
            estimate: of(&last.vehicle),
            sigma: of(&last.vehicle_sigma),
            truth: vehicle.as_ref().map(of),
        };
        Self {
            states,
            angles: vec![
                angle("heading", |a| a.heading),
                angle("roll", |a| a.roll),
                angle("pitch", |a| a.pitch),
            ],
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Its name in JSON where it is a fault.
    pub name: &'static str,
    /// What is thought of it.
    pub verdict: Verdict,
    /// In a few words.
    pub text: String,
}

/// Everything that was looked at; faults first.
pub fn findings(run: &GatheredRun, end: &End) -> Vec<Finding> {
    let mut findings = vec![converged(run), consistent(run)];
    findings.extend(near_truth(end));
    findings.extend([without_gaps(run), without_refusals(run), whole(run)]);
    let diagnostics = run.diagnostics.list().len() as u64;
    if diagnostics > 0 {
        findings.push(Finding {
            name: "diagnostics",
            verdict: Verdict::Warn,
            text: format!("{} above OK", plural(diagnostics, "diagnostic")),
        });
    }
    // What the innovations say makes everything else doubtful.
    findings.sort_by_key(|finding| match (finding.verdict, finding.name) {
        (Verdict::Bad, "inconsistent") => 0,
        (Verdict::Bad, _) => 1,
        _ => 2,
    });
    findings
}

fn finding(name: &'static str, fault: Option<String>, good: impl Into<String>) -> Finding {
    Finding {
        name,
        verdict: if fault.is_some() {
            Verdict::Bad
        } else {
            Verdict::Good
        },
        text: fault.unwrap_or_else(|| good.into()),
    }
}

fn converged(run: &GatheredRun) -> Finding {
    let phase = run.history.phase.unwrap_or_default();
    let fault = match phase {
        SelfCalibrationEstimate::CONVERGED => None,
        SelfCalibrationEstimate::INCONSISTENT => Some("not converged".to_owned()),
        other => {
            let reason = run.history.reason();
            let reason = reason.map_or_else(String::new, |reason| format!(": {reason}"));
            Some(format!("not converged: {}{reason}", phase_name(other)))
        }
    };
    finding("not_converged", fault, "converged")
}

fn consistent(run: &GatheredRun) -> Finding {
    // The judge's word: a run that failed is consistent again where windows enough have agreed since.
    let is_doubtful = run.history.phase == Some(SelfCalibrationEstimate::INCONSISTENT);
    let fault = is_doubtful.then(|| inconsistent(&run.history));
    finding("inconsistent", fault, "consistent")
}

/// That a run is inconsistent, and why: whatever test failed, not only the one of the innovations.
fn inconsistent(history: &History) -> String {
    history.reason().map_or_else(
        || "inconsistent".to_owned(),
        |reason| format!("inconsistent: {reason}"),
    )
}

fn near_truth(end: &End) -> Option<Finding> {
    let worst = end
        .states
        .iter()
        .filter_map(|state| Some((state, state.sigmas()?)))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let (state, sigmas) = worst;
    let digits = usize::from(sigmas.abs() < 100.0);
    let text = format!(
        "{} {:.digits$} sigma from the truth",
        state.label.words,
        sigmas.abs()
    );
    let fault = (state.is_good() != Some(true)).then_some(text);
    let good = format!("within {:.1} sigma of the truth", sigmas.abs());
    Some(finding("outside_truth", fault, good))
}

/// Holes in the samples of the bag, else in those that the calibrator got.
pub fn gaps(run: &GatheredRun) -> (u64, u64) {
    let of_bag = run.imu.map_or((0, 0), |at| {
        let imu = &run.streams[at];
        (imu.gap_count(), imu.lost())
    });
    let counts = run.history.counts;
    of_bag.max((counts.gaps, counts.lost))
}

fn without_gaps(run: &GatheredRun) -> Finding {
    let (gaps, lost) = gaps(run);
    let fault = (gaps > 0).then(|| {
        format!(
            "{} in the samples, {} missing",
            plural(gaps, "gap"),
            plural(lost, "sample")
        )
    });
    finding("gaps", fault, "no sample missing")
}

/// Samples that the machines do not use for their stamps.
fn without_refusals(run: &GatheredRun) -> Finding {
    let counts = run.imu.and_then(|at| run.streams[at].refused());
    let fault = counts
        .filter(|(_, refused)| *refused > 0)
        .map(|(came, refused)| format!("{refused} of {came} samples refused for their stamps"));
    finding("refused", fault, "no sample refused")
}

fn whole(run: &GatheredRun) -> Finding {
    let undecodable = run.notes.undecodable_messages;
    let fault = match (run.damage.is_empty(), undecodable) {
        (true, 0) => None,
        (false, _) => Some("bag damaged".to_owned()),
        (true, n) => Some(format!("{} unreadable", plural(n, "message"))),
    };
    finding("damaged", fault, "bag whole")
}

/// `1 gap`, `2 gaps`.
pub fn plural(count: u64, what: &str) -> String {
    if count == 1 {
        format!("1 {what}")
    } else {
        format!("{count} {what}s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An inconsistent run whose innovations never failed tells the judge's reason, or the words of the record.
    #[test]
    fn inconsistent_says_why() {
        let mut history = History::default();
        assert_eq!(inconsistent(&history), "inconsistent");
        history.recorded_words = Some("scale factor x; 1 sigma at most 1 deg/h".to_owned());
        let expected = "inconsistent: scale factor x; 1 sigma at most 1 deg/h";
        assert_eq!(inconsistent(&history), expected);
        history.reasons = vec!["latitude".to_owned(), "noise".to_owned()];
        assert_eq!(inconsistent(&history), "inconsistent: latitude");
    }
}
