//! What the ship says of herself, and what goes wrong with it.

use ros_node::{ParameterSet, Unit};
use sins::simulation::{AidingSettings, TimeWindow};

/// Noise of what the ship says of herself.
pub fn aiding() -> ParameterSet<AidingSettings> {
    let set = ParameterSet::new("Aiding", AidingSettings::default())
        .number(
            "velocity_noise_m_per_s",
            Unit::METRE_PER_SECOND,
            0.0..=1e6,
            |s| &mut s.velocity_std_m_s,
            "1 sigma of the aiding velocity, every axis",
        )
        .number(
            "position_noise_m",
            Unit::METRE,
            0.0..=1e6,
            |s| &mut s.horizontal_std_m,
            "1 sigma of fix, East and North",
        )
        .number(
            "height_noise_m",
            Unit::METRE,
            0.0..=1e6,
            |s| &mut s.vertical_std_m,
            "1 sigma of the height of fix",
        )
        .number(
            "position_rate_hz",
            Unit::HERTZ,
            0.001..=100.0,
            |s| &mut s.position_rate_hz,
            "Positions a second",
        )
        .number(
            "velocity_rate_hz",
            Unit::HERTZ,
            0.001..=100.0,
            |s| &mut s.velocity_rate_hz,
            "Velocities a second",
        )
        .numbers(
            "antenna_arm_m",
            Unit::METRE,
            -500.0..=500.0,
            |s| s.antenna_arm_m.as_mut_slice(),
            "Where both are measured, from the table's centre: starboard, forward, up",
        );
    aiding_faults(set)
}

/// What goes wrong with it on a real ship.
fn aiding_faults(set: ParameterSet<AidingSettings>) -> ParameterSet<AidingSettings> {
    set.number(
        "position_latency_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.position_latency_s,
        "How old a position is at its stamp",
    )
    .number(
        "velocity_latency_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.velocity_latency_s,
        "How old a velocity is at its stamp",
    )
    .number(
        "outlier_probability",
        Unit::NONE,
        0.0..=1.0,
        |s| &mut s.outlier_probability,
        "Part of the positions that are outliers",
    )
    .number(
        "outlier_m",
        Unit::METRE,
        0.0..=1e6,
        |s| &mut s.outlier_std_m,
        "1 sigma of an outlier",
    )
    .numbers(
        "position_lie_m",
        Unit::METRE,
        -1e6..=1e6,
        |s| s.position_lie_m.as_mut_slice(),
        "What is added to positions while they lie: East, North, Up",
    )
    .array::<3>(
        "position_lie_window_s",
        Unit::SECOND,
        0.0..=1e9,
        (
            |s| window(&s.position_lies),
            |s, w| s.position_lies = window_of(w),
        ),
        "When positions lie: start, length (0: never), period (0: once)",
    )
    .numbers(
        "velocity_lie_m_per_s",
        Unit::METRE_PER_SECOND,
        -1e3..=1e3,
        |s| s.velocity_lie_m_s.as_mut_slice(),
        "What is added to velocities while they lie: East, North, Up",
    )
    .array::<3>(
        "velocity_lie_window_s",
        Unit::SECOND,
        0.0..=1e9,
        (
            |s| window(&s.velocity_lies),
            |s, w| s.velocity_lies = window_of(w),
        ),
        "When velocities lie: start, length (0: never), period (0: once)",
    )
    .array::<3>(
        "dropout_window_s",
        Unit::SECOND,
        0.0..=1e9,
        (|s| window(&s.dropouts), |s, w| s.dropouts = window_of(w)),
        "When neither position nor velocity comes: start, length (0: never), period (0: once)",
    )
    .number(
        "fix_variance_ratio",
        Unit::NONE,
        0.0..=1e6,
        |s| &mut s.stated_variance_ratio,
        "Variance that a position states over that of its noise; 0: it states none",
    )
}

fn window(window: &TimeWindow) -> [f64; 3] {
    [window.start_s, window.duration_s, window.period_s]
}

fn window_of([start_s, duration_s, period_s]: [f64; 3]) -> TimeWindow {
    TimeWindow {
        start_s,
        duration_s,
        period_s,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Windows are given as start, length and period.
    #[test]
    fn windows_are_filled_in_order() {
        let set = aiding();
        let mut settings = *set.base();
        set.put(
            &mut settings,
            "dropout_window_s",
            &vec![7.0, 5.0, 100.0].into(),
        )
        .unwrap();
        assert!(settings.dropouts.contains(108.0) && !settings.dropouts.contains(6.0));
    }
}
