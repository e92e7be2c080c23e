//! What several studies share: the setting of the paper's simulation (its Table 1), and the states that calibration is about.

use nalgebra::Vector3;

use crate::estimation::filter::InitialUncertainty;
use crate::estimation::model::{CALIBRATED_NAMES, Model, Paper};
use crate::estimation::state::{StateLabel, positions};
use crate::units::{DEG_PER_HOUR, MICRO_G};

/// Number of the states of [`CALIBRATED`].
pub const CALIBRATED_STATES: usize = CALIBRATED_NAMES.len();

/// The states that calibration is about: misalignment (E, N, U), biases, drifts (x, y, z).
pub static CALIBRATED: [StateLabel; CALIBRATED_STATES] = {
    let names = CALIBRATED_NAMES;
    let at = positions(Paper::LIST, names);
    let mut labels = [Paper::LIST[0]; CALIBRATED_STATES];
    let mut state = 0;
    while state < CALIBRATED_STATES {
        labels[state] = Paper::LIST[at[state]];
        state += 1;
    }
    labels
};

/// Misalignment φ (E, N, U) \[rad\]: 0.01, 0.01, 0.05 deg.
pub fn misalignment_rad() -> Vector3<f64> {
    Vector3::new(0.01, 0.01, 0.05) * std::f64::consts::PI / 180.0
}

/// Accelerometer bias of every axis \[m/s²\]: 100 ug.
pub fn accelerometer_bias_m_s2() -> Vector3<f64> {
    Vector3::repeat(100.0 * MICRO_G)
}

/// Gyroscope drift of every axis \[rad/s\]: 0.01 deg/h.
pub fn gyroscope_drift_rad_s() -> Vector3<f64> {
    Vector3::repeat(0.01 * DEG_PER_HOUR)
}

/// P0 of the paper's simulation and of `expected-results`: the errors of Table 1 as sigmas, 10 m, 0.01 m/s.
pub fn initial_uncertainty() -> InitialUncertainty {
    InitialUncertainty {
        position_m: 10.0,
        velocity_m_s: 0.01,
        misalignment_rad: misalignment_rad(),
        accelerometer_bias_m_s2: accelerometer_bias_m_s2(),
        gyroscope_drift_rad_s: gyroscope_drift_rad_s(),
    }
}
