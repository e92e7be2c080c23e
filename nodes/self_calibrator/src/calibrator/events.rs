//! What happens in the machine, told to the log and handed on.

use sins::machines::self_calibration::{Event, Phase};
use sins::sensor::sample::ImuSample;
use sins::units::ARC_SECOND;

use super::{Calibrator, Output};
use crate::phase;

/// What to say of samples without covariances.
pub(super) const NOISE_IS_ASSUMED: &str = "the covariances are not filled in; 0.001 deg/sqrt(h) and 10 ug/sqrt(Hz) are \
     assumed (parameters angle_random_walk_deg_per_sqrt_hour and velocity_random_walk_ug_per_sqrt_hz tell better)";

/// The same behind the line of an estimate.
pub(super) const NOISE_IN_AN_ESTIMATE: &str =
    "; the noise of the samples is assumed, so the sigmas are too";

impl Calibrator {
    /// What happened in the machine, and what it gives to publish.
    pub(super) fn follow(&mut self, event: Event) -> Option<Output> {
        match event {
            Event::Estimate(estimate) => return Some(self.take(*estimate)),
            // Of a filter that runs the estimate comes right behind, and has the reason.
            Event::PhaseChanged { to, .. } => {
                if matches!(to, Phase::WaitingForPosition | Phase::CoarseAlignment) {
                    self.follow_phase();
                }
            }
            Event::Refused(refused) => {
                let stamp = refused.stamp.nanos();
                let reason = format!("sample at {stamp} ns: {}", refused.why);
                self.inputs.imu.refuse(refused.why.name(), reason);
            }
            Event::Restarted {
                stamp,
                cause,
                sensors_kept,
            } => {
                let kept = if sensors_kept {
                    "; what is known of the sensors is kept"
                } else {
                    ""
                };
                let stamp = stamp.nanos();
                tracing::error!(
                    "{}: {cause} at {stamp} ns: alignment starts anew{kept}",
                    self.inputs.imu.topic()
                );
                self.forget();
            }
            Event::HoleCrossed {
                stamp,
                seconds,
                sigma_rad,
                ..
            } => tracing::warn!(
                "{}: a hole of {seconds:.3} s up to {} ns; the attitude is less certain by {:.1} arcsec",
                self.inputs.imu.topic(),
                stamp.nanos(),
                sigma_rad / ARC_SECOND
            ),
            Event::AlignmentFailed { reason, .. } => {
                tracing::error!("{}: {reason}", self.inputs.imu.topic());
                self.problem = Some(reason);
                self.forget();
            }
        }
        None
    }

    /// Logs a change of phase, once, with its reason.
    pub(super) fn follow_phase(&mut self) {
        if self.waking.is_some() {
            return;
        }
        let now = self.machine.phase();
        let before = std::mem::replace(&mut self.phase, now);
        if before == now {
            return;
        }
        self.hurries = true;
        let why = phase::reason(before, now, self.latest.as_ref(), self.machine.settings());
        let (from, to) = (before.name(), now.name());
        if now == Phase::Inconsistent {
            tracing::warn!("phase {from} -> {to}: {why}");
        } else {
            tracing::info!("phase {from} -> {to}: {why}");
        }
    }

    /// Says once where the noise of the samples has to be assumed.
    pub(super) fn look_at_noise(&mut self, sample: &ImuSample) {
        if self.noise_is_assumed.is_some() {
            return;
        }
        let known = |v: &nalgebra::Vector3<f64>| v.iter().all(|x| *x > 0.0);
        let is_told = self.machine.settings().noise.is_some()
            || (known(&sample.angular_rate_variance) && known(&sample.specific_force_variance));
        self.noise_is_assumed = Some(!is_told);
        if !is_told {
            tracing::warn!("{}: {NOISE_IS_ASSUMED}", self.inputs.imu.topic());
        }
    }
}
