//! The stripped observability matrix of a piecewise constant system (Goshen-Meskin and Bar-Itzhack 1992).
//!
//! In every dwell F is constant, and the dwell shows the row space of \[H; H F; …; H F¹²\]. What all dwells together show is the
//! row space of these blocks stacked. (It takes the rotations between them to be known and to show nothing themselves.)
//!
//! Rank is counted in natural units: angles in rad, time in 1/ν with ν = √(g/R), the Schuler rate. Then the entries of F are 1 and the
//! earth rate over ν, 0.059, the weakest chain that shows anything takes its square, and rounding is 1e-16:
//! a singular value below [`RANK_TOLERANCE`] of the largest is rounding, and no true one comes near. The report says
//! how near: the smallest value kept and the largest dropped.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::dynamics_at_rest;
use crate::earth::LocalEarth;
use crate::error::Error;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::{MISALIGNMENT, POSITION, VELOCITY};
use crate::estimation::model::{Model, Paper};
use crate::estimation::state::{StateValues, positions};
use crate::simulation::Ship;
use crate::studies::paper;
use crate::table::scheme::{Program, SegmentKind};

/// Singular values below this part of the largest one count as zero.
pub const RANK_TOLERANCE: f64 = 1e-10;
/// Parts of a hidden direction below this (in natural units, largest part 1) are rounding.
const PART: f64 = 1e-8;

/// States of the model.
pub(super) const STATES: usize = Paper::N;
type StateVector = SVector<f64, STATES>;
pub(super) type StateMatrix = SMatrix<f64, STATES, STATES>;

/// Rows of the velocities, which are measured.
pub(super) const MEASURED: [usize; 2] = positions(Paper::LIST, VELOCITY);
const POSITIONS: [usize; 2] = positions(Paper::LIST, POSITION);
const ATTITUDE: [usize; 3] = positions(Paper::LIST, MISALIGNMENT);
const BIASES: [usize; 3] = positions(Paper::LIST, ACCELEROMETER_BIAS);
const DRIFTS: [usize; 3] = positions(Paper::LIST, GYROSCOPE_DRIFT);

/// A combination of errors that the measurements cannot tell from nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenDirection {
    /// SI units, scaled so that its first part is one field unit.
    pub vector: StateValues,
    /// In words, such as "misalignment up 1 arcsec with gyroscope drift x -5.1e-5 deg/h".
    pub words: String,
}

/// After one dwell.
#[derive(Clone, Debug, PartialEq)]
pub struct RankAfterDwell {
    /// Number of the dwell, from 1.
    pub dwell: usize,
    /// Cycle of the program.
    pub cycle: u32,
    /// Name of the position.
    pub position: String,
    /// Number of independent combinations of states shown so far.
    pub rank: usize,
    /// The smallest singular value that counts, over the largest.
    pub smallest_kept: f64,
    /// The largest that does not count, over the largest; zero where all count.
    pub largest_dropped: f64,
    /// What is still hidden.
    pub hidden: Vec<HiddenDirection>,
}

/// Ranks after every dwell of the first `cycles` cycles.
///
/// # Errors
/// [`Error::Setting`] where the ship is nowhere.
pub fn ranks(program: &Program, ship: &Ship, cycles: u32) -> Result<Vec<RankAfterDwell>, Error> {
    ship.validate()?;
    let earth = LocalEarth::at(ship.latitude_rad, ship.height_m);
    let schuler = (earth.gravity_m_s2 / earth.meridian_radius_m).sqrt();
    let units = natural_units(&earth, schuler);
    let attitude = ship.at(0.0).attitude;
    let mut seen = DMatrix::<f64>::zeros(0, STATES);
    let mut ranks = Vec::new();
    let dwells = program
        .segments()
        .take_while(|s| s.cycle < cycles)
        .filter(|s| s.kind == SegmentKind::Dwell && s.end_nanos > s.start_nanos);
    for segment in dwells {
        let block = attitude
            * program
                .table
                .attitude(program.target(segment.cycle, segment.step));
        let attitude = block.to_rotation_matrix().into_inner();
        let f = dynamics_at_rest(&paper::initial_uncertainty().model(), earth, &attitude).dense();
        let natural = StateMatrix::from_fn(|i, j| f[(i, j)] * units[j] / units[i] / schuler);
        seen = triangle(&stack(&seen, &natural));
        ranks.push(RankAfterDwell {
            dwell: ranks.len() + 1,
            cycle: segment.cycle,
            position: program.position(segment.step).to_owned(),
            ..judge(&seen, &units)
        });
    }
    Ok(ranks)
}

