//! Global observability: the paper's conditions on positions and rotation axes.

use nalgebra::{Matrix3, Vector3};

use crate::earth::LocalEarth;
use crate::error::Error;
use crate::simulation::Ship;
use crate::table::Axis;
use crate::table::scheme::Program;

/// Poses closer than this are one position \[rad\].
const SAME_POSE_RAD: f64 = 1e-6;
/// An axis within this of the horizon is horizontal \[rad\].
const HORIZONTAL_RAD: f64 = 0.02;
/// Centres whose margin is below this lie in one plane: far above rounding, far below any use.
pub const PLANE_MARGIN: f64 = 1e-6;
/// Beyond this many positions the first ones speak for all: four of n grows as n⁴.
const MOST_POSITIONS: usize = 48;

/// A position of the block, with what the sensors would measure there if they had no errors.
#[derive(Clone, Debug, PartialEq)]
pub struct RestingPosition {
    /// Its name in the program.
    pub name: String,
    /// Joint angles (outer, inner) \[rad\].
    pub joints: [f64; 2],
    /// Direction of the earth's rotation, block axes (unit vector).
    pub earth_rate: Vector3<f64>,
    /// Direction of the specific force, block axes (unit vector).
    pub specific_force: Vector3<f64>,
}

/// Whether four centres out of one plane exist.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// The four positions that span the most, by name; fewer where there are fewer than four.
    pub best: Vec<String>,
    /// How far they are from lying in one plane: 0 in one plane, 1 a regular tetrahedron. The smallest singular value
    /// of the four unit vectors about their mean, over that of the tetrahedron (√(4/3)). An error of the measured
    /// vectors comes back in the sensor error divided by about this.
    pub margin: f64,
}

impl Spread {
    /// Whether the four centres are out of one plane.
    pub fn out_of_plane(&self) -> bool {
        self.margin > PLANE_MARGIN
    }
}

/// A rotation of the program and where its axis points.
#[derive(Clone, Debug, PartialEq)]
pub struct RotationAxis {
    /// Number of the rotation in the cycle, from 1.
    pub step: usize,
    /// From this position.
    pub from: String,
    /// To this one.
    pub to: String,
    /// Axis of the block at zero joint angles.
    pub axis: Axis,
    /// Angle, counter-clockwise positive \[rad\].
    pub angle_rad: f64,
    /// Direction of the axis in n (East, North, Up) while it turns.
    pub direction: Vector3<f64>,
    /// Angle of the axis above the horizon, 0..π/2 \[rad\].
    pub elevation_rad: f64,
}

impl RotationAxis {
    /// Whether the axis lies in the horizon.
    pub fn is_horizontal(&self) -> bool {
        self.elevation_rad < HORIZONTAL_RAD
    }
}

/// The conditions of the paper's section 2 for one cycle of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct GlobalConditions {
    /// Distinct positions, in the order of the first visits.
    pub positions: Vec<RestingPosition>,
    /// For the gyroscopes: the centres are ω_i.
    pub gyroscopes: Spread,
    /// For the accelerometers: the centres are f_i.
    pub accelerometers: Spread,
    /// All rotations of one cycle.
    pub rotations: Vec<RotationAxis>,
}

impl GlobalConditions {
    /// Looks at one cycle of `program` on a ship at rest.
    ///
    /// # Errors
    /// [`Error::Setting`] where the ship is nowhere.
    pub fn of(program: &Program, ship: &Ship) -> Result<Self, Error> {
        ship.validate()?;
        let earth = LocalEarth::at(ship.latitude_rad, ship.height_m);
        let to_ship = ship.at(0.0).attitude.inverse();
        let (rate, up) = (
            to_ship * earth.earth_rate().normalize(),
            to_ship * Vector3::z(),
        );
        let mut positions: Vec<RestingPosition> = Vec::new();
        let mut rotations = Vec::new();
        for number in 0..=program.steps.len() {
            let step = number as u32;
            let joints = program.target(0, step);
            let table = program.table.attitude(joints);
            let known = positions
                .iter()
                .any(|p| program.table.attitude(p.joints).angle_to(&table) < SAME_POSE_RAD);
            if program.dwell_nanos(step) > 0 && !known {
                positions.push(RestingPosition {
                    name: program.position(step).to_owned(),
                    joints,
                    earth_rate: table.inverse() * rate,
                    specific_force: table.inverse() * up,
                });
            }
            if let Some(rotation) = program.step(step) {
                let mut rates = [0.0; 2];
                rates[rotation.joint.index()] = 1.0;
                let in_block = program.table.body_rate(joints, rates);
                let direction = ship.at(0.0).attitude * (table * in_block);
                rotations.push(RotationAxis {
                    step: number,
                    from: program.position(step - 1).to_owned(),
                    to: rotation.position.clone(),
                    axis: rotation.axis,
                    angle_rad: rotation.angle_rad,
                    direction,
                    elevation_rad: direction.z.abs().min(1.0).asin(),
                });
            }
        }
        Ok(Self {
            gyroscopes: spread(&positions, |p| p.earth_rate),
            accelerometers: spread(&positions, |p| p.specific_force),
            positions,
            rotations,
        })
    }

