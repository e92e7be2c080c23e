//! Results of the mathematics as messages.

use std::fmt::Write as _;

use nalgebra::{DMatrix, Matrix3, Vector3};
use ros2_interfaces::sensor_msgs::{NavSatFix, NavSatStatus};
use rotary_sins_msgs::convert::{header, row_major};
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate};
use sins::Stamp;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::MISALIGNMENT;
use sins::estimation::groups::scale::{ACCELEROMETER_SCALE_FACTOR, GYROSCOPE_SCALE_FACTOR};
use sins::estimation::state::StateList;
use sins::machines::self_calibration::{
    Estimate, NOT_KNOWN, Phase, SampleReport, Settings, named_errors,
};
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

/// Number of a phase in messages.
pub const fn phase_number(phase: Phase) -> u8 {
    match phase {
        Phase::WaitingForPosition => SelfCalibrationEstimate::WAITING_FOR_POSITION,
        Phase::CoarseAlignment => SelfCalibrationEstimate::COARSE_ALIGNMENT,
        Phase::FineAlignment => SelfCalibrationEstimate::FINE_ALIGNMENT,
        Phase::Calibrating => SelfCalibrationEstimate::CALIBRATING,
        Phase::Converged => SelfCalibrationEstimate::CONVERGED,
        Phase::Inconsistent => SelfCalibrationEstimate::INCONSISTENT,
    }
}

/// The message of an estimate. Heading, pitch and roll are those of the block with both joints turned back to zero.
pub fn estimate(
    estimate: &Estimate,
    settings: &Settings,
    frame_id: &str,
) -> SelfCalibrationEstimate {
    let covariance = estimate.covariance();
    let vehicle_sigma = estimate.vehicle_sigma();
    SelfCalibrationEstimate {
        header: header(estimate.stamp, frame_id),
        phase: phase_number(estimate.phase),
        phase_name: estimate.phase.name().to_owned(),
        state_names: names(estimate.states.states()),
        state: estimate.states.values().to_vec(),
        covariance: covariance.row_major(),
        std: covariance.sigmas(),
        prior_std: prior(estimate),
        threshold: estimate
            .states
            .states()
            .iter()
            .map(|name| settings.thresholds.of(name).unwrap_or(0.0))
            .collect(),
        gyroscope_drift: estimate.gyroscope_drift().into(),
        gyroscope_drift_std: estimate.gyroscope_drift_sigma().into(),
        accelerometer_bias: estimate.accelerometer_bias().into(),
        accelerometer_bias_std: estimate.accelerometer_bias_sigma().into(),
        misalignment_std: estimate.misalignment_sigma().into(),
        attitude: estimate.navigation.attitude.into(),
        heading: estimate.vehicle.heading,
        heading_std: vehicle_sigma.heading,
        roll: estimate.vehicle.roll,
        roll_std: vehicle_sigma.roll,
        pitch: estimate.vehicle.pitch,
        pitch_std: vehicle_sigma.pitch,
        nis: estimate.innovations.last,
        nis_window_mean: estimate.innovations.window_mean,
        nis_upper_bound: estimate.innovations.window_bound,
        samples: estimate.samples.counts.samples,
        gaps: estimate.samples.counts.gaps,
        lost_samples: estimate.samples.counts.lost,
        duration: estimate.duration_s,
        message: line(estimate, settings),
    }
}

/// What is known before the filter runs: the phase and how far it has come. Sigmas that are not known are -1.
pub fn progress(
    stamp: Stamp,
    phase: Phase,
    share: f64,
    samples: &SampleReport,
    frame_id: &str,
) -> SelfCalibrationEstimate {
    let unknown = [NOT_KNOWN; 3];
    SelfCalibrationEstimate {
        header: header(stamp, frame_id),
        phase: phase_number(phase),
        phase_name: phase.name().to_owned(),
        gyroscope_drift_std: unknown,
        accelerometer_bias_std: unknown,
        misalignment_std: unknown,
        heading_std: NOT_KNOWN,
        roll_std: NOT_KNOWN,
        pitch_std: NOT_KNOWN,
        samples: samples.counts.samples,
        gaps: samples.counts.gaps,
        lost_samples: samples.counts.lost,
        message: format!(
            "{}: {:.0} % of coarse alignment",
            phase.name().replace('_', " "),
            100.0 * share
        ),
        ..SelfCalibrationEstimate::default()
    }
}

/// A calibration, of this estimate where it is not from a file. `valid` unless its filter did not agree with its samples.
pub fn calibration(
    result: &sins::machines::self_calibration::Calibration,
    estimate: Option<&Estimate>,
    frame_id: &str,
    source: &str,
) -> Calibration {
    let sigma = |name: &str| result.covariance.sigma(name).unwrap_or(NOT_KNOWN);
    // Zeros where nothing is known, as the message has it.
    let misalignment: Matrix3<f64> = result.covariance.block(&MISALIGNMENT).unwrap_or_default();
    let states = States::of(result);
    let [gyroscopes, accelerometers] = MATRICES
        .map(|matrix| std::array::from_fn(|element| matrix[element].map_or(NOT_KNOWN, sigma)));
    Calibration {
        header: header(result.stamp, frame_id),
        valid: result.phase != Phase::Inconsistent,
        converged: result.phase == Phase::Converged,
        gyroscope_drift: result.errors.gyroscope_drift.into(),
        gyroscope_drift_std: GYROSCOPE_DRIFT.map(sigma),
        accelerometer_bias: result.errors.accelerometer_bias.into(),
        accelerometer_bias_std: ACCELEROMETER_BIAS.map(sigma),
        gyroscope_matrix: row_major(&result.errors.gyroscope_matrix),
        gyroscope_matrix_std: gyroscopes,
        accelerometer_matrix: row_major(&result.errors.accelerometer_matrix),
        accelerometer_matrix_std: accelerometers,
        attitude: result.attitude.into(),
        attitude_covariance: row_major(&misalignment),
        latitude_deg: result.position.latitude_rad.to_degrees(),
        longitude_deg: result.position.longitude_rad.to_degrees(),
        height_m: result.position.height_m,
        state_names: states.names,
        state: states.values,
        covariance: states.covariance,
        phase: phase_number(result.phase),
        nis_mean: estimate.map_or(NOT_KNOWN, |estimate| estimate.innovations.window_mean),
        samples: result.samples,
        gaps: result.gaps,
        duration: estimate.map_or(NOT_KNOWN, |estimate| estimate.duration_s),
        source: source.to_owned(),
    }
}

