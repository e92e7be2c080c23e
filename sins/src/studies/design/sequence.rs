//! Candidates: sequences of rotations with their dwells, and how one becomes another.

use std::ops::RangeInclusive;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::catalogue::{Catalogue, Turn};
use crate::table::Joint;
use crate::table::scheme::{About, CableLimits, Rotation, Scheme};

/// A sequence that breaks a rule is drawn anew so many times.
const TRIES: usize = 200;

/// What a sequence must keep to.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// The last rotation comes back to where the first one left, and the cycle repeats. Otherwise the table rests in the last
    /// position until the time is over.
    pub closed: bool,
    /// How far the cables let the joints turn (outer, inner), in units of angle.
    pub limits: [RangeInclusive<i32>; 2],
    /// How many rotations.
    pub rotations: RangeInclusive<usize>,
}

/// One rotation and the dwell after it, by their numbers in the [`Catalogue`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Leg {
    /// Number of the rotation.
    pub turn: u16,
    /// Number of the dwell after it.
    pub dwell: u16,
}

/// A candidate.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Sequence {
    /// Number of the dwell that comes first.
    pub first_dwell: u16,
    /// The rotations of a cycle.
    pub legs: Vec<Leg>,
}

impl Sequence {
    /// Whether it keeps to the rules.
    pub fn keeps_to(&self, rules: &Rules, turns: &[Turn]) -> bool {
        let mut at = [0; 2];
        let within = self.legs.iter().all(|leg| {
            let Some(Turn { joint, units }) = turns.get(usize::from(leg.turn)) else {
                return false;
            };
            at[joint.index()] += units;
            rules.limits[joint.index()].contains(&at[joint.index()])
        });
        within && rules.rotations.contains(&self.legs.len()) && (!rules.closed || at == [0; 2])
    }

    /// As a scheme of a person.
    pub fn scheme(&self, name: &str, catalogue: &Catalogue, rules: &Rules) -> Scheme {
        let dwell = |number: u16| f64::from(catalogue.dwells_s()[usize::from(number)]);
        let rotation = |leg: &Leg| {
            let Turn { joint, units } = catalogue.turns()[usize::from(leg.turn)];
            let table = catalogue.physics().table;
            let axis = match joint {
                Joint::Outer => table.outer,
                Joint::Inner => table.inner,
            };
            let mut rotation = Rotation::new(About::Axis(axis), catalogue.angle_rad(units));
            rotation.dwell_s = Some(dwell(leg.dwell));
            rotation
        };
        let mut scheme = Scheme::new(name, self.legs.iter().map(rotation).collect());
        scheme.dwell_s = dwell(self.first_dwell);
        scheme.rate_rad_s = catalogue.physics().rate_rad_s;
        scheme.acceleration_rad_s2 = catalogue.physics().acceleration_rad_s2;
        scheme.cycles = if rules.closed { None } else { Some(1) };
        let limit = |joint: usize| {
            let limits = &rules.limits[joint];
            (
                catalogue.angle_rad(*limits.start()),
                catalogue.angle_rad(*limits.end()),
            )
        };
        scheme.limits = CableLimits {
            outer: limit(0),
            inner: limit(1),
        };
        for rotation in &mut scheme.rotations {
            if rotation.dwell_s == Some(scheme.dwell_s) {
                rotation.dwell_s = None;
            }
        }
        scheme
    }
}

/// Draws candidates.
pub(super) struct Draw<'a> {
    pub random: Xoshiro256PlusPlus,
    pub rules: &'a Rules,
    pub turns: &'a [Turn],
    pub dwells: usize,
}

