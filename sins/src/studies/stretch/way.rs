//! The way of a block through dwells and rotations on a ship at rest, in covariance steps of any model.

use nalgebra::{DMatrix, Matrix3, UnitQuaternion, Vector3};

use super::element::{Element, Second};
use super::space::Space;
use crate::earth::{LocalEarth, Position};
use crate::error::Error;
use crate::estimation::filter::InitialUncertainty;
use crate::estimation::grade::GroupPriors;
use crate::estimation::group::{Interval, Span};
use crate::estimation::groups::navigation::{MISALIGNMENT, POSITION, VELOCITY, sensor_noise_rate};
use crate::estimation::groups::vertical::HEIGHT;
use crate::estimation::model::{Model, Paper, Whole};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::range;
use crate::sensor::Increment;
use crate::sensor::sample::NoiseDensity;
use crate::simulation::{NoiseReading, Ship};
use crate::studies::paper;
use crate::table::{Joint, JointState, TableErrors, Trajectory, Turntable};

/// Parts of a step over which attitude and forces are gathered while the table turns.
const PARTS: u32 = 10;
/// One-sigma of a base of which nothing is known \[rad\], as the filter has it.
const UNKNOWN_BASE_RAD: f64 = 0.1;

/// Which errors are estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum States {
    /// The paper's thirteen.
    Paper,
    /// Every group whose prior is not zero.
    Groups(GroupPriors),
}

/// What is measured once a second; one-sigma each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurements {
    /// Velocity east and north \[m/s\].
    pub velocity_m_s: f64,
    /// Velocity up \[m/s\]: the mean heave is zero. Only with groups.
    pub velocity_up_m_s: Option<f64>,
    /// Position, each axis \[m\].
    pub position_m: Option<f64>,
    /// Both encoders \[rad\]. Only with groups.
    pub encoder_rad: Option<f64>,
}

/// Everything that decides how well a scheme shows the errors, beside the scheme and the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physics {
    /// The errors.
    pub states: States,
    /// The measurements.
    pub measurements: Measurements,
    /// White noise of the sensors.
    pub noise: NoiseDensity,
    /// Where the ship lies \[rad\].
    pub latitude_rad: f64,
    /// The table.
    pub table: Turntable,
    /// Cruise rate of every rotation \[rad/s\].
    pub rate_rad_s: f64,
    /// Its acceleration \[rad/s²\].
    pub acceleration_rad_s2: f64,
}

impl Default for Physics {
    /// The paper's, noise read as D.
    fn default() -> Self {
        Self {
            states: States::Paper,
            measurements: Measurements {
                velocity_m_s: 0.01,
                velocity_up_m_s: None,
                position_m: None,
                encoder_rad: None,
            },
            noise: NoiseReading::D.density(),
            latitude_rad: Ship::default().latitude_rad,
            table: Turntable::default(),
            rate_rad_s: crate::table::scheme::DEFAULT_RATE_RAD_S,
            acceleration_rad_s2: crate::table::scheme::DEFAULT_ACCELERATION_RAD_S2,
        }
    }
}

/// When encoders are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::studies) enum EncodersRead {
    /// Every second.
    Always,
    /// While the table rests, as the filter of self-calibration does.
    AtRest,
}

/// A model's steps along a way.
pub(in crate::studies) trait Way: Send + Sync {
    fn space(&self) -> &Space;
    /// A second at rest.
    fn rest(&self, heading_rad: f64, angles: [f64; 2]) -> Second;
    /// A rotation, second by second; the last step of all is as long as the others.
    fn rotation(&self, heading_rad: f64, motion: &Trajectory) -> Vec<Second>;
}

