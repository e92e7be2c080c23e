//! What the simulation and the sequencer say, as messages: the one function that both the nodes and simulated bags use.

use nalgebra::{UnitQuaternion, Vector3};
use sins::sensor::errors::SensorErrors;
use sins::simulation::{PositionFix, ShipState, VelocityFix};
use sins::table::scheme::sequencer::{Command, State, Status};
use sins::time::Stamp;

use crate::convert::row_major;
use crate::geometry_msgs::TwistWithCovarianceStamped;
use crate::nav_msgs::Odometry;
use crate::sensor_msgs::{NavSatFix, NavSatStatus};
use crate::std_msgs::Header;
use crate::trajectory_msgs::JointTrajectory;
use crate::{Calibration, SchemeStatus};

/// Ours is a local East-North-Up frame.
const MAP: &str = "map";
const IMU_LINK: &str = "imu_link";

impl From<&PositionFix> for NavSatFix {
    fn from(fix: &PositionFix) -> Self {
        let mut message = Self {
            header: Header::new(fix.stamp, "base_link"),
            status: NavSatStatus {
                status: NavSatStatus::STATUS_FIX,
                service: NavSatStatus::SERVICE_GPS,
            },
            latitude: fix.latitude_rad.to_degrees(),
            longitude: fix.longitude_rad.to_degrees(),
            altitude: fix.height_m,
            position_covariance_type: Self::COVARIANCE_TYPE_DIAGONAL_KNOWN,
            ..Self::default()
        };
        for axis in 0..3 {
            message.position_covariance[4 * axis] = fix.variance_m2[axis];
        }
        message
    }
}

impl From<&VelocityFix> for TwistWithCovarianceStamped {
    /// East, North, Up; nothing is said of the angular rate (variance −1).
    fn from(fix: &VelocityFix) -> Self {
        let mut message = Self {
            header: Header::new(fix.stamp, MAP),
            ..Self::default()
        };
        message.twist.twist.linear = fix.velocity.into();
        for axis in 0..3 {
            message.twist.covariance[7 * axis] = fix.variance[axis];
            message.twist.covariance[7 * (axis + 3)] = -1.0;
        }
        message
    }
}

impl Odometry {
    /// The true pose of the sensor block, East-North-Up from where the ship rests, its velocity and its rate in its own axes.
    pub fn of_block(
        stamp: Stamp,
        attitude: UnitQuaternion<f64>,
        velocity: Vector3<f64>,
        rate: Vector3<f64>,
    ) -> Self {
        let mut message = Self {
            header: Header::new(stamp, MAP),
            child_frame_id: IMU_LINK.to_owned(),
            ..Self::default()
        };
        message.pose.pose.orientation = attitude.into();
        message.twist.twist.linear = (attitude.inverse() * velocity).into();
        message.twist.twist.angular = rate.into();
        message
    }
}

impl Calibration {
    /// The truth of a simulated sensor block: no uncertainty.
    pub fn ground_truth(
        stamp: Stamp,
        errors: &SensorErrors,
        attitude: UnitQuaternion<f64>,
        ship: &ShipState,
    ) -> Self {
        Self {
            header: Header::new(stamp, IMU_LINK),
            valid: true,
            converged: true,
            gyroscope_drift: errors.gyroscope_drift.into(),
            accelerometer_bias: errors.accelerometer_bias.into(),
            gyroscope_matrix: row_major(&errors.gyroscope_matrix),
            accelerometer_matrix: row_major(&errors.accelerometer_matrix),
            attitude: attitude.into(),
            latitude_deg: ship.latitude_rad.to_degrees(),
            longitude_deg: ship.longitude_rad.to_degrees(),
            height_m: ship.height_m,
            source: "ground truth".to_owned(),
            ..Self::default()
        }
    }
}

impl From<&Command> for JointTrajectory {
    /// Stamp zero where the motion starts at once.
    fn from(command: &Command) -> Self {
        let mut message = Self::from(&command.trajectory);
        if let Some(start) = command.start {
            message.header.stamp = start.into();
        }
        message
    }
}

impl From<&Status> for SchemeStatus {
    fn from(status: &Status) -> Self {
        let rotation = status.rotation;
        Self {
            header: Header::new(status.stamp, ""),
            scheme: status.scheme.clone(),
            state: match status.state {
                State::Idle => Self::IDLE,
                State::WaitingForTable => Self::WAITING_FOR_TABLE,
                State::Dwelling => Self::DWELLING,
                State::Rotating => Self::ROTATING,
                State::Paused => Self::PAUSED,
                State::Aborted => Self::ABORTED,
                State::Finished => Self::FINISHED,
                State::Fault => Self::FAULT,
            },
            cycle: status.cycle,
            step: status.step,
            steps_per_cycle: status.steps_per_cycle,
            position: status.position.clone(),
            rotation_joint: rotation.map_or_else(String::new, |r| r.joint.name().to_owned()),
            rotation_axis: rotation.map_or_else(String::new, |r| r.axis.to_string()),
            rotation_angle_rad: rotation.map_or(0.0, |r| r.angle_rad),
            elapsed: status.elapsed_s,
            remaining: status.remaining_s.unwrap_or(-1.0),
            target: status.target,
            message: status.message.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fix keeps its place in degrees and its variance on the diagonal.
    #[test]
    fn fix_in_degrees_with_variance() {
        let fix = PositionFix {
            stamp: Stamp::from_nanos(5),
            latitude_rad: 0.5,
            longitude_rad: -1.0,
            height_m: 3.0,
            variance_m2: Vector3::new(1.0, 2.0, 4.0),
        };
        let message = NavSatFix::from(&fix);
        assert!((message.latitude - 28.647_889_756_541_16).abs() < 1e-12);
        assert_eq!(
            message.position_covariance,
            [1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 4.0]
        );
        assert_eq!(message.header.stamp.nanosec, 5);
    }

    /// A velocity's variances stand on the first half of the diagonal of 6×6.
    #[test]
    fn velocity_with_variance() {
        let fix = VelocityFix {
            stamp: Stamp::default(),
            velocity: Vector3::new(1.0, 2.0, 3.0),
            variance: Vector3::repeat(1e-4),
        };
        let message = TwistWithCovarianceStamped::from(&fix);
        assert_eq!(message.velocity_measurement().east_north, [1.0, 2.0]);
        assert!((message.velocity_measurement().sigma[1] - 0.01).abs() < 1e-15);
        assert_eq!(message.twist.covariance[35], -1.0);
    }

    /// A commanded start is the stamp of the trajectory; none is zero.
    #[test]
    fn start_is_the_stamp() {
        let mut command = Command {
            start: Some(Stamp::from_nanos(7)),
            trajectory: sins::table::Trajectory::default(),
        };
        assert_eq!(JointTrajectory::from(&command).header.stamp.nanosec, 7);
        command.start = None;
        assert_eq!(JointTrajectory::from(&command).header, Header::default());
    }
}
