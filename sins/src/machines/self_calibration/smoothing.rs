//! The whole record once more, backwards: every epoch as all readings say it is, those before it and those after it.
//!
//! A [`Smoothing`] drives a machine over the record and keeps its tape. What does not fit into its memory it lets go of, and keeps
//! the machine as it stood at the beginning of such a window instead; on the way back the readings of the window are asked for
//! once more ([`Smoothing::rewind`]). So memory is bounded whatever the length of the record, and the result is the same to the
//! last bit.

use std::collections::VecDeque;
use std::sync::Arc;

use super::{Estimate, Event, SelfCalibration};
use crate::error::Error;
use crate::estimation::groups::antenna::ANTENNA_ARM;
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::estimation::smoother::{Backward, Smoothed, Tape};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::SensorErrors;
use crate::stream::Reading;
use crate::table::TableErrors;
use crate::time::Stamp;

/// Memory for tapes: what four hours of the whole model take at one step a second, and a little more \[bytes\].
pub const TAPE_BYTES: usize = 250_000_000;
/// A window of the record ends when its tape has become so long \[bytes\].
const WINDOW_BYTES: usize = 32_000_000;

/// Readings that are asked for once more, counted from the first one that was pushed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replay {
    /// So many are left aside.
    pub skip: u64,
    /// So many are wanted after them.
    pub count: u64,
}

#[derive(Debug)]
struct Window {
    /// The machine before the first reading of the window.
    begins: Box<SelfCalibration>,
    first: u64,
    tape: Option<Tape>,
}

/// A machine that goes over a record forwards and then backwards.
#[derive(Debug)]
pub struct Smoothing {
    machine: SelfCalibration,
    windows: VecDeque<Window>,
    readings: u64,
    tape_bytes: usize,
    window_bytes: usize,
    /// Where the window ends whose readings are asked for.
    replayed_to: Option<u64>,
    backward: Backward,
    /// The last one first.
    epochs: Vec<Smoothed>,
}

impl Smoothing {
    /// Drives a machine that has not been given anything yet.
    pub fn new(machine: SelfCalibration) -> Self {
        Self::within(machine, TAPE_BYTES)
    }

    /// The same with so much memory for tapes \[bytes\].
    pub fn within(machine: SelfCalibration, tape_bytes: usize) -> Self {
        let mut smoothing = Self {
            windows: VecDeque::new(),
            readings: 0,
            tape_bytes,
            window_bytes: WINDOW_BYTES.min(tape_bytes / 2),
            replayed_to: None,
            backward: Backward::default(),
            epochs: Vec::new(),
            machine,
        };
        smoothing.open_window();
        smoothing
    }

    /// The machine.
    pub fn machine(&self) -> &SelfCalibration {
        &self.machine
    }

    /// Nothing is to be smoothed after all: drops what has been kept, and keeps nothing more.
    pub fn keep_nothing(&mut self) {
        self.machine.record(false);
        self.windows.clear();
    }

    fn open_window(&mut self) {
        let begins = Box::new(self.machine.clone());
        self.machine.record(true);
        self.windows.push_back(Window {
            begins,
            first: self.readings,
            tape: None,
        });
    }

    fn close_window(&mut self) {
        let tape = self.machine.take_tape();
        if let Some(window) = self.windows.back_mut() {
            window.tape = tape;
        }
        let bytes = |window: &Window| window.tape.as_ref().map_or(0, Tape::bytes);
        let mut held: usize = self.windows.iter().map(bytes).sum();
        let newest = self.windows.len().saturating_sub(1);
        for window in self.windows.iter_mut().take(newest) {
            if held <= self.tape_bytes {
                break;
            }
            held -= bytes(window);
            window.tape = None;
        }
    }

    /// As [`SelfCalibration::push`]; what happened before must have been polled.
    ///
    /// # Errors
    /// As there.
    pub fn push(&mut self, reading: &Reading) -> Result<(), Error> {
        if self.machine.tape_bytes() >= self.window_bytes {
            self.close_window();
            self.open_window();
        }
        self.readings += 1;
        self.machine.push(reading)
    }

