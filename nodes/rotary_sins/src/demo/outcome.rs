//! Truth against estimate, and whether anything was lost on the way.

use std::collections::VecDeque;
use std::path::Path;

use anyhow::{Context, Result, bail};
use bags::{Bag, Sample, SensorOptions, SensorStream};
use nalgebra::Vector3;
use ros2_interfaces::nav_msgs::Odometry;
use rotary_sins_msgs::convert::stamp_from_time;
use rotary_sins_msgs::interfaces::topics::{ESTIMATE, TRUE_CALIBRATION, TRUE_ODOMETRY};
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use sins::Stamp;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::stream::order::StampOrder;
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

use super::Options;
use super::fleet::Ended;
use super::watch::{CONSUMERS, Counts, PositionError, Seen};

/// How many sigmas an estimate may be off.
pub const LIMIT_SIGMA: f64 = 4.0;

/// One estimated quantity, in the unit of a person.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is, with axis.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// What it is really.
    pub truth: f64,
    /// What was found.
    pub estimate: f64,
    /// One-sigma of what was found.
    pub sigma: f64,
}

impl Row {
    /// Estimate minus truth.
    pub fn error(&self) -> f64 {
        self.estimate - self.truth
    }

    /// The error in sigmas.
    pub fn sigmas(&self) -> f64 {
        self.error() / self.sigma
    }

    fn is_good(&self) -> bool {
        self.sigma > 0.0 && self.sigmas().abs() <= LIMIT_SIGMA
    }
}

/// A consumer and its samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Consumer {
    /// Name of node or bag.
    pub name: String,
    /// What it counted.
    pub counts: Counts,
}

/// The result of a run.
#[derive(Clone, Debug)]
pub struct DemoResult {
    /// The nine estimates, and those of the groups beyond them.
    pub rows: Vec<Row>,
    /// The estimate they are from.
    pub estimate: SelfCalibrationEstimate,
    /// Every consumer of samples.
    pub consumers: Vec<Consumer>,
    /// Samples that were sent.
    pub sent: u64,
    /// Navigation with the calibration, and without; from the first calibration to the end.
    pub navigation: [Option<PositionError>; 2],
    /// Processes that did not end as they should.
    pub unclean: Vec<String>,
    /// What the scheme ended by, where the table did not follow.
    pub scheme_fault: Option<String>,
}

impl DemoResult {
    /// Compares what was seen with the truth and counts what is in the bag.
    ///
    /// # Errors
    /// Where estimate or truth never came, or the bag cannot be read.
    pub fn new(
        args: &Options,
        seen: Seen,
        bag: Option<&Path>,
        processes: &[Ended],
    ) -> Result<Self> {
        let mut consumers = Vec::new();
        for consumer in CONSUMERS {
            let counts = seen
                .counts(consumer)
                .with_context(|| format!("{consumer} sent no diagnostics of its samples"))?;
            consumers.push(Consumer {
                name: consumer.to_owned(),
                counts,
            });
        }
        if let Some(bag) = bag {
            consumers.push(Consumer {
                name: "recorded bag".to_owned(),
                counts: count(bag)?,
            });
        }
        let (Some(estimate), Some(truth)) = (seen.estimate, seen.truth) else {
            bail!("{} or {} never came", ESTIMATE.name, TRUE_CALIBRATION.name);
        };
        let odometry = nearest(&seen.truth_odometry, stamp_from_time(estimate.header.stamp))
            .with_context(|| format!("{} did not come until the end", TRUE_ODOMETRY.name))?;
        if estimate.state.is_empty() {
            bail!(
                "self-calibration came no further than phase {}",
                estimate.phase_name
            );
        }
        let mut rows = Vec::new();
        for (name, unit, scale, truth, found, sigma) in [
            (
                "gyroscope drift",
                "deg/h",
                DEG_PER_HOUR,
                truth.gyroscope_drift,
                estimate.gyroscope_drift,
                estimate.gyroscope_drift_std,
            ),
            (
                "accelerometer bias",
                "ug",
                MICRO_G,
                truth.accelerometer_bias,
                estimate.accelerometer_bias,
                estimate.accelerometer_bias_std,
            ),
            (
                "misalignment",
                "arcsec",
                ARC_SECOND,
                [0.0; 3],
                misalignment(&estimate, odometry)?.into(),
                estimate.misalignment_std,
            ),
        ] {
            let axes = if name == "misalignment" {
                ["East", "North", "Up"]
            } else {
                ["x", "y", "z"]
            };
            rows.extend((0..3).map(|axis| Row {
                name: format!("{name} {}", axes[axis]),
                unit,
                truth: truth[axis] / scale,
                estimate: found[axis] / scale,
                sigma: sigma[axis] / scale,
            }));
        }
        rows.extend(further_rows(&estimate, &truth));
        let scheme_fault = seen
            .scheme
            .filter(|scheme| scheme.state == SchemeStatus::FAULT)
            .map(|scheme| scheme.message);
        Ok(Self {
            rows,
            scheme_fault,
            estimate,
            consumers,
            sent: args.samples(),
            navigation: [seen.compensated, seen.uncompensated],
            unclean: processes
                .iter()
                .filter(|process| !process.cleanly)
                .map(|process| format!("{} ({})", process.name, process.status))
                .collect(),
        })
    }

    /// Whether a consumer has every sample, and used it.
    pub fn is_whole(&self, consumer: &Consumer) -> bool {
        let counts = consumer.counts;
        counts.samples == self.sent && counts.lost == 0 && counts.refused == 0
    }

    /// Every estimate within its limit, nothing lost, everything ended as it should.
    pub fn is_good(&self) -> bool {
        self.rows.iter().all(Row::is_good)
            && self
                .consumers
                .iter()
                .all(|consumer| self.is_whole(consumer))
            && self.unclean.is_empty()
            && self.scheme_fault.is_none()
    }

