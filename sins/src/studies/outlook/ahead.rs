//! The covariance of a filter, carried ahead through rests and rotations.

use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::rc::Rc;

use super::{Met, Place, Question, Standing};
use crate::error::Error;
use crate::estimation::state::{NamedCovariance, StateList, StateValues};
use crate::machines::self_calibration::{EncoderUse, Estimate, ModelChoice, Settings, Thresholds};
use crate::studies::stretch::{
    Element, EncodersRead, Measurements, Physics, Scratch, Space, States, Way, motion,
};
use crate::table::Joint;
use crate::table::scheme::{Program, SegmentKind, Step};

/// Powers of two of a second that a rest is made of: up to 16 s, so that times are known as well.
const POWERS: usize = 5;
/// Angles are told apart by this \[rad\].
const SAME_RAD: f64 = 1e-6;

/// A pose by whole turns.
type Pose = [i64; 2];
/// Where from, which joint, by how much, how fast and how sharply.
type Rotation = (Pose, usize, [u64; 3]);

/// What has been worked out already.
#[derive(Default)]
struct Worked {
    rests: HashMap<Pose, Rc<Vec<Element>>>,
    rotations: HashMap<Rotation, Rc<Element>>,
}

/// What a question is worked out with.
struct Means<'a> {
    way: Box<dyn Way>,
    physics: Physics,
    heading_rad: f64,
    now: &'a NamedCovariance,
    worked: RefCell<Worked>,
}

/// A covariance at a time from now.
#[derive(Clone)]
pub(super) struct Ahead<'a> {
    means: Rc<Means<'a>>,
    /// Scaled, row by row.
    covariance: Vec<f64>,
    scratch: Scratch,
    time_s: f64,
}

/// What is measured of a moored ship, and how well, by what the filter takes it to be worth now.
fn measurements(estimate: &Estimate, settings: &Settings) -> Result<Measurements, Error> {
    let Some([east, north, up]) = estimate.ship_motion_m_s else {
        return Err(Error::setting(
            "velocity of the ship",
            "measured",
            "a ship at her mooring: what a moving one will do is not foreseen",
        ));
    };
    // As much as a measurement of every second says.
    let of_a_second = settings.step_s.sqrt();
    let is_whole = settings.model == ModelChoice::Whole;
    let reads = matches!(estimate.encoders, EncoderUse::Used(_));
    let encoder = settings.encoders.filter(|_| is_whole && reads);
    Ok(Measurements {
        velocity_m_s: (0.5 * (east * east + north * north)).sqrt() * of_a_second,
        velocity_up_m_s: is_whole.then_some(up * of_a_second),
        position_m: None,
        encoder_rad: encoder.map(|accuracy| accuracy.sigma_rad * of_a_second),
    })
}

impl<'a> Ahead<'a> {
    /// Begins at what the filter knows now.
    pub fn new(question: &Question<'a>) -> Result<Self, Error> {
        let (estimate, settings) = (question.estimate, question.settings);
        let (initial, states) = match settings.model {
            ModelChoice::Paper => (settings.prior, States::Paper),
            ModelChoice::Whole => {
                let (initial, groups) = settings.whole_priors(&estimate.noise);
                (initial, States::Groups(groups))
            }
        };
        let physics = Physics {
            states,
            measurements: measurements(estimate, settings)?,
            noise: estimate.noise,
            latitude_rad: estimate.navigation.position.latitude_rad,
            table: question.program.table,
            rate_rad_s: question.program.rate_rad_s,
            acceleration_rad_s2: question.program.acceleration_rad_s2,
        };
        physics.validate()?;
        let means = Means {
            way: physics.way_from(&initial, EncodersRead::AtRest),
            physics,
            heading_rad: estimate.vehicle.heading,
            now: estimate.covariance(),
            worked: RefCell::default(),
        };
        let covariance = scaled(means.way.space(), means.now);
        Ok(Self {
            means: Rc::new(means),
            covariance,
            scratch: Scratch::default(),
            time_s: 0.0,
        })
    }

    /// From now \[s\].
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// One-sigma of a state; as it is now where nothing here moves it, infinite where the filter does not have it.
    pub fn sigma_of(&self, name: &str) -> f64 {
        let space = self.means.way.space();
        match space.position(name) {
            Some(state) if self.means.now.position(name).is_some() => {
                space.sigma(&self.covariance, state)
            }
            _ => self.means.now.sigma(name).unwrap_or(f64::INFINITY),
        }
    }

