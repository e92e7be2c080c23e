//! Rotation schemes by search, held against those that are known.

mod ask;
mod page;
mod summary;

use std::f64::consts::TAU;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use sins::studies::design::{
    CHAINS, Catalogue, Criterion, Goal, Measure, Progress, Rules, Search, Standing, Turn,
};
use sins::studies::stretch::{Physics, States};
use sins::table::scheme::Scheme;

pub use ask::goal;
pub use page::page;
pub use summary::{Report, text};

use crate::{Error, Listener};

/// Headings at which the result is held, whatever number the search looked at.
pub const HELD_AT: usize = 24;
/// Neighbours that a chain looks at in a round, where a model is larger than the paper's.
const NEIGHBOURS_WHOLE: usize = 50;

/// A search as a person asks for it. Angles in deg as they are chosen: whole numbers of `step_deg`.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Errors, measurements, noise, place and table.
    pub physics: Physics,
    /// Rotations are multiples of this: 45 or 90.
    pub step_deg: u16,
    /// How far the cables let the joints turn, outer and inner: (min, max).
    pub limits_deg: [(i32, i32); 2],
    /// Dwells to choose from \[s\].
    pub dwells_s: Vec<u32>,
    /// Whether the cycle comes back to its start and repeats.
    pub closed: bool,
    /// Fewest and most rotations of a cycle.
    pub rotations: (usize, usize),
    /// Length of the run \[s\].
    pub duration_s: f64,
    /// Headings that the search looks at, round the compass.
    pub headings: usize,
    /// What is asked, see [`goal`]; the paper's where there is none.
    pub goals: Vec<String>,
    /// How the goals become one number.
    pub criterion: Criterion,
    /// Decides the search.
    pub seed: u64,
}

/// A scheme with what it has at every heading.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The scheme.
    pub scheme: Scheme,
    /// By heading.
    pub standings: Vec<Standing>,
}

impl Judged {
    /// The value of each goal at its worst heading; 1 is what was asked.
    pub fn worst(&self) -> Vec<f64> {
        let mut worst = Vec::new();
        for standing in &self.standings {
            worst.resize(standing.values.len(), 0.0);
            for (worst, value) in worst.iter_mut().zip(&standing.values) {
                *worst = value.max(*worst);
            }
        }
        worst
    }

    /// The worst heading's score.
    pub fn score(&self) -> f64 {
        self.standings.iter().map(|s| s.score).fold(0.0, f64::max)
    }
}

impl Plan {
    /// The goals over the states of a model.
    ///
    /// # Errors
    /// Where one of them cannot be read or means nothing.
    pub fn goals(&self) -> Result<Vec<Goal>, Error> {
        let labels = self.physics.labels()?;
        if self.goals.is_empty() {
            return Ok(match self.physics.states {
                States::Paper => Goal::paper(),
                States::Groups(_) => ask::WHOLE
                    .iter()
                    .map(|text| goal(text, &labels))
                    .collect::<Result<_, _>>()?,
            });
        }
        self.goals.iter().map(|text| goal(text, &labels)).collect()
    }

    fn headings(count: usize) -> Vec<f64> {
        (0..count).map(|k| TAU * k as f64 / count as f64).collect()
    }

    /// The search.
    ///
    /// # Errors
    /// Where the plan means nothing.
    pub fn search(&self) -> Result<Search, Error> {
        let step = i32::from(self.step_deg);
        let (fewest, most) = self.rotations;
        let limits = self.limits_deg.map(|(min, max)| min / step..=max / step);
        let checks = [
            (
                "step of rotations [deg]",
                self.step_deg.to_string(),
                [45, 90].contains(&self.step_deg),
                "45 or 90",
            ),
            (
                "rotations of a cycle",
                format!("{fewest} to {most}"),
                2 <= fewest && fewest <= most && most <= 60,
                "2 to 60, fewest first",
            ),
            (
                "headings",
                self.headings.to_string(),
                (1..=360).contains(&self.headings),
                "1 to 360",
            ),
            (
                "dwells [s]",
                format!("{:?}", self.dwells_s),
                !self.dwells_s.is_empty() && self.dwells_s.iter().all(|d| (1..=16_000).contains(d)),
                "one or more of 1 to 16000 s",
            ),
            (
                "cable limits [deg]",
                format!("{:?}", self.limits_deg),
                self.limits_deg
                    .iter()
                    .all(|(min, max)| (-3600..=0).contains(min) && (0..=3600).contains(max)),
                "min,max with 0 between them, ten turns at most either way",
            ),
        ];
        for (name, value, good, expected) in checks {
            if !good {
                return Err(sins::Error::setting(name, value, expected).into());
            }
        }
        let units = 360 / self.step_deg;
        let catalogue = Catalogue::new(
            &self.physics,
            Self::headings(self.headings),
            units,
            Turn::all(i32::from(units)),
            self.dwells_s.clone(),
        )?;
        let rules = Rules {
            closed: self.closed,
            limits,
            rotations: fewest..=most,
        };
        let search = Search::new(
            catalogue,
            &self.goals()?,
            self.criterion,
            rules,
            self.duration_s,
            self.seed,
        )?;
        Ok(match self.physics.states {
            States::Paper => search,
            States::Groups(_) => search.with_neighbours(NEIGHBOURS_WHOLE),
        })
    }

    /// A scheme in this plan's setting, at [`HELD_AT`] headings.
    ///
    /// # Errors
    /// Where its rotations are not whole eighths of a turn.
    pub fn judge(&self, scheme: &Scheme) -> Result<Judged, Error> {
        let (search, sequence) = Search::of_scheme(
            scheme,
            &self.physics,
            Self::headings(HELD_AT),
            &self.goals()?,
            self.criterion,
            self.duration_s,
        )?;
        let standings = (0..HELD_AT)
            .into_par_iter()
            .map(|heading| search.standing(&sequence, heading))
            .collect();
        Ok(Judged {
            scheme: scheme.clone(),
            standings,
        })
    }
}

/// Rounds on all cores, each after the last is merged, as long as `go_on` says so.
pub fn run(
    search: &Search,
    progress: &mut Progress,
    listener: &dyn Listener,
    mut go_on: impl FnMut(&Progress) -> bool,
) {
    while go_on(progress) {
        let found = (0..CHAINS)
            .into_par_iter()
            .map(|chain| {
                let found = search.chain(progress, chain);
                listener.advance(1);
                found
            })
            .collect();
        search.merge(progress, found);
        if let Some(best) = progress.best.first() {
            listener.task(&format!(
                "best {:.4} of {}",
                best.score, progress.evaluations
            ));
        }
    }
}

/// The value of a goal in the unit in which it was asked, and the unit.
pub(crate) fn in_words(
    goal: &Goal,
    value: f64,
    labels: &[&'static sins::estimation::state::StateLabel],
) -> (f64, &'static str) {
    match goal.measure {
        Measure::TimeBelow { one_s, .. } => (value * one_s / 3600.0, "h"),
        Measure::SigmaAtEnd(one) => labels
            .iter()
            .find(|label| goal.states.first().is_some_and(|name| name == label.name))
            .map_or((value * one, ""), |label| {
                (value * one / label.scale, label.unit)
            }),
    }
}
