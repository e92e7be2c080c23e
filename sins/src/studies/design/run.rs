//! The covariance along a scheme at one heading, leg by leg, and when the goals are met.

use super::catalogue::Catalogue;
use super::goal::{Goals, Measure};
use crate::studies::stretch::Space;
use crate::studies::stretch::{Element, Scratch};

/// Room for a run, so that nothing is allocated in a search.
#[derive(Clone, Debug, Default)]
pub(super) struct Room {
    scratch: Scratch,
    before: Vec<f64>,
    trial: Vec<f64>,
}

/// A run at one heading so far.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub covariance: Vec<f64>,
    /// Since the start \[s\].
    pub time_s: f64,
    /// Where the joints stand, by whole turns.
    pub pose: usize,
    /// When a goal's states came below its limit for good \[s\].
    pub times_s: Vec<f64>,
    /// Goals that are about a time and are not met.
    pub pending: Vec<bool>,
}

/// One stretch of a run: a rotation, if there is one, and the dwell after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    pub turn: Option<usize>,
    /// Number of the dwell.
    pub dwell: usize,
}

impl Run {
    /// At the start.
    pub fn new(space: &Space, goals: &Goals) -> Self {
        let is_time = |measure: &Measure| matches!(measure, Measure::TimeBelow { .. });
        let mut run = Self {
            covariance: space.initial_covariance(),
            time_s: 0.0,
            pose: 0,
            times_s: vec![0.0; goals.all.len()],
            pending: goals.all.iter().map(|(_, m, _)| is_time(m)).collect(),
        };
        for goal in 0..goals.all.len() {
            if over(goals, goal, space, &run.covariance) < 1.0 {
                run.pending[goal] = false;
            }
        }
        run
    }

    /// Goes on by a leg, at most to `end_s`.
    pub fn advance(
        &mut self,
        catalogue: &Catalogue,
        goals: &Goals,
        heading: usize,
        leg: Leg,
        end_s: f64,
        room: &mut Room,
    ) {
        let space = catalogue.space();
        room.before.clone_from(&self.covariance);
        let rotation = leg
            .turn
            .map(|turn| catalogue.rotation(heading, self.pose, turn));
        let rotation_s = rotation.map_or(0.0, |rotation| rotation.seconds);
        let dwell_s = f64::from(catalogue.dwells_s()[leg.dwell]);
        let from = self.pose;
        self.pose = leg.turn.map_or(from, |turn| catalogue.turned(from, turn));
        let left_s = end_s - self.time_s;
        let whole = rotation_s + dwell_s <= left_s + 1e-6;
        let dwell_s = dwell_s.min((left_s - rotation_s).max(0.0));
        match leg.turn {
            Some(turn) if whole => {
                let element = catalogue.leg(heading, from, turn, leg.dwell);
                element.apply(&mut self.covariance, &space.walk, &mut room.scratch);
            }
            Some(turn) if rotation_s > left_s => {
                let part = catalogue.part_of_rotation(heading, from, turn, left_s);
                part.apply(&mut self.covariance, &space.walk, &mut room.scratch);
            }
            _ => {
                if let Some(rotation) = rotation {
                    rotation.apply(&mut self.covariance, &space.walk, &mut room.scratch);
                }
                let rests = catalogue.rests(heading, self.pose);
                dwell(rests, dwell_s, &mut self.covariance, space, room);
            }
        }
        for goal in 0..goals.all.len() {
            let Measure::TimeBelow { .. } = goals.all[goal].1 else {
                continue;
            };
            let met = over(goals, goal, space, &self.covariance) < 1.0;
            if met && self.pending[goal] {
                let rests = catalogue.rests(heading, self.pose);
                let after = Stretch {
                    rotation,
                    rests,
                    dwell_s,
                };
                self.times_s[goal] = self.time_s + after.met_after(goals, goal, space, room);
            }
            self.pending[goal] = !met;
        }
        self.time_s += (rotation_s + dwell_s).min(left_s);
    }

    /// Ends the run: a time that was not reached is as much longer as the sigma is too large.
    pub fn end(&mut self, goals: &Goals, space: &Space) {
        for goal in 0..goals.all.len() {
            if self.pending[goal] {
                self.times_s[goal] =
                    self.time_s * (1.0 + over(goals, goal, space, &self.covariance));
            }
        }
    }
}

/// The greatest sigma over a time goal's limit.
fn over(goals: &Goals, goal: usize, space: &Space, covariance: &[f64]) -> f64 {
    match goals.all[goal].1 {
        Measure::TimeBelow { limit, .. } => goals.over_limit(goal, limit, space, covariance),
        Measure::SigmaAtEnd(_) => f64::INFINITY,
    }
}

/// A dwell of whole seconds.
fn dwell(rests: &[Element], seconds: f64, covariance: &mut [f64], space: &Space, room: &mut Room) {
    let seconds = seconds.round() as u64;
    for (power, element) in rests.iter().enumerate() {
        if seconds & (1 << power) != 0 {
            element.apply(covariance, &space.walk, &mut room.scratch);
        }
    }
}

struct Stretch<'a> {
    rotation: Option<&'a Element>,
    rests: &'a [Element],
    dwell_s: f64,
}

impl Stretch<'_> {
    /// When a goal is met within the stretch that begins with `room.before` \[s\]: to the second in a dwell, and between the
    /// ends of a rotation as the logarithm of sigma falls.
    fn met_after(&self, goals: &Goals, goal: usize, space: &Space, room: &mut Room) -> f64 {
        let before = over(goals, goal, space, &room.before);
        let mut elapsed = 0.0;
        room.trial.clone_from(&room.before);
        if let Some(rotation) = self.rotation {
            rotation.apply(&mut room.trial, &space.walk, &mut room.scratch);
            let after = over(goals, goal, space, &room.trial);
            if after < 1.0 {
                let share = before.ln() / (before / after).ln();
                return rotation.seconds * share.clamp(0.0, 1.0);
            }
            elapsed = rotation.seconds;
        }
        let mut rested = 0;
        let mut reached = room.trial.clone();
        for (power, element) in self.rests.iter().enumerate().rev() {
            let next = rested + (1u64 << power);
            if next as f64 >= self.dwell_s {
                continue;
            }
            room.trial.clone_from(&reached);
            element.apply(&mut room.trial, &space.walk, &mut room.scratch);
            if over(goals, goal, space, &room.trial) >= 1.0 {
                reached.clone_from(&room.trial);
                rested = next;
            }
        }
        elapsed + rested as f64 + 1.0
    }
}
