//! The truth: ship and table, and what a perfect IMU on the table feels.
//!
//! Frames: n East-North-Up, v the ship, b the block. With the table's attitude `R(θ) = C_b^v`,
//!
//! ```text
//! ω_ib^b = R(θ)ᵀ ω_iv^v + ω_vb^b(θ, θ̇)        f^b = R(θ)ᵀ f^v
//! ```
//!
//! A sample is the average of both over the sampling interval, (1/dt)∫ω_ib^b dt and (1/dt)∫f^b dt, in the rotating axes of the
//! block, by Gauss-Legendre quadrature of five nodes between the moments at which the acceleration of a joint changes. There the integrand is
//! smooth, and the rule is exact to rounding (an interval of 0.1 s at 60 deg/s leaves less than 1e-15).

use nalgebra::{UnitQuaternion, Vector3};

use super::{Cadence, Ship, ShipState, Table, TableSettings};
use crate::error::Error;
use crate::table::{JointSample, JointState, Trajectory, Turntable};
use crate::time::Stamp;

/// Nodes and weights of the Gauss-Legendre rule of five nodes on −1..1.
const GAUSS_LEGENDRE: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Where the plant is and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantSettings {
    /// The ship.
    pub ship: Ship,
    /// Axes of the table.
    pub turntable: Turntable,
    /// Drives of the table.
    pub table: TableSettings,
    /// Samples a second \[Hz\].
    pub imu_rate_hz: f64,
    /// Start of the first sampling interval.
    pub start: Stamp,
}

impl Default for PlantSettings {
    fn default() -> Self {
        Self {
            ship: Ship::default(),
            turntable: Turntable::default(),
            table: TableSettings::default(),
            imu_rate_hz: 100.0,
            start: Stamp::default(),
        }
    }
}

/// What is true of one sampling interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthSample {
    /// End of the interval.
    pub stamp: Stamp,
    /// Length of the interval \[ns\].
    pub interval_nanos: i64,
    /// Average of ω_ib^b over the interval \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Average of f^b over the interval \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// Joints at the end of the interval.
    pub joints: JointSample,
}

/// Ship and table, stepped at the rate of the IMU.
#[derive(Clone, Debug)]
pub struct Plant {
    settings: PlantSettings,
    cadence: Cadence,
    table: Table,
    ship: ShipState,
    steps: u64,
    now: Stamp,
    /// Average rate and force while nothing moves; `None` after a motion.
    resting: Option<(Vector3<f64>, Vector3<f64>)>,
    breaks: Vec<i64>,
}

impl Plant {
    /// A plant at the start of its first interval.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting means nothing.
    pub fn new(settings: PlantSettings) -> Result<Self, Error> {
        settings.ship.validate()?;
        Turntable::new(settings.turntable.outer, settings.turntable.inner)?;
        Ok(Self {
            settings,
            cadence: Cadence::new("IMU rate [Hz]", settings.imu_rate_hz, 10_000.0)?,
            table: Table::new(settings.table, settings.start)?,
            ship: settings.ship.at(0.0),
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

    /// Angles and rates of the joints, now.
    pub fn joints(&self) -> JointSample {
        let JointState { position, velocity } = self.table.state(self.now);
        JointSample {
            stamp: self.now,
            position,
            velocity,
        }
    }

    /// Turns b into n (East-North-Up), now.
    pub fn attitude(&self) -> UnitQuaternion<f64> {
        self.ship.attitude * self.settings.turntable.attitude(self.joints().position)
    }

    /// Rate of the block over the ship, in b, now \[rad/s\].
    pub fn block_rate(&self) -> Vector3<f64> {
        let joints = self.joints();
        self.settings
            .turntable
            .body_rate(joints.position, joints.velocity)
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

    /// Lets one sampling interval pass.
    pub fn step(&mut self) -> TruthSample {
        let from = self.now;
        let to = self.next_stamp();
        self.steps += 1;
        let (angular_rate, specific_force) =
            if self.settings.ship.is_at_rest() && self.table.rests(from, to) {
                *self.resting.get_or_insert_with(|| {
                    block_feels(&self.settings, &self.ship, self.table.state(from))
                })
            } else {
                self.resting = None;
                self.average(from, to)
            };
        self.now = to;
        self.table.advance(to);
        if !self.settings.ship.is_at_rest() {
            self.ship = self.settings.ship.at(to.seconds_since(self.settings.start));
        }
        TruthSample {
            stamp: to,
            interval_nanos: to.nanos() - from.nanos(),
            angular_rate,
            specific_force,
            joints: self.joints(),
        }
    }

    fn average(&mut self, from: Stamp, to: Stamp) -> (Vector3<f64>, Vector3<f64>) {
        let mut breaks = std::mem::take(&mut self.breaks);
        self.table.breaks(from, to, &mut breaks);
        let (mut rate, mut force) = (Vector3::zeros(), Vector3::zeros());
        for piece in breaks.windows(2) {
            let begin = from.plus_nanos(piece[0]);
            let half_s = (piece[1] - piece[0]) as f64 * 0.5e-9;
            let since_start_s = begin.seconds_since(self.settings.start);
            let Some((cubic, into_s)) = self.table.piece(begin) else {
                continue;
            };
            for (node, weight) in GAUSS_LEGENDRE {
                let after_s = half_s * (1.0 + node);
                let moving_ship;
                let ship = if self.settings.ship.is_at_rest() {
                    &self.ship
                } else {
                    moving_ship = self.settings.ship.at(since_start_s + after_s);
                    &moving_ship
                };
                let (omega, f) = block_feels(&self.settings, ship, cubic.at(into_s + after_s));
                rate += omega * (weight * half_s);
                force += f * (weight * half_s);
            }
        }
        self.breaks = breaks;
        let dt = to.seconds_since(from);
        (rate / dt, force / dt)
    }
}

/// (ω_ib^b, f^b) at one moment.
fn block_feels(
    settings: &PlantSettings,
    ship: &ShipState,
    joints: JointState,
) -> (Vector3<f64>, Vector3<f64>) {
    let to_block = settings.turntable.attitude(joints.position).inverse();
    let turning = settings
        .turntable
        .body_rate(joints.position, joints.velocity);
    (
        to_block * ship.angular_rate + turning,
        to_block * ship.specific_force,
    )
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
                let (ship, settings) = (*plant.ship(), *plant.settings());
                for k in 0..140 {
                    let sample = plant.step();
                    let (mut rate, mut force, n) = (Vector3::zeros(), Vector3::zeros(), 1000);
                    for i in 0..n {
                        let state = motion.at(k * 50_000_000 + i * 50_000 + 25_000).unwrap();
                        let (w, f) = block_feels(&settings, &ship, state);
                        rate += w / n as f64;
                        force += f / n as f64;
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