    /// Whether there are rotations about two different axes of the block that both lie in the horizon: the paper's
    /// 'alternates between two horizontal axes'.
    pub fn has_two_horizontal_axes(&self) -> bool {
        let mut axes: Vec<Axis> = Vec::new();
        for rotation in self.rotations.iter().filter(|r| r.is_horizontal()) {
            if !axes.contains(&rotation.axis) {
                axes.push(rotation.axis);
            }
        }
        axes.len() >= 2
    }
}

/// The four points that span the most.
fn spread(
    positions: &[RestingPosition],
    centre: impl Fn(&RestingPosition) -> Vector3<f64>,
) -> Spread {
    let points: Vec<Vector3<f64>> = positions.iter().take(MOST_POSITIONS).map(centre).collect();
    let mut best: Option<([usize; 4], f64)> = None;
    for a in 0..points.len() {
        for b in a + 1..points.len() {
            for c in b + 1..points.len() {
                for d in c + 1..points.len() {
                    let margin = margin([points[a], points[b], points[c], points[d]]);
                    // A hair's breadth more is rounding: the first of equals stays.
                    if best.is_none_or(|(_, most)| margin > most + 1e-9) {
                        best = Some(([a, b, c, d], margin));
                    }
                }
            }
        }
    }
    match best {
        Some((four, margin)) => Spread {
            best: four.iter().map(|i| positions[*i].name.clone()).collect(),
            margin,
        },
        None => Spread {
            best: positions.iter().map(|p| p.name.clone()).collect(),
            margin: 0.0,
        },
    }
}

fn margin(points: [Vector3<f64>; 4]) -> f64 {
    let mean = points.iter().sum::<Vector3<f64>>() / 4.0;
    let scatter: Matrix3<f64> = points
        .iter()
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum();
    (scatter.symmetric_eigenvalues().min().max(0.0) / (4.0 / 3.0)).sqrt()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::Turntable;
    use crate::table::scheme::Scheme;

    fn conditions(scheme: &Scheme, heading_deg: f64) -> GlobalConditions {
        let ship = Ship {
            heading_rad: heading_deg.to_radians(),
            ..Ship::default()
        };
        GlobalConditions::of(&scheme.program(scheme.default_table()).unwrap(), &ship).unwrap()
    }

    /// The corners of a regular tetrahedron have margin 1, a square 0.
    #[test]
    fn margin_of_known_bodies() {
        let tetrahedron = [
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ]
        .map(|p| Vector3::from(p).normalize());
        assert!((margin(tetrahedron) - 1.0).abs() < 1e-12);
        let square = [
            [1.0, 0.0, 0.5],
            [0.0, 1.0, 0.5],
            [-1.0, 0.0, 0.5],
            [0.0, -1.0, 0.5],
        ]
        .map(Vector3::from);
        assert!(margin(square) < 1e-8);
    }

    /// The paper's scheme: eight positions, four of them out of one plane for both kinds of sensor, all ten rotations about
    /// horizontal axes, two of them.
    #[test]
    fn eight_positions_meet_the_conditions() {
        let c = conditions(&Scheme::eight_position(), 0.0);
        assert_eq!(c.positions.len(), 8);
        assert!(c.gyroscopes.margin > 0.3, "{:?}", c.gyroscopes);
        assert!(c.accelerometers.margin > 0.3, "{:?}", c.accelerometers);
        assert!(c.rotations.len() == 10 && c.rotations.iter().all(RotationAxis::is_horizontal));
        assert!(c.has_two_horizontal_axes());
    }

    /// The other gimbal order turns the outer axis about the vertical in no position, but the inner one: with outer y and
    /// inner x the four rotations about x at E..H are about a vertical axis.
    #[test]
    fn the_other_gimbal_order_has_vertical_axes() {
        let scheme = Scheme::eight_position();
        let yx = Turntable::new(Axis::Y, Axis::X).unwrap();
        let c = GlobalConditions::of(&scheme.program(yx).unwrap(), &Ship::default()).unwrap();
        let vertical = c.rotations.iter().filter(|r| !r.is_horizontal()).count();
        assert_eq!(vertical, 4);
    }

    /// At rest there is one position and nothing to span with; turns about one axis only leave the gravity vectors in a plane.
    #[test]
    fn too_little_is_called_too_little() {
        let still = conditions(&Scheme::stationary(), 0.0);
        assert_eq!(still.positions.len(), 1);
        assert!(!still.gyroscopes.out_of_plane() && !still.accelerometers.out_of_plane());
        let text = "rotations: [{axis: x, angle_deg: 90}, {axis: x, angle_deg: 90}, {axis: x, angle_deg: 90}, {axis: x, angle_deg: -270}]";
        let one_axis = conditions(&Scheme::from_yaml("one.yaml", text).unwrap(), 30.0);
        assert_eq!(one_axis.positions.len(), 4);
        assert!(!one_axis.accelerometers.out_of_plane(), "{one_axis:?}");
        assert!(!one_axis.has_two_horizontal_axes());
    }
}
