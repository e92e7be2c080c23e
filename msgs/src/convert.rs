//! Messages to samples and back: the one function that both the DDS path and the bag path use.

use nalgebra::{Matrix3, SMatrix, Vector3};
use ros2_interfaces::{
    builtin_interfaces::{Duration, Time},
    geometry_msgs::TwistWithCovarianceStamped,
    sensor_msgs::{Imu, JointState, NavSatFix, NavSatStatus},
    std_msgs::Header,
    trajectory_msgs::{JointTrajectory, JointTrajectoryPoint},
};
use sins::{
    earth::Position,
    estimation::filter::VelocityMeasurement,
    sensor::{PositionMeasurement, sample::ImuSample},
    table::{JOINT_NAMES, JointSample, Trajectory, Waypoint, Waypoints},
    time::{NANOS_PER_SECOND, Stamp},
};

/// What the mathematics makes of a message. (Both ends are types of other crates, so that `From` cannot stand here.)
pub trait FromMessage<Message>: Sized {
    /// Reads a message.
    ///
    /// # Errors
    /// Why it cannot be used.
    fn from_message(message: &Message) -> Result<Self, ConvertError>;
}

/// What the mathematics has to say as a message.
pub trait ToMessage<Message> {
    /// Makes the message.
    fn to_message(&self) -> Message;
}

pub use crate::convert_simulation::odometry_of_block;

/// Why a message cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConvertError {
    /// A joint that the table has is not in the message.
    #[error("joint {joint} is missing, the message has {}", listed(found))]
    MissingJoint {
        /// Name of the joint.
        joint: &'static str,
        /// Names that the message has.
        found: Vec<String>,
    },
    /// An array that goes together with the names is too short.
    #[error("{field} has no value for joint {joint}")]
    MissingValue {
        /// Name of the joint.
        joint: &'static str,
        /// Name of the array.
        field: &'static str,
    },
    /// A trajectory moves a joint that the table does not have.
    #[error("joint {joint} is not one of the table's: {}", JOINT_NAMES.join(", "))]
    UnknownJoint {
        /// Name of the joint.
        joint: String,
    },
    /// A stamp does not exist.
    #[error("nanosec of a stamp is {nanosec}, expected less than 1000000000")]
    Stamp {
        /// What the message has.
        nanosec: u32,
    },
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

/// A square matrix row by row, as messages have it; `M` is the square of `N`.
pub fn row_major<const N: usize, const M: usize>(matrix: &SMatrix<f64, N, N>) -> [f64; M] {
    std::array::from_fn(|index| matrix[(index / N, index % N)])
}

impl FromMessage<Time> for Stamp {
    /// # Errors
    /// [`ConvertError::Stamp`].
    fn from_message(time: &Time) -> Result<Self, ConvertError> {
        let nanosec = time.nanosec;
        if i64::from(nanosec) < NANOS_PER_SECOND {
            Ok(stamp_from_time(*time))
        } else {
            Err(ConvertError::Stamp { nanosec })
        }
    }
}

impl ToMessage<Time> for Stamp {
    fn to_message(&self) -> Time {
        Time::from_nanos(self.nanos())
    }
}

/// A stamp as it is, also where its nanoseconds make more than a second.
pub const fn stamp_from_time(time: Time) -> Stamp {
    Stamp::from_nanos(time.nanos())
}

/// A header from a stamp and a frame.
pub fn header(stamp: Stamp, frame_id: impl Into<String>) -> Header {
    Header {
        stamp: stamp.to_message(),
        frame_id: frame_id.into(),
    }
}

/// The diagonal of a 3×3 row-major covariance.
fn diagonal(covariance: &[f64; 9]) -> Vector3<f64> {
    Vector3::new(covariance[0], covariance[4], covariance[8])
}

impl FromMessage<Imu> for ImuSample {
    /// Stamp, rates and forces as they are; variances from the diagonals. The orientation is not used.
    fn from_message(imu: &Imu) -> Result<Self, ConvertError> {
        Ok(Self {
            stamp: Stamp::from_message(&imu.header.stamp)?,
            angular_rate: imu.angular_velocity.into(),
            specific_force: imu.linear_acceleration.into(),
            angular_rate_variance: diagonal(&imu.angular_velocity_covariance),
            specific_force_variance: diagonal(&imu.linear_acceleration_covariance),
        })
    }
}

/// The message of a sample, in the frame of the sensor block, without an orientation.
pub fn imu_from_sample(sample: &ImuSample, frame_id: impl Into<String>) -> Imu {
    let mut imu = Imu {
        header: header(sample.stamp, frame_id),
        angular_velocity: sample.angular_rate.into(),
        linear_acceleration: sample.specific_force.into(),
        ..Imu::default()
    };
    imu.orientation_covariance[0] = -1.0;
    for axis in 0..3 {
        imu.angular_velocity_covariance[4 * axis] = sample.angular_rate_variance[axis];
        imu.linear_acceleration_covariance[4 * axis] = sample.specific_force_variance[axis];
    }
    imu
}

