//! A ship that moves: every quantity a function of time, differentiated by hand.
//!
//! Place is a function on a chart: East and North in metres from the start, divided by the radii **of the start**, are
//! longitude and latitude. That makes latitude, longitude and height explicit functions with explicit derivatives, so that
//! velocity and specific force are exact; only the scale of the chart changes a little far from the start.

use std::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use serde::{Deserialize, Serialize};

use super::course::Track;
use super::sea::{Jet, WaveMotion, Waves};
use super::{Course, Hull, Ship, ShipState, Swing, WaveSystem};
use crate::earth::LocalEarth;
use crate::error::Error;
use crate::range;
use crate::simulation::{Stream, generator};

/// Waves of a wind sea.
const SEA_WAVES: usize = 28;
/// Waves of a swell.
const SWELL_WAVES: usize = 14;

/// How a ship moves. By default not at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionSettings {
    /// The wind sea.
    pub sea: WaveSystem,
    /// A swell beside it.
    pub swell: WaveSystem,
    /// How the hull answers.
    pub hull: Hull,
    /// The swing round the mooring.
    pub swing: Swing,
    /// The course under way.
    pub course: Course,
    /// From the ship's centre of motion to the table's centre: starboard, forward, up \[m\].
    pub table_arm_m: Vector3<f64>,
}

impl Default for MotionSettings {
    fn default() -> Self {
        Self {
            sea: WaveSystem::WIND_SEA,
            swell: WaveSystem::SWELL,
            hull: Hull::default(),
            swing: Swing::default(),
            course: Course::default(),
            table_arm_m: Vector3::zeros(),
        }
    }
}

/// The motion of one ship in one sea.
#[derive(Clone, Debug)]
pub struct ShipMotion {
    ship: Ship,
    settings: MotionSettings,
    waves: Waves,
    swing_phases: [f64; 2],
    /// The state of a ship that does not move.
    calm: ShipState,
    at_rest: bool,
    /// Metres of a radian of latitude and of longitude, at the start.
    chart_m: [f64; 2],
}

/// Place, velocity and acceleration on the chart (East, North, Up), and heading, pitch and roll with their derivatives.
struct Pose {
    chart: [Vector3<f64>; 3],
    angles: [Jet; 3],
}

impl ShipMotion {
    /// The motion that `seed` decides.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting means nothing.
    pub fn new(ship: Ship, settings: MotionSettings, seed: u64) -> Result<Self, Error> {
        ship.validate()?;
        settings.sea.validate()?;
        settings.swell.validate()?;
        settings.hull.validate()?;
        settings.swing.validate()?;
        settings.course.validate()?;
        for arm in &settings.table_arm_m {
            range::within("arm of the table's centre in the ship [m]", *arm, 1000.0)?;
        }
        if settings.swing.amplitude_rad != 0.0 && settings.course.speed_m_s != 0.0 {
            return Err(Error::setting(
                "speed of a ship that swings round her mooring [m/s]",
                settings.course.speed_m_s,
                "0, or no swing",
            ));
        }
        let mut random = generator(seed, Stream::Sea);
        let mut waves = Waves::default();
        for (system, count) in [(&settings.sea, SEA_WAVES), (&settings.swell, SWELL_WAVES)] {
            let way = (ship.heading_rad, settings.course.speed_m_s);
            waves.add(system, &settings.hull, way, count, &mut random);
        }
        let earth = LocalEarth::at(ship.latitude_rad, ship.height_m);
        Ok(Self {
            ship,
            settings,
            swing_phases: [0, 1].map(|_| TAU * random.random::<f64>()),
            calm: ship.at(0.0),
            at_rest: waves.is_calm()
                && settings.swing.amplitude_rad == 0.0
                && settings.course.speed_m_s == 0.0,
            waves,
            chart_m: [
                earth.meridian_radius_m,
                earth.transverse_radius_m * earth.cos_latitude,
            ],
        })
    }

    /// Whether the state never changes, so that a table at rest makes every sample the same.
    pub fn is_at_rest(&self) -> bool {
        self.at_rest
    }

    /// How she moves.
    pub fn settings(&self) -> &MotionSettings {
        &self.settings
    }

