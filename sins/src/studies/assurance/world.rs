//! One drawn world: simulated, calibrated, and compared with its truth.

use std::collections::VecDeque;

use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};

use crate::earth::Position;
use crate::error::Error;
use crate::estimation::model::CALIBRATED_NAMES;
use crate::machines::self_calibration::{
    Estimate, SelfCalibration, Settings, Verdict, named_errors,
};
use crate::sensor::SensorErrors;
use crate::simulation::{Run, Simulator, SimulatorSettings};
use crate::studies::paper::{CALIBRATED, CALIBRATED_STATES};
use crate::table::scheme::sequencer::SequencerSettings;
use crate::table::scheme::{Scheme, Sequencer};
use crate::table::{TableErrors, Turntable};
use crate::time::Stamp;

/// Within this of its target a joint has arrived: more than any encoder's zero is off \[rad\].
const TOLERANCE_RAD: f64 = 1e-3;

/// Truths that are kept, in samples: two seconds.
const KEPT_TRUTHS: usize = 20;

/// A world and what the calibrator is told of it.
#[derive(Clone, Debug)]
pub struct World {
    /// Ship, table, sensors.
    pub simulator: SimulatorSettings,
    /// What the table does.
    pub scheme: Scheme,
    /// How long \[s\].
    pub duration_s: f64,
    /// What the calibrator is told; the model is put in its place before the run.
    pub calibration: Settings,
    /// What is added to latitude and longitude of the fix \[rad\].
    pub fix_error_rad: [f64; 2],
    /// Sign and scale of what is told of the encoders' readings.
    pub encoder_scale: [f64; 2],
}

/// What became of a world.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What the judge said.
    pub verdict: Verdict,
    /// The estimate at the end.
    pub estimate: Estimate,
    /// Every sigma asked for was reached: the bounds say that it should have converged.
    pub reached: bool,
    /// Error over sigma of the nine, in the order of [`CALIBRATED`].
    pub z: [f64; CALIBRATED_STATES],
    /// Normalized estimation error squared of the nine.
    pub nees: f64,
    /// Error over sigma of every other error of sensors and table that the filter has learned, by the state's name.
    pub others: Vec<(&'static str, f64)>,
}

impl Outcome {
    /// The nine's greatest error over sigma, with its symbol.
    pub fn worst(&self) -> (&'static str, f64) {
        let each = CALIBRATED.iter().zip(self.z);
        each.map(|(label, z)| (label.symbol, z.abs()))
            .fold(("", 0.0), |worst, next| {
                if next.1 > worst.1 || next.1.is_nan() {
                    next
                } else {
                    worst
                }
            })
    }

