//! The search: simulated annealing in rounds of chains, from scratch, the same for a seed whatever runs it.
//!
//! A round is [`CHAINS`] chains that know nothing of each other, so they may run on as many cores as there are; what they
//! found is merged in their order. A chain draws a limit before it looks at a neighbour, and a run that will exceed it is
//! given up at the heading or at the dwell that shows it.

use std::cmp::Ordering;
use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::catalogue::{Catalogue, Turn};
use super::goal::{Criterion, Goal, Goals};
use super::run::{self, Room, Run};
use super::sequence::{Draw, Rules, Sequence};
use crate::error::Error;
use crate::studies::stretch::Physics;
use crate::table::scheme::Scheme;

/// Chains of a round.
pub const CHAINS: usize = 16;
/// Neighbours that a chain looks at in a round, unless a search says otherwise.
pub const NEIGHBOURS: usize = 2000;
/// Best candidates that are kept.
const KEPT: usize = 24;
/// Members of a front that are kept, those of the best scores.
const FRONT: usize = 256;
/// Scores closer than this are those of one scheme and its mirror images.
const SAME_SCORE: f64 = 1e-6;

/// A candidate with its score: less is better.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scored {
    /// The worst heading's.
    pub score: f64,
    /// Each goal's value at its worst heading; 1 is what was asked.
    pub values: Vec<f64>,
    /// What has it.
    pub sequence: Sequence,
}

/// What a heading has of a scheme.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// The heading \[rad\].
    pub heading_rad: f64,
    /// Values of the goals; 1 is what was asked.
    pub values: Vec<f64>,
    /// When the goals about times were met \[s\]; as much longer than the run as the sigma is too large where not.
    pub times_s: Vec<f64>,
    /// One-sigma of every state of the [`Space`](crate::studies::stretch::Space) at the end, SI.
    pub sigma: Vec<f64>,
    /// What counts.
    pub score: f64,
}

/// A search: what may be chosen, and what for.
pub struct Search {
    catalogue: Catalogue,
    goals: Goals,
    rules: Rules,
    duration_s: f64,
    seed: u64,
    neighbours: usize,
}

/// What a chain comes back with.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Where it stands; after a tour, the best it met.
    pub stands: Scored,
    /// What it met that nothing else it met was better than in every goal.
    pub front: Vec<Scored>,
}

/// How far a search is: everything that the next round depends on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Rounds done.
    pub rounds: u64,
    /// Schemes looked at.
    pub evaluations: u64,
    /// Where every chain stands.
    pub chains: Vec<Scored>,
    /// The best of all, best first.
    pub best: Vec<Scored>,
    /// Those that no other is at least as good as in every goal: what one goal costs in another.
    pub front: Vec<Scored>,
}

impl Search {
    /// Puts a search together.
    ///
    /// # Errors
    /// [`Error::Setting`] where goals, rules or duration mean nothing.
    pub fn new(
        catalogue: Catalogue,
        goals: &[Goal],
        criterion: Criterion,
        rules: Rules,
        duration_s: f64,
        seed: u64,
    ) -> Result<Self, Error> {
        let goals = Goals::new(goals, criterion, catalogue.space())?;
        if !(duration_s.is_finite() && (60.0..=1e6).contains(&duration_s)) {
            return Err(Error::setting(
                "duration of a search [s]",
                duration_s,
                "60 to 1e6",
            ));
        }
        Ok(Self {
            catalogue,
            goals,
            rules,
            duration_s,
            seed,
            neighbours: NEIGHBOURS,
        })
    }

    /// Looks at so many neighbours in a chain's round; a model of many states takes its time for one.
    #[must_use]
    pub fn with_neighbours(mut self, neighbours: usize) -> Self {
        self.neighbours = neighbours.max(1);
        self
    }

    /// How many neighbours a chain looks at in a round.
    pub fn neighbours(&self) -> usize {
        self.neighbours
    }

