//! Many calibrations of one truth: errors drawn from the filter's own P0, and what the filter made of them.
//!
//! One truth stream serves all runs of a batch, so a batch needs the memory of its filters and no more. Batches with other
//! run numbers can be worked by other threads.

mod statistics;
mod voyage;

use nalgebra::{SVector, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::earth::Position;
use crate::earth::rotation::small_rotation;
use crate::error::Error;
use crate::estimation::filter::{InitialUncertainty, Loop, VelocityMeasurement};
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::{MISALIGNMENT, POSITION, VELOCITY};
use crate::estimation::model::CALIBRATED_NAMES;
use crate::estimation::model::{Model, Paper, PaperFilter};
use crate::estimation::state::{NamedCovariance, StateValues, positions};
use crate::machines::self_calibration::{Calibration, Phase};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::Increment;
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::NoiseDensity;
use crate::simulation::{
    ImuErrorSettings, ImuErrors, PlantSettings, Run, Simulator, SimulatorSettings, Tick,
};
use crate::studies::paper::{self, CALIBRATED_STATES};
use crate::table::scheme::sequencer::SequencerSettings;
use crate::table::scheme::{Scheme, Sequencer};
use crate::time::Stamp;

pub use statistics::{Point, Statistics, Trace, mean_nees_bounds};
pub use voyage::{Departure, Voyage, VoyageTrack};

/// Where the errors of a run stand among the filter's states.
mod at {
    use super::{
        ACCELEROMETER_BIAS, GYROSCOPE_DRIFT, MISALIGNMENT, Model, POSITION, Paper, VELOCITY,
        positions,
    };

    pub(super) const POSITIONS: [usize; 2] = positions(Paper::LIST, POSITION);
    pub(super) const VELOCITIES: [usize; 2] = positions(Paper::LIST, VELOCITY);
    pub(super) const ATTITUDE: [usize; 3] = positions(Paper::LIST, MISALIGNMENT);
    pub(super) const BIASES: [usize; 3] = positions(Paper::LIST, ACCELEROMETER_BIAS);
    pub(super) const DRIFTS: [usize; 3] = positions(Paper::LIST, GYROSCOPE_DRIFT);
}

type StateVector = SVector<f64, { Paper::N }>;

/// What all runs have in common.
#[derive(Clone, Debug)]
pub struct MonteCarlo {
    /// Ship, table, rate of the IMU.
    pub plant: PlantSettings,
    /// What the table does.
    pub scheme: Scheme,
    /// Length of a run \[s\].
    pub duration_s: f64,
    /// White noise that the sensors have.
    pub noise: NoiseDensity,
    /// White noise that the filter assumes.
    pub assumed_noise: NoiseDensity,
    /// One-sigma of the velocity measurement, real and assumed \[m/s\].
    pub velocity_sigma_m_s: f64,
    /// Whether measurements have the noise that the filter assumes, or none.
    pub noisy_measurements: bool,
    /// The filter's P0.
    pub initial: InitialUncertainty,
    /// Errors of every run, or `None` to draw them from P0 for each.
    pub errors: Option<TrueErrors>,
    /// Times of the snapshots \[s\], ascending.
    pub snapshots_s: Vec<f64>,
    /// Decides every random number together with the number of the run.
    pub seed: u64,
}

/// The errors that a run starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueErrors {
    /// Misalignment φ of the initial attitude (E, N, U) \[rad\].
    pub misalignment: Vector3<f64>,
    /// Errors of initial latitude and longitude \[rad\].
    pub position: [f64; 2],
    /// Errors of initial velocity (E, N) \[m/s\].
    pub velocity: [f64; 2],
    /// Accelerometer bias \[m/s²\].
    pub accelerometer_bias: Vector3<f64>,
    /// Gyroscope drift \[rad/s\].
    pub gyroscope_drift: Vector3<f64>,
}

impl TrueErrors {
    /// Table 1 of the paper: 0.01 deg/h and 100 ug on every axis, misalignment (0.01, 0.01, 0.05) deg.
    pub fn table_1() -> Self {
        Self {
            misalignment: paper::misalignment_rad(),
            position: [0.0; 2],
            velocity: [0.0; 2],
            accelerometer_bias: paper::accelerometer_bias_m_s2(),
            gyroscope_drift: paper::gyroscope_drift_rad_s(),
        }
    }

    fn from_state(x: &StateVector) -> Self {
        Self {
            misalignment: at::ATTITUDE.map(|state| x[state]).into(),
            position: at::POSITIONS.map(|state| x[state]),
            velocity: at::VELOCITIES.map(|state| x[state]),
            accelerometer_bias: at::BIASES.map(|state| x[state]).into(),
            gyroscope_drift: at::DRIFTS.map(|state| x[state]).into(),
        }
    }
}

/// One run's error and covariance at one time.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Time since the start \[s\].
    pub time_s: f64,
    /// What is left of every error: truth minus estimate, by the states' definitions.
    pub error: StateValues,
    /// What the filter says of it.
    pub covariance: NamedCovariance,
}

