//! The plant with one set of sensors: what a simulator node publishes and a simulated bag holds.

use super::{
    Aiding, AidingSettings, Cadence, Encoder, EncoderSettings, ImuErrorSettings, ImuErrors, Plant,
    PlantSettings, PositionFix, TruthSample, VelocityFix,
};
use crate::error::Error;
use crate::sensor::SensorErrors;
use crate::sensor::sample::ImuSample;
use crate::table::{JointSample, Trajectory, Waypoints};
use crate::time::Stamp;
use serde::{Deserialize, Serialize};

/// Plant, sensors, rates and seed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorSettings {
    /// Ship, table and rate of the IMU.
    pub plant: PlantSettings,
    /// Errors of the IMU.
    pub imu: ImuErrorSettings,
    /// Errors of the encoders.
    pub encoder: EncoderSettings,
    /// Joint states a second, at the stamps of IMU samples; at most one with each \[Hz\].
    pub joint_state_rate_hz: f64,
    /// Noise of position and velocity.
    pub aiding: AidingSettings,
    /// Decides all noise.
    pub seed: u64,
}

impl Default for SimulatorSettings {
    fn default() -> Self {
        Self {
            plant: PlantSettings::default(),
            imu: ImuErrorSettings::default(),
            encoder: EncoderSettings::default(),
            joint_state_rate_hz: 20.0,
            aiding: AidingSettings::default(),
            seed: 1,
        }
    }
}

/// What one sampling interval brings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// The truth.
    pub truth: TruthSample,
    /// The IMU's sample.
    pub imu: ImuSample,
    /// The encoders' reading, where one is due.
    pub joints: Option<JointSample>,
    /// A position, where one is due.
    pub position: Option<PositionFix>,
    /// A velocity, where one is due.
    pub velocity: Option<VelocityFix>,
}

/// Plant and sensors.
#[derive(Clone, Debug)]
pub struct Simulator {
    plant: Plant,
    imu: ImuErrors,
    encoder: Encoder,
    aiding: Aiding,
    joint_cadence: Cadence,
    position_cadence: Cadence,
    velocity_cadence: Cadence,
    first_joints: JointSample,
}

impl Simulator {
    /// A simulator at the start of its first interval.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting means nothing.
    pub fn new(settings: SimulatorSettings) -> Result<Self, Error> {
        // The plant makes what is the IMU's delay, and one seed decides all.
        let plant = Plant::new(PlantSettings {
            accelerometer_delay_s: settings.imu.errors.accelerometer_delay_s,
            motion_seed: settings.seed,
            ..settings.plant
        })?;
        let table_errors = settings.plant.table_errors;
        let mut encoder = Encoder::new(settings.encoder, table_errors, settings.seed)?;
        let first_joints = encoder.read(&plant.joints());
        Ok(Self {
            plant,
            imu: ImuErrors::new(settings.imu, settings.seed)?,
            encoder,
            aiding: Aiding::new(settings.aiding, settings.seed)?,
            joint_cadence: Cadence::new(
                "joint state rate [Hz]",
                settings.joint_state_rate_hz,
                10_000.0,
            )?,
            position_cadence: Cadence::new(
                "position rate [Hz]",
                settings.aiding.position_rate_hz,
                10_000.0,
            )?,
            velocity_cadence: Cadence::new(
                "velocity rate [Hz]",
                settings.aiding.velocity_rate_hz,
                10_000.0,
            )?,
            first_joints,
        })
    }

    /// The encoders' reading at the start of the first interval, which comes before all ticks.
    pub fn first_joints(&self) -> JointSample {
        self.first_joints
    }

    /// The truth.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Stamp of the sample that comes next.
    pub fn next_stamp(&self) -> Stamp {
        self.plant.next_stamp()
    }

    /// The errors of the IMU as they were set.
    pub fn imu_errors(&self) -> &ImuErrorSettings {
        self.imu.settings()
    }

    /// The errors of the IMU as they stand now: drifts and biases may have walked.
    pub fn sensor_errors(&self) -> SensorErrors {
        self.imu.errors()
    }

    /// Hands a trajectory to the table; see [`Table::command`](super::Table::command).
    ///
    /// # Errors
    /// [`Error::Setting`] where the table cannot follow.
    pub fn command(
        &mut self,
        start: Option<Stamp>,
        trajectory: &Trajectory,
    ) -> Result<Stamp, Error> {
        self.plant.command(start, trajectory)
    }

    /// As [`Self::command`], for a motion whose points may have no rates.
    ///
    /// # Errors
    /// As [`super::table::Table::command`].
    pub fn follow(&mut self, start: Option<Stamp>, motion: &Waypoints) -> Result<Stamp, Error> {
        self.plant.follow(start, motion)
    }

    /// Lets one sampling interval pass.
    pub fn step(&mut self) -> Tick {
        let origin = self.plant.settings().start.nanos();
        let from = self.plant.now().nanos() - origin;
        let truth = self.plant.step();
        let to = truth.stamp.nanos() - origin;
        let (seconds, motion) = (self.plant.elapsed_s(), self.plant.motion());
        Tick {
            truth,
            imu: self.imu.measure(&truth),
            joints: self
                .joint_cadence
                .comes_in(from, to)
                .then(|| self.encoder.read(&truth.joints)),
            position: self
                .position_cadence
                .comes_in(from, to)
                .then(|| self.aiding.position(truth.stamp, seconds, motion))
                .flatten(),
            velocity: self
                .velocity_cadence
                .comes_in(from, to)
                .then(|| self.aiding.velocity(truth.stamp, seconds, motion))
                .flatten(),
        }
    }
}
