//! What many runs amount to, in the memory of one.

use nalgebra::SVector;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{RunResult, Snapshot};
use crate::estimation::state::StateValues;
use crate::studies::paper::{CALIBRATED, CALIBRATED_STATES};

/// One run's errors over time, for a picture.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Number of the run.
    pub run: u64,
    /// Error of misalignment, biases and drifts at the time of every [`Point`], SI.
    pub errors: Vec<StateValues>,
}

/// Sums over the runs at one time.
#[derive(Clone, Debug)]
pub struct Point {
    /// Since the start \[s\].
    pub time_s: f64,
    runs: u64,
    squares: SVector<f64, CALIBRATED_STATES>,
    normalized_squares: SVector<f64, CALIBRATED_STATES>,
    variances: SVector<f64, CALIBRATED_STATES>,
    nees: f64,
    nees_runs: u64,
}

impl Point {
    fn new(time_s: f64) -> Self {
        Self {
            time_s,
            runs: 0,
            squares: SVector::zeros(),
            normalized_squares: SVector::zeros(),
            variances: SVector::zeros(),
            nees: 0.0,
            nees_runs: 0,
        }
    }

    fn add(&mut self, snapshot: &Snapshot) {
        let (error, sigma) = (snapshot.calibrated_error(), snapshot.calibrated_sigma());
        self.runs += 1;
        self.squares += error.component_mul(&error);
        self.variances += sigma.component_mul(&sigma);
        self.normalized_squares += error.component_div(&sigma).map(|ratio| ratio * ratio);
        if let Some(nees) = snapshot.nees() {
            self.nees += nees;
            self.nees_runs += 1;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.runs += other.runs;
        self.squares += other.squares;
        self.variances += other.variances;
        self.normalized_squares += other.normalized_squares;
        self.nees += other.nees;
        self.nees_runs += other.nees_runs;
    }

    /// Root mean square error over the runs, SI.
    pub fn rms(&self) -> StateValues {
        roots(&(self.squares / self.runs as f64))
    }

    /// One-sigma that the filters give, root mean square over the runs, SI.
    pub fn sigma(&self) -> StateValues {
        roots(&(self.variances / self.runs as f64))
    }

    /// Root mean square of error over its own sigma; 1 where the filter is consistent.
    pub fn rms_over_sigma(&self) -> StateValues {
        roots(&(self.normalized_squares / self.runs as f64))
    }

    /// Mean normalized estimation error squared of the nine; 9 where the filter is consistent.
    pub fn mean_nees(&self) -> Option<f64> {
        (self.nees_runs > 0).then(|| self.nees / self.nees_runs as f64)
    }
}

fn roots(squares: &SVector<f64, CALIBRATED_STATES>) -> StateValues {
    StateValues::of(&CALIBRATED, &squares.map(f64::sqrt))
}

/// Sums over any number of runs, and the traces of the first few.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    /// Number of runs.
    pub runs: u64,
    /// At the times of the snapshots.
    pub points: Vec<Point>,
    /// Of the runs with the lowest numbers.
    pub traces: Vec<Trace>,
}

impl Statistics {
    /// Adds a run; its trace too, as long as there are fewer than `traces`.
    pub fn add(&mut self, run: &RunResult, traces: usize) {
        if self.points.is_empty() {
            self.points = run.snapshots.iter().map(|s| Point::new(s.time_s)).collect();
        }
        self.runs += 1;
        for (point, snapshot) in self.points.iter_mut().zip(&run.snapshots) {
            point.add(snapshot);
        }
        if self.traces.len() < traces {
            self.traces.push(Trace {
                run: run.run,
                errors: run
                    .snapshots
                    .iter()
                    .map(|s| StateValues::of(&CALIBRATED, &s.calibrated_error()))
                    .collect(),
            });
        }
    }

    /// Adds the sums of later runs, keeping at most `traces` traces. Merging in the order of the runs gives the same
    /// numbers to the last bit, however many threads worked.
    pub fn merge(&mut self, later: Self, traces: usize) {
        if self.points.is_empty() {
            *self = later;
            return;
        }
        self.runs += later.runs;
        for (point, other) in self.points.iter_mut().zip(&later.points) {
            point.merge(other);
        }
        self.traces.extend(later.traces);
        self.traces.truncate(traces);
    }

    /// The last point.
    pub fn end(&self) -> Option<&Point> {
        self.points.last()
    }
}

/// Bounds between which the mean NEES of `runs` runs lies with probability `confidence`, for consistent filters: chi-square of
/// `runs` · 9 degrees over `runs`.
pub fn mean_nees_bounds(runs: u64, confidence: f64) -> [f64; 2] {
    let degrees = (runs.max(1) * CALIBRATED_STATES as u64) as f64;
    let tail = 0.5 * (1.0 - confidence);
    // The distribution exists for every positive number of degrees.
    ChiSquared::new(degrees).map_or([0.0, f64::INFINITY], |d| {
        [tail, 1.0 - tail].map(|p| d.inverse_cdf(p) / runs.max(1) as f64)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::simulation::NoiseReading;
    use crate::studies::monte_carlo::MonteCarlo;
    use crate::table::scheme::Scheme;

    /// The table's bounds: chi-square of 9 degrees between 2.700 and 19.023 (95 %); of many runs close to 9.
    #[test]
    fn nees_bounds_are_those_of_the_table() {
        let [low, high] = mean_nees_bounds(1, 0.95);
        assert!((low - 2.700).abs() < 1e-3 && (high - 19.023).abs() < 1e-3);
        let [low, high] = mean_nees_bounds(400, 0.95);
        assert!(low > 8.5 && high < 9.5);
    }

    /// Sums in batches are the sums of all, and are those of the runs by hand.
    #[test]
    fn batches_add_up() {
        let mut monte_carlo =
            MonteCarlo::paper(Scheme::eight_position(), NoiseReading::D.density());
        monte_carlo.plant.imu_rate_hz = 10.0;
        monte_carlo.duration_s = 600.0;
        monte_carlo.snapshots_s = vec![300.0, 600.0];
        let runs = monte_carlo.run(0..4).unwrap();
        let (mut merged, mut all) = (Statistics::default(), Statistics::default());
        for half in [0..2, 2..4] {
            let mut part = Statistics::default();
            for run in &monte_carlo.run(half).unwrap() {
                part.add(run, 3);
            }
            merged.merge(part, 3);
        }
        for run in &runs {
            all.add(run, 3);
        }
        assert_eq!((merged.runs, merged.traces.len()), (4, 3));
        let name = CALIBRATED[8].name;
        let by_hand = runs
            .iter()
            .map(|r| r.snapshots[1].error.value(name).unwrap().powi(2))
            .sum::<f64>();
        let rms = (by_hand / 4.0).sqrt();
        assert!((all.end().unwrap().rms().value(name).unwrap() / rms - 1.0).abs() < 1e-12);
        assert!((merged.end().unwrap().rms().value(name).unwrap() / rms - 1.0).abs() < 1e-12);
        assert_eq!(merged.traces[2].errors, all.traces[2].errors);
    }
}
