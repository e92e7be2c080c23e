//! Mathematics of a dual-axis rotary strapdown inertial navigation system.
//!
//! No ROS, no files, no clock, no threads: every machine in this crate is fed samples and hands back results.

pub mod coarse_alignment;
pub mod earth;
pub mod error;
pub mod estimation;
pub mod imu;
pub mod joint_history;
pub mod monte_carlo;
pub mod navigator;
pub mod odometry;
pub mod rotation;
pub mod sampling;
pub mod self_calibration;
pub mod sensor_errors;
pub mod stamp_order;
pub mod stepper;
pub mod strapdown;
pub mod scheme;
pub mod simulation;
pub mod time;
pub mod turntable;
pub mod units;

pub use error::Error;
pub use time::Stamp;