    fn pose(&self, seconds: f64) -> Pose {
        let heading = self.ship.heading_rad;
        let Track {
            place,
            heading: turned,
        } = if self.settings.course.speed_m_s > 0.0 {
            self.settings.course.at(seconds, heading)
        } else {
            self.settings.swing.at(seconds, heading, self.swing_phases)
        };
        let WaveMotion {
            drift,
            heave,
            angles: [yaw, pitch, roll],
        } = self.waves.at(seconds, &place);
        let about = |mean: f64, first: Jet, second: Jet| {
            [
                mean + first[0] + second[0],
                first[1] + second[1],
                first[2] + second[2],
            ]
        };
        Pose {
            chart: [0, 1, 2].map(|order| {
                Vector3::new(
                    place[0][order] + drift[0][order],
                    place[1][order] + drift[1][order],
                    heave[order],
                )
            }),
            angles: [
                about(heading, turned, yaw),
                about(self.ship.pitch_rad, [0.0; 3], pitch),
                about(self.ship.roll_rad, [0.0; 3], roll),
            ],
        }
    }

    /// The state `seconds` after the start.
    pub fn at(&self, seconds: f64) -> ShipState {
        if self.at_rest {
            return self.calm;
        }
        let Pose { chart, angles } = self.pose(seconds);
        let (attitude, rate, rate_change) = turning(&angles);
        // The table's centre is carried round the centre of motion; in a calm it lies where the ship is said to be.
        let arm = self.settings.table_arm_m;
        let carried = rate.cross(&arm);
        let [place, velocity, acceleration] = chart;
        let place = place + attitude * arm - self.calm.attitude * arm;
        let velocity = velocity + attitude * carried;
        let acceleration =
            acceleration + attitude * (rate_change.cross(&arm) + rate.cross(&carried));

        let [north_m, east_m] = self.chart_m;
        let latitude_rad = self.ship.latitude_rad + place.y / north_m;
        let height_m = self.ship.height_m + place.z;
        let (latitude_rate, latitude_change) = (velocity.y / north_m, acceleration.y / north_m);
        let (longitude_rate, longitude_change) = (velocity.x / east_m, acceleration.x / east_m);
        let earth = LocalEarth::at(latitude_rad, height_m);
        let (meridian, transverse) = (earth.meridian_radius_m, earth.transverse_radius_m);
        // v_E = λ̇ (R_N + h) cos L, v_N = L̇ (R_M + h), v_U = ḣ, and their derivatives.
        let over_ground = Vector3::new(
            longitude_rate * transverse * earth.cos_latitude,
            latitude_rate * meridian,
            velocity.z,
        );
        let transverse_change = earth.transverse_radius_slope_m * latitude_rate + velocity.z;
        let meridian_change = earth.meridian_radius_slope_m * latitude_rate + velocity.z;
        let over_ground_change = Vector3::new(
            longitude_change * transverse * earth.cos_latitude
                + longitude_rate
                    * (transverse_change * earth.cos_latitude
                        - transverse * earth.sin_latitude * latitude_rate),
            latitude_change * meridian + latitude_rate * meridian_change,
            acceleration.z,
        );
        let (earth_rate, transport) = (earth.earth_rate(), earth.transport_rate(&over_ground));
        let force = over_ground_change
            + (2.0 * earth_rate + transport).cross(&over_ground)
            + Vector3::new(0.0, 0.0, earth.gravity_m_s2);
        let unturn = attitude.inverse();
        let level = unturn * (earth_rate + transport);
        // The turn of the level frame itself changes by less than 1e-6 rad/s², and only arms of millimetres see it.
        let level_change = unturn * earth.transport_rate(&over_ground_change);
        ShipState {
            attitude,
            angular_rate: level + rate,
            angular_acceleration: rate_change - rate.cross(&level) + level_change,
            rate_over_level: rate,
            specific_force: unturn * force,
            velocity: over_ground,
            latitude_rad,
            longitude_rad: self.ship.longitude_rad + place.x / east_m,
            height_m,
        }
    }
}

