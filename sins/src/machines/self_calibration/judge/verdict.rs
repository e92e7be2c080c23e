//! The verdict on an estimate, as text and JSON have it.

use serde::Serialize;

use super::Finding;

/// The verdict on an estimate.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "one a test, as the JSON has it"
)]
pub struct Verdict {
    /// Everything asked for is found, and nothing speaks against it: the phase is `converged`.
    pub converged: bool,
    /// The filter describes its samples.
    pub consistent: bool,
    /// The innovations pass their test, and have for long enough where they once did not.
    pub innovations: bool,
    /// Samples came in order, whole and plausible, but for few.
    pub samples: bool,
    /// Every sigma is below its threshold.
    pub sigmas: bool,
    /// The block has turned, so that sensor errors and attitude come apart.
    pub turned: bool,
    /// Every state that is asked for is better known than before.
    pub learned: bool,
    /// What speaks against the estimate, in words; empty where it converged.
    pub reasons: Vec<String>,
    /// Every test that could be made.
    pub tests: Vec<TestResult>,
}

/// A test as JSON has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TestResult {
    /// Its name.
    pub name: &'static str,
    /// Whether it passed.
    pub passed: bool,
    /// Its figure.
    pub figure: f64,
    /// How large the figure may be.
    pub bound: f64,
    /// The state that the figure is about, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<&'static str>,
    /// Its value or difference, SI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The one-sigma that goes with it, SI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// What a test that failed means, in words; it is among the reasons of the verdict.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sentence: Option<String>,
}

impl From<&Finding> for TestResult {
    fn from(finding: &Finding) -> Self {
        Self {
            name: finding.test.name(),
            passed: finding.passes(),
            figure: finding.figure,
            bound: finding.bound,
            state: finding.about.map(|(label, _, _)| label.name),
            value: finding.about.map(|(_, value, _)| value),
            sigma: finding.about.map(|(_, _, sigma)| sigma),
            sentence: (!finding.passes()).then(|| finding.to_string()),
        }
    }
}
