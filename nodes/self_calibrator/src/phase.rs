//! Why a phase was entered, in one line for a person.

use sins::machines::self_calibration::{Estimate, Phase, Settings};
use sins::units::{DEG_PER_HOUR, MICRO_G};

/// Why self-calibration went from one phase to another.
pub fn reason(from: Phase, to: Phase, estimate: Option<&Estimate>, settings: &Settings) -> String {
    match (from, to) {
        (_, Phase::WaitingForPosition) => "no valid position has come".to_owned(),
        (Phase::WaitingForPosition, Phase::CoarseAlignment) => format!(
            "the position is known; gravity and earth rate are gathered for {} s",
            settings.coarse_alignment_s
        ),
        (_, Phase::CoarseAlignment) => format!(
            "alignment starts anew, for {} s",
            settings.coarse_alignment_s
        ),
        (Phase::WaitingForPosition | Phase::CoarseAlignment, _) => {
            estimate.map_or_else(String::new, |estimate| {
                format!(
                    "coarse alignment found heading {:.3} deg, 1 sigma {:.3} deg",
                    estimate.vehicle.heading.to_degrees(),
                    estimate.vehicle_sigma().heading.to_degrees()
                )
            })
        }
        (_, Phase::Converged) => estimate.map_or_else(String::new, |estimate| {
            format!(
                "every sigma is below its threshold: at most {:.4} deg/h and {:.2} ug",
                estimate.gyroscope_drift_sigma().max() / DEG_PER_HOUR,
                estimate.accelerometer_bias_sigma().max() / MICRO_G
            )
        }),
        (_, Phase::Inconsistent) => reasons(estimate, settings),
        (_, Phase::Calibrating) if from == Phase::Converged => reasons(estimate, settings),
        (Phase::Inconsistent, _) => "every test of the judge passes again".to_owned(),
        (_, Phase::Calibrating) => {
            format!(
                "the block has turned by more than {:.0} deg",
                settings.turn_rad.to_degrees()
            )
        }
        (_, Phase::FineAlignment) => "the block rests".to_owned(),
    }
}

/// What the judge has against an estimate, the worst first.
fn reasons(estimate: Option<&Estimate>, settings: &Settings) -> String {
    estimate.map_or_else(String::new, |estimate| {
        estimate.verdict(settings).reasons.join("; ")
    })
}