impl Draw<'_> {
    fn below(&mut self, bound: usize) -> usize {
        (self.random.random::<u64>() % bound.max(1) as u64) as usize
    }

    /// Uniform between 0 and 1.
    pub fn chance(&mut self) -> f64 {
        self.random.random()
    }

    fn leg(&mut self) -> Leg {
        Leg {
            turn: self.below(self.turns.len()) as u16,
            dwell: self.below(self.dwells) as u16,
        }
    }

    /// A sequence by chance that keeps to the rules; `None` where none was found.
    pub fn any(&mut self) -> Option<Sequence> {
        for _ in 0..TRIES {
            let (from, to) = (*self.rules.rotations.start(), *self.rules.rotations.end());
            let length = from + self.below(to - from + 1);
            let mut sequence = Sequence {
                first_dwell: self.below(self.dwells) as u16,
                legs: (0..length).map(|_| self.leg()).collect(),
            };
            // Rotations that would leave the cables are left out on the way.
            let mut at = [0i32; 2];
            sequence.legs.retain(|leg| {
                let Turn { joint, units } = self.turns[usize::from(leg.turn)];
                let next = at[joint.index()] + units;
                let good = self.rules.limits[joint.index()].contains(&next);
                if good {
                    at[joint.index()] = next;
                }
                good
            });
            if self.mend(&mut sequence) {
                return Some(sequence);
            }
        }
        None
    }

    /// A neighbour that keeps to the rules; the same sequence where none was found.
    pub fn neighbour(&mut self, of: &Sequence) -> Sequence {
        for _ in 0..TRIES {
            let mut sequence = of.clone();
            let changes = 1 + usize::from(self.chance() < 0.3);
            for _ in 0..changes {
                self.change(&mut sequence);
            }
            let mended = self.mend(&mut sequence);
            if mended && sequence != *of {
                return sequence;
            }
        }
        of.clone()
    }

    fn change(&mut self, sequence: &mut Sequence) {
        let length = sequence.legs.len();
        let (one, other) = (self.below(length), self.below(length));
        let kinds = if self.dwells > 1 { 8 } else { 6 };
        match self.below(kinds) {
            _ if length == 0 => sequence.legs.push(self.leg()),
            0 => sequence.legs[one].turn = self.leg().turn,
            1 => {
                let leg = self.leg();
                sequence.legs.insert(self.below(length + 1), leg);
            }
            2 => {
                sequence.legs.remove(one);
            }
            3 => sequence.legs.swap(one, other),
            4 => {
                let leg = sequence.legs.remove(one);
                sequence.legs.insert(other.min(length - 1), leg);
            }
            5 => sequence.legs[one.min(other)..=one.max(other)].reverse(),
            6 => sequence.legs[one].dwell = self.leg().dwell,
            _ => sequence.first_dwell = self.leg().dwell,
        }
    }

    /// Closes the cycle where it must be closed: by changing a rotation of the joint that did not come back, or by one more.
    fn mend(&mut self, sequence: &mut Sequence) -> bool {
        if self.rules.closed {
            for joint in [Joint::Outer, Joint::Inner] {
                let own = |leg: &Leg| {
                    let turn = self.turns[usize::from(leg.turn)];
                    (turn.joint == joint).then_some(turn.units)
                };
                let net: i32 = sequence.legs.iter().filter_map(own).sum();
                if net == 0 {
                    continue;
                }
                let places: Vec<(usize, i32)> = sequence
                    .legs
                    .iter()
                    .enumerate()
                    .filter_map(|(place, leg)| own(leg).map(|units| (place, units)))
                    .collect();
                let (place, units) = places[self.below(places.len())];
                let turn = |units: i32| {
                    let wanted = Turn { joint, units };
                    self.turns.iter().position(|turn| *turn == wanted)
                };
                let changed = turn(units - net).map(|turn| turn as u16);
                let added = turn(-net).map(|turn| turn as u16);
                match (changed, added) {
                    _ if units == net => {
                        sequence.legs.remove(place);
                    }
                    (Some(turn), _) => sequence.legs[place].turn = turn,
                    (None, Some(turn)) => {
                        let at = self.below(sequence.legs.len() + 1);
                        let dwell = self.below(self.dwells) as u16;
                        sequence.legs.insert(at, Leg { turn, dwell });
                    }
                    (None, None) => return false,
                }
            }
        }
        sequence.keeps_to(self.rules, self.turns)
    }
}
