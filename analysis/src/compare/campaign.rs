//! The runs of `compare`: which cases there are, and how their work is spread over the cores.

use std::sync::Mutex;

use rayon::prelude::*;
use sins::{
    simulation::{NoiseReading, Ship},
    studies::monte_carlo::{MonteCarlo, RunResult, Statistics, TrueErrors, Voyage, VoyageTrack},
    studies::observability::{
        Setting,
        bound::{self, BoundPoint},
    },
    table::scheme::{Program, Scheme},
    table::{Axis, Turntable},
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
/// Points of a voyage's track \[s\].
pub const TRACK_S: f64 = 300.0;
/// Samples a second in the calibrations before the voyages: what they find does not depend on it.
pub const VOYAGE_CALIBRATION_HZ: f64 = 20.0;
/// Lengths of the voyages \[h\].
pub const VOYAGE_H: [f64; 2] = [24.0, 72.0];
/// Turns of the ship before them \[deg\].
pub const TURNS_DEG: [f64; 2] = [0.0, 90.0];

/// The paper's three simulations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simulation {
    /// At rest.
    Static,
    /// Eight positions about x and y.
    Xy,
    /// The same about y and z.
    Yz,
}

impl Simulation {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Static, Self::Xy, Self::Yz];

    /// Its scheme.
    pub fn scheme(self) -> Scheme {
        match self {
            Self::Static => Scheme::stationary(),
            Self::Xy => Scheme::eight_position(),
            Self::Yz => Scheme::eight_position_yz(),
        }
    }

    /// What the paper calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Xy => "x-y",
            Self::Yz => "y-z",
        }
    }

    /// The tables it runs on, the default one first.
    pub fn tables(self) -> Vec<Turntable> {
        let of = |outer, inner| Turntable { outer, inner };
        match self {
            Self::Static => vec![Turntable::default()],
            Self::Xy => vec![of(Axis::X, Axis::Y), of(Axis::Y, Axis::X)],
            Self::Yz => vec![of(Axis::Y, Axis::Z), of(Axis::Z, Axis::Y)],
        }
    }
}

/// One simulation on one table under one reading of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Which of the three.
    pub simulation: Simulation,
    /// Its table.
    pub table: Turntable,
    /// Noise.
    pub reading: NoiseReading,
}

impl Case {
    /// Every case: simulation, reading, gimbal order.
    pub fn all() -> Vec<Self> {
        let mut cases = Vec::new();
        for reading in [NoiseReading::D, NoiseReading::H] {
            for simulation in Simulation::ALL {
                for table in simulation.tables() {
                    cases.push(Self {
                        simulation,
                        table,
                        reading,
                    });
                }
            }
        }
        cases
    }

    /// Whether the table is the one that the simulation runs on by default.
    pub fn has_default_table(self) -> bool {
        self.table == self.simulation.tables()[0]
    }

    /// Its name in tables and files.
    pub fn name(self) -> String {
        match self.simulation {
            Simulation::Static => format!("{} static", self.reading.letter()),
            other => format!(
                "{} {}, outer {} inner {}",
                self.reading.letter(),
                other.name(),
                self.table.outer,
                self.table.inner
            ),
        }
    }

    /// The program on its table.
    pub fn program(self) -> Result<Program, sins::Error> {
        self.simulation.scheme().program(self.table)
    }
}

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

/// Position errors of many voyages.
#[derive(Clone, Debug, Default)]
pub struct VoyageStatistics {
    /// Since the ship lay still \[s\].
    pub times_s: Vec<f64>,
    /// Sums of squares \[m²\]: with the calibration and without.
    squares: [Vec<f64>; 2],
    /// The greatest of all runs \[m\].
    pub greatest: [Vec<f64>; 2],
    /// Every run's greatest error \[m\], up to each of [`VOYAGE_H`], with and without: 32 bytes a run, for the median.
    pub runs: Vec<[[f64; 2]; 2]>,
}