    /// The greatest error over sigma of what was learned beyond the nine, with its name; none where nothing was.
    pub fn worst_other(&self) -> Option<(&'static str, f64)> {
        let each = self.others.iter().map(|(name, z)| (*name, z.abs()));
        each.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Exit status 0.
    pub fn is_accepted(&self) -> bool {
        self.verdict.converged && self.verdict.consistent
    }
}

impl World {
    /// Runs it.
    ///
    /// # Errors
    /// [`Error`] where a setting means nothing, or the calibration has no estimate at all.
    pub fn run(&self) -> Result<Outcome, Error> {
        let program = self.scheme.program(self.simulator.plant.turntable)?;
        let sequencer = Sequencer::new(
            program,
            SequencerSettings {
                position_tolerance_rad: TOLERANCE_RAD,
                ..SequencerSettings::default()
            },
        )?;
        let simulator = Simulator::new(self.simulator)?;
        let mut machine = SelfCalibration::new(self.calibration.clone())?;
        let joints = |machine: &mut SelfCalibration, mut sample: crate::table::JointSample| {
            for joint in 0..2 {
                sample.position[joint] *= self.encoder_scale[joint];
                sample.velocity[joint] *= self.encoder_scale[joint];
            }
            machine.push_joints(sample)
        };
        joints(&mut machine, simulator.first_joints())?;
        let mut run = Run::new(simulator, sequencer, self.duration_s);
        // The last estimate stands at the last covariance step, a little before the last sample.
        let mut truths = VecDeque::new();
        while let Some(tick) = run.next() {
            let tick = tick?;
            if let Some(fix) = tick.position {
                machine.push_position(Position {
                    latitude_rad: fix.latitude_rad + self.fix_error_rad[0],
                    longitude_rad: fix.longitude_rad + self.fix_error_rad[1],
                    height_m: fix.height_m,
                })?;
            }
            if let Some(sample) = tick.joints {
                joints(&mut machine, sample)?;
            }
            if let Some(fix) = tick.velocity {
                let measurement = crate::sensor::VelocityMeasurement {
                    east_north: [fix.velocity.x, fix.velocity.y],
                    sigma: [fix.variance.x.sqrt(), fix.variance.y.sqrt()],
                };
                machine.push_velocity(fix.stamp, measurement)?;
            }
            machine.push_imu(&tick.imu);
            truths.push_back(Truth {
                stamp: tick.imu.stamp,
                attitude: run.simulator().plant().attitude(),
                errors: run.simulator().sensor_errors(),
                table: self.simulator.plant.table_errors,
            });
            if truths.len() > KEPT_TRUTHS {
                truths.pop_front();
            }
            while machine.poll().is_some() {}
        }
        let estimate = machine.finish()?;
        let at = estimate.stamp;
        let truth = truths
            .iter()
            .min_by_key(|truth| truth.stamp.nanos().abs_diff(at.nanos()))
            .ok_or_else(|| {
                Error::setting("duration of a world [s]", self.duration_s, "some samples")
            })?;
        Ok(compare(estimate, truth, machine.settings()))
    }
}

/// What is true at a sample.
struct Truth {
    stamp: Stamp,
    attitude: UnitQuaternion<f64>,
    errors: SensorErrors,
    table: TableErrors,
}

/// Every state that the filter has learned beyond the nine, against its truth. What kept its prior was not found, and is listed as
/// unobservable.
fn learned_others(estimate: &Estimate, truth: &Truth) -> Vec<(&'static str, f64)> {
    let hidden = estimate.unobservable();
    let true_values = named_errors(&truth.errors, &truth.table);
    let found = named_errors(&estimate.errors, &estimate.table);
    let pairs = found.into_iter().zip(true_values);
    pairs
        .filter(|((name, _), _)| !CALIBRATED_NAMES.contains(name) && !hidden.contains(name))
        .filter_map(|((name, found), (_, is))| {
            let sigma = estimate.states.sigma(name).filter(|sigma| *sigma > 0.0)?;
            Some((name, (is - found) / sigma))
        })
        .collect()
}

fn compare(estimate: Estimate, truth: &Truth, settings: &Settings) -> Outcome {
    let Truth {
        attitude, errors, ..
    } = truth;
    let misalignment = (attitude * estimate.navigation.attitude.inverse()).scaled_axis();
    let thirds: [Vector3<f64>; 3] = [
        misalignment,
        errors.accelerometer_bias - estimate.errors.accelerometer_bias,
        errors.gyroscope_drift - estimate.errors.gyroscope_drift,
    ];
    let covariance = estimate.covariance();
    let sigma = |state: usize| {
        covariance
            .sigma(CALIBRATED_NAMES[state])
            .unwrap_or(f64::NAN)
    };
    let z: [f64; CALIBRATED_STATES] =
        std::array::from_fn(|state| thirds[state / 3][state % 3] / sigma(state));
    let nees = covariance.block(&CALIBRATED_NAMES).and_then(|block| {
        let sigmas = SVector::<f64, CALIBRATED_STATES>::from_fn(|state, _| sigma(state));
        let correlation: SMatrix<f64, CALIBRATED_STATES, CALIBRATED_STATES> =
            block.component_div(&(sigmas * sigmas.transpose()));
        let scaled = SVector::from(z);
        Some(scaled.dot(&correlation.cholesky()?.solve(&scaled)))
    });
    Outcome {
        others: learned_others(&estimate, truth),
        verdict: estimate.verdict(settings),
        reached: settings.thresholds.reached(covariance) >= 1.0,
        estimate,
        z,
        nees: nees.unwrap_or(f64::NAN),
    }
}

/// The other order of both joints.
pub fn swapped(turntable: Turntable) -> Turntable {
    Turntable {
        outer: turntable.inner,
        inner: turntable.outer,
    }
}
