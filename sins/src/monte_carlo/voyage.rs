//! Navigation after calibration: how the position error grows with the calibration and without it.

use nalgebra::{UnitQuaternion, Vector3};

use crate::earth::LocalEarth;
use crate::error::Error;
use crate::imu::NoiseDensity;
use crate::navigator::{Navigator, NavigatorSettings};
use crate::self_calibration::Calibration;
use crate::sensor_errors::SensorErrors;
use crate::simulation::{ImuErrorSettings, ImuErrors, TruthSample};
use crate::turntable::JointSample;

/// Turn of the ship in one sampling interval \[rad\].
const TURN_STEP_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// Sampling interval \[s\]. The block is at rest, or turns evenly: its averages are exact at any length.
const INTERVAL_S: f64 = 1.0;

/// Where a voyage starts from.
#[derive(Clone, Debug)]
pub struct Departure {
    /// What calibration found.
    pub calibration: Calibration,
    /// The true attitude of the block, b to n.
    pub attitude: UnitQuaternion<f64>,
    /// The true sensor errors.
    pub errors: SensorErrors,
    /// Decides the sensors' noise.
    pub seed: u64,
}

/// A ship that turns at her mooring, and then lies still while the system navigates freely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voyage {
    /// Turn about the vertical before she lies still, counter-clockwise positive \[rad\].
    pub turn_rad: f64,
    /// How long she lies \[s\].
    pub duration_s: f64,
    /// White noise of the sensors.
    pub noise: NoiseDensity,
    /// Time between the points of the track \[s\].
    pub every_s: f64,
}

/// The horizontal position error of one voyage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoyageTrack {
    /// Since the ship lay still \[s\].
    pub times_s: Vec<f64>,
    /// With the calibration \[m\].
    pub compensated_m: Vec<f64>,
    /// Without it \[m\].
    pub uncompensated_m: Vec<f64>,
}

impl VoyageTrack {
    /// The greatest error up to a time, with the calibration and without it \[m\].
    pub fn greatest_m(&self, until_s: f64) -> [f64; 2] {
        [&self.compensated_m, &self.uncompensated_m].map(|errors| {
            self.times_s
                .iter()
                .zip(errors)
                .take_while(|(time_s, _)| **time_s <= until_s)
                .fold(0.0, |greatest: f64, (_, error)| greatest.max(*error))
        })
    }
}

impl Voyage {
    /// Sails.
    ///
    /// # Errors
    /// [`Error`] where the sensor errors or the noise mean nothing.
    pub fn sail(&self, departure: &Departure) -> Result<VoyageTrack, Error> {
        let mooring = &departure.calibration;
        let earth = LocalEarth::at(mooring.latitude, mooring.height);
        let settings = ImuErrorSettings {
            errors: departure.errors,
            noise: self.noise,
        };
        let mut imu = ImuErrors::new(settings, departure.seed)?;
        let mut navigator = Navigator::new(NavigatorSettings::default())?;
        let mut stamp = mooring.stamp;
        let mut attitude = departure.attitude;
        let mut feed = |attitude: &UnitQuaternion<f64>, turn_rate: f64| {
            stamp = stamp.plus_seconds(INTERVAL_S);
            let rate = earth.earth_rate() + Vector3::z() * turn_rate;
            let truth = TruthSample {
                stamp,
                interval_nanos: (INTERVAL_S * 1e9) as i64,
                angular_rate: attitude.inverse() * rate,
                specific_force: attitude.inverse() * (Vector3::z() * earth.gravity_m_s2),
                joints: JointSample {
                    stamp,
                    position: [0.0; 2],
                    velocity: [0.0; 2],
                },
            };
            let sample = imu.measure(&truth);
            let Some(output) = navigator.ingest_imu(&sample)? else {
                // The first sample starts the clock, and navigation starts at its stamp.
                navigator.ingest_calibration(Calibration {
                    stamp,
                    ..mooring.clone()
                })?;
                return Ok(None);
            };
            Ok(Some([output.compensated, output.uncompensated].map(|s| {
                f64::hypot(
                    (s.navigation.latitude - mooring.latitude) * earth.meridian_radius_m,
                    (s.navigation.longitude - mooring.longitude)
                        * earth.transverse_radius_m
                        * earth.cos_latitude,
                )
            })))
        };
        feed(&attitude, 0.0)?;
        let steps = (self.turn_rad.abs() / TURN_STEP_RAD).round();
        if steps > 0.0 {
            let part = self.turn_rad / steps;
            let turned = |angle: f64, q: &UnitQuaternion<f64>| {
                UnitQuaternion::from_scaled_axis(Vector3::z() * angle) * q
            };
            for _ in 0..steps as u32 {
                // The attitude at the middle of the interval stands for its average.
                feed(&turned(0.5 * part, &attitude), part / INTERVAL_S)?;
                attitude = turned(part, &attitude);
            }
        }
        let mut track = VoyageTrack::default();
        let mut due_s = self.every_s;
        for step in 1..=(self.duration_s / INTERVAL_S).round() as u64 {
            let Some(errors) = feed(&attitude, 0.0)? else {
                continue;
            };
            let time_s = step as f64 * INTERVAL_S;
            if time_s >= due_s {
                due_s += self.every_s;
                track.times_s.push(time_s);
                track.compensated_m.push(errors[0]);
                track.uncompensated_m.push(errors[1]);
            }
        }
        Ok(track)
    }
}
