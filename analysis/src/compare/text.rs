//! The results of `compare` as a short text that can stand in a repository.

use std::fmt::Write;

use sins::{
    estimation::state::StateValues,
    studies::{monte_carlo::mean_nees_bounds, paper::CALIBRATED},
    units::NAUTICAL_MILE_M,
};

use super::{
    CONFIDENCE,
    campaign::Campaign,
    claims::Claim,
    summary::settled_h,
    voyages::{TURNS_DEG, VOYAGE_H},
};
use crate::words::significant;

/// A short text with the figures that a review wants to see change.
pub fn text(campaign: &Campaign, claims: &[Claim], command: &str) -> String {
    let mut text = format!("{command}\n\n");
    let labels = &CALIBRATED;
    let line = |name: &str, cells: Vec<String>| {
        let mut text = format!("{name:<16}");
        for cell in cells {
            write!(text, "{cell:>10}").ok();
        }
        text.push('\n');
        text
    };
    for result in &campaign.cases {
        let Some(end) = result.statistics.end() else {
            continue;
        };
        writeln!(text, "{}", result.case.name()).ok();
        text += &line("", labels.iter().map(|l| l.symbol.to_owned()).collect());
        text += &line("", labels.iter().map(|l| l.unit.to_owned()).collect());
        let scaled = |values: StateValues| {
            values
                .as_slice()
                .iter()
                .zip(labels)
                .map(|(v, l)| significant(v / l.scale))
                .collect()
        };
        text += &line("rms error", scaled(end.rms()));
        text += &line("sigma", scaled(end.sigma()));
        text += &line(
            "rms / sigma",
            end.rms_over_sigma()
                .as_slice()
                .iter()
                .map(|v| format!("{v:.2}"))
                .collect(),
        );
        text += &line(
            "found after, h",
            settled_h(result)
                .iter()
                .map(|t| t.map_or_else(|| "-".to_owned(), |t| format!("{t:.2}")))
                .collect(),
        );
        let [low, high] = mean_nees_bounds(campaign.plan.runs, CONFIDENCE);
        if let Some(nees) = end.mean_nees() {
            writeln!(text, "mean NEES {nees:.2} (bounds {low:.2} .. {high:.2})").ok();
        }
        for (voyages, turn) in result.voyages.iter().zip(TURNS_DEG) {
            for (length, hours) in VOYAGE_H.into_iter().enumerate() {
                let nmi = |metres: f64| metres / NAUTICAL_MILE_M;
                writeln!(
                    text,
                    "position error, {hours:.0} h, turned by {turn:.0} deg: median {:.2} nmi, worst {:.2}; without compensation {:.2}, {:.2}",
                    nmi(voyages.median_greatest(length, 0)),
                    nmi(voyages.worst(length, 0)),
                    nmi(voyages.median_greatest(length, 1)),
                    nmi(voyages.worst(length, 1)),
                )
                .ok();
            }
        }
        for (voyages, turn) in result.drawn_voyages.iter().zip(TURNS_DEG) {
            let nmi = |metres: f64| metres / NAUTICAL_MILE_M;
            writeln!(
                text,
                "position error, drawn errors, {:.0} h, turned by {turn:.0} deg: rms {:.2} nmi, worst {:.2}; without compensation {:.2}, {:.2}",
                VOYAGE_H[0],
                nmi(voyages.rms_greatest(0, 0)),
                nmi(voyages.worst(0, 0)),
                nmi(voyages.rms_greatest(0, 1)),
                nmi(voyages.worst(0, 1)),
            )
            .ok();
        }
        text.push('\n');
    }
    text += "Claims of the paper\n";
    for claim in claims {
        writeln!(text, "{:<14} {}", claim.verdict, claim.text).ok();
        for f in &claim.findings {
            let range = if f.range.is_empty() {
                String::new()
            } else {
                format!(" ({})", f.range)
            };
            writeln!(
                text,
                "    {} {:<44} {}{range} {}: {}",
                f.reading, f.setting, f.first, claim.unit, f.holds
            )
            .ok();
        }
    }
    text
}
