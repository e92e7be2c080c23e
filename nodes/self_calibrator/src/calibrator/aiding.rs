//! What the ship and the table tell besides samples: positions, velocities, joints.

use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::sensor_msgs::{JointState, NavSatFix};
use rotary_sins_msgs::convert::{
    FromMessage, fix_from_message, stamp_from_time, velocity_from_twist,
};
use sins::table::JointSample;

use super::Calibrator;
use crate::translation;

impl Calibrator {
    /// A position of the ship.
    pub fn fix(&mut self, fix: &NavSatFix) {
        self.inputs.fix.arrived(1);
        if let Some((kind, reason)) = translation::refusal(fix) {
            self.inputs.fix.refuse(kind, reason);
        } else if let Some(fix) = fix_from_message(fix)
            && let Err(error) = self.machine.push_fix(fix)
        {
            self.inputs.fix.refuse("off the globe", error);
        }
        self.follow_phase();
    }

    /// A reading of the joints.
    pub fn joints(&mut self, joints: &JointState) {
        self.inputs.joints.arrived(1);
        match JointSample::from_message(joints) {
            Ok(sample) => {
                if let Some(waking) = &mut self.waking {
                    waking.joints(sample);
                }
                if let Err(error) = self.machine.push_joints(sample) {
                    self.inputs.joints.refuse("not finite", error);
                }
            }
            Err(error) => self.inputs.joints.refuse("other joints", error),
        }
    }

    /// A velocity of the ship.
    pub fn velocity(&mut self, velocity: &TwistWithCovarianceStamped) {
        self.inputs.velocity.arrived(1);
        let measurement = velocity_from_twist(velocity);
        if let Err(error) = self
            .machine
            .push_velocity(stamp_from_time(velocity.header.stamp), measurement)
        {
            self.inputs.velocity.refuse("unusable", error);
        }
    }
}
