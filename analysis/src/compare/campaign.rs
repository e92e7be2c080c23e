//! The runs of `compare`, and how their work is spread over the cores.

use std::sync::Mutex;

use rayon::prelude::*;
use sins::{
    simulation::Ship,
    studies::monte_carlo::{MonteCarlo, Statistics, TrueErrors},
    studies::observability::{
        Setting,
        bound::{self, BoundPoint},
    },
};

use super::{
    cases::Case,
    voyages::{self, VOYAGE_H, VoyageStatistics},
};
use crate::Listener;

/// Runs worked in lockstep on one truth. A constant, so that sums do not depend on the number of cores.
const BATCH: u64 = 5;

/// Batches at hand at a time: memory does not grow with the number of runs.
const WINDOW: usize = 16;

/// Runs whose traces are drawn.
const TRACES: usize = 6;

/// Time between snapshots \[s\].
const SNAPSHOT_S: f64 = 60.0;

/// Headings of the sweep \[deg\].
pub const SWEEP_DEG: [f64; 13] = [
    0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0, 165.0, 180.0,
];

/// Samples a second in the calibrations before the voyages: what they find does not depend on it.
pub const VOYAGE_CALIBRATION_HZ: f64 = 20.0;

/// What the campaign is to do.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Runs of every case.
    pub runs: u64,
    /// Length of calibration \[h\].
    pub hours: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Seed.
    pub seed: u64,
    /// The ship, at the heading of the Monte Carlo.
    pub ship: Ship,
    /// Whether voyages are made.
    pub voyages: bool,
}

/// What became of a case.
pub struct CaseResult {
    /// The case.
    pub case: Case,
    /// Errors of the runs.
    pub statistics: Statistics,
    /// The covariance bound at the heading of the Monte Carlo, every 10 s.
    pub bound: Vec<BoundPoint>,
    /// Position errors of Table 1's IMU by the turns of [`TURNS_DEG`]; empty where no voyages are made.
    pub voyages: Vec<VoyageStatistics>,
    /// The same of IMUs with errors drawn from P0, for the first of [`VOYAGE_H`] only.
    pub drawn_voyages: Vec<VoyageStatistics>,
}

/// The bound of a case at one heading, every minute.
pub struct SweepPoint {
    /// The case.
    pub case: Case,
    /// Heading \[deg\].
    pub heading_deg: f64,
    /// The bound.
    pub bound: Vec<BoundPoint>,
}

/// Everything that was worked out.
pub struct Campaign {
    /// What was asked for.
    pub plan: Plan,
    /// In the order of `Case::all`.
    pub cases: Vec<CaseResult>,
    /// Every case at every heading of `SWEEP_DEG`.
    pub sweep: Vec<SweepPoint>,
}

impl Plan {
    fn voyages_of(&self, case: Case) -> bool {
        self.voyages && case.has_default_table()
    }

    /// Units of progress: one a run, one a pair of voyages.
    pub fn work(&self) -> u64 {
        Case::all()
            .iter()
            .map(|case| self.runs * (1 + u64::from(self.voyages_of(*case))))
            .sum()
    }

    fn monte_carlo(&self, case: Case) -> MonteCarlo {
        let mut monte_carlo = MonteCarlo::paper(case.simulation.scheme(), case.reading.density());
        monte_carlo.plant.turntable = case.table;
        monte_carlo.plant.imu_rate_hz = self.rate_hz;
        monte_carlo.plant.ship = self.ship;
        monte_carlo.duration_s = self.hours * 3600.0;
        monte_carlo.seed = self.seed;
        let count = (monte_carlo.duration_s / SNAPSHOT_S).floor() as u64;
        monte_carlo.snapshots_s = (1..=count).map(|k| k as f64 * SNAPSHOT_S).collect();
        if count as f64 * SNAPSHOT_S < monte_carlo.duration_s {
            monte_carlo.snapshots_s.push(monte_carlo.duration_s);
        }
        monte_carlo
    }

