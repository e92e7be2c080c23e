//! The truth: ship and table, and what a perfect IMU on the table feels.
//!
//! Frames: n East-North-Up, v the ship, b the block. What the block feels at a moment is in [`block`](super::block).
//!
//! A sample is the average over the sampling interval, (1/dt)∫ω_ib^b dt, (1/dt)∫f^b dt and what else a sensor feels, in the
//! rotating axes of the block, by Gauss-Legendre quadrature of five nodes between the moments at which the acceleration of a joint changes. There the integrand is
//! smooth, and the rule is exact to rounding (an interval of 0.1 s at 60 deg/s leaves less than 1e-15).

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::block::Mount;
use super::truth::{Averages, TruthSample};
use super::{Cadence, MotionSettings, Ship, ShipMotion, ShipState, Table, TableSettings};
use crate::error::Error;
use crate::range;
use crate::table::{JointSample, JointState, TableErrors, Trajectory, Turntable, Waypoints};
use crate::time::{Stamp, seconds_to_nanos};

/// Nodes and weights of the Gauss-Legendre rule of five nodes on −1..1.
const GAUSS_LEGENDRE: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Nodes and weights of the rule of three nodes, for a ship that moves: over 50 ms the sea leaves less than 1e-12 of it.
const GAUSS_LEGENDRE_OF_THREE: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
    (0.0, 0.888_888_888_888_888_8),
    (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
];
/// Up to this length of an interval three nodes are enough \[s\].
const SHORT_INTERVAL_S: f64 = 0.05;
/// Accelerometers cannot be later than this \[s\].
const LONGEST_DELAY_S: f64 = 0.1;

/// Where the plant is and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantSettings {
    /// The ship: where she lies and how.
    pub ship: Ship,
    /// How she moves about that, or from there. By default not at all.
    pub motion: MotionSettings,
    /// Decides the sea.
    pub motion_seed: u64,
    /// Axes of the table.
    pub turntable: Turntable,
    /// Drives of the table.
    pub table: TableSettings,
    /// What is wrong with its axes and encoders.
    pub table_errors: TableErrors,
    /// How its structure bends: the block turns by d × u, u upwards in the block \[rad per g\].
    pub flexing_rad_per_g: Vector3<f64>,
    /// How late the accelerometers are against the gyroscopes \[s\].
    pub accelerometer_delay_s: f64,
    /// Samples a second \[Hz\].
    pub imu_rate_hz: f64,
    /// Start of the first sampling interval.
    pub start: Stamp,
}

impl Default for PlantSettings {
    fn default() -> Self {
        Self {
            ship: Ship::default(),
            motion: MotionSettings::default(),
            motion_seed: 1,
            turntable: Turntable::default(),
            table: TableSettings::default(),
            table_errors: TableErrors::default(),
            flexing_rad_per_g: Vector3::zeros(),
            accelerometer_delay_s: 0.0,
            imu_rate_hz: 100.0,
            start: Stamp::default(),
        }
    }
}

/// Ship and table, stepped at the rate of the IMU.
#[derive(Clone, Debug)]
pub struct Plant {
    settings: PlantSettings,
    mount: Mount,
    motion: ShipMotion,
    delay_nanos: i64,
    cadence: Cadence,
    table: Table,
    ship: ShipState,
    steps: u64,
    now: Stamp,
    /// What the block feels while nothing moves; `None` after a motion.
    resting: Option<Averages>,
    breaks: Vec<i64>,
}

impl Plant {
    /// A plant at the start of its first interval.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting means nothing.
    pub fn new(settings: PlantSettings) -> Result<Self, Error> {
        let motion = ShipMotion::new(settings.ship, settings.motion, settings.motion_seed)?;
        Turntable::new(settings.turntable.outer, settings.turntable.inner)?;
        for error in settings.table_errors.values() {
            range::within("error of the table [rad]", error, 0.1)?;
        }
        for bend in &settings.flexing_rad_per_g {
            range::within("flexing [rad per g]", *bend, 0.1)?;
        }
        let delay_s = settings.accelerometer_delay_s;
        if !(0.0..=LONGEST_DELAY_S).contains(&delay_s) {
            return Err(Error::setting(
                "delay of the accelerometers [s]",
                delay_s,
                format!("0 to {LONGEST_DELAY_S}"),
            ));
        }
        Ok(Self {
            mount: Mount {
                turntable: settings.turntable,
                errors: settings.table_errors,
                flexing_rad_per_g: settings.flexing_rad_per_g,
            },
            delay_nanos: seconds_to_nanos(delay_s),
            cadence: Cadence::new("IMU rate [Hz]", settings.imu_rate_hz, 10_000.0)?,
            table: Table::new(settings.table, settings.start)?,
            ship: motion.at(0.0),
            motion,
            settings,
            steps: 0,
            now: settings.start,
            resting: None,
            breaks: Vec::new(),
        })
    }