    /// One-sigma of all states that the filter has.
    pub fn sigma(&self) -> Result<StateValues, Error> {
        let names: Vec<&str> = self.means.now.states().iter().collect();
        let values: Vec<f64> = names.iter().map(|name| self.sigma_of(name)).collect();
        StateValues::new(StateList::names(names), &values)
    }

    /// How far the thresholds are: the sum of ln(sigma over threshold) of those above theirs.
    pub fn distance(&self, thresholds: &Thresholds) -> f64 {
        let far = |name: &str, limit: f64| (self.sigma_of(name) / limit).ln().max(0.0);
        thresholds
            .iter()
            .map(|(label, limit)| far(label.name, limit))
            .sum()
    }

    /// Notes the first time at which every threshold is met.
    pub fn meet(&self, met: &mut Option<Met>, thresholds: &Thresholds, place: Place) {
        if met.is_none() && self.distance(thresholds) <= 0.0 {
            *met = Some(Met {
                in_s: self.time_s,
                place,
            });
        }
    }

    /// What is left of the dwell or the rotation under way, and the dwell after that one.
    pub fn finish_segment(
        &mut self,
        program: &Program,
        standing: &Standing,
        mut look: impl FnMut(&Self),
    ) -> Result<(), Error> {
        let Standing { cycle, step, .. } = *standing;
        let mut dwell_s = dwell_s(program, step);
        if standing.kind == SegmentKind::Rotation {
            self.finish_rotation(program, standing)?;
            look(self);
        } else {
            dwell_s = (dwell_s - standing.for_s).max(0.0);
        }
        self.rest(program.target(cycle, step), dwell_s, look);
        Ok(())
    }

    /// What is left of the rotation under way.
    pub fn finish_rotation(&mut self, program: &Program, standing: &Standing) -> Result<(), Error> {
        let means = Rc::clone(&self.means);
        let step = program.step(standing.step);
        let step = step.ok_or_else(|| no_rotation(program, standing))?;
        let from = before(program, standing.cycle, standing.step, step);
        let steps = means.way.rotation(
            means.heading_rad,
            &motion(&means.rates(step), step.joint, from, step.angle_rad)?,
        );
        let mut time_s = 0.0;
        let left = steps.iter().filter(|second| {
            time_s += second.seconds;
            time_s > standing.for_s + 0.5 * second.seconds
        });
        let space = means.way.space();
        let element = Element::of_seconds(space.moving, space.len(), left);
        self.apply(&element);
        Ok(())
    }

    /// A step of a program: its rotation, and the dwell after it.
    pub fn step(
        &mut self,
        program: &Program,
        place: Place,
        mut look: impl FnMut(&Self),
    ) -> Result<(), Error> {
        let Place {
            cycle,
            step: number,
        } = place;
        if let Some(step) = program.step(number) {
            let from = before(program, cycle, number, step);
            let physics = self.means.rates(step);
            self.turn(&physics, step.joint, from, step.angle_rad)?;
            look(self);
        }
        self.rest(
            program.target(cycle, number),
            dwell_s(program, number),
            look,
        );
        Ok(())
    }

    /// A rotation with the scheme's own rate and the dwell after it; rest for as long where the angle is 0.
    pub fn turn_and_rest(
        &mut self,
        program: &Program,
        joint: Joint,
        from: [f64; 2],
        angle_rad: f64,
        dwell_s: f64,
    ) -> Result<(), Error> {
        let mut to = from;
        to[joint.index()] += angle_rad;
        if angle_rad != 0.0 {
            let physics = Physics {
                rate_rad_s: program.rate_rad_s,
                acceleration_rad_s2: program.acceleration_rad_s2,
                ..self.means.physics
            };
            self.turn(&physics, joint, from, angle_rad)?;
        }
        self.rest(to, dwell_s, |_| {});
        Ok(())
    }

    /// A rest of whole seconds.
    pub fn rest(&mut self, angles: [f64; 2], seconds: f64, mut look: impl FnMut(&Self)) {
        let powers = self.means.rests(angles);
        // A dwell of a year is a hundred days too long; what is left of a rest below a second is none.
        let mut left = seconds.clamp(0.0, 1e7).round() as u64;
        while left > 0 {
            let power = (left.ilog2() as usize).min(POWERS - 1);
            left -= 1 << power;
            self.apply(&powers[power]);
            look(self);
        }
    }