/// One natural unit of every state in SI.
fn natural_units(earth: &LocalEarth, schuler: f64) -> StateVector {
    let mut units = StateVector::repeat(1.0);
    for i in MEASURED {
        units[i] = earth.gravity_m_s2 / schuler;
    }
    for i in BIASES {
        units[i] = earth.gravity_m_s2;
    }
    for i in DRIFTS {
        units[i] = schuler;
    }
    units
}

/// `seen` with \[H; H F; …\] below it.
fn stack(seen: &DMatrix<f64>, f: &StateMatrix) -> DMatrix<f64> {
    let mut rows = nalgebra::SMatrix::<f64, 2, STATES>::zeros();
    for (row, state) in MEASURED.into_iter().enumerate() {
        rows[(row, state)] = 1.0;
    }
    let above = seen.nrows();
    let mut stacked = DMatrix::zeros(above + 2 * STATES, STATES);
    stacked.rows_mut(0, above).copy_from(seen);
    for power in 0..STATES {
        stacked.rows_mut(above + 2 * power, 2).copy_from(&rows);
        rows *= f;
    }
    stacked
}

/// The same row space in at most as many rows as columns.
pub(super) fn triangle(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    matrix.clone().qr().r()
}

/// Singular values, descending, with their right singular vectors as rows.
pub(super) fn singular(matrix: &DMatrix<f64>) -> Vec<(f64, SVector<f64, STATES>)> {
    // A square matrix, so that the null space has its vectors too.
    let mut square = DMatrix::zeros(STATES.max(matrix.nrows()), STATES);
    square.rows_mut(0, matrix.nrows()).copy_from(matrix);
    let svd = square.svd(false, true);
    let mut values: Vec<_> = svd.v_t.map_or_else(Vec::new, |v_t| {
        (0..STATES)
            .map(|k| (svd.singular_values[k], SVector::from_fn(|i, _| v_t[(k, i)])))
            .collect()
    });
    values.sort_by(|a, b| b.0.total_cmp(&a.0));
    values
}

fn judge(seen: &DMatrix<f64>, units: &StateVector) -> RankAfterDwell {
    let singular = singular(seen);
    let largest = singular[0].0;
    let counts = |value: f64| value > RANK_TOLERANCE * largest;
    let rank = singular.iter().filter(|(value, _)| counts(*value)).count();
    let null: Vec<_> = singular[rank..].iter().map(|(_, v)| *v).collect();
    RankAfterDwell {
        dwell: 0,
        cycle: 0,
        position: String::new(),
        rank,
        smallest_kept: singular[rank - 1].0 / largest,
        largest_dropped: singular.get(rank).map_or(0.0, |(value, _)| value / largest),
        hidden: sparse_basis(null)
            .into_iter()
            .map(|(first, v)| in_words(first, &v.component_mul(units)))
            .collect(),
    }
}

/// A basis of the same space in which every vector has a leading state that no other has, by Gauss and Jordan: the
/// vectors become combinations that a person can read.
fn sparse_basis(mut basis: Vec<StateVector>) -> Vec<(usize, StateVector)> {
    // Attitude errors lead; sensor errors follow from them. Position stands last but one, velocity is measured.
    let order = [
        POSITIONS[1],
        ATTITUDE[2],
        ATTITUDE[0],
        ATTITUDE[1],
        POSITIONS[0],
        BIASES[2],
        BIASES[0],
        BIASES[1],
        DRIFTS[2],
        DRIFTS[0],
        DRIFTS[1],
        MEASURED[0],
        MEASURED[1],
    ];
    let mut done: Vec<(usize, StateVector)> = Vec::new();
    for state in order {
        let Some(best) = (0..basis.len())
            .max_by(|a, b| basis[*a][state].abs().total_cmp(&basis[*b][state].abs()))
            .filter(|best| basis[*best][state].abs() > 1e-6)
        else {
            continue;
        };
        let mut pivot = basis.swap_remove(best);
        pivot /= pivot[state];
        for other in basis.iter_mut().chain(done.iter_mut().map(|(_, v)| v)) {
            let factor = other[state];
            *other -= pivot * factor;
        }
        done.push((state, pivot));
    }
    for (_, v) in &mut done {
        let largest = v.amax();
        v.iter_mut()
            .filter(|part| part.abs() < PART * largest)
            .for_each(|part| *part = 0.0);
    }
    done
}

