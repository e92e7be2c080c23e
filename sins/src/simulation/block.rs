//! How the block moves: what the ship does, the table with its errors, and the bend of its structure, at one moment.
//!
//! With the attitude C_b^v of the block in the ship, its rate over the ship ω_vb, and the ship's own motion,
//!
//! ```text
//! ω = C_v^b ω_iv + ω_vb      ω̇ = C_v^b ω̇_iv − ω_vb × C_v^b ω_iv + ω̇_vb      f = C_v^b f_v
//! ```
//!
//! all in the turning axes of the block. A structure that bends under its weight turns the block by φ = d × u, with u the
//! upward direction in the block and d a compliance times the arm of the weight; the gyroscopes feel φ̇ as any other turn.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::ShipState;
use crate::table::{JointState, TableErrors, Turntable};

/// What holds the block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mount {
    pub turntable: Turntable,
    pub errors: TableErrors,
    /// d: the block turns by d × u, u upwards in the block \[rad per g\].
    pub flexing_rad_per_g: Vector3<f64>,
}

/// The block at one moment, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Felt {
    /// ω against inertial space \[rad/s\].
    pub rate: Vector3<f64>,
    /// Its derivative \[rad/s²\].
    pub rate_change: Vector3<f64>,
    /// f at the table's centre \[m/s²\].
    pub force: Vector3<f64>,
}

impl Felt {
    /// What a metre of arm from the table's centre adds to the specific force \[1/s²\]: a ↦ ω × (ω × a) + ω̇ × a.
    pub fn lever(&self) -> Matrix3<f64> {
        let (w, a) = (&self.rate, &self.rate_change);
        Matrix3::new(
            -(w.y * w.y + w.z * w.z),
            w.x * w.y - a.z,
            w.x * w.z + a.y,
            w.x * w.y + a.z,
            -(w.x * w.x + w.z * w.z),
            w.y * w.z - a.x,
            w.x * w.z - a.y,
            w.y * w.z + a.x,
            -(w.x * w.x + w.y * w.y),
        )
    }
}

/// The table's turn over the ship, in the block.
struct Turning {
    to_block: UnitQuaternion<f64>,
    rate: Vector3<f64>,
    rate_change: Vector3<f64>,
}

impl Mount {
    /// Turns the block into the ship's axes, where the joints truly stand at `angles` (outer, inner) \[rad\].
    pub fn attitude(&self, ship: &ShipState, angles: [f64; 2]) -> UnitQuaternion<f64> {
        let rigid = self.rigid_attitude(angles);
        if self.flexing_rad_per_g == Vector3::zeros() {
            return rigid;
        }
        rigid * UnitQuaternion::from_scaled_axis(self.bend(&up_in_block(ship, &rigid)))
    }

    fn rigid_attitude(&self, angles: [f64; 2]) -> UnitQuaternion<f64> {
        if self.errors.is_zero() {
            self.turntable.attitude(angles)
        } else {
            self.turntable.true_attitude(angles, &self.errors)
        }
    }

    fn bend(&self, up: &Vector3<f64>) -> Vector3<f64> {
        self.flexing_rad_per_g.cross(up)
    }

    /// Rate of the block over the ship, in the block \[rad/s\].
    pub fn rate_over_ship(&self, ship: &ShipState, joints: JointState) -> Vector3<f64> {
        self.turning(ship, joints, [0.0; 2]).rate
    }

    fn turning(&self, ship: &ShipState, joints: JointState, accelerations: [f64; 2]) -> Turning {
        let JointState { position, velocity } = joints;
        let rigid = self.rigid_attitude(position);
        let rate = if self.errors.is_zero() {
            self.turntable.body_rate(position, velocity)
        } else {
            let [outer, inner] = self.turntable.joint_axes(position, &self.errors);
            outer * velocity[0] + inner * velocity[1]
        };
        // The inner axis stands still in the block; the outer one is carried round by the inner joint.
        let [outer, inner] = self.turntable.joint_axes(position, &self.errors);
        let rate_change = outer * accelerations[0] + inner * accelerations[1]
            - (inner * velocity[1]).cross(&(outer * velocity[0]));
        if self.flexing_rad_per_g == Vector3::zeros() {
            return Turning {
                to_block: rigid.inverse(),
                rate,
                rate_change,
            };
        }
        let up = up_in_block(ship, &rigid);
        let over_level = rigid.inverse() * ship.rate_over_level + rate;
        let up_change = up.cross(&over_level);
        let (bend, bend_rate) = (self.bend(&up), self.bend(&up_change));
        let unbend = UnitQuaternion::from_scaled_axis(-bend);
        let turned = unbend * rate;
        let bend_change = self.bend(&(up_change.cross(&over_level) + up.cross(&rate_change)));
        Turning {
            to_block: unbend * rigid.inverse(),
            // The right Jacobian of the rotation vector, to its second order.
            rate: turned + bend_rate - 0.5 * bend.cross(&bend_rate),
            rate_change: unbend * rate_change - bend_rate.cross(&turned) + bend_change,
        }
    }

