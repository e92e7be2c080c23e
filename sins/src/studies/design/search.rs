//! The search: simulated annealing in rounds of chains, from scratch, the same for a seed whatever runs it.
//!
//! A round is [`CHAINS`] chains that know nothing of each other, so they may run on as many cores as there are; what they
//! found is merged in their order. A chain draws a limit before it looks at a neighbour, and a run that will exceed it is
//! given up at the heading or at the dwell that shows it.

use std::cmp::Ordering;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::catalogue::Catalogue;
use super::goal::{Criterion, Goal, Goals};
use super::run::{self, Room, Run};
use super::sequence::{Draw, Rules, Sequence};
use crate::error::Error;
use crate::table::scheme::Scheme;

/// Chains of a round.
pub const CHAINS: usize = 16;
/// Neighbours that a chain looks at in a round.
pub const NEIGHBOURS: usize = 2000;
/// Best candidates that are kept.
const KEPT: usize = 24;
/// Scores closer than this are those of one scheme and its mirror images.
const SAME_SCORE: f64 = 1e-6;

/// A candidate with its score: less is better.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scored {
    /// The worst heading's.
    pub score: f64,
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
    /// One-sigma of every state of the [`Space`](super::space::Space) at the end, SI.
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
        })
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
    ) -> Option<f64> {
        let mut worst: f64 = 0.0;
        let space = self.catalogue.space();
        for place in 0..order.len() {
            let score = self.run(sequence, order[place], limit, room).map(|run| {
                let values = self.goals.values(space, &run.covariance, &run.times_s);
                self.goals.score(&values)
            });
            match score {
                Some(score) if score <= limit => worst = worst.max(score),
                _ => {
                    order[..=place].rotate_right(1);
                    return None;
                }
            }
        }
        Some(worst)
    }

    /// One chain of the next round. `temperature` is in units of the score.
    pub fn chain(&self, progress: &Progress, chain: usize) -> Scored {
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
            let score = self.score(&sequence, f64::INFINITY, &mut order, &mut room)?;
            Some(Scored { score, sequence })
        });
        let Some(mut current) = start else {
            return Scored {
                score: f64::INFINITY,
                sequence: Sequence {
                    first_dwell: 0,
                    legs: Vec::new(),
                },
            };
        };
        let mut best = current.clone();
        // A tour of several rounds cools from where everything is possible to where only better is taken.
        let tour = progress.rounds % TOUR;
        let (hot, cold) = (0.1f64, 0.002f64);
        for step in 0..NEIGHBOURS {
            let done = (tour as f64 + step as f64 / NEIGHBOURS as f64) / TOUR as f64;
            let temperature = hot * (cold / hot).powf(done);
            let limit = current.score - temperature * draw.chance().max(1e-300).ln();
            let sequence = draw.neighbour(&current.sequence);
            if let Some(score) = self.score(&sequence, limit, &mut order, &mut room) {
                current = Scored { score, sequence };
                if current.score < best.score {
                    best = current.clone();
                }
            }
        }
        if tour + 1 == TOUR { best } else { current }
    }

    /// Takes what the chains of a round found.
    pub fn merge(&self, progress: &mut Progress, found: Vec<Scored>) {
        progress.rounds += 1;
        progress.evaluations += (found.len() * NEIGHBOURS) as u64;
        let mut all = std::mem::take(&mut progress.best);
        all.extend(found.iter().filter(|one| one.score.is_finite()).cloned());
        all.sort_by(better);
        all.dedup_by(|b, a| (b.score - a.score).abs() < SAME_SCORE);
        all.truncate(KEPT);
        progress.best = all;
        // A tour begins anew from chance.
        progress.chains = if progress.rounds % TOUR == 0 {
            Vec::new()
        } else {
            found
        };
    }
}

/// Rounds in which a chain cools down once.
pub const TOUR: u64 = 5;

fn longest(dwells_s: &[u32]) -> usize {
    (0..dwells_s.len())
        .max_by_key(|dwell| dwells_s[*dwell])
        .unwrap_or(0)
}

fn better(a: &Scored, b: &Scored) -> Ordering {
    a.score
        .total_cmp(&b.score)
        .then_with(|| a.sequence.cmp(&b.sequence))
}
