//! The calibration as a file: field units for people, SI for the machine.
//!
//! The section `si` holds the numbers to the last bit. Those in field units say the same; where a person changed one of
//! them, the file is refused, for it would say two things. A file without `si` is taken from its field units.

use std::{fs, path::Path};

use anyhow::{Context, bail, ensure};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use sins::earth::Position;
use sins::{
    Stamp,
    estimation::error_state::{BIAS, DRIFT, STATE_NAMES, STATES, StateMatrix},
    machines::self_calibration::{Calibration, Phase},
    sensor::errors::SensorErrors,
    units::{DEG_PER_HOUR, MICRO_G},
};

/// Two numbers in different units say the same when they agree to this share.
const SAME: f64 = 1e-9;

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationFile {
    /// What made it.
    source: String,
    phase: Phase,
    stamp_ns: i64,
    samples: u64,
    gaps: u64,
    gyroscope_drift_deg_per_hour: [f64; 3],
    gyroscope_drift_std_deg_per_hour: [f64; 3],
    accelerometer_bias_ug: [f64; 3],
    accelerometer_bias_std_ug: [f64; 3],
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
    attitude_xyzw: [f64; 4],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    si: Option<Si>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Si {
    gyroscope_drift_rad_s: [f64; 3],
    accelerometer_bias_m_s2: [f64; 3],
    gyroscope_matrix: [[f64; 3]; 3],
    accelerometer_matrix: [[f64; 3]; 3],
    latitude_rad: f64,
    longitude_rad: f64,
    state_names: Vec<String>,
    covariance: Vec<Vec<f64>>,
}

/// Writes a calibration; `source` says what made it. A file that is there already is replaced as a whole.
///
/// # Errors
/// One line that names the file.
pub fn write(path: &Path, calibration: &Calibration, source: &str) -> anyhow::Result<()> {
    let name = || path.display().to_string();
    let text = text(calibration, source)?;
    // Whoever reads meanwhile, and whoever loses power meanwhile, has the old file or the new one.
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    fs::write(&beside, text).with_context(name)?;
    fs::rename(&beside, path).with_context(name)
}

fn text(calibration: &Calibration, source: &str) -> anyhow::Result<String> {
    let errors = &calibration.errors;
    let sigma = calibration.sigma();
    let sigma = |start: usize| sigma.fixed_rows::<3>(start).into_owned();
    let q = calibration.attitude;
    let file = CalibrationFile {
        source: source.to_owned(),
        phase: calibration.phase,
        stamp_ns: calibration.stamp.nanos(),
        samples: calibration.samples,
        gaps: calibration.gaps,
        gyroscope_drift_deg_per_hour: (errors.gyroscope_drift / DEG_PER_HOUR).into(),
        gyroscope_drift_std_deg_per_hour: (sigma(DRIFT) / DEG_PER_HOUR).into(),
        accelerometer_bias_ug: (errors.accelerometer_bias / MICRO_G).into(),
        accelerometer_bias_std_ug: (sigma(BIAS) / MICRO_G).into(),
        latitude_deg: calibration.position.latitude_rad.to_degrees(),
        longitude_deg: calibration.position.longitude_rad.to_degrees(),
        height_m: calibration.position.height_m,
        attitude_xyzw: [q.i, q.j, q.k, q.w],
        si: Some(Si {
            gyroscope_drift_rad_s: errors.gyroscope_drift.into(),
            accelerometer_bias_m_s2: errors.accelerometer_bias.into(),
            gyroscope_matrix: errors.gyroscope_matrix.transpose().into(),
            accelerometer_matrix: errors.accelerometer_matrix.transpose().into(),
            latitude_rad: calibration.position.latitude_rad,
            longitude_rad: calibration.position.longitude_rad,
            state_names: STATE_NAMES.map(str::to_owned).to_vec(),
            covariance: calibration
                .covariance
                .row_iter()
                .map(|row| row.iter().copied().collect())
                .collect(),
        }),
    };
    Ok(serde_saphyr::to_string(&file)?)
}

/// Reads a calibration.
///
/// # Errors
/// One line that names the file, and the key in it where there is one.
pub fn read(path: &Path) -> anyhow::Result<Calibration> {
    let name = || path.display().to_string();
    let text = fs::read_to_string(path).with_context(name)?;
    let file: CalibrationFile = serde_saphyr::from_str(&text)
        .map_err(|error| {
            anyhow::anyhow!("{}", error.to_string().lines().next().unwrap_or_default())
        })
        .with_context(name)?;
    calibration(file).with_context(name)
}

fn calibration(file: CalibrationFile) -> anyhow::Result<Calibration> {
    let drift = Vector3::from(file.gyroscope_drift_deg_per_hour) * DEG_PER_HOUR;
    let bias = Vector3::from(file.accelerometer_bias_ug) * MICRO_G;
    let [x, y, z, w] = file.attitude_xyzw;
    let raw = Quaternion::new(w, x, y, z);
    ensure!(
        (raw.norm() - 1.0).abs() < 1e-6,
        "attitude_xyzw has the norm {}, expected 1",
        raw.norm()
    );
    let mut calibration = Calibration {
        stamp: Stamp::from_nanos(file.stamp_ns),
        phase: file.phase,
        errors: SensorErrors::constant(drift, bias),
        attitude: UnitQuaternion::new_unchecked(raw),
        position: Position {
            latitude_rad: file.latitude_deg.to_radians(),
            longitude_rad: file.longitude_deg.to_radians(),
            height_m: file.height_m,
        },
        covariance: StateMatrix::zeros(),
        samples: file.samples,
        gaps: file.gaps,
    };
    let stds = [
        (DRIFT, file.gyroscope_drift_std_deg_per_hour, DEG_PER_HOUR),
        (BIAS, file.accelerometer_bias_std_ug, MICRO_G),
    ];
    for (start, std, unit) in stds {
        for (axis, std) in std.into_iter().enumerate() {
            calibration.covariance[(start + axis, start + axis)] = (std * unit).powi(2);
        }
    }
    if let Some(si) = file.si {
        agree(
            "gyroscope_drift_deg_per_hour",
            drift,
            si.gyroscope_drift_rad_s.into(),
        )?;
        agree(
            "accelerometer_bias_ug",
            bias,
            si.accelerometer_bias_m_s2.into(),
        )?;
        let place = |latitude, longitude| Vector3::new(latitude, longitude, 0.0);
        let (degrees, radians) = (
            place(
                calibration.position.latitude_rad,
                calibration.position.longitude_rad,
            ),
            place(si.latitude_rad, si.longitude_rad),
        );
        agree("latitude_deg, longitude_deg", degrees, radians)?;
        calibration.errors = SensorErrors {
            gyroscope_drift: si.gyroscope_drift_rad_s.into(),
            accelerometer_bias: si.accelerometer_bias_m_s2.into(),
            gyroscope_matrix: nalgebra::Matrix3::from(si.gyroscope_matrix).transpose(),
            accelerometer_matrix: nalgebra::Matrix3::from(si.accelerometer_matrix).transpose(),
        };
        calibration.position.latitude_rad = si.latitude_rad;
        calibration.position.longitude_rad = si.longitude_rad;
        if si.state_names != STATE_NAMES {
            bail!(
                "si.state_names is {}, expected {}",
                si.state_names.join(", "),
                STATE_NAMES.join(", ")
            );
        }
        ensure!(
            si.covariance.len() == STATES && si.covariance.iter().all(|row| row.len() == STATES),
            "si.covariance is not {STATES} rows of {STATES}"
        );
        calibration.covariance = StateMatrix::from_fn(|row, column| si.covariance[row][column]);
    }
    Ok(calibration)
}

fn agree(name: &str, field: Vector3<f64>, si: Vector3<f64>) -> anyhow::Result<()> {
    let differs = (field - si).norm() > SAME * si.norm().max(f64::MIN_POSITIVE);
    ensure!(
        !differs,
        "{name} and its value in si differ (to set it by hand, take the section si out)"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn example() -> Calibration {
        Calibration {
            stamp: Stamp::from_nanos(1_760_014_400_000_000_001),
            phase: Phase::Converged,
            errors: SensorErrors {
                gyroscope_drift: Vector3::new(4.848_136_811_095_36e-8, -1.0 / 3.0 * 1e-7, 5e-324),
                accelerometer_bias: Vector3::new(9.806_65e-4, 0.1 + 0.2, -1e-17),
                gyroscope_matrix: nalgebra::Matrix3::from_fn(|i, j| 1e-5 * (3 * i + j) as f64),
                accelerometer_matrix: nalgebra::Matrix3::from_fn(|i, j| -1e-6 * (3 * i + j) as f64),
            },
            attitude: UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
            position: Position {
                latitude_rad: 0.799,
                longitude_rad: 2.210_8,
                height_m: 0.1,
            },
            covariance: StateMatrix::from_fn(|i, j| 1e-12 / (1 + i + j) as f64),
            samples: 1_440_000,
            gaps: 0,
        }
    }

    /// Written and read, every number is the same to the last bit.
    #[test]
    fn there_and_back() {
        let text = text(&example(), "x.mcap").unwrap();
        let file = serde_saphyr::from_str(&text).unwrap();
        assert_eq!(calibration(file).unwrap(), example());
    }

    /// A value changed by hand beside the other of its pair is refused by its name.
    #[test]
    fn two_truths_are_refused() {
        let mut file: CalibrationFile =
            serde_saphyr::from_str(&text(&example(), "x").unwrap()).unwrap();
        file.accelerometer_bias_ug[2] += 1.0;
        assert!(
            calibration(file)
                .unwrap_err()
                .to_string()
                .starts_with("accelerometer_bias_ug")
        );
    }

    /// Without the section `si` the field units count, and their sigmas are the covariance.
    #[test]
    fn written_by_hand() {
        let mut file: CalibrationFile =
            serde_saphyr::from_str(&text(&example(), "x").unwrap()).unwrap();
        file.si = None;
        file.gyroscope_drift_deg_per_hour = [0.01; 3];
        file.gyroscope_drift_std_deg_per_hour = [0.001; 3];
        let calibration = calibration(file).unwrap();
        assert!((calibration.errors.gyroscope_drift.x - 0.01 * DEG_PER_HOUR).abs() < 1e-22);
        assert!(
            (calibration.covariance[(DRIFT, DRIFT)].sqrt() / DEG_PER_HOUR - 0.001).abs() < 1e-15
        );
    }

    /// A key that means nothing is named.
    #[test]
    fn unknown_keys_are_refused() {
        let text = text(&example(), "x").unwrap() + "gyro_drift: 1\n";
        let error = serde_saphyr::from_str::<CalibrationFile>(&text)
            .unwrap_err()
            .to_string();
        assert!(error.contains("gyro_drift"), "{error}");
    }
}