impl FromMessage<JointState> for JointSample {
    /// Both joints by name, in whatever order they come. Velocities that were not measured (an empty array) are zero.
    fn from_message(joints: &JointState) -> Result<Self, ConvertError> {
        let mut sample = Self {
            stamp: Stamp::from_message(&joints.header.stamp)?,
            position: [0.0; 2],
            velocity: [0.0; 2],
        };
        for (slot, joint) in JOINT_NAMES.into_iter().enumerate() {
            let index = joints
                .name
                .iter()
                .position(|name| name == joint)
                .ok_or_else(|| ConvertError::MissingJoint {
                    joint,
                    found: joints.name.clone(),
                })?;
            sample.position[slot] =
                *joints
                    .position
                    .get(index)
                    .ok_or(ConvertError::MissingValue {
                        joint,
                        field: "position",
                    })?;
            if !joints.velocity.is_empty() {
                sample.velocity[slot] =
                    *joints
                        .velocity
                        .get(index)
                        .ok_or(ConvertError::MissingValue {
                            joint,
                            field: "velocity",
                        })?;
            }
        }
        Ok(sample)
    }
}

impl ToMessage<JointState> for JointSample {
    /// Both joints, outer first.
    fn to_message(&self) -> JointState {
        JointState {
            header: header(self.stamp, ""),
            name: JOINT_NAMES.map(str::to_owned).to_vec(),
            position: self.position.to_vec(),
            velocity: self.velocity.to_vec(),
            effort: Vec::new(),
        }
    }
}

/// A position as a fix that no satellites made, with its covariance (E, N, U) \[m²\].
pub fn fix_of_position(
    stamp: Stamp,
    frame_id: impl Into<String>,
    position: &Position,
    covariance: &Matrix3<f64>,
) -> NavSatFix {
    NavSatFix {
        header: header(stamp, frame_id),
        status: NavSatStatus {
            status: NavSatStatus::STATUS_FIX,
            service: NavSatStatus::SERVICE_UNKNOWN,
        },
        latitude: position.latitude_rad.to_degrees(),
        longitude: position.longitude_rad.to_degrees(),
        altitude: position.height_m,
        position_covariance: row_major(covariance),
        position_covariance_type: NavSatFix::COVARIANCE_TYPE_KNOWN,
    }
}

/// The position in radians and metres; `None` where the receiver had none (a status below `STATUS_FIX`, or not a number).
pub fn position_from_fix(fix: &NavSatFix) -> Option<Position> {
    let position = Position {
        latitude_rad: fix.latitude.to_radians(),
        longitude_rad: fix.longitude.to_radians(),
        height_m: fix.altitude,
    };
    let is_finite = position.latitude_rad.is_finite()
        && position.longitude_rad.is_finite()
        && position.height_m.is_finite();
    (is_finite && fix.status.status >= NavSatStatus::STATUS_FIX).then_some(position)
}

/// The position with its time and its one-sigma, zero where the receiver does not say; `None` where it had none.
pub fn fix_from_message(fix: &NavSatFix) -> Option<PositionMeasurement> {
    let covariance = &fix.position_covariance;
    let is_known = fix.position_covariance_type != NavSatFix::COVARIANCE_TYPE_UNKNOWN;
    let sigma = |element: usize| {
        let variance = covariance[element];
        if is_known && variance.is_finite() && variance > 0.0 {
            variance.sqrt()
        } else {
            0.0
        }
    };
    Some(PositionMeasurement {
        stamp: stamp_from_time(fix.header.stamp),
        position: position_from_fix(fix)?,
        sigma_m: nalgebra::Vector3::new(sigma(0), sigma(4), sigma(8)),
    })
}

/// Velocity over ground, East and North, with its one-sigma from the covariance.
pub fn velocity_from_twist(message: &TwistWithCovarianceStamped) -> VelocityMeasurement {
    let twist = &message.twist;
    VelocityMeasurement {
        east_north: [twist.twist.linear.x, twist.twist.linear.y],
        sigma: [twist.covariance[0].sqrt(), twist.covariance[7].sqrt()],
    }
}