    fn turn(
        &mut self,
        physics: &Physics,
        joint: Joint,
        from: [f64; 2],
        angle_rad: f64,
    ) -> Result<(), Error> {
        let element = self.means.rotation(physics, joint, from, angle_rad)?;
        self.apply(&element);
        Ok(())
    }

    fn apply(&mut self, element: &Element) {
        let walk = &self.means.way.space().walk;
        element.apply(&mut self.covariance, walk, &mut self.scratch);
        self.time_s += element.seconds;
    }
}

impl Means<'_> {
    /// The physics with the rate of a step.
    fn rates(&self, step: &Step) -> Physics {
        Physics {
            rate_rad_s: step.rate_rad_s,
            acceleration_rad_s2: step.acceleration_rad_s2,
            ..self.physics
        }
    }

    /// Rests of 1, 2, 4, … s.
    fn rests(&self, angles: [f64; 2]) -> Rc<Vec<Element>> {
        let key = pose(angles);
        if let Some(found) = self.worked.borrow().rests.get(&key) {
            return Rc::clone(found);
        }
        let space = self.way.space();
        let second = self.way.rest(self.heading_rad, angles);
        let first = Element::of_seconds(space.moving, space.len(), [&second]);
        let twice = |last: &Element| Some(last.then(last));
        let powers = std::iter::successors(Some(first), twice).take(POWERS);
        let powers = Rc::new(powers.collect::<Vec<_>>());
        let known = &mut self.worked.borrow_mut().rests;
        known.insert(key, Rc::clone(&powers));
        powers
    }

    fn rotation(
        &self,
        physics: &Physics,
        joint: Joint,
        from: [f64; 2],
        angle_rad: f64,
    ) -> Result<Rc<Element>, Error> {
        let numbers = [angle_rad, physics.rate_rad_s, physics.acceleration_rad_s2];
        let key = (pose(from), joint.index(), numbers.map(f64::to_bits));
        if let Some(found) = self.worked.borrow().rotations.get(&key) {
            return Ok(Rc::clone(found));
        }
        let motion = motion(physics, joint, from, angle_rad)?;
        let steps = self.way.rotation(self.heading_rad, &motion);
        let space = self.way.space();
        let element = Rc::new(Element::of_seconds(space.moving, space.len(), &steps));
        let known = &mut self.worked.borrow_mut().rotations;
        known.insert(key, Rc::clone(&element));
        Ok(element)
    }
}

fn no_rotation(program: &Program, standing: &Standing) -> Error {
    Error::setting(
        "place in the scheme",
        format!("rotation {}", standing.step),
        format!(
            "one of the {} rotations of {}",
            program.steps.len(),
            program.name
        ),
    )
}

/// Joint angles from which a step of a cycle turns \[rad\].
fn before(program: &Program, cycle: u32, number: u32, step: &Step) -> [f64; 2] {
    let mut from = program.target(cycle, number);
    from[step.joint.index()] -= step.angle_rad;
    from
}

/// The dwell that ends a step; where it lasts until stopped, as long as one is counted \[s\].
fn dwell_s(program: &Program, step: u32) -> f64 {
    let nanos = program.dwell_nanos(step).min(program.cycle_nanos().max(1));
    nanos as f64 / 1e9
}

fn pose(angles: [f64; 2]) -> Pose {
    angles.map(|angle| {
        let turned = (angle / SAME_RAD).round() as i64;
        turned.rem_euclid((TAU / SAME_RAD).round() as i64)
    })
}

/// The covariance of the states of a space, each over its scale; of what the filter does not have, the prior.
fn scaled(space: &Space, now: &NamedCovariance) -> Vec<f64> {
    let n = space.len();
    let mut covariance = space.initial_covariance();
    let places: Vec<Option<usize>> = space
        .labels
        .iter()
        .map(|label| now.position(label.name))
        .collect();
    for i in 0..n {
        for j in 0..n {
            if let (Some(a), Some(b)) = (places[i], places[j]) {
                let scale = space.scale[i] * space.scale[j];
                covariance[i * n + j] = now.matrix()[(a, b)] / scale;
            }
        }
    }
    covariance
}
