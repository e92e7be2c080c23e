//! Elements of every rotation and dwell that a search may choose, at every heading: each is worked out once.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use super::sequence::{Leg, Sequence};
use crate::error::Error;
use crate::studies::stretch::Element;
use crate::studies::stretch::Space;
use crate::studies::stretch::{Physics, Way, motion, rotation_element};
use crate::table::Joint;
use crate::table::scheme::{Program, Scheme, Step};

/// A dwell is made of powers of two of a second: up to 2^13 s.
const POWERS: usize = 14;

/// A rotation that may be chosen: a joint and so many units of angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Turn {
    /// The joint.
    pub joint: Joint,
    /// Units of angle, either way.
    pub units: i32,
}

impl Turn {
    /// Every rotation of both joints by 1 to `most` units, either way.
    pub fn all(most: i32) -> Vec<Self> {
        let both = [Joint::Outer, Joint::Inner].into_iter();
        both.flat_map(|joint| {
            let either_way = (-most..=most).filter(|units| *units != 0);
            either_way.map(move |units| Self { joint, units })
        })
        .collect()
    }
}

/// Elements of a search.
pub struct Catalogue {
    way: Box<dyn Way>,
    physics: Physics,
    headings_rad: Vec<f64>,
    /// Units of angle in a whole turn.
    units: u16,
    turns: Vec<Turn>,
    dwells_s: Vec<u32>,
    /// By heading, then pose.
    rests: Vec<Vec<OnceLock<Vec<Element>>>>,
    /// By heading, pose, turn.
    rotations: Vec<Vec<OnceLock<Element>>>,
    /// By heading, pose, turn, dwell: a rotation and the dwell after it.
    legs: Vec<Vec<OnceLock<Element>>>,
}

fn locks<T>(count: usize) -> Vec<OnceLock<T>> {
    (0..count).map(|_| OnceLock::new()).collect()
}

impl Catalogue {
    /// For these choices. Elements are worked out when they are first asked for, by whichever thread; they are the same.
    ///
    /// # Errors
    /// [`Error::Setting`] where the physics means nothing.
    pub fn new(
        physics: &Physics,
        headings_rad: Vec<f64>,
        units: u16,
        turns: Vec<Turn>,
        dwells_s: Vec<u32>,
    ) -> Result<Self, Error> {
        physics.validate()?;
        let poses = usize::from(units) * usize::from(units);
        let way = physics.way();
        // What every rotation takes is found here once, so that no rotation is refused later.
        for turn in &turns {
            motion(physics, turn.joint, [0.0; 2], angle(units, turn.units))?;
        }
        let headings = headings_rad.len();
        Ok(Self {
            way,
            physics: *physics,
            headings_rad,
            units,
            rests: (0..headings).map(|_| locks(poses)).collect(),
            rotations: (0..headings).map(|_| locks(poses * turns.len())).collect(),
            legs: (0..headings)
                .map(|_| locks(poses * turns.len() * dwells_s.len()))
                .collect(),
            turns,
            dwells_s,
        })
    }

    /// States of the search.
    pub fn space(&self) -> &Space {
        self.way.space()
    }

    /// How many headings.
    pub fn headings(&self) -> usize {
        self.headings_rad.len()
    }

    /// A heading \[rad\].
    pub fn heading_rad(&self, heading: usize) -> f64 {
        self.headings_rad[heading]
    }

    /// What may be turned.
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    /// How long may be dwelt \[s\].
    pub fn dwells_s(&self) -> &[u32] {
        &self.dwells_s
    }

    /// The table and what is measured on it.
    pub fn physics(&self) -> &Physics {
        &self.physics
    }

    /// Angle of so many units \[rad\].
    pub fn angle_rad(&self, units: i32) -> f64 {
        angle(self.units, units)
    }

