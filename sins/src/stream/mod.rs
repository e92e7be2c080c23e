//! Samples, joint states and aiding as they come, put into the order of their stamps.

pub mod joint_history;
pub mod sampling;
pub mod stamp_order;
pub mod stepper;
