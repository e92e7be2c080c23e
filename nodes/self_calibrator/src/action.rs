//! The action `~/self_calibrate`: a goal asks for sigmas and waits until the calibrator has reached them.

use std::time::Instant;

use ros_node::{ActionServer, GoalHandle, InputWatch, Node, Purpose};
use rotary_sins_msgs::convert::stamp_from_time;
use rotary_sins_msgs::interfaces::actions::SELF_CALIBRATE;
use rotary_sins_msgs::{
    Calibration, SchemeStatus, SelfCalibrateFeedback as Feedback, SelfCalibrateGoal as Goal,
    SelfCalibrateResult as Outcome, SelfCalibrationEstimate,
};
use sins::Stamp;
use sins::machines::self_calibration::Thresholds;

use crate::calibrator::{Calibrator, Output};

/// Times the patience with the samples after which a goal is given up: a driver may be started anew meanwhile.
const SILENCES: u32 = 10;

/// The server and its goal; there is never more than one.
pub struct SelfCalibrate {
    /// Name of the action after remapping, for log lines.
    action: String,
    server: ActionServer<Goal, Outcome, Feedback>,
    under_way: Option<UnderWay>,
}

struct UnderWay {
    handle: GoalHandle<Goal, Outcome, Feedback>,
    goal: Goal,
    accepted: Instant,
    /// Stamp of the first sample after the goal was accepted.
    began: Option<Stamp>,
    /// Time since then that was told last \[s\].
    elapsed_s: f64,
}

impl SelfCalibrate {
    /// Creates the server.
    ///
    /// # Errors
    /// What the middleware refuses.
    pub fn new(node: &Node) -> ros_node::Result<Self> {
        Ok(Self {
            action: node.resolve_service(SELF_CALIBRATE.name)?,
            // A default would say that it has converged.
            server: node.serve_action(
                &SELF_CALIBRATE,
                Outcome {
                    code: Outcome::SHUTDOWN,
                    message: "given up: the calibrator ends".to_owned(),
                    ..Outcome::default()
                },
            )?,
            under_way: None,
        })
    }

    /// Takes goals and cancels; to be called now and then.
    pub fn take_requests(&mut self, calibrator: &mut Calibrator) {
        while let Some(request) = self.server.try_recv() {
            if self.under_way.is_some() {
                tracing::warn!("{}: goal rejected: one is under way", self.action);
                request.reject();
                continue;
            }
            if let Some(why) = nonsense(&request.goal) {
                tracing::warn!("{}: goal rejected: {why}", self.action);
                request.reject();
                continue;
            }
            let (goal, handle) = request.accept();
            tracing::info!("{}: goal accepted", self.action);
            if goal.restart {
                calibrator.restart("a goal asks for it");
            }
            calibrator.ask_for(Some(thresholds(&goal, calibrator.own_thresholds())));
            self.under_way = Some(UnderWay {
                handle,
                goal,
                accepted: Instant::now(),
                began: None,
                elapsed_s: 0.0,
            });
        }
        let Some(under_way) = &self.under_way else {
            return;
        };
        if under_way.handle.is_cancel_requested() {
            self.end(
                calibrator,
                Outcome::CANCELED,
                "cancelled; the calibrator goes on".to_owned(),
            );
        } else if let Some(why) = wrong_scheme(&under_way.goal, calibrator) {
            self.end(calibrator, Outcome::WRONG_SCHEME, why);
        } else if let Some(why) = silence(under_way, calibrator.samples()) {
            self.end(calibrator, Outcome::NO_SAMPLES, why);
        }
    }

    /// Whether a goal asks for sigmas of its own.
    pub fn is_under_way(&self) -> bool {
        self.under_way.is_some()
    }

    /// Takes what a sample has given.
    pub fn follow(&mut self, calibrator: &mut Calibrator, output: &Output) {
        let (Some(under_way), Some(estimate)) = (&mut self.under_way, &output.estimate) else {
            return;
        };
        let now = stamp_from_time(estimate.header.stamp);
        // The first estimate stands at the last step of the alignment, a little before the last sample that was gathered for it.
        let since = now.seconds_since(*under_way.began.get_or_insert(now));
        let elapsed = since.max(under_way.elapsed_s);
        under_way.elapsed_s = elapsed;
        let feedback = feedback(estimate, elapsed, calibrator);
        under_way.handle.feedback(feedback);
        let limit = under_way.goal.time_limit;
        if estimate.phase == SelfCalibrationEstimate::CONVERGED {
            let message = format!("converged after {elapsed:.0} s: {}", estimate.message);
            self.end(calibrator, Outcome::CONVERGED, message);
        } else if limit > 0.0 && elapsed >= limit {
            let message = format!("not converged within {limit:.0} s: {}", estimate.message);
            self.end(calibrator, Outcome::TIME_LIMIT, message);
        }
    }

    /// Before the node stops being active.
    pub fn shut_down(&mut self, calibrator: &mut Calibrator, purpose: Purpose) {
        self.end(
            calibrator,
            Outcome::SHUTDOWN,
            format!("the calibrator {}", purpose.verb()),
        );
    }

    fn end(&mut self, calibrator: &mut Calibrator, code: u8, message: String) {
        let Some(UnderWay { handle, .. }) = self.under_way.take() else {
            return;
        };
        // What ends for another reason says that one alone.
        let message = if code == Outcome::TIME_LIMIT {
            with_reasons(message, &calibrator.reasons())
        } else {
            message
        };
        tracing::info!("{}: {message}", self.action);
        let mut calibration: Calibration = calibrator.last_good().unwrap_or_default();
        calibration.converged &= code == Outcome::CONVERGED;
        calibrator.ask_for(None);
        let outcome = Outcome {
            code,
            message,
            calibration,
        };
        match code {
            Outcome::CONVERGED => handle.succeed(&outcome),
            Outcome::CANCELED => handle.canceled(&outcome),
            _ => handle.abort(&outcome),
        }
    }
}

