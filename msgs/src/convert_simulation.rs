//! What the simulation and the sequencer say, as messages: the one function that both the nodes and simulated bags use.

use nalgebra::{UnitQuaternion, Vector3};
use ros2_interfaces::geometry_msgs::{Point, TwistWithCovarianceStamped};
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{NavSatFix, NavSatStatus};
use ros2_interfaces::trajectory_msgs::JointTrajectory;
use sins::machines::self_calibration::named_errors;
use sins::simulation::{PositionFix, Simulator, VelocityFix};
use sins::table::scheme::sequencer::{Command, State, Status};
use sins::time::Stamp;

use crate::convert::{ToMessage, header, row_major};
use crate::{Calibration, SchemeStatus};

/// Ours is a local East-North-Up frame.
const MAP: &str = "map";
const IMU_LINK: &str = "imu_link";

impl ToMessage<NavSatFix> for PositionFix {
    fn to_message(&self) -> NavSatFix {
        let mut message = NavSatFix {
            header: header(self.stamp, "base_link"),
            status: NavSatStatus {
                status: NavSatStatus::STATUS_FIX,
                service: NavSatStatus::SERVICE_GPS,
            },
            latitude: self.latitude_rad.to_degrees(),
            longitude: self.longitude_rad.to_degrees(),
            altitude: self.height_m,
            position_covariance_type: if self.variance_m2 == Vector3::zeros() {
                NavSatFix::COVARIANCE_TYPE_UNKNOWN
            } else {
                NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN
            },
            ..NavSatFix::default()
        };
        for axis in 0..3 {
            message.position_covariance[4 * axis] = self.variance_m2[axis];
        }
        message
    }
}

impl ToMessage<TwistWithCovarianceStamped> for VelocityFix {
    /// East, North, Up; nothing is said of the angular rate (variance −1).
    fn to_message(&self) -> TwistWithCovarianceStamped {
        let mut message = TwistWithCovarianceStamped {
            header: header(self.stamp, MAP),
            ..TwistWithCovarianceStamped::default()
        };
        message.twist.twist.linear = self.velocity.into();
        for axis in 0..3 {
            message.twist.covariance[7 * axis] = self.variance[axis];
            message.twist.covariance[7 * (axis + 3)] = -1.0;
        }
        message
    }
}

/// The true pose of the sensor block, East-North-Up from where the ship began, its velocity and its rate in its own axes.
pub fn odometry_of_block(
    stamp: Stamp,
    place: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
) -> Odometry {
    let mut message = Odometry {
        header: header(stamp, MAP),
        child_frame_id: IMU_LINK.to_owned(),
        ..Odometry::default()
    };
    message.pose.pose.position = Point {
        x: place.x,
        y: place.y,
        z: place.z,
    };
    message.pose.pose.orientation = attitude.into();
    message.twist.twist.linear = (attitude.inverse() * velocity).into();
    message.twist.twist.angular = rate.into();
    message
}

impl Calibration {
    /// The truth of a simulated sensor block: no uncertainty.
    pub fn ground_truth(simulator: &Simulator) -> Self {
        let (plant, errors) = (simulator.plant(), simulator.sensor_errors());
        let (ship, table) = (plant.ship(), &plant.settings().table_errors);
        let (names, state): (Vec<&str>, _) = named_errors(&errors, table).into_iter().unzip();
        Self {
            header: header(plant.now(), IMU_LINK),
            valid: true,
            converged: true,
            gyroscope_drift: errors.gyroscope_drift.into(),
            accelerometer_bias: errors.accelerometer_bias.into(),
            gyroscope_matrix: row_major(&errors.gyroscope_matrix),
            accelerometer_matrix: row_major(&errors.accelerometer_matrix),
            attitude: plant.attitude().into(),
            latitude_deg: ship.latitude_rad.to_degrees(),
            longitude_deg: ship.longitude_rad.to_degrees(),
            height_m: ship.height_m,
            source: "ground truth".to_owned(),
            state_names: names.into_iter().map(str::to_owned).collect(),
            state,
            ..Self::default()
        }
    }
}

impl ToMessage<JointTrajectory> for Command {
    /// Stamp zero where the motion starts at once.
    fn to_message(&self) -> JointTrajectory {
        let mut message: JointTrajectory = self.trajectory.to_message();
        if let Some(start) = self.start {
            message.header.stamp = start.to_message();
        }
        message
    }
}

impl ToMessage<SchemeStatus> for Status {
    fn to_message(&self) -> SchemeStatus {
        let rotation = self.rotation;
        SchemeStatus {
            header: header(self.stamp, ""),
            scheme: self.scheme.clone(),
            state: match self.state {
                State::Idle => SchemeStatus::IDLE,
                State::WaitingForTable => SchemeStatus::WAITING_FOR_TABLE,
                State::Dwelling => SchemeStatus::DWELLING,
                State::Rotating => SchemeStatus::ROTATING,
                State::Paused => SchemeStatus::PAUSED,
                State::Aborted => SchemeStatus::ABORTED,
                State::Finished => SchemeStatus::FINISHED,
                State::Fault => SchemeStatus::FAULT,
            },
            cycle: self.cycle,
            step: self.step,
            steps_per_cycle: self.steps_per_cycle,
            position: self.position.clone(),
            rotation_joint: rotation.map_or_else(String::new, |r| r.joint.name().to_owned()),
            rotation_axis: rotation.map_or_else(String::new, |r| r.axis.to_string()),
            rotation_angle_rad: rotation.map_or(0.0, |r| r.angle_rad),
            elapsed: self.elapsed_s,
            remaining: self.remaining_s.unwrap_or(-1.0),
            target: self.target,
            message: self.message.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use ros2_interfaces::std_msgs::Header;

    use super::*;
    use crate::convert::velocity_from_twist;

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
        let message: NavSatFix = fix.to_message();
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
        let message = fix.to_message();
        assert_eq!(velocity_from_twist(&message).east_north, [1.0, 2.0]);
        assert!((velocity_from_twist(&message).sigma[1] - 0.01).abs() < 1e-15);
        assert_eq!(message.twist.covariance[35], -1.0);
    }

    /// A commanded start is the stamp of the trajectory; none is zero.
    #[test]
    fn start_is_the_stamp() {
        let mut command = Command {
            start: Some(Stamp::from_nanos(7)),
            trajectory: sins::table::Trajectory::default(),
        };
        assert_eq!(command.to_message().header.stamp.nanosec, 7);
        command.start = None;
        assert_eq!(command.to_message().header, Header::default());
    }
}
