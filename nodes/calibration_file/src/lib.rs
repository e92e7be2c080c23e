//! The calibration as a file: field units for people, SI for the machine.
//!
//! The section `si` holds the numbers to the last bit. Those in field units say the same; where a person changed one of
//! them, the file is refused, for it would say two things. A file without `si` is taken from its field units.
//!
//! States are found by their names. A file may hold more of them than this program knows, or fewer; of one that is missing, or
//! whose variance is zero, a reader knows what it knew before. A sigma of zero in field units says that it is not known.

use std::{collections::BTreeMap, path::Path};

use anyhow::{Context, ensure};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use sins::earth::Position;
use sins::{
    Stamp,
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    machines::self_calibration::{
        Calibration, CalibrationRecord, Phase, RecordedCovariance, further_errors,
    },
    units::{DEG_PER_HOUR, MICRO_G},
};

/// A text that is no calibration. What it shows quotes the file: that is for who may read the file anyway.
#[derive(Debug, thiserror::Error)]
#[error("{words}")]
pub struct NoCalibration {
    /// Up to here it could be one; the first line is 1.
    pub line: Option<u64>,
    words: String,
}

/// A file of a hundred states is a tenth of it \[bytes\].
const LONGEST: u64 = 4 << 20;

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
    /// Every other error of sensors and table by the name of its state; one that is missing is zero.
    #[serde(default)]
    states: BTreeMap<String, f64>,
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
    let text = text(calibration, source)?;
    files::write(path, text.as_bytes()).with_context(|| path.display().to_string())
}

