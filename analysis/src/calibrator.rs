//! Self-calibration fed from a bag.

use bags::Sample;
use sins::{
    machines::self_calibration::{Estimate, SelfCalibration, Settings},
    stream::stamp_order::{InOrder, StampOrder},
};

/// Self-calibration with its samples in the order of their stamps, as the node has it.
pub struct Calibrator {
    /// The machine.
    pub machine: SelfCalibration,
    order: StampOrder,
}

impl Calibrator {
    /// Waits for its first sample.
    ///
    /// # Errors
    /// Where a setting is refused.
    pub fn new(settings: &Settings) -> Result<Self, sins::Error> {
        Ok(Self {
            machine: SelfCalibration::new(*settings)?,
            order: StampOrder::new(0.0),
        })
    }

    /// Hands a sample to the machine. Positions that the receiver did not have are left aside.
    ///
    /// # Errors
    /// What the machine refuses.
    pub fn ingest(&mut self, sample: &Sample) -> Result<Option<Estimate>, sins::Error> {
        match sample {
            Sample::Imu(imu) => {
                self.order.push_sample(*imu);
                while let Some(next) = self.order.next() {
                    if let InOrder::Joints(joints) = next {
                        self.machine.ingest_joints(joints)?;
                    }
                }
                return self.machine.ingest_imu(imu);
            }
            Sample::Joints(joints) => self.order.push_joints(*joints),
            Sample::Fix(fix) => fix
                .position
                .map_or(Ok(()), |position| self.machine.ingest_position(position))?,
            Sample::Velocity(stamp, velocity) => self.machine.ingest_velocity(*stamp, *velocity)?,
        }
        Ok(None)
    }
}
