//! What the diagnostics say of the inputs and of the estimate.

use imu_input::samples_report;
use ros_node::{InputWatch, Level, Report};
use sins::machines::self_calibration::{Phase, Reference};

use super::Calibrator;
use super::events::NOISE_IS_ASSUMED;
use crate::phase;

impl Calibrator {
    /// How the samples come.
    pub fn imu_report(&self) -> Report {
        let samples = self.machine.samples();
        let report = samples_report(
            &self.inputs.imu,
            &self.imu_stamps,
            samples.counts,
            &self.publishers,
        );
        if self.noise_is_assumed != Some(true) {
            return report;
        }
        let topic = self.inputs.imu.topic();
        report.worsened(Level::Warn, &format!("{topic}: {NOISE_IS_ASSUMED}"))
    }

    /// How the joint states come.
    pub fn joints_report(&self) -> Report {
        self.inputs.joints.report()
    }

    /// How the position comes; once it is known, silence is no fault.
    pub fn fix_report(&self) -> Report {
        if self.phase == Phase::WaitingForPosition {
            return self.inputs.fix.report();
        }
        quiet_report(&self.inputs.fix)
    }

    /// How the measured velocity comes, where it is asked for.
    pub fn velocity_report(&self) -> Report {
        let Reference::Measured { .. } = self.machine.settings().reference else {
            return Report::ok("not asked for: the ship is moored");
        };
        let missing = self.machine.samples().missing_velocities;
        self.inputs
            .velocity
            .report()
            .with("missing velocities", missing)
    }

    /// Whether the state is kept.
    pub fn checkpoint_report(&self) -> Report {
        let Some((written, problem)) = &self.kept else {
            return Report::ok("off");
        };
        let report = Report::ok(format!("written {written} times")).with("written", written);
        match problem {
            Some(problem) => report.worsened(Level::Error, problem),
            None => report,
        }
    }

    /// Where self-calibration stands.
    pub fn estimate_report(&self) -> Report {
        let mut report =
            Report::ok(format!("phase {}", self.phase.name())).with("phase", self.phase.name());
        if let Some(problem) = &self.problem {
            report = report.worsened(Level::Error, problem);
        }
        let Some(latest) = &self.latest else {
            return report.with(
                "coarse alignment [%]",
                format!("{:.0}", 100.0 * self.machine.coarse_progress()),
            );
        };
        let innovations = latest.innovations;
        report = report
            .with("duration [s]", format!("{:.3}", latest.duration_s))
            .with("NIS", format!("{:.3}", innovations.last))
            .with("NIS mean", format!("{:.4}", innovations.window_mean))
            .with("NIS bound", format!("{:.4}", innovations.window_bound))
            .with("NIS failures", innovations.failures);
        if let Some(doubt) = latest.axes_doubt() {
            report = report.worsened(Level::Warn, &doubt);
        }
        let verdict = latest.verdict(self.machine.settings());
        for (name, reason) in ["reason", "second reason", "third reason"]
            .into_iter()
            .zip(&verdict.reasons)
        {
            report = report.with(name, reason);
        }
        if self.phase == Phase::Inconsistent {
            let why = phase::reason(
                Phase::Calibrating,
                self.phase,
                Some(latest),
                self.machine.settings(),
            );
            report = report.worsened(Level::Warn, &why);
        }
        report
    }
}

/// How an input is whose silence is no fault.
fn quiet_report(watch: &InputWatch) -> Report {
    Report::ok(format!("{} messages", watch.received())).with("refused", watch.refused())
}