impl Snapshot {
    /// Error of the states of [`CALIBRATED`](paper::CALIBRATED); NaN where the filter does not have one.
    pub fn calibrated_error(&self) -> SVector<f64, CALIBRATED_STATES> {
        SVector::from(CALIBRATED_NAMES.map(|name| self.error.value(name).unwrap_or(f64::NAN)))
    }

    /// One-sigma of the states of [`CALIBRATED`](paper::CALIBRATED); NaN where the filter does not have one.
    pub fn calibrated_sigma(&self) -> SVector<f64, CALIBRATED_STATES> {
        SVector::from(CALIBRATED_NAMES.map(|name| self.covariance.sigma(name).unwrap_or(f64::NAN)))
    }

    /// Normalized estimation error squared of the nine; `None` where the covariance cannot be inverted.
    pub fn nees(&self) -> Option<f64> {
        let error = self.calibrated_error();
        // Units of 1e-8 rad/s beside 1e-3 m/s² would spoil the factorization; correlations do not.
        let sigma = self.calibrated_sigma();
        let scaled = error.component_div(&sigma);
        let correlation = self
            .covariance
            .block(&CALIBRATED_NAMES)?
            .component_div(&(sigma * sigma.transpose()));
        Some(scaled.dot(&correlation.cholesky()?.solve(&scaled)))
    }
}

/// What became of one run.
#[derive(Clone, Debug)]
pub struct RunResult {
    /// Number of the run.
    pub run: u64,
    /// At the times asked for.
    pub snapshots: Vec<Snapshot>,
    /// The errors it started with.
    pub truth: TrueErrors,
    /// The calibration at its end.
    pub calibration: Calibration,
    /// The true attitude at its end, b to n.
    pub attitude: UnitQuaternion<f64>,
}

impl RunResult {
    /// What a voyage that starts at the end of this run needs to know.
    pub fn departure(&self) -> Departure {
        Departure {
            calibration: self.calibration.clone(),
            attitude: self.attitude,
            errors: SensorErrors::constant(
                self.truth.gyroscope_drift,
                self.truth.accelerometer_bias,
            ),
            seed: 1000 + self.run,
        }
    }
}

/// One filter among the runs of a batch.
struct Trial {
    run: u64,
    imu: ImuErrors,
    truth: TrueErrors,
    filter: PaperFilter,
    random: Xoshiro256PlusPlus,
    snapshots: Vec<Snapshot>,
}

impl MonteCarlo {
    /// The setting of `expected-results`: the paper's place, heading 0, Table 1, eight positions, noise read as D.
    pub fn paper(scheme: Scheme, noise: NoiseDensity) -> Self {
        Self {
            plant: PlantSettings {
                turntable: scheme.default_table(),
                ..PlantSettings::default()
            },
            scheme,
            duration_s: 4.0 * 3600.0,
            noise,
            assumed_noise: noise,
            velocity_sigma_m_s: 0.01,
            noisy_measurements: true,
            initial: paper::initial_uncertainty(),
            errors: None,
            snapshots_s: vec![4.0 * 3600.0],
            seed: 1,
        }
    }

    /// Works the runs of these numbers in lockstep on one truth.
    ///
    /// # Errors
    /// [`Error`] where a setting means nothing or the scheme cannot be run on the table.
    pub fn run(&self, runs: std::ops::Range<u64>) -> Result<Vec<RunResult>, Error> {
        let settings = SimulatorSettings {
            plant: self.plant,
            imu: ImuErrorSettings::perfect(),
            joint_state_rate_hz: self.plant.imu_rate_hz.min(10.0),
            seed: self.seed,
            ..SimulatorSettings::default()
        };
        let program = self.scheme.program(self.plant.turntable)?;
        let sequencer = Sequencer::new(program, SequencerSettings::default())?;
        let simulator = Simulator::new(settings)?;
        let start = NavigationState {
            attitude: simulator.plant().attitude(),
            velocity: Vector3::zeros(),
            position: Position {
                latitude_rad: self.plant.ship.latitude_rad,
                longitude_rad: self.plant.ship.longitude_rad,
                height_m: self.plant.ship.height_m,
            },
        };
        let mut trials = runs
            .map(|run| self.trial(run, &start))
            .collect::<Result<Vec<_>, _>>()?;
        let mut due = self.snapshots_s.iter().copied().peekable();
        let mut simulation = Run::new(simulator, sequencer, self.duration_s);
        let mut next_step_s = 1.0;
        while let Some(tick) = simulation.next() {
            let tick = tick?;
            let time_s = tick.truth.stamp.seconds_since(self.plant.start);
            let half = 0.5e-9 * tick.truth.interval_nanos as f64;
            let step = time_s + half >= next_step_s;
            for trial in &mut trials {
                self.advance(trial, &tick, step)?;
            }
            if step {
                next_step_s += 1.0;
            }
            if due.peek().is_some_and(|at| time_s + half >= *at) {
                due.next();
                let attitude = simulation.simulator().plant().attitude();
                for trial in &mut trials {
                    let snapshot = trial.snapshot(time_s, &NavigationState { attitude, ..start });
                    trial.snapshots.push(snapshot);
                }
            }
        }
        let attitude = simulation.simulator().plant().attitude();
        Ok(trials
            .into_iter()
            .map(|t| RunResult {
                run: t.run,
                calibration: t.calibration(simulation.simulator().plant().now()),
                snapshots: t.snapshots,
                truth: t.truth,
                attitude,
            })
            .collect())
    }