    fn setting(&self, case: Case, heading_deg: f64) -> Setting {
        Setting {
            ship: Ship {
                heading_rad: heading_deg.to_radians(),
                ..self.ship
            },
            duration_s: self.hours * 3600.0,
            noise: case.reading.density(),
            ..Setting::default()
        }
    }

    /// Does all of it.
    ///
    /// # Errors
    /// Where the ship or the rate is refused.
    pub fn run(&self, listener: &dyn Listener) -> Result<Campaign, sins::Error> {
        let cases = Case::all();
        listener.task("covariance bounds over heading");
        let sweep = cases
            .par_iter()
            .flat_map(|case| SWEEP_DEG.par_iter().map(move |heading| (*case, *heading)))
            .map(|(case, heading_deg)| {
                Ok(SweepPoint {
                    case,
                    heading_deg,
                    bound: bound::bound(&case.program()?, &self.setting(case, heading_deg), 60)?,
                })
            })
            .collect::<Result<Vec<_>, sins::Error>>()?;
        let cases = cases
            .into_iter()
            .map(|case| self.run_case(case, listener))
            .collect::<Result<_, _>>()?;
        Ok(Campaign {
            plan: *self,
            cases,
            sweep,
        })
    }

    fn run_case(&self, case: Case, listener: &dyn Listener) -> Result<CaseResult, sins::Error> {
        listener.task(&case.name());
        let monte_carlo = self.monte_carlo(case);
        let heading_deg = self.ship.heading_rad.to_degrees();
        let mut result = CaseResult {
            case,
            statistics: Statistics::default(),
            bound: bound::bound(&case.program()?, &self.setting(case, heading_deg), 10)?,
            voyages: Vec::new(),
            drawn_voyages: Vec::new(),
        };
        let batches: Vec<_> = (0..self.runs)
            .step_by(BATCH as usize)
            .map(|from| from..(from + BATCH).min(self.runs))
            .collect();
        let failed = Mutex::new(None);
        for window in batches.chunks(WINDOW) {
            let done: Vec<_> = window
                .par_iter()
                .map(|batch| {
                    let worked = self.run_batch(&monte_carlo, case, batch.clone(), listener);
                    worked
                        .map_err(|error| failed.lock().map(|mut slot| slot.replace(error)).ok())
                        .ok()
                })
                .collect();
            if let Some(error) = failed.lock().ok().and_then(|mut slot| slot.take()) {
                return Err(error);
            }
            for (statistics, [table_1, drawn]) in done.into_iter().flatten() {
                result.statistics.merge(statistics, TRACES);
                voyages::merge(&mut result.voyages, table_1);
                voyages::merge(&mut result.drawn_voyages, drawn);
            }
        }
        Ok(result)
    }

    fn run_batch(
        &self,
        monte_carlo: &MonteCarlo,
        case: Case,
        batch: std::ops::Range<u64>,
        listener: &dyn Listener,
    ) -> Result<(Statistics, [Vec<VoyageStatistics>; 2]), sins::Error> {
        let mut statistics = Statistics::default();
        let runs = monte_carlo.run(batch.clone())?;
        for run in &runs {
            statistics.add(run, TRACES);
        }
        listener.advance(runs.len() as u64);
        let mut sailed = [Vec::new(), Vec::new()];
        if self.voyages_of(case) {
            // The paper's picture is that of an IMU with the errors of Table 1, whose axes are all alike; IMUs with drawn errors
            // show what that hides.
            let mut table_1 = MonteCarlo {
                errors: Some(TrueErrors::table_1()),
                snapshots_s: Vec::new(),
                ..monte_carlo.clone()
            };
            table_1.plant.imu_rate_hz = self.rate_hz.min(VOYAGE_CALIBRATION_HZ);
            sailed[0] = voyages::sail(case, &table_1.run(batch)?, VOYAGE_H[1])?;
            sailed[1] = voyages::sail(case, &runs, VOYAGE_H[0])?;
            listener.advance(runs.len() as u64);
        }
        Ok((statistics, sailed))
    }
}