    /// What it is made of.
    pub fn settings(&self) -> &PlantSettings {
        &self.settings
    }

    /// End of the last interval.
    pub fn now(&self) -> Stamp {
        self.now
    }

    /// End of the interval that comes next.
    pub fn next_stamp(&self) -> Stamp {
        self.settings
            .start
            .plus_nanos(self.cadence.nanos(self.steps + 1))
    }

    /// The ship, now.
    pub fn ship(&self) -> &ShipState {
        &self.ship
    }

    /// How the ship moves, at any time since the start.
    pub fn motion(&self) -> &ShipMotion {
        &self.motion
    }

    /// Where the table's centre is, from where it was at the start: East, North, Up \[m\].
    pub fn place_m(&self) -> Vector3<f64> {
        if self.motion.is_at_rest() {
            return Vector3::zeros();
        }
        self.motion
            .at(0.0)
            .position()
            .offset_m(&self.ship.position())
    }

    /// Seconds since the start.
    pub fn elapsed_s(&self) -> f64 {
        self.now.seconds_since(self.settings.start)
    }

    /// Where the joints truly stand. The table's controller brings its encoders to the angles that it was told, so that their
    /// zeros stand in the true angles. (Once a turn it is off by the eccentricity as well, which is seconds of arc.)
    fn true_joints(&self, at: Stamp) -> JointState {
        self.truly(self.table.state(at))
    }

    fn truly(&self, told: JointState) -> JointState {
        let errors = &self.settings.table_errors;
        let zeros = [errors.encoder_zero_outer_rad, errors.encoder_zero_inner_rad];
        JointState {
            position: [0, 1].map(|joint| told.position[joint] - zeros[joint]),
            velocity: told.velocity,
        }
    }

    /// Angles and rates of the joints, now, where they truly stand.
    pub fn joints(&self) -> JointSample {
        let JointState { position, velocity } = self.true_joints(self.now);
        JointSample {
            stamp: self.now,
            position,
            velocity,
        }
    }

    /// Turns b into n (East-North-Up), now.
    pub fn attitude(&self) -> UnitQuaternion<f64> {
        self.ship.attitude * self.mount.attitude(&self.ship, self.joints().position)
    }

    /// Rate of the block over the ship, in b, now \[rad/s\].
    pub fn block_rate(&self) -> Vector3<f64> {
        let JointSample {
            position, velocity, ..
        } = self.joints();
        self.mount
            .rate_over_ship(&self.ship, JointState { position, velocity })
    }

    /// Angles and rates that the joints should have now by the motion they were told.
    pub fn planned_joints(&self) -> JointState {
        self.table.planned(self.now)
    }

    /// Hands a trajectory to the table; see [`Table::command`].
    ///
    /// # Errors
    /// [`Error::Setting`] where the table cannot follow.
    pub fn command(
        &mut self,
        start: Option<Stamp>,
        trajectory: &Trajectory,
    ) -> Result<Stamp, Error> {
        self.table.command(self.now, start, trajectory)
    }

    /// As [`Self::command`], for a motion whose points may have no rates.
    ///
    /// # Errors
    /// As [`Table::command`].
    pub fn follow(&mut self, start: Option<Stamp>, motion: &Waypoints) -> Result<Stamp, Error> {
        self.table.follow(self.now, start, motion)
    }

    /// Lets one sampling interval pass.
    pub fn step(&mut self) -> TruthSample {
        let from = self.now;
        let to = self.next_stamp();
        self.steps += 1;
        let late = self.delay_nanos;
        let (gyroscopes, accelerometers) =
            if self.motion.is_at_rest() && self.table.rests(from.plus_nanos(-late), to) {
                let joints = self.true_joints(from);
                let resting = *self.resting.get_or_insert_with(|| {
                    Averages::of(&self.mount.felt(&self.ship, joints, [0.0; 2]))
                });
                (resting, resting)
            } else {
                self.resting = None;
                let gyroscopes = self.average(from, to);
                let accelerometers = if late == 0 {
                    gyroscopes
                } else {
                    self.average(from.plus_nanos(-late), to.plus_nanos(-late))
                };
                (gyroscopes, accelerometers)
            };
        self.now = to;
        self.table.advance(to);
        if !self.motion.is_at_rest() {
            self.ship = self.motion.at(to.seconds_since(self.settings.start));
        }
        let interval_nanos = to.nanos() - from.nanos();
        gyroscopes.sample(&accelerometers, to, interval_nanos, self.joints())
    }