    fn trial(&self, run: u64, start: &NavigationState) -> Result<Trial, Error> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(
            self.seed
                .wrapping_add(run.wrapping_mul(0x9E37_79B9_7F4A_7C15)),
        );
        let model = self.initial.model();
        let covariance = model.initial_covariance(start);
        let truth = self.errors.unwrap_or_else(|| {
            TrueErrors::from_state(&StateVector::from_fn(|i, _| {
                let normal: f64 = StandardNormal.sample(&mut random);
                normal * covariance[(i, i)].sqrt()
            }))
        });
        let imu = ImuErrorSettings {
            errors: SensorErrors::constant(truth.gyroscope_drift, truth.accelerometer_bias),
            noise: self.noise,
            ..ImuErrorSettings::perfect()
        };
        let computed = NavigationState {
            attitude: small_rotation(&-truth.misalignment) * start.attitude,
            velocity: Vector3::new(truth.velocity[0], truth.velocity[1], 0.0),
            position: Position {
                latitude_rad: start.position.latitude_rad + truth.position[0],
                longitude_rad: start.position.longitude_rad + truth.position[1],
                height_m: start.position.height_m,
            },
        };
        Ok(Trial {
            run,
            imu: ImuErrors::new(imu, rand::Rng::next_u64(&mut random))?,
            truth,
            filter: PaperFilter::new(
                model,
                computed,
                &SensorErrors::default(),
                covariance,
                self.assumed_noise,
                Loop::Closed,
            )?,
            random,
            snapshots: Vec::with_capacity(self.snapshots_s.len()),
        })
    }

    fn advance(&self, trial: &mut Trial, tick: &Tick, step: bool) -> Result<(), Error> {
        let sample = trial.imu.measure(&tick.truth);
        let interval_s = tick.truth.interval_nanos as f64 / 1e9;
        trial.filter.propagate(&Increment::from_averages(
            interval_s,
            &sample.angular_rate,
            &sample.specific_force,
        ));
        if step {
            trial.filter.step()?;
            let sigma = self.velocity_sigma_m_s;
            let east_north = [0, 1].map(|_| {
                let normal: f64 = StandardNormal.sample(&mut trial.random);
                if self.noisy_measurements {
                    normal * sigma
                } else {
                    0.0
                }
            });
            let measurement = VelocityMeasurement {
                east_north,
                sigma: [sigma; 2],
            };
            trial.filter.update_velocity(&measurement, None);
        }
        Ok(())
    }
}

impl Trial {
    fn calibration(&self, stamp: Stamp) -> Calibration {
        let navigation = self.filter.navigation();
        Calibration {
            stamp,
            phase: Phase::Calibrating,
            errors: self.filter.sensor_errors(),
            table: self.filter.installation().table,
            attitude: navigation.attitude,
            position: Position {
                latitude_rad: navigation.position.latitude_rad,
                longitude_rad: navigation.position.longitude_rad,
                height_m: navigation.position.height_m,
            },
            covariance: self.filter.named_covariance(),
            samples: 0,
            gaps: 0,
        }
    }

    fn snapshot(&self, time_s: f64, truth: &NavigationState) -> Snapshot {
        let computed = self.filter.navigation();
        let found = self.filter.sensor_errors();
        let left = -(computed.attitude * truth.attitude.inverse()).scaled_axis();
        let bias = self.truth.accelerometer_bias - found.accelerometer_bias;
        let drift = self.truth.gyroscope_drift - found.gyroscope_drift;
        let velocity = computed.velocity - truth.velocity;
        let [latitude, longitude] = at::POSITIONS;
        let mut error = StateVector::zeros();
        error[latitude] = computed.position.latitude_rad - truth.position.latitude_rad;
        error[longitude] = computed.position.longitude_rad - truth.position.longitude_rad;
        for axis in 0..2 {
            error[at::VELOCITIES[axis]] = velocity[axis];
        }
        for axis in 0..3 {
            error[at::ATTITUDE[axis]] = left[axis];
            error[at::BIASES[axis]] = bias[axis];
            error[at::DRIFTS[axis]] = drift[axis];
        }
        Snapshot {
            time_s,
            error: StateValues::of(Paper::LIST, &error),
            covariance: self.filter.named_covariance(),
        }
    }
}
