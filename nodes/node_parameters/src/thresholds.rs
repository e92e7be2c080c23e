//! When an estimate counts as found.

use ros_node::ParameterSet;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::MISALIGNMENT;
use sins::machines::self_calibration::Thresholds;

use crate::units::{ARC_MINUTE, DEGREE_PER_HOUR, MICRO_G};

/// One sigma below which an estimate counts as found; 0 asks for nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThresholdParameters {
    /// Of the attitude about East and North \[rad\].
    pub level_rad: f64,
    /// Of the attitude about Up \[rad\].
    pub azimuth_rad: f64,
    /// Of the biases x, y, z \[m/s²\].
    pub accelerometer_bias_m_s2: [f64; 3],
    /// Of the drifts x, y, z \[rad/s\].
    pub gyroscope_drift_rad_s: [f64; 3],
}

impl Default for ThresholdParameters {
    fn default() -> Self {
        let thresholds = Thresholds::default();
        let asked = |state: &str| thresholds.of(state).unwrap_or(0.0);
        Self {
            level_rad: asked(MISALIGNMENT[0]),
            azimuth_rad: asked(MISALIGNMENT[2]),
            accelerometer_bias_m_s2: ACCELEROMETER_BIAS.map(asked),
            gyroscope_drift_rad_s: GYROSCOPE_DRIFT.map(asked),
        }
    }
}

impl From<ThresholdParameters> for Thresholds {
    fn from(given: ThresholdParameters) -> Self {
        Self::new(
            [given.level_rad, given.level_rad, given.azimuth_rad],
            given.accelerometer_bias_m_s2,
            given.gyroscope_drift_rad_s,
        )
    }
}

/// Parameters of the thresholds.
pub fn thresholds() -> ParameterSet<ThresholdParameters> {
    ParameterSet::new("Converged below", ThresholdParameters::default())
        .numbers(
            "gyroscope_drift_threshold_deg_per_hour",
            DEGREE_PER_HOUR,
            0.0..=1e4,
            |s| &mut s.gyroscope_drift_rad_s,
            "1 sigma below which the drifts x, y, z count as found; 0: not asked for",
        )
        .changeable()
        .numbers(
            "accelerometer_bias_threshold_ug",
            MICRO_G,
            0.0..=1e6,
            |s| &mut s.accelerometer_bias_m_s2,
            "1 sigma below which the biases x, y, z count as found; 0: not asked for",
        )
        .changeable()
        .number(
            "azimuth_threshold_arcmin",
            ARC_MINUTE,
            0.0..=1e4,
            |s| &mut s.azimuth_rad,
            "1 sigma below which the azimuth counts as found; 0: not asked for",
        )
        .changeable()
        .number(
            "level_threshold_arcmin",
            ARC_MINUTE,
            0.0..=1e4,
            |s| &mut s.level_rad,
            "1 sigma below which the level counts as found; 0: not asked for",
        )
        .changeable()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parameters' defaults are the machine's.
    #[test]
    fn defaults_are_those_of_the_machine() {
        assert_eq!(
            Thresholds::from(*thresholds().base()),
            Thresholds::default()
        );
    }
}