impl Physics {
    /// Refuses what means nothing.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn validate(&self) -> Result<(), Error> {
        let m = &self.measurements;
        range::positive("velocity sigma [m/s]", m.velocity_m_s)?;
        for (name, value) in [
            ("vertical velocity sigma [m/s]", m.velocity_up_m_s),
            ("position sigma [m]", m.position_m),
            ("encoder sigma [rad]", m.encoder_rad),
        ] {
            if let Some(value) = value {
                range::positive(name, value)?;
            }
        }
        if self.states == States::Paper && m.encoder_rad.or(m.velocity_up_m_s).is_some() {
            return Err(Error::setting(
                "measurements of the paper's states",
                "encoders or vertical velocity",
                "horizontal velocity and position: the thirteen states have neither table nor vertical channel",
            ));
        }
        range::positive("rotation rate [rad/s]", self.rate_rad_s)?;
        range::positive("rotation acceleration [rad/s²]", self.acceleration_rad_s2)?;
        Turntable::new(self.table.outer, self.table.inner)?;
        Position {
            latitude_rad: self.latitude_rad,
            longitude_rad: 0.0,
            height_m: 0.0,
        }
        .checked()?;
        Ok(())
    }

    /// Labels of the states that a search carries.
    ///
    /// # Errors
    /// [`Error::Setting`] where the rest means nothing.
    pub fn labels(&self) -> Result<Vec<&'static StateLabel>, Error> {
        self.validate()?;
        Ok(self.way().space().labels.clone())
    }

    pub(in crate::studies) fn way(&self) -> Box<dyn Way> {
        self.way_from(&paper::initial_uncertainty(), EncodersRead::Always)
    }

    /// With other priors than the paper's of navigation, biases and drifts.
    pub(in crate::studies) fn way_from(
        &self,
        initial: &InitialUncertainty,
        encoders: EncodersRead,
    ) -> Box<dyn Way> {
        match &self.states {
            States::Paper => Box::new(ModelWay::<Paper, { Paper::M }, { Paper::N }>::new(
                initial.model(),
                self,
                encoders,
            )),
            States::Groups(priors) => Box::new(ModelWay::<Whole, { Whole::M }, { Whole::N }>::new(
                priors.model(initial),
                self,
                encoders,
            )),
        }
    }
}

struct ModelWay<G: Model<M, N>, const M: usize, const N: usize> {
    model: G,
    physics: Physics,
    encoders: EncodersRead,
    earth: LocalEarth,
    space: Space,
}

impl<G: Model<M, N>, const M: usize, const N: usize> ModelWay<G, M, N> {
    fn new(model: G, physics: &Physics, encoders: EncodersRead) -> Self {
        let place = NavigationState {
            attitude: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            position: Position {
                latitude_rad: physics.latitude_rad,
                longitude_rad: 0.0,
                height_m: 0.0,
            },
        };
        let prior = model.prior(&place);
        let walk = model.walk();
        let measured = physics.measurements;
        let group = |first: Option<usize>, size: usize, state: usize| {
            first.is_some_and(|first| (first..first + size).contains(&state))
        };
        let mut space = Space {
            labels: Vec::new(),
            positions: Vec::new(),
            moving: 0,
            scale: Vec::new(),
            initial: Vec::new(),
            walk: Vec::new(),
        };
        for state in 0..N {
            let moves = state < M;
            let of_base = group(G::BASE, 3, state);
            let of_table = group(G::TABLE, 8, state);
            // A place at rest shows an arm of the antenna as an offset of the position.
            let kept = if of_base {
                measured.encoder_rad.is_some()
            } else if of_table {
                measured.encoder_rad.is_some() && prior[state] > 0.0
            } else if group(G::ANTENNA, 3, state) {
                false
            } else if G::STATES[state].name == POSITION[1] {
                measured.position_m.is_some()
            } else {
                moves || prior[state] > 0.0 || walk[state] > 0.0
            };
            if !kept {
                continue;
            }
            let known = if of_base {
                UNKNOWN_BASE_RAD
            } else {
                prior[state]
            };
            let scale = if known > 0.0 { known } else { 1.0 };
            space.labels.push(&G::LIST[state]);
            space.positions.push(state);
            space.moving += usize::from(moves);
            space.scale.push(scale);
            space.initial.push((known / scale).powi(2));
            space.walk.push(if moves {
                0.0
            } else {
                walk[state] / scale.powi(2)
            });
        }
        Self {
            model,
            physics: *physics,
            encoders,
            earth: LocalEarth::at(physics.latitude_rad, 0.0),
            space,
        }
    }