/// Who waited for a calibration and does not get it reads everything that the judge has against it.
fn with_reasons(mut message: String, reasons: &[String]) -> String {
    for reason in reasons {
        // The line of an estimate has the worst already.
        if !message.contains(reason) {
            message.push_str("; ");
            message.push_str(reason);
        }
    }
    message
}

/// Why a goal means nothing.
fn nonsense(goal: &Goal) -> Option<String> {
    let numbers = [
        ("azimuth_threshold", goal.azimuth_threshold),
        ("level_threshold", goal.level_threshold),
        ("gyroscope_drift_threshold", goal.gyroscope_drift_threshold),
        (
            "accelerometer_bias_threshold",
            goal.accelerometer_bias_threshold,
        ),
        ("time_limit", goal.time_limit),
    ];
    if let Some((name, value)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
        return Some(format!("{name} is {value}, expected a finite number"));
    }
    let negative = numbers.iter().find(|(_, value)| *value < 0.0);
    negative.map(|(name, value)| format!("{name} is {value}, expected 0 or more"))
}

/// The goal's thresholds, and the node's where the goal has none.
fn thresholds(goal: &Goal, own: Thresholds) -> Thresholds {
    let (level, azimuth) = (goal.level_threshold, goal.azimuth_threshold);
    let (bias, drift) = (
        goal.accelerometer_bias_threshold,
        goal.gyroscope_drift_threshold,
    );
    let asked = Thresholds::new([level, level, azimuth], [bias; 3], [drift; 3]);
    own.replaced_by(&asked)
}

/// Why the scheme that the goal names cannot bring it there. As long as nobody tells of a scheme, it may still come.
fn wrong_scheme(goal: &Goal, calibrator: &Calibrator) -> Option<String> {
    let status = calibrator.scheme_status()?;
    if goal.scheme.is_empty() {
        return None;
    }
    if status.scheme != goal.scheme {
        return Some(format!(
            "the scheme is {}, the goal asks for {}",
            status.scheme, goal.scheme
        ));
    }
    let how = match status.state {
        SchemeStatus::FINISHED => "is finished",
        SchemeStatus::ABORTED => "was aborted",
        SchemeStatus::FAULT => "has a fault",
        _ => return None,
    };
    // What the scheme has shown by its end may still be on its way through the samples.
    calibrator
        .has_come_to(stamp_from_time(status.header.stamp))
        .then(|| format!("scheme {} {how}: {}", status.scheme, status.message))
}

/// Why nothing more will come of a goal: its time limit runs by the samples, which have stopped.
fn silence(under_way: &UnderWay, samples: &InputWatch) -> Option<String> {
    let silence = samples.silence().min(under_way.accepted.elapsed());
    (silence > SILENCES * samples.patience()).then(|| {
        let (topic, seconds) = (samples.topic(), silence.as_secs_f64());
        format!("no {topic} for {seconds:.0} s")
    })
}

fn feedback(estimate: &SelfCalibrationEstimate, elapsed: f64, calibrator: &Calibrator) -> Feedback {
    let scheme = calibrator.scheme_status().cloned().unwrap_or_default();
    Feedback {
        header: estimate.header.clone(),
        phase: estimate.phase,
        phase_name: estimate.phase_name.clone(),
        elapsed,
        progress: calibrator.progress_share(),
        misalignment_std: estimate.misalignment_std,
        gyroscope_drift_std: estimate.gyroscope_drift_std,
        accelerometer_bias_std: estimate.accelerometer_bias_std,
        scheme: scheme.scheme,
        scheme_cycle: scheme.cycle,
        scheme_step: scheme.step,
        message: estimate.message.clone(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// What a goal leaves out is as the node's parameters say; what they do not ask for, a goal can.
    #[test]
    fn thresholds_of_goal_and_node() {
        let own = Thresholds::new([0.0, 0.0, 3e-4], [1e-4; 3], [1e-8; 3]);
        let goal = Goal {
            level_threshold: 2e-5,
            gyroscope_drift_threshold: 5e-8,
            ..Goal::default()
        };
        let expected = Thresholds::new([2e-5, 2e-5, 3e-4], [1e-4; 3], [5e-8; 3]);
        assert_eq!(thresholds(&goal, own), expected);
    }

    /// A result has every reason of the judge, each once.
    #[test]
    fn a_result_has_the_reasons() {
        let reasons = ["scale factor".to_owned(), "latitude".to_owned()];
        let message = with_reasons("not converged: scale factor; 1 sigma".to_owned(), &reasons);
        assert_eq!(message, "not converged: scale factor; 1 sigma; latitude");
        assert_eq!(with_reasons("cancelled".to_owned(), &[]), "cancelled");
    }

    /// Numbers that are none, and a time that runs backwards, are refused by name.
    #[test]
    fn nonsense_is_refused() {
        assert_eq!(nonsense(&Goal::default()), None);
        let goal = Goal {
            level_threshold: f64::NAN,
            ..Goal::default()
        };
        assert!(
            nonsense(&goal)
                .unwrap()
                .starts_with("level_threshold is NaN")
        );
        let goal = Goal {
            time_limit: -1.0,
            ..Goal::default()
        };
        assert!(nonsense(&goal).unwrap().starts_with("time_limit is -1,"));
        let goal = Goal {
            accelerometer_bias_threshold: -1e-9,
            ..Goal::default()
        };
        assert_eq!(
            nonsense(&goal).unwrap(),
            "accelerometer_bias_threshold is -0.000000001, expected 0 or more"
        );
    }
}
