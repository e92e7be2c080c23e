//! Navigation after calibration: how the position error grows with the calibration and without it.

use nalgebra::{UnitQuaternion, Vector3};

use crate::earth::LocalEarth;
use crate::error::Error;
use crate::machines::self_calibration::Calibration;
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::Increment;
use crate::sensor::compensation::Compensator;
use crate::sensor::errors::SensorErrors;
use crate::sensor::sample::{ImuSample, NoiseDensity};
use crate::simulation::{ImuErrorSettings, ImuErrors, TruthSample};
use crate::time::Stamp;

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

/// The block and its sensors while the ship turns and lies.
struct Sea {
    earth: LocalEarth,
    attitude: UnitQuaternion<f64>,
    imu: ImuErrors,
    stamp: Stamp,
}

impl Sea {
    fn new(departure: &Departure, noise: NoiseDensity) -> Result<Self, Error> {
        let mooring = &departure.calibration;
        let settings = ImuErrorSettings {
            errors: departure.errors,
            noise,
            ..ImuErrorSettings::perfect()
        };
        Ok(Self {
            earth: LocalEarth::at(mooring.position.latitude_rad, mooring.position.height_m),
            attitude: departure.attitude,
            imu: ImuErrors::new(settings, departure.seed)?,
            stamp: mooring.stamp,
        })
    }

    /// Lets an interval pass in which the ship turns by `angle` about the vertical.
    fn pass(&mut self, angle: f64) -> ImuSample {
        self.stamp = self.stamp.plus_seconds(INTERVAL_S);
        let about_up = |angle: f64| UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        // The attitude at the middle of the interval stands for its average.
        let middle = about_up(0.5 * angle) * self.attitude;
        self.attitude = about_up(angle) * self.attitude;
        let rate = self.earth.earth_rate() + Vector3::z() * (angle / INTERVAL_S);
        self.imu.measure(&TruthSample::steady(
            self.stamp,
            (INTERVAL_S * 1e9) as i64,
            middle.inverse() * rate,
            middle.inverse() * (Vector3::z() * self.earth.gravity_m_s2),
        ))
    }

    /// Distance from the mooring \[m\].
    fn distance_m(&self, mooring: &Calibration, state: &NavigationState) -> f64 {
        f64::hypot(
            (state.position.latitude_rad - mooring.position.latitude_rad)
                * self.earth.meridian_radius_m,
            (state.position.longitude_rad - mooring.position.longitude_rad)
                * self.earth.transverse_radius_m
                * self.earth.cos_latitude,
        )
    }
}

impl Voyage {
    /// The turns of the ship, interval by interval, and then zeros for the time that she lies \[rad\].
    fn turns(&self) -> impl Iterator<Item = f64> {
        let steps = (self.turn_rad.abs() / TURN_STEP_RAD).round() as usize;
        let part = if steps == 0 {
            0.0
        } else {
            self.turn_rad / steps as f64
        };
        let still = (self.duration_s / INTERVAL_S).round() as usize;
        std::iter::repeat_n(part, steps).chain(std::iter::repeat_n(0.0, still))
    }

    /// What the sensors deliver on it: a sample that ends at the calibration's stamp, and then one a second while the ship turns and
    /// lies. For whoever drives the [`Navigator`](crate::machines::navigator::Navigator) itself.
    ///
    /// # Errors
    /// [`Error`] where the sensor errors or the noise mean nothing.
    pub fn samples(&self, departure: &Departure) -> Result<impl Iterator<Item = ImuSample>, Error> {
        let mut first = Sea::new(departure, self.noise)?.pass(0.0);
        first.stamp = departure.calibration.stamp;
        let mut sea = Sea::new(departure, self.noise)?;
        let turns: Vec<f64> = self.turns().collect();
        Ok(std::iter::once(first).chain(turns.into_iter().map(move |turn| sea.pass(turn))))
    }

    /// Sails, with the mechanization and the compensation of the [`Navigator`](crate::machines::navigator::Navigator) and without its covariance.
    ///
    /// # Errors
    /// [`Error`] where the sensor errors or the noise mean nothing.
    pub fn sail(&self, departure: &Departure) -> Result<VoyageTrack, Error> {
        let mooring = &departure.calibration;
        let mut sea = Sea::new(departure, self.noise)?;
        let start = NavigationState {
            attitude: mooring.attitude,
            velocity: Vector3::zeros(),
            position: mooring.position,
        };
        let mut compensator = Compensator::new(mooring.errors.compensation()?);
        let mut solutions = [Strapdown::new(start), Strapdown::new(start)];
        let mut track = VoyageTrack::default();
        let lies_from = self.turns().count() - (self.duration_s / INTERVAL_S).round() as usize;
        let mut due_s = self.every_s;
        for (index, turn) in self.turns().enumerate() {
            let sample = sea.pass(turn);
            let raw = (sample.angular_rate, sample.specific_force);
            let corrected = compensator.averages(INTERVAL_S, &raw.0, &raw.1);
            for (solution, (rate, force)) in solutions.iter_mut().zip([corrected, raw]) {
                solution.propagate(&Increment::from_averages(INTERVAL_S, &rate, &force));
            }
            let Some(lain) = (index + 1).checked_sub(lies_from).filter(|n| *n > 0) else {
                continue;
            };
            let time_s = lain as f64 * INTERVAL_S;
            if time_s >= due_s {
                due_s += self.every_s;
                let [with, without] = solutions
                    .each_ref()
                    .map(|s| sea.distance_m(mooring, s.state()));
                track.times_s.push(time_s);
                track.compensated_m.push(with);
                track.uncompensated_m.push(without);
            }
        }
        Ok(track)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::machines::navigator::{Navigator, NavigatorEvent, NavigatorSettings};
    use crate::simulation::NoiseReading;
    use crate::studies::monte_carlo::{MonteCarlo, TrueErrors};
    use crate::table::scheme::Scheme;

    /// A voyage is what the navigator makes of the same samples, the turn of the ship included.
    #[test]
    fn a_voyage_is_the_navigators() {
        let mut monte_carlo =
            MonteCarlo::paper(Scheme::eight_position(), NoiseReading::D.density());
        monte_carlo.plant.imu_rate_hz = 10.0;
        monte_carlo.duration_s = 3600.0;
        monte_carlo.errors = Some(TrueErrors::table_1());
        let departure = monte_carlo.run(0..1).unwrap()[0].departure();
        let voyage = Voyage {
            turn_rad: 1.5,
            duration_s: 3600.0,
            noise: NoiseReading::D.density(),
            every_s: 3600.0,
        };
        let track = voyage.sail(&departure).unwrap();
        let mooring = &departure.calibration;
        let sea = Sea::new(&departure, voyage.noise).unwrap();
        let mut navigator = Navigator::new(NavigatorSettings::default()).unwrap();
        let mut last = None;
        for (index, sample) in voyage.samples(&departure).unwrap().enumerate() {
            navigator.push_imu(&sample);
            if index == 0 {
                navigator.push_calibration(mooring.clone()).unwrap();
            }
            while let Some(event) = navigator.poll() {
                if let NavigatorEvent::Sample { output, .. } = event {
                    last = output;
                }
            }
        }
        let last = last.unwrap();
        for (solution, ours) in [
            (last.compensated, track.compensated_m[0]),
            (last.uncompensated, track.uncompensated_m[0]),
        ] {
            let distance = sea.distance_m(mooring, &solution.navigation);
            assert!((distance - ours).abs() < 1e-6 * ours, "{distance} {ours}");
        }
    }
}
