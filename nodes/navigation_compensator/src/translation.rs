//! Calibration messages to calibrations; solutions to messages.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Matrix6, Vector3};
use ros2_interfaces::compass_interfaces::Azimuth;
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, NavSatFix};
use rotary_sins_msgs::convert::{
    fix_of_position, header, imu_from_sample, row_major, stamp_from_time,
};
use rotary_sins_msgs::{Calibration as CalibrationMessage, SelfCalibrationEstimate};
use sins::Stamp;
use sins::earth::Position;
use sins::earth::rotation::{HeadingPitchRoll, base_link_to_block};
use sins::estimation::groups::navigation::{MISALIGNMENT, VELOCITY};
use sins::machines::navigator::Solution;
use sins::machines::odometry::{UNKNOWN_VARIANCE, VehicleMotion, pose_covariance};
use sins::machines::self_calibration::{Calibration, CalibrationRecord, Phase, RecordedCovariance};
use sins::sensor::sample::ImuSample;

/// The ship's heading, true, from East and from North, with its variance.
pub fn azimuths(stamp: Stamp, solution: &Solution, base_frame_id: &str) -> [Azimuth; 2] {
    let vehicle = solution.base_link * base_link_to_block().inverse();
    let heading = HeadingPitchRoll::from_attitude(&vehicle).heading;
    let misalignment = solution
        .covariance
        .block_or(&MISALIGNMENT, UNKNOWN_VARIANCE);
    let sigma = HeadingPitchRoll::sigma(heading, &misalignment).heading;
    let azimuth = |azimuth: f64, orientation| Azimuth {
        header: header(stamp, base_frame_id),
        azimuth: azimuth.rem_euclid(TAU),
        variance: sigma * sigma,
        unit: Azimuth::UNIT_RAD,
        orientation,
        reference: Azimuth::REFERENCE_GEOGRAPHIC,
    };
    [
        azimuth(FRAC_PI_2 - heading, Azimuth::ORIENTATION_ENU),
        azimuth(heading, Azimuth::ORIENTATION_NED),
    ]
}

/// The calibration of a message. Where it carries no covariance, its standard deviations make one.
///
/// # Errors
/// One line: which field is unusable and what was expected.
pub fn calibration(message: &CalibrationMessage) -> Result<Calibration, String> {
    if !message.valid {
        return Err(format!(
            "valid is false (phase {}): the calibration is not used",
            message.phase
        ));
    }
    let (states, names) = (message.state.len(), message.state_names.len());
    if states != 0 && states != names {
        return Err(format!(
            "length of state is {states}, expected {names}, as many as state_names, or none"
        ));
    }
    let q = &message.attitude;
    let record = CalibrationRecord {
        stamp: stamp_from_time(message.header.stamp),
        phase: phase(message.phase)?,
        gyroscope_drift_rad_s: message.gyroscope_drift,
        accelerometer_bias_m_s2: message.accelerometer_bias,
        gyroscope_matrix: message.gyroscope_matrix,
        accelerometer_matrix: message.accelerometer_matrix,
        further: message
            .named_states()
            .map(|(name, value)| (name.to_owned(), value))
            .collect(),
        attitude_xyzw: [q.x, q.y, q.z, q.w],
        position: Position::from_degrees(
            message.latitude_deg,
            message.longitude_deg,
            message.height_m,
        ),
        covariance: covariance(message),
        samples: message.samples,
        gaps: message.gaps,
    };
    record
        .calibration()
        .and_then(Calibration::usable)
        .map_err(|error| error.to_string())
}

fn phase(number: u8) -> Result<Phase, String> {
    Ok(match number {
        SelfCalibrationEstimate::WAITING_FOR_POSITION => Phase::WaitingForPosition,
        SelfCalibrationEstimate::COARSE_ALIGNMENT => Phase::CoarseAlignment,
        SelfCalibrationEstimate::FINE_ALIGNMENT => Phase::FineAlignment,
        SelfCalibrationEstimate::CALIBRATING => Phase::Calibrating,
        SelfCalibrationEstimate::CONVERGED => Phase::Converged,
        SelfCalibrationEstimate::INCONSISTENT => Phase::Inconsistent,
        other => {
            return Err(format!(
                "phase is {other}, expected a phase of SelfCalibrationEstimate, 0 to 5"
            ));
        }
    })
}

fn covariance(message: &CalibrationMessage) -> RecordedCovariance {
    if message.covariance.is_empty() {
        return RecordedCovariance::Sensors {
            gyroscope_drift: message.gyroscope_drift_std,
            accelerometer_bias: message.accelerometer_bias_std,
            misalignment: message.attitude_covariance,
        };
    }
    RecordedCovariance::States {
        names: message.state_names.clone(),
        row_major: message.covariance.clone(),
    }
}

/// The compensated sample with its attitude.
pub fn imu(stamp: Stamp, solution: &Solution, measured: &ImuSample, frame_id: &str) -> Imu {
    let sample = ImuSample {
        stamp,
        angular_rate: solution.angular_rate,
        specific_force: solution.specific_force,
        ..*measured
    };
    Imu {
        orientation: solution.navigation.attitude.into(),
        orientation_covariance: row_major(
            &solution
                .covariance
                .block_or(&MISALIGNMENT, UNKNOWN_VARIANCE),
        ),
        ..imu_from_sample(&sample, frame_id)
    }
}

/// Pose in the local frame, twist in the ship's.
pub fn odometry(
    stamp: Stamp,
    solution: &Solution,
    motion: &VehicleMotion,
    origin: &Position,
    frames: [&str; 2],
) -> Odometry {
    let navigation = &solution.navigation;
    let offset = origin.offset_m(&navigation.position);
    let mut message = Odometry {
        header: header(stamp, frames[0]),
        child_frame_id: frames[1].to_owned(),
        ..Odometry::default()
    };
    let position = &mut message.pose.pose.position;
    (position.x, position.y, position.z) = (offset.x, offset.y, offset.z);
    message.pose.pose.orientation = solution.base_link.into();
    message.pose.covariance =
        row_major(&pose_covariance(&solution.navigation, &solution.covariance));
    message.twist.twist.linear = motion.velocity.into();
    message.twist.twist.angular = motion.angular_rate.into();
    message.twist.covariance = row_major(&motion.covariance);
    message
}

/// The position on the globe.
pub fn fix(stamp: Stamp, solution: &Solution, frame_id: &str) -> NavSatFix {
    let pose = pose_covariance(&solution.navigation, &solution.covariance);
    let covariance = pose.fixed_view::<3, 3>(0, 0).into_owned();
    fix_of_position(stamp, frame_id, &solution.navigation.position, &covariance)
}

/// Velocity over ground, East, North, Up; the angular part is not known here.
pub fn velocity(stamp: Stamp, solution: &Solution, frame_id: &str) -> TwistWithCovarianceStamped {
    let mut covariance = Matrix6::from_diagonal_element(UNKNOWN_VARIANCE);
    covariance
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&solution.covariance.block_or(&VELOCITY, UNKNOWN_VARIANCE));
    let mut message = TwistWithCovarianceStamped {
        header: header(stamp, frame_id),
        ..TwistWithCovarianceStamped::default()
    };
    message.twist.twist.linear = Vector3::into(solution.navigation.velocity);
    message.twist.covariance = row_major(&covariance);
    message
}
