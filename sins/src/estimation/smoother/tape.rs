//! What the filter did, in the order in which it did it, as the way back needs it.

use nalgebra::{SMatrix, SVector};

use crate::estimation::measurement::Row;
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::time::Stamp;

/// Which states a tape is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimation) struct Shape {
    /// Labels of all of them.
    pub(in crate::estimation) labels: &'static [StateLabel],
    /// So many move.
    pub(in crate::estimation) moving: usize,
    /// The first so many are smoothed: those that move, and the parameters that may walk.
    pub(in crate::estimation) smoothed: usize,
    /// Row of the vertical velocity, before which the height stands.
    pub(in crate::estimation) velocity_up: Option<usize>,
}

/// One thing that the filter did. Its numbers stand in the tape's own list, those of the last one last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark {
    /// A covariance step: the rows of Φ of the moving states, one after the other, and the diagonal of D where it decays.
    Step { decays: bool },
    /// A scalar update: ν, s, the gain, then pairs of a state and its coefficient in h.
    Update { coefficients: usize },
    /// A state was forgotten.
    Forgotten(usize),
    /// All states are new but those from the first to before the second.
    Epoch([usize; 2]),
    /// Everything is new.
    Break,
    /// An epoch that is to be smoothed: quaternion, velocity, position; values of the smoothed states; their columns of P.
    Point(Stamp),
}

/// Length of a navigation state among the numbers.
pub(super) const NAVIGATION: usize = 10;

/// The record of a filter. A stretch of it may be taken out at any time; the next one begins where it ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Tape {
    shape: Shape,
    numbers: Vec<f64>,
    marks: Vec<Mark>,
}

impl Tape {
    pub(in crate::estimation) fn new(shape: Shape) -> Self {
        Self {
            shape,
            numbers: Vec::new(),
            marks: Vec::new(),
        }
    }

    pub(super) fn shape(&self) -> &Shape {
        &self.shape
    }

    pub(super) fn into_parts(self) -> (Vec<Mark>, Vec<f64>) {
        (self.marks, self.numbers)
    }

    /// Memory that it holds \[bytes\].
    pub fn bytes(&self) -> usize {
        self.numbers.len() * size_of::<f64>() + self.marks.len() * size_of::<Mark>()
    }

    /// Whether nothing has been written.
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// Takes out what has been written; the tape goes on empty.
    #[must_use]
    pub fn take(&mut self) -> Self {
        let empty = Self::new(self.shape);
        std::mem::replace(self, empty)
    }

    /// Goes on with what another one of the same filter has.
    pub fn append(&mut self, mut later: Self) {
        self.numbers.append(&mut later.numbers);
        self.marks.append(&mut later.marks);
    }

    /// Attitude, velocity and position begin anew, and so does the base; what is known of the sensors goes on.
    pub fn epoch(&mut self, base: Option<usize>) {
        let first = self.shape.moving;
        let last = base.unwrap_or(self.shape.labels.len());
        self.marks.push(Mark::Epoch([first, last]));
    }

    /// Everything begins anew.
    pub fn cut(&mut self) {
        self.marks.push(Mark::Break);
    }

    pub(in crate::estimation) fn step<const M: usize, const N: usize>(
        &mut self,
        rows: &SMatrix<f64, N, M>,
        decay: Option<&SVector<f64, N>>,
    ) {
        self.numbers.extend_from_slice(rows.as_slice());
        self.numbers
            .extend(decay.iter().flat_map(|decay| decay.iter()));
        self.marks.push(Mark::Step {
            decays: decay.is_some(),
        });
    }

    pub(in crate::estimation) fn update<const N: usize>(
        &mut self,
        row: &Row<N>,
        gain: &SVector<f64, N>,
        innovation: f64,
        variance: f64,
    ) {
        self.numbers.extend([innovation, variance]);
        self.numbers.extend_from_slice(gain.as_slice());
        let before = self.numbers.len();
        let entries = row.entries();
        self.numbers
            .extend(entries.flat_map(|(state, coefficient)| [state as f64, coefficient]));
        self.marks.push(Mark::Update {
            coefficients: (self.numbers.len() - before) / 2,
        });
    }

    pub(in crate::estimation) fn forgotten(&mut self, state: usize) {
        self.marks.push(Mark::Forgotten(state));
    }

    /// An epoch that is to be smoothed: the mechanization as it stands, and all values of the filter beside it (of what
    /// moves, what has not been fed back).
    pub(in crate::estimation) fn point<const N: usize>(
        &mut self,
        stamp: Stamp,
        navigation: &NavigationState,
        values: &SVector<f64, N>,
        covariance: &SMatrix<f64, N, N>,
    ) {
        let NavigationState {
            attitude,
            velocity: v,
            position: p,
        } = navigation;
        let q = attitude.coords;
        self.numbers.extend([q.x, q.y, q.z, q.w, v.x, v.y, v.z]);
        self.numbers
            .extend([p.latitude_rad, p.longitude_rad, p.height_m]);
        let smoothed = self.shape.smoothed;
        self.numbers
            .extend_from_slice(&values.as_slice()[..smoothed]);
        self.numbers
            .extend_from_slice(&covariance.as_slice()[..smoothed * N]);
        self.marks.push(Mark::Point(stamp));
    }
}
