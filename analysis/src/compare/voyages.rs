//! Voyages after calibration, and the sums of many.

use sins::studies::monte_carlo::{RunResult, Voyage, VoyageTrack};

use super::cases::Case;

/// Points of a voyage's track \[s\].
pub const TRACK_S: f64 = 300.0;

/// Lengths of the voyages \[h\].
pub const VOYAGE_H: [f64; 2] = [24.0, 72.0];

/// Turns of the ship before them \[deg\].
pub const TURNS_DEG: [f64; 2] = [0.0, 90.0];

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

/// Voyages of all these runs, by the turns of [`TURNS_DEG`].
pub fn sail(
    case: Case,
    runs: &[RunResult],
    hours: f64,
) -> Result<Vec<VoyageStatistics>, sins::Error> {
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

/// Adds the sums of later runs, turn by turn.
pub fn merge(sums: &mut Vec<VoyageStatistics>, later: Vec<VoyageStatistics>) {
    if sums.is_empty() {
        *sums = later;
        return;
    }
    for (sum, later) in sums.iter_mut().zip(later) {
        sum.merge(later);
    }
}