fn in_words(first: usize, vector: &StateVector) -> HiddenDirection {
    let vector = vector * (Paper::LIST[first].scale / vector[first]);
    let part = |state: usize| {
        let label = &Paper::LIST[state];
        let value = format!("{:.3}", vector[state] / label.scale);
        // Small parts keep their digits.
        let value = match value.trim_start_matches('-') {
            "1.000" => value.replace("1.000", "1"),
            _ if (vector[state] / label.scale).abs() < 0.01 => {
                format!("{:.2e}", vector[state] / label.scale)
            }
            _ => value,
        };
        format!("{} {value} {}", label.words, label.unit)
    };
    let others: Vec<String> = (0..STATES)
        .filter(|state| *state != first && vector[*state] != 0.0)
        .map(part)
        .collect();
    let words = if others.is_empty() {
        format!("{} alone", Paper::LIST[first].words)
    } else {
        format!("{} with {}", part(first), others.join(", "))
    };
    HiddenDirection {
        vector: StateValues::of(Paper::LIST, &vector),
        words,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::scheme::Scheme;

    fn of(scheme: &Scheme) -> Vec<RankAfterDwell> {
        let program = scheme.program(scheme.default_table()).unwrap();
        ranks(&program, &Ship::default(), 1).unwrap()
    }

    fn first(scheme: &Scheme, count: usize) -> Vec<usize> {
        of(scheme).iter().take(count).map(|r| r.rank).collect()
    }

    /// The ranks of the project's `expected-results`.
    #[test]
    fn ranks_are_the_expected_ones() {
        assert_eq!(first(&Scheme::stationary(), 1), [7]);
        assert_eq!(
            first(&Scheme::eight_position(), 7),
            [7, 9, 10, 10, 10, 12, 12]
        );
        assert_eq!(
            first(&Scheme::eight_position_yz(), 7),
            [7, 10, 11, 11, 11, 12, 12]
        );
    }

    /// Nothing stands near the tolerance: a factor of a thousand above and below.
    #[test]
    fn the_tolerance_is_in_a_wide_gap() {
        for scheme in [Scheme::eight_position(), Scheme::eight_position_yz()] {
            for r in of(&scheme) {
                assert!(
                    r.smallest_kept > 1e3 * RANK_TOLERANCE,
                    "{} {:e}",
                    r.dwell,
                    r.smallest_kept
                );
                assert!(
                    r.largest_dropped < 1e-3 * RANK_TOLERANCE,
                    "{} {:e}",
                    r.dwell,
                    r.largest_dropped
                );
            }
        }
    }

    /// In the end longitude alone is hidden. At rest at heading 0 the level error about east hides behind the north accelerometer
    /// bias, g to one, and the azimuth error behind the east gyroscope, ω cos L to one.
    #[test]
    fn hidden_directions_have_their_names() {
        let end = of(&Scheme::eight_position()).pop().unwrap();
        let words: Vec<_> = end.hidden.iter().map(|h| h.words.as_str()).collect();
        assert_eq!(words, ["longitude error alone"]);
        let still = &of(&Scheme::stationary())[0];
        assert_eq!(still.hidden.len(), 6);
        let azimuth = still
            .hidden
            .iter()
            .find(|h| h.words.starts_with("misalignment up"))
            .unwrap();
        let earth = LocalEarth::at(Ship::default().latitude_rad, 0.0);
        let part = |h: &HiddenDirection, state| h.vector.value(state).unwrap();
        let ratio = part(azimuth, GYROSCOPE_DRIFT[0]) / part(azimuth, MISALIGNMENT[2]);
        assert!(
            (ratio.abs() / earth.earth_rate().y - 1.0).abs() < 1e-6,
            "{}",
            azimuth.words
        );
        let level = still
            .hidden
            .iter()
            .find(|h| h.words.starts_with("misalignment east"))
            .unwrap();
        let ratio = part(level, ACCELEROMETER_BIAS[1]) / part(level, MISALIGNMENT[0]);
        assert!(
            (ratio.abs() / earth.gravity_m_s2 - 1.0).abs() < 1e-6,
            "{}",
            level.words
        );
    }
}
