//! Self-calibration fed from a bag.

use bags::Sample;
use sins::machines::self_calibration::{Event, SelfCalibration, Settings};

/// Self-calibration that takes the samples of a bag as they come; the machine itself puts them in order.
pub struct Calibrator {
    /// The machine.
    pub machine: SelfCalibration,
}

impl Calibrator {
    /// Waits for its first sample.
    ///
    /// # Errors
    /// Where a setting is refused.
    pub fn new(settings: &Settings) -> Result<Self, sins::Error> {
        Ok(Self {
            machine: SelfCalibration::new(settings.clone())?,
        })
    }

    /// Hands a sample to the machine. Positions that the receiver did not have are left aside.
    ///
    /// # Errors
    /// What the machine refuses.
    pub fn push(&mut self, sample: &Sample) -> Result<(), sins::Error> {
        match sample {
            Sample::Imu(imu) => {
                self.machine.push_imu(imu);
                Ok(())
            }
            Sample::Joints(joints) => self.machine.push_joints(*joints),
            Sample::Fix(fix) => fix
                .position
                .map_or(Ok(()), |position| self.machine.push_position(position)),
            Sample::Velocity(stamp, velocity) => self.machine.push_velocity(*stamp, *velocity),
        }
    }

    /// What happened next; `None` until more has been pushed.
    pub fn poll(&mut self) -> Option<Event> {
        self.machine.poll()
    }
}