impl VoyageStatistics {
    fn add(&mut self, track: &VoyageTrack) {
        if self.times_s.is_empty() {
            self.times_s.clone_from(&track.times_s);
            self.squares = [
                vec![0.0; track.times_s.len()],
                vec![0.0; track.times_s.len()],
            ];
            self.greatest.clone_from(&self.squares);
        }
        for (k, errors) in [&track.compensated_m, &track.uncompensated_m]
            .into_iter()
            .enumerate()
        {
            for (i, error) in errors.iter().enumerate() {
                self.squares[k][i] += error * error;
                self.greatest[k][i] = self.greatest[k][i].max(*error);
            }
        }
        self.runs
            .push(VOYAGE_H.map(|h| track.greatest_m(h * 3600.0)));
    }

    fn merge(&mut self, later: Self) {
        if self.times_s.is_empty() {
            *self = later;
            return;
        }
        for k in 0..2 {
            for i in 0..self.times_s.len() {
                self.squares[k][i] += later.squares[k][i];
                self.greatest[k][i] = self.greatest[k][i].max(later.greatest[k][i]);
            }
        }
        self.runs.extend(later.runs);
    }

    /// Root mean square error over the runs at every time \[m\], with the calibration (0) or without (1).
    pub fn rms(&self, which: usize) -> Vec<f64> {
        let runs = self.runs.len().max(1) as f64;
        self.squares[which]
            .iter()
            .map(|s| (s / runs).sqrt())
            .collect()
    }

    /// Median over the runs of the greatest error up to `VOYAGE_H[length]` \[m\].
    pub fn median_greatest(&self, length: usize, which: usize) -> f64 {
        let mut values: Vec<f64> = self.runs.iter().map(|run| run[length][which]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Root mean square over the runs of the greatest error up to `VOYAGE_H[length]` \[m\].
    pub fn rms_greatest(&self, length: usize, which: usize) -> f64 {
        let sum: f64 = self.runs.iter().map(|run| run[length][which].powi(2)).sum();
        (sum / self.runs.len().max(1) as f64).sqrt()
    }

    /// The greatest error of any run up to `VOYAGE_H[length]` \[m\].
    pub fn worst(&self, length: usize, which: usize) -> f64 {
        self.runs
            .iter()
            .map(|run| run[length][which])
            .fold(f64::NAN, f64::max)
    }
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
    /// In the order of [`Case::all`].
    pub cases: Vec<CaseResult>,
    /// Every case at every heading of [`SWEEP_DEG`].
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
            for (statistics, [voyages, drawn]) in done.into_iter().flatten() {
                result.statistics.merge(statistics, TRACES);
                merge(&mut result.voyages, voyages);
                merge(&mut result.drawn_voyages, drawn);
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
        let mut voyages = [Vec::new(), Vec::new()];
        if self.voyages_of(case) {
            // The paper's picture is that of an IMU with the errors of Table 1, whose axes are all alike; IMUs with drawn errors
            // show what that hides.
            let mut table_1 = MonteCarlo {
                errors: Some(TrueErrors::table_1()),
                snapshots_s: Vec::new(),
                ..monte_carlo.clone()
            };
            table_1.plant.imu_rate_hz = self.rate_hz.min(VOYAGE_CALIBRATION_HZ);
            voyages[0] = sail(case, &table_1.run(batch)?, VOYAGE_H[1])?;
            voyages[1] = sail(case, &runs, VOYAGE_H[0])?;
            listener.advance(runs.len() as u64);
        }
        Ok((statistics, voyages))
    }
}

/// Voyages of all these runs, by the turns of [`TURNS_DEG`].
fn sail(case: Case, runs: &[RunResult], hours: f64) -> Result<Vec<VoyageStatistics>, sins::Error> {
    TURNS_DEG
        .iter()
        .map(|turn_deg| {
            let voyage = Voyage {
                turn_rad: turn_deg.to_radians(),
                duration_s: hours * 3600.0,
                noise: case.reading.density(),
                every_s: TRACK_S,
            };
            let mut sum = VoyageStatistics::default();
            for run in runs {
                sum.add(&voyage.sail(&run.departure())?);
            }
            Ok(sum)
        })
        .collect()
}

fn merge(sums: &mut Vec<VoyageStatistics>, later: Vec<VoyageStatistics>) {
    if sums.is_empty() {
        *sums = later;
        return;
    }
    for (sum, later) in sums.iter_mut().zip(later) {
        sum.merge(later);
    }
}