/// Attitude, rate over the level frame and its derivative, in the ship's axes, of heading, pitch and roll with their derivatives.
/// ω = `R_y(−roll)` (`R_x(−pitch)` (−ψ̇ z) + ṗ x) + ṙ y.
fn turning(angles: &[Jet; 3]) -> (UnitQuaternion<f64>, Vector3<f64>, Vector3<f64>) {
    let [heading, pitch, roll] = *angles;
    let unroll = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -roll[0]);
    let attitude = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -heading[0])
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch[0])
        * unroll.inverse();
    let (sin, cos) = pitch[0].sin_cos();
    let up = Vector3::new(0.0, sin, cos);
    let up_change = Vector3::new(0.0, cos, -sin) * pitch[1];
    let before_roll = Vector3::x() * pitch[1] - up * heading[1];
    let before_roll_change = Vector3::x() * pitch[2] - up * heading[2] - up_change * heading[1];
    let turned = unroll * before_roll;
    (
        attitude,
        turned + Vector3::y() * roll[1],
        unroll * before_roll_change - Vector3::y().cross(&turned) * roll[1]
            + Vector3::y() * roll[2],
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::earth::Position;

    fn rough() -> ShipMotion {
        let settings = MotionSettings {
            sea: WaveSystem {
                significant_height_m: 2.0,
                ..WaveSystem::WIND_SEA
            },
            swell: WaveSystem {
                significant_height_m: 1.0,
                ..WaveSystem::SWELL
            },
            course: Course {
                speed_m_s: 7.0,
                leg_s: 60.0,
                ..Course::default()
            },
            table_arm_m: Vector3::new(2.0, -20.0, 6.0),
            ..MotionSettings::default()
        };
        let ship = Ship {
            heading_rad: 2.0,
            pitch_rad: 0.02,
            roll_rad: -0.03,
            ..Ship::default()
        };
        ShipMotion::new(ship, settings, 3).unwrap()
    }

    /// A ship that does not move is the ship at rest, to the last bit.
    #[test]
    fn a_calm_is_a_calm() {
        let ship = Ship::default();
        let motion = ShipMotion::new(ship, MotionSettings::default(), 1).unwrap();
        assert!(motion.is_at_rest());
        assert_eq!(motion.at(77.0), ship.at(0.0));
    }

    /// Velocity is the derivative of the place, rates are those of the attitude, and accelerations those of the rates, in a sea under way in
    /// a turn.
    #[test]
    fn everything_is_the_derivative_of_what_it_should_be() {
        let motion = rough();
        let place = |state: &ShipState| Position {
            latitude_rad: state.latitude_rad,
            longitude_rad: state.longitude_rad,
            height_m: state.height_m,
        };
        // Differences of the fourth order: the shortest waves change within half a second.
        let h = 2e-3;
        for t in [0.5, 200.0, 345.0, 3000.0] {
            let now = motion.at(t);
            let differences = |of: &dyn Fn(&ShipState, &ShipState) -> Vector3<f64>| {
                let over = |steps: f64| {
                    of(&motion.at(t - steps * h), &motion.at(t + steps * h)) / (2.0 * steps * h)
                };
                (4.0 * over(1.0) - over(2.0)) / 3.0
            };
            let velocity = differences(&|before, after| place(before).offset_m(&place(after)));
            // A longitude of 2 rad has lost a nanometre to rounding.
            assert!(
                (velocity - now.velocity).norm() < 3e-6,
                "{t}: {velocity} {}",
                now.velocity
            );
            let over_level = differences(&|before, after| {
                (before.attitude.inverse() * after.attitude).scaled_axis()
            });
            assert!((over_level - now.rate_over_level).norm() < 1e-8);
            let change = differences(&|before, after| after.angular_rate - before.angular_rate);
            assert!((change - now.angular_acceleration).norm() < 1e-7);
        }
    }

    /// The same seed makes the same sea, another one another.
    #[test]
    fn seed_decides_the_sea() {
        let other = ShipMotion::new(rough().ship, rough().settings, 4).unwrap();
        assert_eq!(rough().at(12.3), rough().at(12.3));
        assert_ne!(rough().at(12.3), other.at(12.3));
    }

    /// A ship cannot swing round her mooring and steam.
    #[test]
    fn swing_and_speed_exclude_each_other() {
        let settings = MotionSettings {
            swing: Swing {
                amplitude_rad: 0.1,
                ..Swing::default()
            },
            ..rough().settings
        };
        let message = ShipMotion::new(Ship::default(), settings, 1)
            .unwrap_err()
            .to_string();
        assert!(message.contains("swings round her mooring"), "{message}");
    }
}
