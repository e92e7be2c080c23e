//! Why a phase was entered, in one line for a person.

use sins::machines::self_calibration::{Estimate, Phase, Settings};
use sins::units::{DEG_PER_HOUR, MICRO_G};

/// Why self-calibration went from one phase to another.
pub fn reason(from: Phase, to: Phase, estimate: Option<&Estimate>, settings: &Settings) -> String {
    let innovations = estimate.map(|estimate| estimate.innovations);
    match (from, to) {
        (_, Phase::WaitingForPosition) => "no valid position has come".to_owned(),
        (Phase::WaitingForPosition, Phase::CoarseAlignment) => format!(
            "the position is known; gravity and earth rate are gathered for {} s",
            settings.coarse_alignment_s
        ),
        (_, Phase::CoarseAlignment) => format!("alignment starts anew, for {} s", settings.coarse_alignment_s),
        (Phase::WaitingForPosition | Phase::CoarseAlignment, _) => estimate.map_or_else(String::new, |estimate| {
            format!(
                "coarse alignment found heading {:.3} deg, 1 sigma {:.3} deg",
                estimate.vehicle.heading.to_degrees(),
                estimate.vehicle_sigma().heading.to_degrees()
            )
        }),
        (_, Phase::Converged) => estimate.map_or_else(String::new, |estimate| {
            format!(
                "every sigma is below its threshold: at most {:.4} deg/h and {:.2} ug",
                estimate.gyroscope_drift_sigma().max() / DEG_PER_HOUR,
                estimate.accelerometer_bias_sigma().max() / MICRO_G
            )
        }),
        (_, Phase::Calibrating) if from == Phase::Converged => estimate.map_or_else(String::new, |estimate| {
            estimate.verdict(settings).reasons.join("; ")
        }),
        (_, Phase::Inconsistent) => innovations.map_or_else(String::new, |innovations| {
            format!(
                "the innovations do not agree with the covariance: mean NIS {:.2} over {} updates, bound {:.2}",
                innovations.window_mean, settings.window_updates, innovations.window_bound
            )
        }),
        (Phase::Inconsistent, _) => "the innovations have agreed with the covariance for long enough".to_owned(),
        (_, Phase::Calibrating) => {
            format!("the block has turned by more than {:.0} deg", settings.turn_rad.to_degrees())
        }
        (_, Phase::FineAlignment) => "the block rests".to_owned(),
    }
}