    /// As [`SelfCalibration::poll`].
    pub fn poll(&mut self) -> Option<Event> {
        self.machine.poll()
    }

    /// As [`SelfCalibration::finish`]: the record is at its end.
    ///
    /// # Errors
    /// As there.
    pub fn finish(&mut self) -> Result<Estimate, Error> {
        let finished = self.machine.finish();
        self.close_window();
        finished
    }

    /// Goes back as far as it can. Where it wants readings once more it says which: hand them to [`Self::again`], and call this
    /// again. `None`: it is at the beginning of the record.
    pub fn rewind(&mut self) -> Option<Replay> {
        if let Some(end) = self.replayed_to.take() {
            let tape = self.machine.take_tape();
            self.go_over(tape);
            self.readings = end;
        }
        while let Some(window) = self.windows.pop_back() {
            if let Some(tape) = window.tape {
                self.go_over(Some(tape));
                self.readings = window.first;
                continue;
            }
            let replay = Replay {
                skip: window.first,
                count: self.readings - window.first,
            };
            self.machine = *window.begins;
            self.machine.record(true);
            self.replayed_to = Some(window.first);
            return Some(replay);
        }
        None
    }

    fn go_over(&mut self, tape: Option<Tape>) {
        if let Some(tape) = tape {
            let epochs = &mut self.epochs;
            self.backward.go_over(tape, |epoch| epochs.push(epoch));
        }
    }

    /// Takes a reading once more. What it was refused for it has been refused for before.
    pub fn again(&mut self, reading: &Reading) {
        let _ = self.machine.push(reading);
        while self.machine.poll().is_some() {}
    }

    /// The smoothed epochs in their order. Before [`Self::rewind`] has come to the beginning they are those from where it stands.
    pub fn into_epochs(mut self) -> Vec<Smoothed> {
        self.epochs.reverse();
        self.epochs
    }
}

/// What a second pass is linear about: the first one's smoothed record, and the sensors as it found them.
///
/// The errors of sensors and alignment enter attitude, velocity and position as products too: a drift of 0.5 deg/h that is
/// integrated in a wrong azimuth of 3 deg is off by 0.03 deg/h. A pass that begins with errors of that size has used up the information of its
/// first minutes about the wrong point. The second pass measures the same, from the same prior, about the trajectory
/// that the first one found: a step of Gauss and Newton on the posterior of the whole record (iterated extended Kalman smoother,
/// Bell 1994, SIAM J. Optimization 4, 626).
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// In the order of their stamps but for clocks that were set back.
    points: Vec<(Stamp, NavigationState)>,
    pub(super) errors: SensorErrors,
    pub(super) table: TableErrors,
    pub(super) antenna_arm_m: nalgebra::Vector3<f64>,
    /// One-sigma of the azimuth at its beginning \[rad\].
    pub(super) azimuth_sigma_rad: f64,
}

impl Guide {
    /// By the smoothed epochs of a record and its last estimate. `None` without an epoch.
    pub fn new(epochs: &[Smoothed], estimate: &Estimate) -> Option<Arc<Self>> {
        let azimuth_sigma_rad = epochs.first()?.sigma(MISALIGNMENT[2])?;
        let mut points: Vec<_> = epochs
            .iter()
            .map(|epoch| (epoch.stamp, epoch.navigation))
            .collect();
        points.sort_by_key(|(stamp, _)| *stamp);
        Some(Arc::new(Self {
            points,
            errors: estimate.errors,
            table: estimate.table,
            antenna_arm_m: estimate.states.value3(&ANTENNA_ARM).unwrap_or_default(),
            azimuth_sigma_rad,
        }))
    }

    /// Attitude, velocity and position at an epoch of the record.
    pub(super) fn at(&self, stamp: Stamp) -> Option<&NavigationState> {
        let at = self
            .points
            .binary_search_by_key(&stamp, |(stamp, _)| *stamp);
        Some(&self.points[at.ok()?].1)
    }
}