    /// What the block feels while the joints stand and move so, with their accelerations (outer, inner) \[rad/s²\].
    pub fn felt(&self, ship: &ShipState, joints: JointState, accelerations: [f64; 2]) -> Felt {
        let Turning {
            to_block,
            rate,
            rate_change,
        } = self.turning(ship, joints, accelerations);
        let carried = to_block * ship.angular_rate;
        Felt {
            rate: carried + rate,
            rate_change: to_block * ship.angular_acceleration - rate.cross(&carried) + rate_change,
            force: to_block * ship.specific_force,
        }
    }
}

/// The upward direction in the block.
fn up_in_block(ship: &ShipState, rigid: &UnitQuaternion<f64>) -> Vector3<f64> {
    rigid.inverse() * (ship.attitude.inverse() * Vector3::z())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::simulation::Ship;
    use crate::table::Axis;

    const STEP_S: f64 = 1e-4;

    fn joints_at(t: f64) -> (JointState, [f64; 2]) {
        let (rates, accelerations) = ([0.08, -0.05], [0.04, 0.03]);
        (
            JointState {
                position: [0, 1]
                    .map(|j| [0.7, -2.0][j] + rates[j] * t + 0.5 * accelerations[j] * t * t),
                velocity: [0, 1].map(|j| rates[j] + accelerations[j] * t),
            },
            accelerations,
        )
    }

    fn mounts() -> [Mount; 3] {
        let errors = TableErrors {
            nonorthogonality_rad: 1e-3,
            inner_axis_tilt_rad: [2e-3, -1e-3],
            ..TableErrors::default()
        };
        let rigid = Mount {
            turntable: Turntable::default(),
            errors: TableErrors::default(),
            flexing_rad_per_g: Vector3::zeros(),
        };
        [
            rigid,
            Mount {
                turntable: Turntable::new(Axis::Y, Axis::Z).unwrap(),
                errors,
                ..rigid
            },
            Mount {
                errors,
                flexing_rad_per_g: Vector3::new(1e-4, -2e-4, 3e-4),
                ..rigid
            },
        ]
    }

    /// Over a still ship the block's rate is the derivative of its attitude, and its acceleration that of its rate, with every error
    /// of the table and a bending structure.
    #[test]
    fn rates_are_derivatives() {
        for mount in mounts() {
            let ship = Ship::default().at(0.0);
            let attitude = |t: f64| mount.attitude(&ship, joints_at(t).0.position);
            let numerical =
                (attitude(-STEP_S).inverse() * attitude(STEP_S)).scaled_axis() / (2.0 * STEP_S);
            let (joints, _) = joints_at(0.0);
            assert!((mount.rate_over_ship(&ship, joints) - numerical).norm() < 1e-9);
            let felt = |t: f64| {
                let (joints, accelerations) = joints_at(t);
                mount.felt(&ship, joints, accelerations)
            };
            let change = (felt(STEP_S).rate - felt(-STEP_S).rate) / (2.0 * STEP_S);
            let off = (felt(0.0).rate_change - change).norm();
            assert!(off < 1e-8, "{off}");
        }
    }

    /// An accelerometer 0.1 m from the centre of a block that turns at a constant rate feels the centripetal ω² r and nothing else; one that
    /// speeds up feels ω̇ r across.
    #[test]
    fn arms_feel_centripetal_and_tangential_acceleration() {
        let steady = Felt {
            rate: Vector3::new(0.0, 0.0, 2.0),
            rate_change: Vector3::zeros(),
            force: Vector3::zeros(),
        };
        let arm = Vector3::new(0.1, 0.0, 0.3);
        assert!((steady.lever() * arm - Vector3::new(-0.4, 0.0, 0.0)).norm() < 1e-15);
        let starting = Felt {
            rate: Vector3::zeros(),
            rate_change: Vector3::new(0.0, 0.0, 3.0),
            ..steady
        };
        assert!((starting.lever() * arm - Vector3::new(0.0, 0.3, 0.0)).norm() < 1e-15);
    }

    /// A structure of 10" per g bends by 10" where its weight hangs across, and not where it hangs along.
    #[test]
    fn the_bend_follows_gravity() {
        let second = crate::units::ARC_SECOND;
        let mount = Mount {
            flexing_rad_per_g: Vector3::new(10.0 * second, 0.0, 0.0),
            ..mounts()[0]
        };
        let ship = Ship::default().at(0.0);
        let bend = |angles: [f64; 2]| {
            (mount.turntable.attitude(angles).inverse() * mount.attitude(&ship, angles)).angle()
        };
        assert!((bend([0.0; 2]) / second - 10.0).abs() < 1e-9);
        assert!(bend([0.0, -std::f64::consts::FRAC_PI_2]) / second < 1e-9);
    }
}
