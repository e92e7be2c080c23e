//! How often the judge is wrong: drawn worlds by kind, on all cores.

mod page;
mod summary;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use sins::machines::self_calibration::ModelChoice;
use sins::studies::assurance::{KINDS, Kind, Outcome};

pub use page::page;
pub use summary::{KindRow, Rate, Report, summarize, text};

use crate::Listener;

/// Each of both mistakes may happen in so many of the worlds.
pub const AT_MOST: f64 = 0.01;

/// What is to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// So many worlds; the kinds come in turn.
    pub worlds: u64,
    /// Decides all of them.
    pub seed: u64,
    /// Model of the filter that is judged.
    pub model: ModelChoice,
}

/// A world with what became of it.
#[derive(Debug)]
pub struct Trial {
    /// Of which kind.
    pub kind: &'static Kind,
    /// What became of it; an error where there is no estimate at all: a world that was refused.
    pub outcome: Result<Outcome, sins::Error>,
}

/// Runs every world.
pub fn run(plan: &Plan, listener: &dyn Listener) -> Vec<Trial> {
    listener.task("worlds");
    (0..plan.worlds)
        .into_par_iter()
        .map(|world| {
            let kind = &KINDS[(world % KINDS.len() as u64) as usize];
            let outcome = kind.draw(plan.seed, world, plan.model).run();
            listener.advance(1);
            Trial { kind, outcome }
        })
        .collect()
}
