//! Samples and joint states in the order of their stamps, whatever the order of their arrival.
//!
//! Two topics arrive through two queues, and either may be ahead of the other. Joint states that are ahead wait for the
//! samples; samples wait for the first joint state that is not earlier than they are, but only for so long, counted by the
//! samples' own stamps, and not at all before the first joint state has come (an IMU without a table).

use std::collections::VecDeque;

use crate::sensor::sample::ImuSample;
use crate::table::JointSample;
use crate::time::{Stamp, seconds_to_nanos};

/// Joint states kept while no samples come.
const LONGEST_QUEUE: usize = 100_000;

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InOrder {
    /// A joint state.
    Joints(JointSample),
    /// A sample; the joint states around its stamp have come before it.
    Sample(ImuSample),
}

/// Puts the two streams in order.
#[derive(Clone, Debug)]
pub struct StampOrder {
    patience_nanos: i64,
    samples: VecDeque<ImuSample>,
    joints: VecDeque<JointSample>,
    last_joints: Option<Stamp>,
}

impl StampOrder {
    /// A sample waits until the samples' stamps are `patience_s` \[s\] further, at most.
    pub fn new(patience_s: f64) -> Self {
        Self {
            patience_nanos: seconds_to_nanos(patience_s),
            samples: VecDeque::new(),
            joints: VecDeque::new(),
            last_joints: None,
        }
    }

    /// Takes a joint state. One that is earlier than the one before it begins a new stream.
    pub fn push_joints(&mut self, joints: JointSample) {
        let before = self
            .joints
            .back()
            .map(|joints| joints.stamp)
            .or(self.last_joints);
        if before.is_some_and(|before| joints.stamp < before) {
            self.joints.clear();
            self.last_joints = None;
        }
        if self.joints.len() == LONGEST_QUEUE {
            self.joints.pop_front();
        }
        self.joints.push_back(joints);
    }

    /// Takes a sample.
    pub fn push_sample(&mut self, sample: ImuSample) {
        self.samples.push_back(sample);
    }

    /// Samples that wait.
    pub fn waiting(&self) -> usize {
        self.samples.len()
    }

    /// What comes next; `None` until more has arrived.
    #[allow(clippy::should_implement_trait, reason = "more may come after None")]
    pub fn next(&mut self) -> Option<InOrder> {
        let first = self.samples.front()?.stamp;
        let newest = self.samples.back()?.stamp;
        let covered = self.last_joints.is_some_and(|last| last >= first);
        if !covered && let Some(joints) = self.joints.pop_front() {
            self.last_joints = Some(joints.stamp);
            return Some(InOrder::Joints(joints));
        }
        let patient = newest.nanos() - first.nanos() < self.patience_nanos && newest >= first;
        if !covered && patient && self.last_joints.is_some() {
            return None;
        }
        self.samples.pop_front().map(InOrder::Sample)
    }

    /// The samples that wait, no matter what: no more will come.
    pub fn flush(&mut self) -> VecDeque<ImuSample> {
        std::mem::take(&mut self.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn sample(millis: i64) -> ImuSample {
        ImuSample {
            stamp: Stamp::from_nanos(millis * 1_000_000),
            angular_rate: Vector3::zeros(),
            specific_force: Vector3::zeros(),
            angular_rate_variance: Vector3::zeros(),
            specific_force_variance: Vector3::zeros(),
        }
    }

    fn joints(millis: i64) -> JointSample {
        JointSample {
            stamp: Stamp::from_nanos(millis * 1_000_000),
            position: [0.0; 2],
            velocity: [0.0; 2],
        }
    }

    /// What comes out, as milliseconds: joints negative.
    fn drain(order: &mut StampOrder) -> Vec<i64> {
        std::iter::from_fn(|| order.next())
            .map(|next| match next {
                InOrder::Joints(j) => -j.stamp.nanos() / 1_000_000,
                InOrder::Sample(s) => s.stamp.nanos() / 1_000_000,
            })
            .collect()
    }

    /// Joint states that are far ahead are let through only as the samples need them.
    #[test]
    fn joints_wait_for_samples() {
        let mut order = StampOrder::new(0.2);
        for ms in [50, 100, 150] {
            order.push_joints(joints(ms));
        }
        assert_eq!(drain(&mut order), []);
        for ms in [40, 50, 60] {
            order.push_sample(sample(ms));
        }
        assert_eq!(drain(&mut order), [-50, 40, 50, -100, 60]);
    }

    /// A sample waits for the joint state after it, and no longer than its patience.
    #[test]
    fn samples_wait_for_joints() {
        let mut order = StampOrder::new(0.03);
        order.push_joints(joints(10));
        for ms in [10, 20, 30] {
            order.push_sample(sample(ms));
        }
        assert_eq!(drain(&mut order), [-10, 10]);
        order.push_sample(sample(50));
        assert_eq!(drain(&mut order), [20]);
        order.push_joints(joints(60));
        assert_eq!(drain(&mut order), [-60, 30, 50]);
    }

    /// When time runs back, the joint states of the new stream come through again.
    #[test]
    fn time_may_run_back() {
        let mut order = StampOrder::new(0.0);
        order.push_joints(joints(5000));
        order.push_sample(sample(4990));
        assert_eq!(drain(&mut order), [-5000, 4990]);
        order.push_joints(joints(10));
        order.push_sample(sample(5));
        assert_eq!(drain(&mut order), [-10, 5]);
    }

    /// Without a table nothing waits; without patience neither.
    #[test]
    fn nothing_waits_without_a_table_or_patience() {
        let mut order = StampOrder::new(1.0);
        order.push_sample(sample(10));
        assert_eq!(drain(&mut order), [10]);
        let mut hasty = StampOrder::new(0.0);
        hasty.push_joints(joints(0));
        hasty.push_sample(sample(10));
        assert_eq!(drain(&mut hasty), [0, 10]);
        assert_eq!(hasty.waiting(), 0);
    }
}