/// What [`write()`] writes.
///
/// # Errors
/// Numbers that YAML cannot hold.
pub fn text(calibration: &Calibration, source: &str) -> anyhow::Result<String> {
    let errors = &calibration.errors;
    let covariance = &calibration.covariance;
    let sigma = |names| covariance.sigma3(names).unwrap_or_default();
    let q = calibration.attitude;
    let file = CalibrationFile {
        source: source.to_owned(),
        phase: calibration.phase,
        stamp_ns: calibration.stamp.nanos(),
        samples: calibration.samples,
        gaps: calibration.gaps,
        gyroscope_drift_deg_per_hour: (errors.gyroscope_drift / DEG_PER_HOUR).into(),
        gyroscope_drift_std_deg_per_hour: (sigma(&GYROSCOPE_DRIFT) / DEG_PER_HOUR).into(),
        accelerometer_bias_ug: (errors.accelerometer_bias / MICRO_G).into(),
        accelerometer_bias_std_ug: (sigma(&ACCELEROMETER_BIAS) / MICRO_G).into(),
        latitude_deg: calibration.position.latitude_rad.to_degrees(),
        longitude_deg: calibration.position.longitude_rad.to_degrees(),
        height_m: calibration.position.height_m,
        attitude_xyzw: [q.i, q.j, q.k, q.w],
        si: Some(Si {
            gyroscope_drift_rad_s: errors.gyroscope_drift.into(),
            accelerometer_bias_m_s2: errors.accelerometer_bias.into(),
            gyroscope_matrix: errors.gyroscope_matrix.transpose().into(),
            accelerometer_matrix: errors.accelerometer_matrix.transpose().into(),
            states: further_errors(errors, &calibration.table)
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
            latitude_rad: calibration.position.latitude_rad,
            longitude_rad: calibration.position.longitude_rad,
            state_names: covariance.states().iter().map(Into::into).collect(),
            covariance: covariance
                .matrix()
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
    let text = files::read_text(path, LONGEST).with_context(name)?;
    let file: CalibrationFile = serde_saphyr::from_str(&text)
        .map_err(|error| NoCalibration {
            line: error.location().map(|at| at.line()),
            words: error.to_string().lines().next().unwrap_or_default().into(),
        })
        .with_context(name)?;
    calibration(file).with_context(name)
}

fn calibration(file: CalibrationFile) -> anyhow::Result<Calibration> {
    let scaled = |values: [f64; 3], unit: f64| values.map(|value| value * unit);
    for (key, sigmas) in [
        (
            "gyroscope_drift_std_deg_per_hour",
            file.gyroscope_drift_std_deg_per_hour,
        ),
        ("accelerometer_bias_std_ug", file.accelerometer_bias_std_ug),
    ] {
        for sigma in sigmas {
            // Not a number is at least nothing.
            ensure!(
                sigma >= 0.0 && sigma.is_finite(),
                "{key} holds {sigma}, expected finite numbers that are not negative"
            );
        }
    }
    let mut record = CalibrationRecord {
        stamp: Stamp::from_nanos(file.stamp_ns),
        phase: file.phase,
        gyroscope_drift_rad_s: scaled(file.gyroscope_drift_deg_per_hour, DEG_PER_HOUR),
        accelerometer_bias_m_s2: scaled(file.accelerometer_bias_ug, MICRO_G),
        gyroscope_matrix: [0.0; 9],
        accelerometer_matrix: [0.0; 9],
        further: Vec::new(),
        attitude_xyzw: file.attitude_xyzw,
        position: Position::from_degrees(file.latitude_deg, file.longitude_deg, file.height_m),
        covariance: RecordedCovariance::Sensors {
            gyroscope_drift: scaled(file.gyroscope_drift_std_deg_per_hour, DEG_PER_HOUR),
            accelerometer_bias: scaled(file.accelerometer_bias_std_ug, MICRO_G),
            misalignment: [0.0; 9],
        },
        samples: file.samples,
        gaps: file.gaps,
    };
    if let Some(si) = file.si {
        put_si(&mut record, si)?;
    }
    Ok(record.calibration()?)
}

/// The numbers of the section `si` in the place of those in field units.
fn put_si(record: &mut CalibrationRecord, si: Si) -> anyhow::Result<()> {
    agree(
        "gyroscope_drift_deg_per_hour",
        record.gyroscope_drift_rad_s.into(),
        si.gyroscope_drift_rad_s.into(),
    )?;
    agree(
        "accelerometer_bias_ug",
        record.accelerometer_bias_m_s2.into(),
        si.accelerometer_bias_m_s2.into(),
    )?;
    let position = &mut record.position;
    agree(
        "latitude_deg, longitude_deg",
        Vector3::new(position.latitude_rad, position.longitude_rad, 0.0),
        Vector3::new(si.latitude_rad, si.longitude_rad, 0.0),
    )?;
    position.latitude_rad = si.latitude_rad;
    position.longitude_rad = si.longitude_rad;
    record.gyroscope_drift_rad_s = si.gyroscope_drift_rad_s;
    record.accelerometer_bias_m_s2 = si.accelerometer_bias_m_s2;
    let by_rows = |rows: [[f64; 3]; 3]| std::array::from_fn(|i| rows[i / 3][i % 3]);
    record.gyroscope_matrix = by_rows(si.gyroscope_matrix);
    record.accelerometer_matrix = by_rows(si.accelerometer_matrix);
    record.further = si.states.into_iter().collect();
    let count = si.state_names.len();
    ensure!(
        si.covariance.len() == count && si.covariance.iter().all(|row| row.len() == count),
        "si.covariance is not {count} rows of {count}, as many as si.state_names"
    );
    record.covariance = RecordedCovariance::States {
        names: si.state_names,
        row_major: si.covariance.into_iter().flatten().collect(),
    };
    Ok(())
}

fn agree(name: &str, field: Vector3<f64>, si: Vector3<f64>) -> anyhow::Result<()> {
    let apart = (field - si).norm();
    // Not a number is not near anything.
    let differs = apart.is_nan() || apart > SAME * si.norm().max(f64::MIN_POSITIVE);
    ensure!(
        !differs,
        "{name} and its value in si differ (to set it by hand, take the section si out)"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::{SMatrix, UnitQuaternion};
    use proptest::prelude::*;
    use sins::estimation::model::{Model, Paper};
    use sins::estimation::state::StateList;
    use sins::sensor::errors::SensorErrors;
    use sins::table::TableErrors;

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
                accelerometer_quadratic: Vector3::new(1e-6, -1.0 / 3.0 * 1e-6, 5e-324),
                accelerometer_arms: nalgebra::Matrix3::from_fn(|i, j| 0.1 / (3 * i + j + 3) as f64),
                gyroscope_g_sensitivity: nalgebra::Matrix3::from_fn(|i, j| {
                    1e-9 / (3 * i + j + 7) as f64
                }),
                accelerometer_delay_s: 0.1 + 0.2,
            },
            table: TableErrors {
                nonorthogonality_rad: 1e-4 / 3.0,
                inner_axis_tilt_rad: [1e-5 / 3.0, -2e-5 / 7.0],
                encoder_zero_outer_rad: 0.0,
                encoder_zero_inner_rad: 3e-5 / 7.0,
                encoder_eccentricity_outer_rad: [1e-6 / 3.0, 1e-6 / 7.0],
                encoder_eccentricity_inner_rad: [-1e-6 / 9.0, 1e-6 / 11.0],
            },
            attitude: UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
            position: Position {
                latitude_rad: 0.799,
                longitude_rad: 2.210_8,
                height_m: 0.1,
            },
            covariance: Paper::named(&SMatrix::from_fn(|i, j| 1e-12 / (1 + i + j) as f64)).unwrap(),
            samples: 1_440_000,
            gaps: 0,
        }
    }

    proptest! {
        #![proptest_config(damage::drawn(1500))]

        /// A damaged file is refused in one line that names it, or read as a calibration that a message may carry as well.
        #[test]
        fn damaged_files_are_told(
            bytes in damage::damaged(text(&example(), "x.mcap").unwrap().into_bytes()),
        ) {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), bytes).unwrap();
            match read(file.path()) {
                Ok(calibration) => {
                    let numbers = calibration.errors.gyroscope_drift.iter()
                        .chain(&calibration.errors.accelerometer_bias);
                    prop_assert!(numbers.copied().all(f64::is_finite));
                }
                Err(error) => {
                    let told = format!("{error:#}");
                    prop_assert!(told.contains(file.path().to_str().unwrap()), "{told}");
                    prop_assert!(!told.contains('\n') && told.len() < 1000, "{told}");
                }
            }
        }
    }

    /// Written and read, every number is the same to the last bit.
    #[test]
    fn there_and_back() {
        let text = text(&example(), "x.mcap").unwrap();
        let file = serde_saphyr::from_str(&text).unwrap();
        assert_eq!(calibration(file).unwrap(), example());
    }

    /// A file from before there was the key `states` is read with zeros there, and one with names of tomorrow for those that are
    /// known.
    #[test]
    fn errors_of_yesterday_and_tomorrow() {
        let file = || -> CalibrationFile {
            serde_saphyr::from_str(&text(&example(), "x").unwrap()).unwrap()
        };
        let mut old = serde_json::to_value(file()).unwrap();
        old["si"].as_object_mut().unwrap().remove("states").unwrap();
        let old: CalibrationFile = serde_json::from_value(old).unwrap();
        let read = calibration(old).unwrap();
        assert_eq!(
            read.errors.gyroscope_matrix,
            example().errors.gyroscope_matrix
        );
        assert_eq!(read.errors.accelerometer_delay_s, 0.0);
        assert_eq!(read.table, TableErrors::default());

        let mut new = file();
        let states = &mut new.si.as_mut().unwrap().states;
        states.insert("accelerometer_hysteresis_x".to_owned(), 1.0);
        assert_eq!(calibration(new).unwrap(), example());
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
        let sigma = calibration.covariance.sigma(GYROSCOPE_DRIFT[0]).unwrap();
        assert!((sigma / DEG_PER_HOUR - 0.001).abs() < 1e-15);
    }

    /// A file of tomorrow, with more states and in another order, is read for what is known here; one with fewer is read for
    /// what it has. A covariance that is none is refused by its name.
    #[test]
    fn more_and_fewer_states() {
        let example = example();
        let whole = &example.covariance;
        let si = |names: &[&str]| {
            let mut file: CalibrationFile =
                serde_saphyr::from_str(&text(&example, "x").unwrap()).unwrap();
            let si = file.si.as_mut().unwrap();
            si.state_names = names.iter().map(ToString::to_string).collect();
            let other = |a: &str, b: &str| if a == b { 1.0 } else { 0.0 };
            let element = |a, b| whole.covariance(a, b).unwrap_or_else(|| other(a, b));
            si.covariance = names
                .iter()
                .map(|a| names.iter().map(|b| element(a, b)).collect())
                .collect();
            file
        };
        let mut more: Vec<&str> = whole.states().iter().collect();
        more.insert(3, "accelerometer_quadratic_x_per_m_s2");
        more.reverse();
        let read = calibration(si(&more)).unwrap();
        assert_eq!(
            read.covariance.states(),
            &StateList::names(more.iter().copied())
        );
        let known = read
            .covariance
            .block(&Paper::LIST.map(|label| label.name))
            .unwrap();
        assert_eq!(known.as_slice(), whole.matrix().as_slice());

        let fewer = calibration(si(&GYROSCOPE_DRIFT)).unwrap();
        let named = &fewer.covariance;
        assert_eq!(
            named.sigma3(&GYROSCOPE_DRIFT),
            whole.sigma3(&GYROSCOPE_DRIFT)
        );
        assert_eq!(named.sigma3(&ACCELEROMETER_BIAS), None);

        let mut broken = si(&more);
        broken.si.as_mut().unwrap().covariance[0][0] = -1.0;
        let error = format!("{:#}", calibration(broken).unwrap_err());
        assert!(
            error.contains("variance of gyroscope_drift_z_rad_s"),
            "{error}"
        );
    }

    /// What no sensor and no place can be is refused by its name, in field units as in `si`.
    #[test]
    fn what_cannot_be_is_refused() {
        let mut example = example();
        example.position.height_m = 1e300;
        let file = serde_saphyr::from_str(&text(&example, "x").unwrap()).unwrap();
        let error = calibration(file).unwrap_err().to_string();
        assert!(error.contains("height"), "{error}");
        example.position.height_m = 0.0;
        let mut file: CalibrationFile =
            serde_saphyr::from_str(&text(&example, "x").unwrap()).unwrap();
        file.si = None;
        file.gyroscope_drift_deg_per_hour[1] = 1e6;
        let error = calibration(file).unwrap_err().to_string();
        assert!(error.contains("gyroscope_drift"), "{error}");
    }

    /// Numbers that are none, sigmas below zero and places off the globe are refused in one line that names them, in the text as in the
    /// section `si`.
    #[test]
    fn numbers_that_mean_nothing_are_refused() {
        type Change = fn(&mut CalibrationFile);
        let good = text(&example(), "x").unwrap();
        let told = |change: fn(&mut CalibrationFile)| {
            let mut file: CalibrationFile = serde_saphyr::from_str(&good).unwrap();
            change(&mut file);
            format!("{:#}", calibration(file).unwrap_err())
        };
        let changes: [(&str, Change); 8] = [
            ("gyroscope_drift", |f| {
                f.gyroscope_drift_deg_per_hour[0] = f64::NAN;
            }),
            ("gyroscope_drift_std", |f| {
                f.gyroscope_drift_std_deg_per_hour[2] = -0.1;
            }),
            ("accelerometer_bias_std", |f| {
                f.accelerometer_bias_std_ug[1] = f64::NAN;
            }),
            ("latitude", |f| {
                f.si = None;
                f.latitude_deg = 95.0;
            }),
            ("longitude", |f| {
                f.si = None;
                f.longitude_deg = f64::INFINITY;
            }),
            ("attitude", |f| f.attitude_xyzw[3] = f64::NAN),
            ("covariance", |f| {
                f.si.as_mut().unwrap().covariance[0][1] = f64::NAN;
            }),
            ("variance of", |f| {
                f.si.as_mut().unwrap().covariance[4][4] = -1e-9;
            }),
        ];
        for (words, change) in changes {
            let line = told(change);
            assert!(
                line.contains(words) && !line.contains('\n'),
                "{words}: {line}"
            );
        }
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
