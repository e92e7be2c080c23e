//! The topics that the node publishes.

use std::time::Duration;

use anyhow::{Context, Result};
use ros_node::{Node, Published, Publisher};
use ros2_interfaces::geometry_msgs::TwistWithCovarianceStamped;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::rosgraph_msgs::Clock;
use ros2_interfaces::sensor_msgs::{Imu, JointState, NavSatFix};
use rotary_sins_msgs::Calibration;
use rotary_sins_msgs::convert::{ToMessage, imu_from_sample, odometry_of_block};
use rotary_sins_msgs::interfaces::topics::{
    AIDING_VELOCITY, CLOCK, FIX, IMU_DATA_RAW, JOINT_STATES, JOINT_TRAJECTORY, TRUE_CALIBRATION,
    TRUE_ODOMETRY,
};
use sins::simulation::{Simulator, Tick};
use sins::table::JointSample;
use sins::time::Stamp;

use crate::parameters::Settings;
use crate::wait_list::Wait;

/// Topics that can be waited for.
pub const TOPICS: [&str; 7] = [
    IMU_DATA_RAW.name,
    JOINT_STATES.name,
    FIX.name,
    AIDING_VELOCITY.name,
    TRUE_ODOMETRY.name,
    TRUE_CALIBRATION.name,
    // The input, which can be waited for too.
    JOINT_TRAJECTORY.name,
];

/// How long simulated time stands still for the subscribers of one topic.
#[derive(Debug)]
struct Patience {
    limit: Duration,
    /// A subscriber did not acknowledge for the whole limit: samples are dropped until there is room again.
    exhausted: bool,
}

impl Patience {
    fn new(limit: Duration) -> Self {
        Self {
            limit,
            exhausted: false,
        }
    }

    fn now(&self) -> Duration {
        if self.exhausted {
            Duration::ZERO
        } else {
            self.limit
        }
    }

    fn learn(&mut self, published: Published) {
        self.exhausted = matches!(published, Published::Refused { .. });
    }
}

/// All publishers of the node.
pub struct Outputs {
    imu: Publisher<Imu>,
    joints: Publisher<JointState>,
    fix: Publisher<NavSatFix>,
    velocity: Option<Publisher<TwistWithCovarianceStamped>>,
    odometry: Publisher<Odometry>,
    calibration: Publisher<Calibration>,
    clock: Publisher<Clock>,
    imu_patience: Patience,
    joints_patience: Patience,
}

impl Outputs {
    /// Creates the publishers.
    ///
    /// # Errors
    /// A name that is none, or a middleware that refuses.
    pub fn new(node: &Node, settings: &Settings) -> Result<Self> {
        let publish_timeout = Duration::from_secs_f64(settings.publish_timeout_s);
        let velocity = if settings.velocity_aiding {
            Some(node.publish_on(&AIDING_VELOCITY)?)
        } else {
            None
        };
        Ok(Self {
            imu: node.publish_on(&IMU_DATA_RAW)?,
            joints: node.publish_on(&JOINT_STATES)?,
            fix: node.publish_on(&FIX)?,
            velocity,
            odometry: node.publish_on(&TRUE_ODOMETRY)?,
            calibration: node.publish_on(&TRUE_CALIBRATION)?,
            clock: node.publish_on(&CLOCK)?,
            imu_patience: Patience::new(publish_timeout),
            joints_patience: Patience::new(publish_timeout),
        })
    }

    /// Waits until the topic of `wait` has its subscribers.
    ///
    /// # Errors
    /// They are not there in time, or the topic is not published.
    pub async fn wait_for(&self, wait: &Wait, timeout: Duration) -> Result<()> {
        let count = wait.count;
        let there = match wait.topic.as_str() {
            name if name == IMU_DATA_RAW.name => {
                self.imu.wait_for_subscribers(count, timeout).await
            }
            name if name == JOINT_STATES.name => {
                self.joints.wait_for_subscribers(count, timeout).await
            }
            name if name == FIX.name => self.fix.wait_for_subscribers(count, timeout).await,
            name if name == TRUE_ODOMETRY.name => {
                self.odometry.wait_for_subscribers(count, timeout).await
            }
            name if name == TRUE_CALIBRATION.name => {
                self.calibration.wait_for_subscribers(count, timeout).await
            }
            topic => {
                let velocity = self.velocity.as_ref();
                let velocity = velocity.with_context(|| {
                    format!("{topic} is not published: 'velocity_aiding' is false")
                })?;
                velocity.wait_for_subscribers(count, timeout).await
            }
        };
        anyhow::ensure!(
            there,
            "{} has not had {count} subscribers within {timeout:?}",
            wait.topic
        );
        Ok(())
    }

    /// What is there before the first sample: the truth, and where the joints stand.
    pub async fn publish_first(&mut self, simulator: &Simulator) {
        let plant = simulator.plant();
        self.publish_truth(simulator);
        self.publish_clock(plant.now());
        self.publish_joints(&simulator.first_joints()).await;
    }

    /// The truth as it stands now.
    pub fn publish_truth(&self, simulator: &Simulator) {
        let truth = Calibration::ground_truth(simulator);
        self.calibration.publish(truth).left_to_diagnostics();
    }

    /// Everything of one sampling interval.
    pub async fn publish(&mut self, tick: &Tick, simulator: &Simulator) {
        let imu = imu_from_sample(&tick.imu, "imu_link");
        let published = self.imu.publish_within(imu, self.imu_patience.now()).await;
        self.imu_patience.learn(published);
        if let Some(joints) = &tick.joints {
            self.publish_joints(joints).await;
        }
        if let (Some(publisher), Some(velocity)) = (&self.velocity, &tick.velocity) {
            publisher
                .publish_if_heard(|| velocity.to_message())
                .left_to_diagnostics();
        }
        if let Some(position) = &tick.position {
            self.fix
                .publish(position.to_message())
                .left_to_diagnostics();
            self.odometry
                .publish_if_heard(|| {
                    let plant = simulator.plant();
                    odometry_of_block(
                        tick.truth.stamp,
                        plant.place_m(),
                        plant.attitude(),
                        plant.ship().velocity,
                        plant.block_rate(),
                    )
                })
                .left_to_diagnostics();
        }
    }

    /// Tells the simulated time.
    pub fn publish_clock(&self, now: Stamp) {
        self.clock
            .publish_if_heard(|| Clock {
                clock: now.to_message(),
            })
            .left_to_diagnostics();
    }

    async fn publish_joints(&mut self, joints: &JointSample) {
        let published = self
            .joints
            .publish_within(joints.to_message(), self.joints_patience.now())
            .await;
        self.joints_patience.learn(published);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After a whole time-out nothing is waited for until a sample was taken again.
    #[test]
    fn patience_ends_and_returns() {
        let mut patience = Patience::new(Duration::from_secs(5));
        patience.learn(Published::Refused { dropped: 1 });
        assert_eq!(patience.now(), Duration::ZERO);
        patience.learn(Published::Sent);
        assert_eq!(patience.now(), Duration::from_secs(5));
    }
}
