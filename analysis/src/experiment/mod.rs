//! The paper's experiment (its section 5) on simulated IMUs, through the machines that a ship would run.
//!
//! Rest of 0.7 h, then the eight positions to 4 h, through coarse alignment and the filter as `calibrate` has them; then
//! free-inertial navigation with the calibration and without it.

mod page;
mod summary;

use nalgebra::SVector;
use rayon::prelude::*;
use sins::{
    estimation::state::StateLabel,
    machines::self_calibration::{Estimate, Event, SelfCalibration, Settings},
    sensor::errors::SensorErrors,
    simulation::{
        ImuErrorSettings, NoiseReading, PlantSettings, Run, Ship, Simulator, SimulatorSettings,
    },
    stream::Reading,
    studies::monte_carlo::{Departure, TrueErrors, Voyage, VoyageTrack},
    studies::paper::CALIBRATED,
    table::scheme::{Scheme, Sequencer, sequencer::SequencerSettings},
};

use crate::{Error, Listener};

pub use page::page;
pub use summary::{Report, summarize, text};

/// Length of calibration in the paper \[h\].
const HOURS: f64 = 4.0;

/// Times at which the position error is told \[h\].
const TOLD_H: [f64; 5] = [4.0, 8.0, 12.0, 24.0, 72.0];

/// Estimates of the first IMU are kept at this distance \[s\].
const KEPT_S: f64 = 60.0;

/// Number of biases and drifts.
const SENSOR_STATES: usize = 6;

/// Biases and drifts: the last of what calibration is about.
fn sensor_states() -> &'static [StateLabel] {
    &CALIBRATED[CALIBRATED.len() - SENSOR_STATES..]
}

/// What the biases and drifts are, in the order of [`sensor_states`].
fn true_errors() -> [f64; SENSOR_STATES] {
    let truth = TrueErrors::table_1();
    let (bias, drift) = (truth.accelerometer_bias, truth.gyroscope_drift);
    [bias.x, bias.y, bias.z, drift.x, drift.y, drift.z]
}

/// What the experiment is to do.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Number of IMUs, all with the errors of Table 1, each with its own noise.
    pub runs: u64,
    /// Samples of the IMU a second.
    pub rate_hz: f64,
    /// White noise of the sensors.
    pub noise: NoiseReading,
    /// Decides all noise.
    pub seed: u64,
    /// The ship.
    pub ship: Ship,
}

/// One estimate on the way.
struct Kept {
    time_s: f64,
    value: SVector<f64, SENSOR_STATES>,
    sigma: SVector<f64, SENSOR_STATES>,
}

/// One IMU's experiment.
pub struct Trial {
    estimate: Estimate,
    azimuth_error_rad: f64,
    history: Vec<Kept>,
    track: VoyageTrack,
}

/// Runs the experiment on all cores, and tells every IMU that is done.
///
/// # Errors
/// Where the ship or the rate is refused.
pub fn run(plan: &Plan, listener: &dyn Listener) -> Result<Vec<Trial>, Error> {
    (0..plan.runs)
        .into_par_iter()
        .map(|run| {
            let trial = trial(plan, run);
            listener.advance(1);
            trial
        })
        .collect()
}

fn trial(plan: &Plan, run: u64) -> Result<Trial, Error> {
    let truth = TrueErrors::table_1();
    let errors = SensorErrors::constant(truth.gyroscope_drift, truth.accelerometer_bias);
    let scheme = Scheme::paper_experiment();
    let turntable = scheme.default_table();
    let seed = plan.seed.wrapping_mul(1_000_003).wrapping_add(run);
    let simulator = Simulator::new(SimulatorSettings {
        plant: PlantSettings {
            ship: plan.ship,
            turntable,
            imu_rate_hz: plan.rate_hz,
            ..PlantSettings::default()
        },
        imu: ImuErrorSettings {
            errors,
            noise: plan.noise.density(),
            ..ImuErrorSettings::perfect()
        },
        seed,
        ..SimulatorSettings::default()
    })?;
    let mut machine = SelfCalibration::new(Settings {
        turntable,
        ..Settings::default()
    })?;
    let sequencer = Sequencer::new(scheme.program(turntable)?, SequencerSettings::default())?;
    machine.push(&Reading::Joints(simulator.first_joints()))?;
    let mut simulation = Run::new(simulator, sequencer, HOURS * 3600.0);
    let mut history = Vec::new();
    for tick in simulation.by_ref() {
        let tick = tick?;
        for reading in tick.readings() {
            machine.push(&reading)?;
        }
        while let Some(event) = machine.poll() {
            let Event::Estimate(estimate) = event else {
                continue;
            };
            if run != 0 || estimate.duration_s < history.len() as f64 * KEPT_S {
                continue;
            }
            let of = |value: &dyn Fn(&str) -> Option<f64>| {
                let names = sensor_states().iter().map(|label| label.name);
                SVector::from_iterator(names.map(|name| value(name).unwrap_or(f64::NAN)))
            };
            history.push(Kept {
                time_s: estimate.duration_s,
                value: of(&|name| estimate.states.value(name)),
                sigma: of(&|name| estimate.states.sigma(name)),
            });
        }
    }
    let estimate = machine.finish()?;
    let attitude = simulation.simulator().plant().attitude();
    let left = -(estimate.navigation.attitude * attitude.inverse()).scaled_axis();
    let voyage = Voyage {
        turn_rad: 0.0,
        duration_s: TOLD_H[TOLD_H.len() - 1] * 3600.0,
        noise: plan.noise.density(),
        every_s: 300.0,
    };
    let track = voyage.sail(&Departure {
        calibration: estimate.calibration(),
        attitude,
        errors,
        seed: seed.wrapping_add(500),
    })?;
    Ok(Trial {
        azimuth_error_rad: left.z,
        estimate,
        history,
        track,
    })
}