impl FromMessage<JointTrajectory> for Waypoints {
    /// Both joints by name, in whatever order they come; points with rates and without. One without points stops the table,
    /// whatever its names.
    fn from_message(message: &JointTrajectory) -> Result<Self, ConvertError> {
        if message.points.is_empty() {
            return Ok(Self::default());
        }
        if let Some(joint) = message
            .joint_names
            .iter()
            .find(|name| !JOINT_NAMES.contains(&name.as_str()))
        {
            return Err(ConvertError::UnknownJoint {
                joint: joint.clone(),
            });
        }
        let mut indices = [0; 2];
        for (slot, joint) in JOINT_NAMES.into_iter().enumerate() {
            indices[slot] = message
                .joint_names
                .iter()
                .position(|name| name == joint)
                .ok_or_else(|| ConvertError::MissingJoint {
                    joint,
                    found: message.joint_names.clone(),
                })?;
        }
        let points = message
            .points
            .iter()
            .map(|point| point_of(point, indices))
            .collect::<Result<_, _>>()?;
        Ok(Self { points })
    }
}

fn point_of(point: &JointTrajectoryPoint, indices: [usize; 2]) -> Result<Waypoint, ConvertError> {
    let pick = |values: &[f64], field: &'static str| -> Result<[f64; 2], ConvertError> {
        let mut picked = [0.0; 2];
        for slot in 0..2 {
            picked[slot] = *values
                .get(indices[slot])
                .ok_or(ConvertError::MissingValue {
                    joint: JOINT_NAMES[slot],
                    field,
                })?;
        }
        Ok(picked)
    };
    Ok(Waypoint {
        time_from_start_nanos: point.time_from_start.nanos(),
        position: pick(&point.positions, "positions")?,
        velocity: match point.velocities.as_slice() {
            [] => None,
            rates => Some(pick(rates, "velocities")?),
        },
    })
}

impl ToMessage<JointTrajectory> for Trajectory {
    /// Both joints, outer first; starts on arrival.
    fn to_message(&self) -> JointTrajectory {
        JointTrajectory {
            header: Header::default(),
            joint_names: JOINT_NAMES.map(str::to_owned).to_vec(),
            points: self
                .points
                .iter()
                .map(|point| JointTrajectoryPoint {
                    positions: point.position.to_vec(),
                    velocities: point.velocity.to_vec(),
                    time_from_start: Duration::from_nanos(point.time_from_start_nanos),
                    ..JointTrajectoryPoint::default()
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use sins::table::TrajectoryPoint;

    fn joints(names: &[&str], position: &[f64]) -> JointState {
        JointState {
            name: names.iter().map(|&name| name.to_owned()).collect(),
            position: position.to_vec(),
            ..JointState::default()
        }
    }

    /// Joints are found by name, not by place.
    #[test]
    fn joints_in_any_order() {
        let message = joints(&["inner_joint", "wheel", "outer_joint"], &[1.0, 2.0, 3.0]);
        assert_eq!(
            JointSample::from_message(&message).unwrap().position,
            [3.0, 1.0]
        );
    }

    /// The error names the joint that is missing and those that are there.
    #[test]
    fn a_missing_joint_is_named() {
        let error =
            JointSample::from_message(&joints(&["outer_joint", "x"], &[0.0, 0.0])).unwrap_err();
        assert_eq!(
            error.to_string(),
            "joint inner_joint is missing, the message has outer_joint, x"
        );
    }

    /// A name without a position is an error, not a zero.
    #[test]
    fn a_missing_position_is_an_error() {
        let error = JointSample::from_message(&joints(&["outer_joint", "inner_joint"], &[0.0]))
            .unwrap_err();
        assert_eq!(
            error,
            ConvertError::MissingValue {
                joint: "inner_joint",
                field: "position"
            }
        );
    }

    /// A sample survives the way through its message to the last bit.
    #[test]
    fn imu_there_and_back() {
        let sample = ImuSample {
            stamp: Stamp::from_nanos(1_760_000_000_123_456_789),
            angular_rate: Vector3::new(1e-5, -2e-7, 0.1 + 0.2),
            specific_force: Vector3::new(0.1, -0.2, 9.806_65),
            angular_rate_variance: Vector3::new(1e-12, 2e-12, 3e-12),
            specific_force_variance: Vector3::new(1e-6, 2e-6, 3e-6),
        };
        let imu = imu_from_sample(&sample, "imu_link");
        assert_eq!(imu.orientation_covariance[0], -1.0);
        assert_eq!(ImuSample::from_message(&imu).unwrap(), sample);
    }

    /// A trajectory survives the way through its message, negative times included.
    #[test]
    fn trajectory_there_and_back() {
        let point = |t| TrajectoryPoint {
            time_from_start_nanos: t,
            position: [1.0, 2.0],
            velocity: [3.0, 4.0],
        };
        let trajectory = Trajectory {
            points: vec![point(-1), point(1_500_000_000)],
        };
        assert_eq!(
            Waypoints::from_message(&trajectory.to_message()).unwrap(),
            trajectory.into()
        );
    }
}
