//! The noise as the nodes are told it, in their units.

use std::fmt::Write;

use serde::Serialize;
use sins::studies::allan::confidence::NoiseType;

use super::{AxisReport, Report, coefficient_unit, is_gyroscope};

/// Parameters of `self_calibrator` and `navigation_compensator`. One number stands for three axes: that of the worst. Null
/// where no axis shows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NodeNoise {
    /// White noise of the gyroscopes.
    pub angle_random_walk_deg_per_sqrt_hour: Option<f64>,
    /// White noise of the accelerometers.
    pub velocity_random_walk_ug_per_sqrt_hz: Option<f64>,
    /// Walk of the gyroscopes' drifts.
    pub gyroscope_drift_walk_deg_per_hour_sqrt_hour: Option<f64>,
    /// Walk of the accelerometers' biases.
    pub accelerometer_bias_walk_ug_per_sqrt_hour: Option<f64>,
}

impl NodeNoise {
    /// Of the axes of a report.
    pub(super) fn of(axes: &[AxisReport]) -> Self {
        let worst = |gyroscope: bool, noise: NoiseType| {
            let of_kind = axes.iter().enumerate();
            let of_kind = of_kind.filter(|(k, _)| is_gyroscope(*k) == gyroscope);
            of_kind
                .filter_map(|(k, axis)| {
                    let value = axis.coefficient(noise).value?;
                    Some(value / coefficient_unit(k, noise).in_si)
                })
                .max_by(f64::total_cmp)
        };
        Self {
            angle_random_walk_deg_per_sqrt_hour: worst(true, NoiseType::White),
            velocity_random_walk_ug_per_sqrt_hz: worst(false, NoiseType::White),
            gyroscope_drift_walk_deg_per_hour_sqrt_hour: worst(true, NoiseType::Walk),
            accelerometer_bias_walk_ug_per_sqrt_hour: worst(false, NoiseType::Walk),
        }
    }

    /// Names and values: what both nodes take, and what the calibrator takes besides.
    fn named(&self) -> [[(&'static str, Option<f64>); 2]; 2] {
        [
            [
                (
                    "angle_random_walk_deg_per_sqrt_hour",
                    self.angle_random_walk_deg_per_sqrt_hour,
                ),
                (
                    "velocity_random_walk_ug_per_sqrt_hz",
                    self.velocity_random_walk_ug_per_sqrt_hz,
                ),
            ],
            [
                (
                    "gyroscope_drift_walk_deg_per_hour_sqrt_hour",
                    self.gyroscope_drift_walk_deg_per_hour_sqrt_hour,
                ),
                (
                    "accelerometer_bias_walk_ug_per_sqrt_hour",
                    self.accelerometer_bias_walk_ug_per_sqrt_hour,
                ),
            ],
        ]
    }
}

/// A parameter file for both nodes. What the record does not show is not in it, so the node's own default stands.
pub fn parameter_file(report: &Report) -> String {
    let [white, walks] = report.parameters.named();
    // One density without the other would be refused.
    let is_white = white.iter().all(|(_, value)| value.is_some());
    let mut text = format!(
        "# Noise of the sensors, {:.0} s at rest at {:.1} Hz; of each kind the worst axis.\n\
         # Use: self_calibrator --ros-args --params-file FILE (and navigation_compensator)\n",
        report.duration_s,
        1.0 / report.interval_s
    );
    let nodes: [(&str, &[_]); 2] = [
        ("self_calibrator", &[white, walks]),
        ("navigation_compensator", &[white]),
    ];
    for (node, groups) in nodes {
        let lines = groups.iter().flatten().map(|(key, value)| {
            let is_told = is_white || !white.iter().any(|(name, _)| name == key);
            let value = value.filter(|_| is_told);
            (*key, value.map(number))
        });
        let lines: Vec<_> = lines.collect();
        // A mapping of comments alone is none.
        let empty = if lines.iter().all(|(_, value)| value.is_none()) {
            " {}"
        } else {
            ""
        };
        writeln!(text, "{node}:\n  ros__parameters:{empty}").ok();
        for (key, value) in lines {
            match value {
                Some(value) => writeln!(text, "    {key}: {value}").ok(),
                None => writeln!(text, "    # {key}: not seen, the default stands").ok(),
            };
        }
    }
    text
}

/// Six digits, and always a floating-point number to YAML.
fn number(value: f64) -> String {
    let short = format!("{value:.5e}").parse::<f64>();
    format!("{:?}", short.unwrap_or(value))
}
