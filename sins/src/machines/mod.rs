//! The machines that nodes, the command line and notebooks drive: fed readings, they hand back what happened.

pub mod navigator;
pub mod odometry;
pub mod self_calibration;
pub mod unseen_motion;
