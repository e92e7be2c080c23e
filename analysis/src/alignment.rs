//! Heading, roll and pitch from the samples up to the first turn of the table.

use std::ops::ControlFlow;

use bags::Sample;
use sins::{
    machines::self_calibration::{Estimate, Event, Phase, SelfCalibration, Settings},
    time::Stamp,
};

/// A joint that is further than this from where it stood at first turns \[rad\].
const TURN_RAD: f64 = 1e-4;

/// An alignment under way.
pub struct Aligner {
    calibrator: SelfCalibration,
    /// The last estimate, and the one before it: the last one may already be of a block that turns.
    aligned: [Option<Estimate>; 2],
    first_joints: Option<[f64; 2]>,
    last_rest: Option<Stamp>,
}

impl Aligner {
    /// One that waits for its first sample.
    ///
    /// # Errors
    /// Where the settings are refused.
    pub fn new(settings: Settings) -> Result<Self, sins::Error> {
        Ok(Self {
            calibrator: SelfCalibration::new(settings)?,
            aligned: [None, None],
            first_joints: None,
            last_rest: None,
        })
    }

    /// Takes a sample; breaks where the block turns.
    ///
    /// # Errors
    /// Where the sample is refused; it is left out.
    pub fn push(
        &mut self,
        sample: &Sample,
        mut tell: impl FnMut(&Event),
    ) -> Result<ControlFlow<()>, sins::Error> {
        let turns = self.joints_turn(sample);
        if let Some(reading) = sample.reading() {
            self.calibrator.push(&reading)?;
        }
        // An IMU without encoders shows by itself that it turns.
        let has_turned = |e: &Estimate| matches!(e.phase, Phase::Calibrating | Phase::Converged);
        let mut turns_by_itself = false;
        while let Some(event) = self.calibrator.poll() {
            tell(&event);
            if let Event::Estimate(estimate) = event {
                turns_by_itself |= has_turned(&estimate);
                if !turns && !turns_by_itself {
                    self.aligned = [Some(*estimate), self.aligned[0].take()];
                }
            }
        }
        Ok(if turns || turns_by_itself {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    }

    fn joints_turn(&mut self, sample: &Sample) -> bool {
        let Sample::Joints(joints) = sample else {
            return false;
        };
        let first = *self.first_joints.get_or_insert(joints.position);
        let moved = |joint: usize| (joints.position[joint] - first[joint]).abs() > TURN_RAD;
        let turns = moved(0) || moved(1);
        if !turns {
            self.last_rest = Some(joints.stamp);
        }
        turns
    }

    /// The last estimate, where it does not stem from a turn.
    pub fn newest(&self) -> Option<&Estimate> {
        self.aligned[0].as_ref()
    }

    /// The alignment.
    ///
    /// # Errors
    /// Why there is none.
    pub fn finish(mut self) -> Result<Estimate, sins::Error> {
        let [last, before] = self.aligned;
        let last_rest = self.last_rest;
        let is_at_rest = |e: &Estimate| last_rest.is_none_or(|rest| e.stamp <= rest);
        match last.filter(is_at_rest).or(before) {
            Some(estimate) => Ok(estimate),
            None => self.calibrator.finish(),
        }
    }
}