    /// How long the run is \[s\].
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// One scheme, as it is, in the same setting as `physics`: for comparison with what was found. Its rotations are whole eighths of a
    /// turn at one rate, its dwells whole seconds.
    ///
    /// # Errors
    /// [`Error::Scheme`] where it is not, [`Error::Setting`] where the rest means nothing.
    pub fn of_scheme(
        scheme: &Scheme,
        physics: &Physics,
        headings_rad: Vec<f64>,
        goals: &[Goal],
        criterion: Criterion,
        duration_s: f64,
    ) -> Result<(Self, Sequence), Error> {
        let fail = |reason: &str| Error::Scheme {
            name: scheme.name.clone(),
            reason: reason.to_owned(),
        };
        let physics = Physics {
            rate_rad_s: scheme.rate_rad_s,
            acceleration_rad_s2: scheme.acceleration_rad_s2,
            ..*physics
        };
        let program = scheme.program(physics.table)?;
        let mut turns: Vec<Turn> = Vec::new();
        let mut dwells_s = vec![whole_seconds(
            scheme.first_dwell_s.unwrap_or(scheme.dwell_s),
        )];
        for step in &program.steps {
            let turn = Turn {
                joint: step.joint,
                units: (step.angle_rad / TAU * f64::from(EIGHTHS)).round() as i32,
            };
            let dwell = whole_seconds(step.dwell_nanos as f64 / 1e9);
            if !turns.contains(&turn) {
                turns.push(turn);
            }
            if !dwells_s.contains(&dwell) {
                dwells_s.push(dwell);
            }
        }
        let catalogue = Catalogue::new(&physics, headings_rad, EIGHTHS, turns, dwells_s)?;
        let rules = Rules {
            closed: scheme.cycles.is_none(),
            limits: [i32::MIN..=i32::MAX, i32::MIN..=i32::MAX],
            rotations: 0..=usize::MAX,
        };
        let search = Self::new(catalogue, goals, criterion, rules, duration_s, 0)?;
        let sequence = search
            .sequence(scheme)
            .ok_or_else(|| fail("expected rotations of whole eighths of a turn, all of one rate, and dwells of whole seconds"))?;
        Ok((search, sequence))
    }

    /// What may be chosen.
    pub fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// What a sequence keeps to.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// One sequence at one heading, whole.
    pub fn standing(&self, sequence: &Sequence, heading: usize) -> Standing {
        let mut room = Room::default();
        let space = self.catalogue.space();
        let run = self
            .run(sequence, heading, f64::INFINITY, &mut room)
            .unwrap_or_else(|| Run::new(space, &self.goals));
        let values = self.goals.values(space, &run.covariance, &run.times_s);
        Standing {
            heading_rad: self.catalogue.heading_rad(heading),
            score: self.goals.score(&values),
            values,
            times_s: run.times_s.clone(),
            sigma: (0..space.len())
                .map(|state| space.sigma(&run.covariance, state))
                .collect(),
        }
    }

    /// A scheme of a person as a sequence, to be compared; `None` where it has a rotation or a dwell that this search may not choose.
    pub fn sequence(&self, scheme: &Scheme) -> Option<Sequence> {
        let program = scheme.program(self.catalogue.physics().table).ok()?;
        self.catalogue.sequence(scheme, &program)
    }

    /// The worst heading's score, where it is not above `limit`.
    pub fn score_within(&self, sequence: &Sequence, limit: f64) -> Option<f64> {
        let mut order: Vec<usize> = (0..self.catalogue.headings()).collect();
        self.score(sequence, limit, &mut order, &mut Room::default())
            .map(|(score, _)| score)
    }

    /// One sequence at all headings.
    pub fn standings(&self, sequence: &Sequence) -> Vec<Standing> {
        (0..self.catalogue.headings())
            .map(|heading| self.standing(sequence, heading))
            .collect()
    }

    /// To the end, or to where the score is sure to be above `limit`.
    fn run(&self, sequence: &Sequence, heading: usize, limit: f64, room: &mut Room) -> Option<Run> {
        let mut run = Run::new(self.catalogue.space(), &self.goals);
        let first = run::Leg {
            turn: None,
            dwell: usize::from(sequence.first_dwell),
        };
        let cycle = sequence.legs.iter().map(|leg| run::Leg {
            turn: Some(usize::from(leg.turn)),
            dwell: usize::from(leg.dwell),
        });
        let mut legs = std::iter::once(first).chain(cycle.clone());
        while run.time_s < self.duration_s - 1e-6 {
            let leg = match legs.next() {
                Some(leg) => leg,
                None if self.rules.closed && !sequence.legs.is_empty() => {
                    legs = std::iter::once(first).chain(cycle.clone());
                    legs.next();
                    continue;
                }
                None => run::Leg {
                    turn: None,
                    dwell: longest(self.catalogue.dwells_s()),
                },
            };
            run.advance(
                &self.catalogue,
                &self.goals,
                heading,
                leg,
                self.duration_s,
                room,
            );
            if self.goals.at_least(run.time_s, &run.pending) > limit {
                return None;
            }
        }
        run.end(&self.goals, self.catalogue.space());
        Some(run)
    }

    /// The worst heading's score; `None` where it is above `limit`. `order` says which heading to ask first, and is told.
    fn score(
        &self,
        sequence: &Sequence,
        limit: f64,
        order: &mut [usize],
        room: &mut Room,
    ) -> Option<(f64, Vec<f64>)> {
        let mut worst: f64 = 0.0;
        let mut values: Vec<f64> = Vec::new();
        let space = self.catalogue.space();
        for place in 0..order.len() {
            let score = self.run(sequence, order[place], limit, room).map(|run| {
                let own = self.goals.values(space, &run.covariance, &run.times_s);
                values.resize(own.len(), 0.0);
                for (worst, own) in values.iter_mut().zip(&own) {
                    *worst = own.max(*worst);
                }
                self.goals.score(&own)
            });
            match score {
                Some(score) if score <= limit => worst = worst.max(score),
                _ => {
                    order[..=place].rotate_right(1);
                    return None;
                }
            }
        }
        Some((worst, values))
    }