    /// What is wrong, one line each.
    pub fn faults(&self) -> Vec<String> {
        let mut faults: Vec<_> = self
            .rows
            .iter()
            .filter(|row| !row.is_good())
            .map(|row| {
                format!(
                    "{} is {:.1} sigma off, expected at most {LIMIT_SIGMA}",
                    row.name,
                    row.sigmas()
                )
            })
            .collect();
        for consumer in self
            .consumers
            .iter()
            .filter(|consumer| !self.is_whole(consumer))
        {
            let Counts {
                samples,
                lost,
                refused,
            } = consumer.counts;
            faults.push(format!(
                "{}: {samples} of {} samples, {lost} lost by stamp, {refused} refused",
                consumer.name, self.sent
            ));
        }
        faults.extend(
            self.scheme_fault
                .iter()
                .map(|why| format!("the scheme did not run: {why}")),
        );
        faults.extend(
            self.unclean
                .iter()
                .map(|name| format!("{name} did not end cleanly")),
        );
        faults
    }
}

/// Estimates of the groups beyond the nine, by their names.
fn further_rows(estimate: &SelfCalibrationEstimate, truth: &Calibration) -> Vec<Row> {
    let count = estimate.state_names.len();
    let is_row =
        |name: &str| !(GYROSCOPE_DRIFT.contains(&name) || ACCELEROMETER_BIAS.contains(&name));
    let named = estimate.state_names.iter().enumerate();
    named
        .filter(|(_, name)| is_row(name))
        .filter_map(|(at, name)| {
            let true_at = truth.state_names.iter().position(|known| known == name)?;
            let label = sins::estimation::model::label(name)?;
            let variance = estimate.covariance.get(at * count + at)?;
            Some(Row {
                name: label.words.to_owned(),
                unit: label.unit,
                truth: truth.state.get(true_at)? / label.scale,
                estimate: estimate.state.get(at)? / label.scale,
                sigma: variance.sqrt() / label.scale,
            })
        })
        .collect()
}

/// The true pose nearest in time; `None` where there is none within two seconds.
fn nearest(poses: &VecDeque<Odometry>, stamp: Stamp) -> Option<&Odometry> {
    let distance = |pose: &&Odometry| {
        stamp_from_time(pose.header.stamp)
            .nanos()
            .abs_diff(stamp.nanos())
    };
    poses
        .iter()
        .min_by_key(distance)
        .filter(|pose| distance(pose) < 2_000_000_000)
}

/// φ of the estimated attitude of the block about East, North, Up \[rad\]: C' = (I − φ×) C.
fn misalignment(estimate: &SelfCalibrationEstimate, truth: &Odometry) -> Result<Vector3<f64>> {
    let orientation = truth.pose.pose.orientation.rotation();
    let truth = orientation
        .with_context(|| format!("{}: orientation is no rotation", TRUE_ODOMETRY.name))?;
    let found = estimate.attitude.rotation();
    let found = found.with_context(|| format!("{}: attitude is no rotation", ESTIMATE.name))?;
    Ok(-(found * truth.inverse()).scaled_axis())
}

/// Counts the samples of a bag by their stamps.
fn count(bag: &Path) -> Result<Counts> {
    let bag = Bag::open(bag)?;
    let mut stream = SensorStream::new(&bag, &SensorOptions::default())?;
    let mut clock = StampOrder::default();
    while let Some(sample) = stream.next()? {
        if let Sample::Imu(sample) = sample {
            clock.push(sample.stamp, sample);
            while clock.pop().is_some() {}
        }
    }
    clock.end();
    let counts = clock.counts();
    Ok(Counts {
        samples: counts.samples,
        lost: counts.lost,
        refused: counts.refused(),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::UnitQuaternion;

    /// The misalignment is found with the sign of C' = (I − φ×) C, however the block stands.
    #[test]
    fn misalignment_has_the_sign_of_the_convention() {
        let block = UnitQuaternion::from_euler_angles(0.3, -1.1, 2.5);
        let phi = Vector3::new(1e-5, -2e-5, 3e-5);
        let estimate = SelfCalibrationEstimate {
            attitude: (UnitQuaternion::from_scaled_axis(-phi) * block).into(),
            ..SelfCalibrationEstimate::default()
        };
        let mut truth = Odometry::default();
        truth.pose.pose.orientation = block.into();
        assert!((misalignment(&estimate, &truth).unwrap() - phi).norm() < 1e-12);
    }

    /// The true pose at the time of the estimate is taken, not one of long ago.
    #[test]
    fn the_nearest_pose_is_taken() {
        let pose = |sec| {
            let mut pose = Odometry::default();
            pose.header.stamp.sec = sec;
            pose
        };
        let poses = VecDeque::from([pose(10), pose(11)]);
        let at = |sec| {
            nearest(&poses, Stamp::from_sec_nanosec(sec, 0)).map(|pose| pose.header.stamp.sec)
        };
        assert_eq!(
            (at(11), at(10), at(12), at(20)),
            (Some(11), Some(10), Some(11), None)
        );
    }

    /// Four sigma are within the limit, more are not, and an estimate without a sigma is none.
    #[test]
    fn rows_are_judged_by_their_sigma() {
        let row = |estimate, sigma| Row {
            name: String::new(),
            unit: "ug",
            truth: 100.0,
            estimate,
            sigma,
        };
        assert!(row(104.0, 1.0).is_good());
        assert!(!row(104.1, 1.0).is_good());
        assert!(!row(100.0, 0.0).is_good() && !row(f64::NAN, 1.0).is_good());
    }
}