    /// C_b^n where the joints stand at `angles`.
    fn attitude(&self, heading_rad: f64, angles: [f64; 2]) -> Matrix3<f64> {
        let ship = Ship {
            heading_rad,
            latitude_rad: self.physics.latitude_rad,
            ..Ship::default()
        };
        let table = self.physics.table.attitude(angles).to_rotation_matrix();
        (ship.at(0.0).attitude.to_rotation_matrix() * table).into_inner()
    }

    /// One step of `seconds` along `at`, in parts while the table turns.
    fn step(
        &self,
        heading_rad: f64,
        seconds: f64,
        is_turning: bool,
        at: impl Fn(f64) -> JointState,
    ) -> Second {
        let table = &self.physics.table;
        let up = Vector3::z() * self.earth.gravity_m_s2;
        // Rate and specific force in the axes of the block.
        let felt = |joints: &JointState| {
            let unturn = self.attitude(heading_rad, joints.position).transpose();
            let rate = unturn * self.earth.earth_rate()
                + table.body_rate(joints.position, joints.velocity);
            (rate, unturn * up)
        };
        let mut gathered = G::Gathered::default();
        let parts = if is_turning { PARTS } else { 1 };
        let part_s = seconds / f64::from(parts);
        let mut before = felt(&at(0.0));
        for part in 0..parts {
            let middle = at((f64::from(part) + 0.5) * part_s);
            let after = felt(&at(f64::from(part + 1) * part_s));
            let (rate, force) = felt(&middle);
            let span = Span {
                attitude: self.attitude(heading_rad, middle.position) * part_s,
                increment: Increment::from_averages(part_s, &rate, &force),
                rate_change: after.0 - before.0,
                force_change: after.1 - before.1,
            };
            before = after;
            G::gather(&mut gathered, &span);
        }
        let interval = Interval::constant(seconds, self.earth, Vector3::zeros(), up);
        let transition = self
            .model
            .dynamics(&gathered, &interval)
            .transition()
            .dense();
        let end = at(seconds).position;
        let attitude = self.attitude(heading_rad, end);
        let noise =
            sensor_noise_rate::<M>(&self.physics.noise, &attitude, G::VELOCITY_UP) * seconds;
        let space = &self.space;
        let (m, n) = (space.moving, space.len());
        let scaled = |i: usize, j: usize| space.scale[j] / space.scale[i];
        Second {
            seconds,
            transition: DMatrix::from_fn(m, n, |i, j| {
                transition[(space.positions[i], space.positions[j])] * scaled(i, j)
            }),
            noise: DMatrix::from_fn(m, m, |i, j| {
                noise[(space.positions[i], space.positions[j])] / (space.scale[i] * space.scale[j])
            }),
            measurements: self.measurements(seconds, end, &attitude, is_turning),
        }
    }