    /// One chain of the next round.
    pub fn chain(&self, progress: &Progress, chain: usize) -> Found {
        let stream = (progress.rounds * CHAINS as u64 + chain as u64 + 1)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut draw = Draw {
            random: Xoshiro256PlusPlus::seed_from_u64(self.seed ^ stream),
            rules: &self.rules,
            turns: self.catalogue.turns(),
            dwells: self.catalogue.dwells_s().len(),
        };
        let mut room = Room::default();
        let mut order: Vec<usize> = (0..self.catalogue.headings()).collect();
        let start = progress.chains.get(chain).cloned().or_else(|| {
            let sequence = draw.any()?;
            let (score, values) = self.score(&sequence, f64::INFINITY, &mut order, &mut room)?;
            Some(Scored {
                score,
                values,
                sequence,
            })
        });
        let Some(mut current) = start else {
            let nothing = Scored {
                score: f64::INFINITY,
                values: Vec::new(),
                sequence: Sequence {
                    first_dwell: 0,
                    legs: Vec::new(),
                },
            };
            return Found {
                stands: nothing,
                front: Vec::new(),
            };
        };
        let mut best = current.clone();
        let mut front = vec![current.clone()];
        // A tour of several rounds cools from where everything is possible to where only better is taken.
        let tour = progress.rounds % TOUR;
        let (hot, cold) = (0.1f64, 0.002f64);
        for step in 0..self.neighbours {
            let done = (tour as f64 + step as f64 / self.neighbours as f64) / TOUR as f64;
            let temperature = hot * (cold / hot).powf(done);
            let limit = current.score - temperature * draw.chance().max(1e-300).ln();
            let sequence = draw.neighbour(&current.sequence);
            let score = self.score(&sequence, limit, &mut order, &mut room);
            if let Some((score, values)) = score {
                current = Scored {
                    score,
                    values,
                    sequence,
                };
                take_in(&mut front, &current);
                if current.score < best.score {
                    best = current.clone();
                }
            }
        }
        let stands = if tour + 1 == TOUR { best } else { current };
        Found { stands, front }
    }

    /// Takes what the chains of a round found.
    pub fn merge(&self, progress: &mut Progress, found: Vec<Found>) {
        progress.rounds += 1;
        progress.evaluations += (found.len() * self.neighbours) as u64;
        for one in found.iter().flat_map(|found| &found.front) {
            take_in(&mut progress.front, one);
        }
        progress.front.sort_by(better);
        progress.front.truncate(FRONT);
        // What a chain met and left again while it was hot counts as well.
        let met = |found: &Found| found.front.iter().min_by(|a, b| better(a, b)).cloned();
        let met: Vec<Scored> = found.iter().filter_map(met).collect();
        let stand: Vec<Scored> = found.into_iter().map(|found| found.stands).collect();
        let mut all = std::mem::take(&mut progress.best);
        all.extend(met);
        all.sort_by(better);
        all.dedup_by(|b, a| (b.score - a.score).abs() < SAME_SCORE);
        all.truncate(KEPT);
        progress.best = all;
        // A tour begins anew from chance.
        progress.chains = if progress.rounds.is_multiple_of(TOUR) {
            Vec::new()
        } else {
            stand
        };
    }
}

/// Units of a whole turn for a scheme of a person.
const EIGHTHS: u16 = 8;

/// Rounds in which a chain cools down once.
pub const TOUR: u64 = 5;

fn whole_seconds(seconds: f64) -> u32 {
    seconds.round() as u32
}

fn longest(dwells_s: &[u32]) -> usize {
    (0..dwells_s.len())
        .max_by_key(|dwell| dwells_s[*dwell])
        .unwrap_or(0)
}

/// Takes one into a front that nothing in it betters in every goal; what it betters goes.
fn take_in(front: &mut Vec<Scored>, one: &Scored) {
    let bettered = |a: &Scored, b: &Scored| {
        a.values
            .iter()
            .zip(&b.values)
            .all(|(a, b)| *a <= *b + SAME_SCORE)
    };
    if front.iter().any(|other| bettered(other, one)) {
        return;
    }
    front.retain(|other| !bettered(one, other));
    front.push(one.clone());
}

fn better(a: &Scored, b: &Scored) -> Ordering {
    a.score
        .total_cmp(&b.score)
        .then_with(|| a.sequence.cmp(&b.sequence))
}