    fn average(&mut self, from: Stamp, to: Stamp) -> Averages {
        let interval_s = to.seconds_since(from);
        let still = self.motion.is_at_rest();
        let nodes: &[(f64, f64)] = if still || interval_s > SHORT_INTERVAL_S {
            &GAUSS_LEGENDRE
        } else {
            &GAUSS_LEGENDRE_OF_THREE
        };
        let mut breaks = std::mem::take(&mut self.breaks);
        self.table.breaks(from, to, &mut breaks);
        let mut sums = Averages::default();
        for piece in breaks.windows(2) {
            let begin = from.plus_nanos(piece[0]);
            let half_s = (piece[1] - piece[0]) as f64 * 0.5e-9;
            let since_start_s = begin.seconds_since(self.settings.start);
            let Some((cubic, into_s)) = self.table.piece(begin) else {
                continue;
            };
            for (node, weight) in nodes {
                let after_s = half_s * (1.0 + node);
                let moving_ship;
                let ship = if still {
                    &self.ship
                } else {
                    moving_ship = self.motion.at(since_start_s + after_s);
                    &moving_ship
                };
                let (joints, accelerations) = (
                    self.truly(cubic.at(into_s + after_s)),
                    cubic.acceleration(into_s + after_s),
                );
                sums.add(
                    &self.mount.felt(ship, joints, accelerations),
                    weight * half_s,
                );
            }
        }
        self.breaks = breaks;
        sums.over(interval_s)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::{Axis, Joint, TrajectoryPoint};

    fn plant(turntable: Turntable, imu_rate_hz: f64) -> Plant {
        let ship = Ship {
            heading_rad: 0.4,
            roll_rad: 0.05,
            pitch_rad: -0.1,
            ..Ship::default()
        };
        Plant::new(PlantSettings {
            ship,
            turntable,
            imu_rate_hz,
            ..PlantSettings::default()
        })
        .unwrap()
    }

    fn turn(plant: &mut Plant, joint: Joint, angle: f64) {
        let from = plant.joints().position;
        let motion =
            Trajectory::trapezoid(joint, from, angle, 5f64.to_radians(), 2.5f64.to_radians())
                .unwrap();
        plant.command(None, &motion).unwrap();
    }

    /// Cruise at a constant rate has a closed form: with u the joint's axis and θ its angle, the integral of R(θ)ᵀa is
    /// (a·u)u Δt + [sin θ (a−(a·u)u) + cos θ (u×a)]/θ̇ between the ends.
    #[test]
    fn cruise_agrees_with_the_closed_form() {
        let mut plant = plant(Turntable::default(), 10.0);
        turn(&mut plant, Joint::Outer, std::f64::consts::PI);
        let samples: Vec<_> = (0..150).map(|_| plant.step()).collect();
        let (before, cruise) = (samples[80], samples[81]);
        let (u, a, rate) = (Vector3::x(), plant.ship.specific_force, 5f64.to_radians());
        let along = u * a.dot(&u);
        let primitive = |angle: f64| ((a - along) * angle.sin() + u.cross(&a) * angle.cos()) / rate;
        let (start, end) = (before.joints.position[0], cruise.joints.position[0]);
        let expected = along + (primitive(end) - primitive(start)) / 0.1;
        assert!(
            (cruise.specific_force - expected).norm() < 1e-12,
            "{}",
            cruise.specific_force - expected
        );
        // The trapezoid turns about one axis only, so its own part of the angular rate is the change of the joint angle.
        assert!((cruise.angular_rate.x - plant.ship.angular_rate.x - rate).abs() < 1e-12);
    }

    /// Over a whole rotation of either joint the sums of Δθ and Δv are the integrals, here by the midpoint rule on a grid a thousand times finer.
    #[test]
    fn rotation_agrees_with_fine_integration() {
        for turntable in [
            Turntable::default(),
            Turntable::new(Axis::Y, Axis::Z).unwrap(),
        ] {
            for joint in [Joint::Outer, Joint::Inner] {
                let mut plant = plant(turntable, 20.0);
                turn(&mut plant, Joint::Inner, 0.7);
                for _ in 0..400 {
                    plant.step();
                }
                let from = plant.joints().position;
                turn(&mut plant, joint, 0.4);
                let motion =
                    Trajectory::trapezoid(joint, from, 0.4, 5f64.to_radians(), 2.5f64.to_radians())
                        .unwrap();
                let (ship, mount) = (*plant.ship(), plant.mount);
                for k in 0..140 {
                    let sample = plant.step();
                    let (mut rate, mut force, n) = (Vector3::zeros(), Vector3::zeros(), 1000);
                    for i in 0..n {
                        let state = motion.at(k * 50_000_000 + i * 50_000 + 25_000).unwrap();
                        let felt = mount.felt(&ship, state, [0.0; 2]);
                        rate += felt.rate / n as f64;
                        force += felt.force / n as f64;
                    }
                    assert!((sample.angular_rate - rate).norm() < 1e-9, "sample {k}");
                    assert!((sample.specific_force - force).norm() < 1e-7, "sample {k}");
                }
            }
        }
    }

    /// The increments of 180 deg add up to 180 deg beside the earth's part, whatever the sampling rate.
    #[test]
    fn increments_of_a_rotation_add_up() {
        for rate_hz in [10.0, 70.0, 400.0] {
            let mut plant = plant(Turntable::default(), rate_hz);
            turn(&mut plant, Joint::Outer, std::f64::consts::PI);
            let (mut sum, mut seconds) = (0.0, 0.0);
            while seconds < 39.0 {
                let sample = plant.step();
                let dt = sample.interval_nanos as f64 * 1e-9;
                sum += sample.angular_rate.x * dt;
                seconds += dt;
            }
            let earth = plant.ship.angular_rate.x * seconds;
            assert!(
                (sum - earth - std::f64::consts::PI).abs() < 1e-9,
                "{rate_hz}: {sum}"
            );
        }
    }

    /// A rotation that starts and ends between samples is split there: refining the sampling changes no sum.
    #[test]
    fn breaks_inside_an_interval_are_exact() {
        let sum = |rate_hz: f64| {
            let mut plant = plant(Turntable::default(), rate_hz);
            let motion = Trajectory::trapezoid(Joint::Inner, [0.0; 2], 0.01, 0.2, 0.9).unwrap();
            plant
                .command(Some(Stamp::from_nanos(123_456_789)), &motion)
                .unwrap();
            let (mut rate, mut force) = (Vector3::zeros(), Vector3::zeros());
            for _ in 0..rate_hz as u32 {
                let sample = plant.step();
                rate += sample.angular_rate * (sample.interval_nanos as f64 * 1e-9);
                force += sample.specific_force * (sample.interval_nanos as f64 * 1e-9);
            }
            (rate, force)
        };
        let ((rate, force), (fine_rate, fine_force)) = (sum(2.0), sum(400.0));
        assert!((rate - fine_rate).norm() < 1e-14 && (force - fine_force).norm() < 1e-12);
    }

    /// At rest every sample is the same, and it is that of the attitude the table stands in.
    #[test]
    fn rest_is_cached_and_right() {
        let mut plant = plant(Turntable::default(), 100.0);
        turn(&mut plant, Joint::Outer, 0.3);
        for _ in 0..1500 {
            plant.step();
        }
        let (a, b) = (plant.step(), plant.step());
        assert_eq!(
            (a.angular_rate, a.specific_force),
            (b.angular_rate, b.specific_force)
        );
        let up = plant.attitude() * b.specific_force;
        assert!((up - Vector3::new(0.0, 0.0, up.z)).norm() < 1e-12);
        assert_eq!(b.joints.velocity, [0.0; 2]);
    }

    /// Stop and go leave no jump: the angle is the integral of what the gyroscope was given.
    #[test]
    fn commanded_stop_keeps_angle_and_rate_together() {
        let mut plant = plant(Turntable::default(), 50.0);
        turn(&mut plant, Joint::Outer, 1.5);
        let mut sum = 0.0;
        for k in 0..1000 {
            if k == 333 {
                plant.command(None, &Trajectory::default()).unwrap();
            }
            sum += (plant.step().angular_rate.x - plant.ship.angular_rate.x) * 0.02;
        }
        assert!((sum - plant.joints().position[0]).abs() < 1e-12);
        assert!(sum > 0.1 && sum < 1.0);
    }

    /// A trajectory beyond the drives is refused and nothing moves.
    #[test]
    fn refused_trajectory_moves_nothing() {
        let mut plant = plant(Turntable::default(), 50.0);
        let point = |nanos, angle| TrajectoryPoint {
            time_from_start_nanos: nanos,
            position: [angle, 0.0],
            velocity: [0.0; 2],
        };
        let motion = Trajectory {
            points: vec![point(0, 0.0), point(1000, 1.0)],
        };
        assert!(plant.command(None, &motion).is_err());
        assert_eq!(plant.step().joints.position, [0.0; 2]);
    }
}