    /// Rows and variances of what is measured in a step; a shorter step has as much of a measurement as it is long.
    fn measurements(
        &self,
        seconds: f64,
        angles: [f64; 2],
        attitude: &Matrix3<f64>,
        is_turning: bool,
    ) -> Vec<(Vec<f64>, f64)> {
        let space = &self.space;
        let measured = &self.physics.measurements;
        let mut rows = Vec::new();
        let mut measure = |entries: &[(usize, f64)], sigma: f64| {
            let mut row = vec![0.0; space.len()];
            for (state, coefficient) in entries {
                if let Some(own) = space.positions.iter().position(|p| p == state) {
                    row[own] += coefficient * space.scale[own];
                }
            }
            rows.push((row, sigma * sigma / seconds));
        };
        let place = |name: &str| G::position(name).unwrap_or(N);
        for name in VELOCITY {
            measure(&[(place(name), 1.0)], measured.velocity_m_s);
        }
        if let (Some(sigma), Some(up)) = (measured.velocity_up_m_s, G::VELOCITY_UP) {
            measure(&[(up, 1.0)], sigma);
        }
        if let Some(sigma) = measured.position_m {
            let east = self.earth.transverse_radius_m * self.earth.cos_latitude;
            measure(&[(place(POSITION[1]), east)], sigma);
            measure(&[(place(POSITION[0]), self.earth.meridian_radius_m)], sigma);
            if G::VELOCITY_UP.is_some() {
                measure(&[(place(HEIGHT), 1.0)], sigma);
            }
        }
        let is_read = self.encoders == EncodersRead::Always || !is_turning;
        let encoder_rad = measured.encoder_rad.filter(|_| is_read);
        if let (Some(sigma), Some(table), Some(base)) = (encoder_rad, G::TABLE, G::BASE) {
            let derivatives = self
                .physics
                .table
                .attitude_derivatives(angles, &TableErrors::default());
            let outer = derivatives.readings[0].normalize();
            let across = outer.cross(&derivatives.readings[1]).normalize();
            for axis in [outer, across.cross(&outer), across] {
                let level = attitude * axis;
                let first = place(MISALIGNMENT[0]);
                let mut entries: Vec<(usize, f64)> = (0..3)
                    .flat_map(|k| [(first + k, -level[k]), (base + k, level[k])])
                    .collect();
                let by_table = derivatives.of_states();
                entries.extend((0..8).map(|k| (table + k, axis.dot(&by_table[k]))));
                measure(&entries, sigma);
            }
        }
        rows
    }
}

impl<G: Model<M, N> + Send + Sync, const M: usize, const N: usize> Way for ModelWay<G, M, N> {
    fn space(&self) -> &Space {
        &self.space
    }

    fn rest(&self, heading_rad: f64, angles: [f64; 2]) -> Second {
        let still = JointState {
            position: angles,
            velocity: [0.0; 2],
        };
        self.step(heading_rad, 1.0, false, |_| still)
    }

    fn rotation(&self, heading_rad: f64, motion: &Trajectory) -> Vec<Second> {
        let duration_s = motion.duration_nanos() as f64 / 1e9;
        let steps = (duration_s - 1e-6).ceil().max(1.0);
        let length_s = duration_s / steps;
        (0..steps as u32)
            .map(|index| {
                let from = f64::from(index) * length_s;
                self.step(heading_rad, length_s, true, |seconds| {
                    let nanos = ((from + seconds) * 1e9).round() as i64;
                    motion.at(nanos).unwrap_or_default()
                })
            })
            .collect()
    }
}

/// One element of a rotation, or of its first `seconds` whole steps.
pub(in crate::studies) fn rotation_element(
    way: &dyn Way,
    heading_rad: f64,
    motion: &Trajectory,
    at_most_s: f64,
) -> Element {
    let space = way.space();
    let steps = way.rotation(heading_rad, motion);
    let mut time = 0.0;
    let within = steps.iter().take_while(|step| {
        time += step.seconds;
        time <= at_most_s + 1e-6
    });
    Element::of_seconds(space.moving, space.len(), within)
}

/// The motion of one rotation.
pub(in crate::studies) fn motion(
    physics: &Physics,
    joint: Joint,
    from: [f64; 2],
    angle_rad: f64,
) -> Result<Trajectory, Error> {
    Trajectory::trapezoid(
        joint,
        from,
        angle_rad,
        physics.rate_rad_s,
        physics.acceleration_rad_s2,
    )
}
