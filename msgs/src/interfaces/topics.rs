//! Topics.

use ros2_interfaces::compass_interfaces::Azimuth;
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
pub use ros2_interfaces::standard_topics::{
    CLOCK, DIAGNOSTICS, PARAMETER_EVENTS, ROSOUT, TF, TF_STATIC,
};
use ros2_interfaces::std_msgs;
use ros2_interfaces::trajectory_msgs::JointTrajectory;
use ros2_interfaces::{Interface, Qos, Topic};

use crate::{Calibration, CalibrationOutlook, SchemeStatus, SelfCalibrationEstimate};

macro_rules! topics {
    ($($(#[$kind:ident])? $constant:ident: $message:ty = $name:literal, $qos:expr, $from:literal => $to:literal, $about:literal;)*) => {
        $(
            #[doc = $about]
            pub const $constant: Topic<$message> =
                Topic::new($name, $qos, $from, $to, $about)$(.$kind())?;
        )*

        /// The rows of all topics, those of the suite first.
        pub const ALL: &[Interface] = &[
            $($constant.row(),)*
            CLOCK.row(),
            TF.row(),
            TF_STATIC.row(),
            DIAGNOSTICS.row(),
            ROSOUT.row(),
            PARAMETER_EVENTS.row(),
        ];
    };
}

// What is `overridable` may be offered and asked for otherwise, by parameters: see [`Topic::overridable`].
//
// Acknowledged messages that a writer keeps are not sent again; at the rate of the IMU they would be most of the
// compensator's memory, so that its outputs are less deep than the samples.
topics! {
    #[overridable]
    IMU_DATA_RAW: Imu = "imu/data_raw", Qos::sensor(),
        "IMU driver or `imu_simulator`" => "`self_calibrator`, `navigation_compensator`",
        "Mean angular rate and specific force of the interval that ends at the stamp";
    #[overridable]
    JOINT_STATES: JointState = "turntable/joint_states", Qos::sensor(),
        "table driver or `imu_simulator`" => "`scheme_sequencer`, `self_calibrator`, `navigation_compensator`",
        "Encoders of `outer_joint` and `inner_joint`";
    JOINT_TRAJECTORY: JointTrajectory = "turntable/joint_trajectory", Qos::reliable(100),
        "`scheme_sequencer`" => "table driver or `imu_simulator`",
        "One rotation; without points: stop";
    SCHEME_STATUS: SchemeStatus = "scheme/status", Qos::latched(1),
        "`scheme_sequencer`" => "`self_calibrator`, tools",
        "Where the rotation scheme stands";
    SCHEME_FILE: std_msgs::String = "scheme/file", Qos::latched(1),
        "`scheme_sequencer`" => "`self_calibrator`, tools",
        "The rotation scheme as it runs, as the text of a scheme file";
    #[overridable]
    FIX: NavSatFix = "fix", Qos::reliable(1000),
        "ship or `imu_simulator`" => "`self_calibrator`, `navigation_compensator`",
        "Position of the ship";
    #[overridable]
    AIDING_VELOCITY: TwistWithCovarianceStamped = "aiding/velocity", Qos::reliable(100),
        "ship or `imu_simulator`" => "`self_calibrator`, `navigation_compensator` with a measured velocity reference",
        "Velocity of the ship over ground";
    ESTIMATE: SelfCalibrationEstimate = "self_calibration/estimate", Qos::latched(1),
        "`self_calibrator`" => "tools",
        "State and covariance of the filter, 1 Hz of sample time";
    OUTLOOK: CalibrationOutlook = "self_calibration/outlook", Qos::latched(1),
        "`self_calibrator`" => "tools",
        "What the scheme under way will still bring, and which rotation would bring more";
    CALIBRATION: Calibration = "self_calibration/calibration", Qos::latched(1),
        "`self_calibrator`" => "`navigation_compensator`",
        "Sensor errors and attitude, when converged, when the scheme ends, when asked";
    #[overridable]
    IMU_DATA: Imu = "imu/data", Qos::reliable(1000),
        "`navigation_compensator`" => "ship",
        "Compensated samples with ENU orientation and covariances";
    #[overridable]
    ODOMETRY: Odometry = "odometry", Qos::reliable(100),
        "`navigation_compensator`" => "ship",
        "Pose and velocity of the ship";
    #[overridable]
    FIX_INS: NavSatFix = "fix_ins", Qos::reliable(100),
        "`navigation_compensator`" => "ship",
        "The same position on the globe";
    #[overridable]
    VELOCITY: TwistWithCovarianceStamped = "velocity", Qos::reliable(100),
        "`navigation_compensator`" => "ship",
        "The same velocity over ground";
    #[overridable]
    AZIMUTH_ENU: Azimuth = "azimuth/enu", Qos::reliable(100),
        "`navigation_compensator` with `azimuth_topics`" => "ship",
        "Heading of the ship from true East, counter-clockwise";
    #[overridable]
    AZIMUTH_NED: Azimuth = "azimuth/ned", Qos::reliable(100),
        "`navigation_compensator` with `azimuth_topics`" => "ship",
        "Heading of the ship from true North, clockwise";
    #[overridable]
    UNCOMPENSATED_IMU_DATA: Imu = "uncompensated/imu/data", Qos::reliable(1000),
        "`navigation_compensator`" => "tools",
        "As `imu/data`, without the calibration";
    #[overridable]
    UNCOMPENSATED_ODOMETRY: Odometry = "uncompensated/odometry", Qos::reliable(100),
        "`navigation_compensator`" => "tools",
        "As `odometry`, without the calibration";
    #[overridable]
    UNCOMPENSATED_FIX_INS: NavSatFix = "uncompensated/fix_ins", Qos::reliable(100),
        "`navigation_compensator`" => "tools",
        "As `fix_ins`, without the calibration";
    #[overridable]
    UNCOMPENSATED_VELOCITY: TwistWithCovarianceStamped = "uncompensated/velocity", Qos::reliable(100),
        "`navigation_compensator`" => "tools",
        "As `velocity`, without the calibration";
    #[overridable]
    TRUE_ODOMETRY: Odometry = "ground_truth/odometry", Qos::reliable(1000),
        "`imu_simulator`" => "tools",
        "True pose of the sensor block";
    TRUE_CALIBRATION: Calibration = "ground_truth/calibration", Qos::latched(1),
        "`imu_simulator`" => "tools",
        "True sensor errors and first attitude";
    SMOOTHED_ODOMETRY: Odometry = "smoothed/odometry", Qos::reliable(1000),
        "`rotary-sins calibrate --smooth`" => "tools",
        "Pose of the sensor block, as the whole record says it was";
    SMOOTHED_FIX: NavSatFix = "smoothed/fix", Qos::reliable(1000),
        "`rotary-sins calibrate --smooth`" => "tools",
        "The same position on the globe";
}
