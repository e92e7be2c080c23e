//! The setting of the paper's simulation (its Table 1), which several studies share.

use nalgebra::Vector3;

use crate::estimation::filter::InitialUncertainty;
use crate::units::{DEG_PER_HOUR, MICRO_G};

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