/// The states of the matrices K_g and K_a, row by row; none above the diagonal of K_a.
const MATRICES: [[Option<&str>; 9]; 2] = [
    [
        Some(GYROSCOPE_SCALE_FACTOR[0]),
        Some("gyroscope_installation_xy_rad"),
        Some("gyroscope_installation_xz_rad"),
        Some("gyroscope_installation_yx_rad"),
        Some(GYROSCOPE_SCALE_FACTOR[1]),
        Some("gyroscope_installation_yz_rad"),
        Some("gyroscope_installation_zx_rad"),
        Some("gyroscope_installation_zy_rad"),
        Some(GYROSCOPE_SCALE_FACTOR[2]),
    ],
    [
        Some(ACCELEROMETER_SCALE_FACTOR[0]),
        None,
        None,
        Some("accelerometer_installation_yx_rad"),
        Some(ACCELEROMETER_SCALE_FACTOR[1]),
        None,
        Some("accelerometer_installation_zx_rad"),
        Some("accelerometer_installation_zy_rad"),
        Some(ACCELEROMETER_SCALE_FACTOR[2]),
    ],
];

/// The states of a calibration as its message has them: those of its covariance, then errors that it has without a covariance.
struct States {
    names: Vec<String>,
    values: Vec<f64>,
    covariance: Vec<f64>,
}

impl States {
    fn of(result: &sins::machines::self_calibration::Calibration) -> Self {
        let errors = named_errors(&result.errors, &result.table);
        let known = &result.covariance;
        let mut names = names(known.states());
        let value = |name: &str| errors.iter().find(|(of, _)| *of == name).map(|(_, v)| *v);
        let mut values: Vec<f64> = names.iter().map(|n| value(n).unwrap_or(0.0)).collect();
        for (name, value) in &errors {
            if *value != 0.0 && known.position(name).is_none() {
                names.push((*name).to_owned());
                values.push(*value);
            }
        }
        let (few, all) = (known.states().len(), names.len());
        let covariance = if few == 0 {
            Vec::new()
        } else {
            DMatrix::resize(known.matrix().transpose(), all, all, 0.0)
                .as_slice()
                .to_vec()
        };
        Self {
            names,
            values,
            covariance,
        }
    }
}

/// Why a fix cannot be used: a kind to count by, and a line for a person. `None` where it can be.
pub fn refusal(fix: &NavSatFix) -> Option<(&'static str, String)> {
    if fix.status.status < NavSatStatus::STATUS_FIX {
        return Some((
            "no fix",
            format!(
                "status is {}, expected 0 or more (the receiver has no fix)",
                fix.status.status
            ),
        ));
    }
    let values = [
        ("latitude", fix.latitude),
        ("longitude", fix.longitude),
        ("altitude", fix.altitude),
    ];
    values
        .iter()
        .find(|(_, value)| !value.is_finite())
        .map(|(name, value)| {
            (
                "not finite",
                format!("{name} is {value}, expected a finite number"),
            )
        })
}

fn prior(estimate: &Estimate) -> Vec<f64> {
    let of = |name| estimate.prior.value(name).unwrap_or_default();
    estimate.states.states().iter().map(of).collect()
}

fn names(states: &StateList) -> Vec<String> {
    states.iter().map(str::to_owned).collect()
}

/// Holes and refusals, where there are any.
fn losses(samples: &SampleReport) -> String {
    let counts = &samples.counts;
    let mut text = String::new();
    if counts.gaps > 0 {
        let _ = write!(text, "; {} gaps, {} samples lost", counts.gaps, counts.lost);
    }
    if counts.refused() > 0 {
        let _ = write!(text, "; {} samples refused", counts.refused());
    }
    if let Some(left_out) = samples.measurements_left_out() {
        let _ = write!(text, "; {left_out}");
    }
    text
}

/// One line for a person: where it stands, what the judge has against it (the worst), and how well the sensors are known.
fn line(estimate: &Estimate, settings: &Settings) -> String {
    let largest = |v: Vector3<f64>| v.max();
    let reason = match estimate.phase {
        Phase::Inconsistent => estimate.verdict(settings).reasons.into_iter().next(),
        _ => None,
    };
    format!(
        "{} at {:.0} s: {}1 sigma at most {:.4} deg/h and {:.2} ug, azimuth {:.1} arcsec{}",
        estimate.phase.name().replace('_', " "),
        estimate.duration_s,
        reason.map_or_else(String::new, |reason| format!("{reason}; ")),
        largest(estimate.gyroscope_drift_sigma()) / DEG_PER_HOUR,
        largest(estimate.accelerometer_bias_sigma()) / MICRO_G,
        estimate.misalignment_sigma().z / ARC_SECOND,
        losses(&estimate.samples)
    )
}