    /// A program in these choices; `None` where it has others.
    pub(super) fn sequence(&self, scheme: &Scheme, program: &Program) -> Option<Sequence> {
        let number = |seconds: f64| {
            let same = |dwell: &u32| (f64::from(*dwell) - seconds).abs() < 1e-6;
            self.dwells_s
                .iter()
                .position(same)
                .map(|dwell| dwell as u16)
        };
        let leg = |step: &Step| {
            let physics = &self.physics;
            let own_rate = (step.rate_rad_s - physics.rate_rad_s).abs() < 1e-9
                && (step.acceleration_rad_s2 - physics.acceleration_rad_s2).abs() < 1e-9;
            let same = |turn: &Turn| {
                turn.joint == step.joint
                    && (self.angle_rad(turn.units) - step.angle_rad).abs() < 1e-6
            };
            let turn = self.turns.iter().position(same).filter(|_| own_rate)?;
            Some(Leg {
                turn: turn as u16,
                dwell: number(step.dwell_nanos as f64 / 1e9)?,
            })
        };
        Some(Sequence {
            first_dwell: number(scheme.first_dwell_s.unwrap_or(scheme.dwell_s))?,
            legs: program.steps.iter().map(leg).collect::<Option<_>>()?,
        })
    }

    /// Where the joints stand, by whole turns.
    pub(super) fn pose(&self, joints: [i32; 2]) -> usize {
        let within = |units: i32| units.rem_euclid(i32::from(self.units)) as usize;
        within(joints[0]) * usize::from(self.units) + within(joints[1])
    }

    /// Units of angle of both joints, 0 to less than a turn.
    fn joints(&self, pose: usize) -> [i32; 2] {
        let units = usize::from(self.units);
        // Both are less than `units`, which an i32 holds.
        [pose / units, pose % units].map(|joint| i32::try_from(joint).unwrap_or(0))
    }

    fn angles(&self, pose: usize) -> [f64; 2] {
        self.joints(pose).map(|units| angle(self.units, units))
    }

    /// Dwells of 1, 2, 4, … s.
    pub(super) fn rests(&self, heading: usize, pose: usize) -> &[Element] {
        self.rests[heading][pose].get_or_init(|| {
            let second = self.way.rest(self.headings_rad[heading], self.angles(pose));
            let space = self.space();
            let mut powers = vec![Element::of_seconds(space.moving, space.len(), [&second])];
            while powers.len() < POWERS {
                let last = &powers[powers.len() - 1];
                powers.push(last.then(last));
            }
            powers
        })
    }

    /// A dwell of whole seconds.
    fn rest(&self, heading: usize, pose: usize, seconds: u32) -> Option<Element> {
        let powers = self.rests(heading, pose);
        let mut whole: Option<Element> = None;
        for (power, element) in powers.iter().enumerate() {
            if seconds & (1 << power) != 0 {
                whole = Some(whole.map_or_else(|| element.clone(), |before| before.then(element)));
            }
        }
        whole
    }

    /// A rotation from a pose.
    pub(super) fn rotation(&self, heading: usize, pose: usize, turn: usize) -> &Element {
        self.rotations[heading][pose * self.turns.len() + turn]
            .get_or_init(|| self.part_of_rotation(heading, pose, turn, f64::INFINITY))
    }

    /// The first whole steps of a rotation, at most so long.
    pub(super) fn part_of_rotation(
        &self,
        heading: usize,
        pose: usize,
        turn: usize,
        at_most_s: f64,
    ) -> Element {
        let Turn { joint, units } = self.turns[turn];
        let motion = motion(
            &self.physics,
            joint,
            self.angles(pose),
            angle(self.units, units),
        )
        .unwrap_or_default();
        rotation_element(
            self.way.as_ref(),
            self.headings_rad[heading],
            &motion,
            at_most_s,
        )
    }

    /// A rotation and the dwell after it, in the pose that it leads to.
    pub(super) fn leg(&self, heading: usize, pose: usize, turn: usize, dwell: usize) -> &Element {
        let place = (pose * self.turns.len() + turn) * self.dwells_s.len() + dwell;
        self.legs[heading][place].get_or_init(|| {
            let rotation = self.rotation(heading, pose, turn);
            self.rest(heading, self.turned(pose, turn), self.dwells_s[dwell])
                .map_or_else(|| rotation.clone(), |rest| rotation.then(&rest))
        })
    }

    /// The pose that a rotation leads to.
    pub(super) fn turned(&self, pose: usize, turn: usize) -> usize {
        let mut joints = self.joints(pose);
        let Turn { joint, units } = self.turns[turn];
        joints[joint.index()] += units;
        self.pose(joints)
    }
}

fn angle(units: u16, count: i32) -> f64 {
    TAU * f64::from(count) / f64::from(units)
}
