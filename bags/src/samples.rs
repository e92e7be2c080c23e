//! Payloads of the sensors straight to samples.
//!
//! An Imu is 37 numbers at fixed places behind a name, and a bag has a million of them: they are read where they stand.
//! Whatever does not look as usual takes the way through [`crate::cdr`] and the message, which is the way of the nodes;
//! both give the same sample, or the same error.

use ros2_interfaces::sensor_msgs::{Imu, JointState};
use rotary_sins_msgs::convert::FromMessage;
use sins::{
    sensor::sample::ImuSample,
    table::{JOINT_NAMES, JointSample},
    time::{NANOS_PER_SECOND, Stamp},
};

use crate::cdr;

/// The sample of a `sensor_msgs/msg/Imu` payload.
///
/// # Errors
/// Why it is none.
pub fn imu(payload: &[u8]) -> Result<ImuSample, String> {
    if let Some(sample) = imu_in_place(payload) {
        return Ok(sample);
    }
    let message: Imu = cdr::decode(payload).map_err(|error| error.to_string())?;
    ImuSample::from_message(&message).map_err(|error| error.to_string())
}

/// The sample of a `sensor_msgs/msg/JointState` payload.
///
/// # Errors
/// Why it is none.
pub fn joints(payload: &[u8]) -> Result<JointSample, String> {
    if let Some(sample) = joints_in_place(payload) {
        return Ok(sample);
    }
    let message: JointState = cdr::decode(payload).map_err(|error| error.to_string())?;
    JointSample::from_message(&message).map_err(|error| error.to_string())
}

/// Walks over little-endian CDR. Places count from behind the encapsulation.
struct Walk<'a> {
    fields: &'a [u8],
    at: usize,
}

impl<'a> Walk<'a> {
    fn new(payload: &'a [u8]) -> Option<Self> {
        let (head, fields) = payload.split_first_chunk::<4>()?;
        (head[..2] == [0, 1]).then_some(Self { fields, at: 0 })
    }

    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let taken = self.fields.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(taken)
    }

    fn u32(&mut self) -> Option<u32> {
        self.at = self.at.next_multiple_of(4);
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    /// A text that ends in a NUL, as it should.
    fn text(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()? as usize;
        let (nul, text) = self.take(length)?.split_last()?;
        (*nul == 0 && text.is_ascii()).then_some(text)
    }

    /// So many f64.
    fn numbers(&mut self, count: usize) -> Option<Numbers<'a>> {
        if count > 0 {
            self.at = self.at.next_multiple_of(8);
        }
        Some(Numbers(self.take(count.checked_mul(8)?)?))
    }

    fn sequence(&mut self) -> Option<Numbers<'a>> {
        let count = self.u32()? as usize;
        self.numbers(count)
    }

    /// A stamp that exists.
    fn stamp(&mut self) -> Option<Stamp> {
        let sec = self.u32()?.cast_signed();
        let nanosec = self.u32()?;
        (i64::from(nanosec) < NANOS_PER_SECOND).then(|| Stamp::from_sec_nanosec(sec, nanosec))
    }
}

#[derive(Clone, Copy)]
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn get(&self, index: usize) -> Option<f64> {
        let bytes = self.0.get(index * 8..index * 8 + 8)?;
        Some(f64::from_le_bytes(bytes.try_into().ok()?))
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

fn imu_in_place(payload: &[u8]) -> Option<ImuSample> {
    let mut walk = Walk::new(payload)?;
    let stamp = walk.stamp()?;
    walk.text()?;
    // Orientation 4, its covariance 9, rate 3, its covariance 9, force 3, its covariance 9.
    let numbers = walk.numbers(37)?;
    let at = |a, b, c| {
        Some(nalgebra::Vector3::new(
            numbers.get(a)?,
            numbers.get(b)?,
            numbers.get(c)?,
        ))
    };
    Some(ImuSample {
        stamp,
        angular_rate: at(13, 14, 15)?,
        specific_force: at(25, 26, 27)?,
        angular_rate_variance: at(16, 20, 24)?,
        specific_force_variance: at(28, 32, 36)?,
    })
}

fn joints_in_place(payload: &[u8]) -> Option<JointSample> {
    let mut walk = Walk::new(payload)?;
    let stamp = walk.stamp()?;
    walk.text()?;
    let mut indices = [None; 2];
    for index in 0..walk.u32()? as usize {
        let name = walk.text()?;
        for (slot, joint) in JOINT_NAMES.into_iter().enumerate() {
            if name == joint.as_bytes() && indices[slot].is_none() {
                indices[slot] = Some(index);
            }
        }
    }
    let (position, velocity, _effort) = (walk.sequence()?, walk.sequence()?, walk.sequence()?);
    let mut sample = JointSample {
        stamp,
        position: [0.0; 2],
        velocity: [0.0; 2],
    };
    for (slot, index) in indices.into_iter().enumerate() {
        sample.position[slot] = position.get(index?)?;
        if !velocity.is_empty() {
            sample.velocity[slot] = velocity.get(index?)?;
        }
    }
    Some(sample)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rotary_sins_msgs::convert::ToMessage;

    use super::*;
    use proptest::prelude::*;
    use ros2_interfaces::{RosMessage, builtin_interfaces::Time};

    fn payload<M: RosMessage>(message: &M) -> Vec<u8> {
        let mut payload = Vec::new();
        cdr::encode(message, &mut payload).unwrap();
        payload
    }

    /// The long way.
    fn through_message<M: RosMessage, S>(
        payload: &[u8],
        convert: impl Fn(&M) -> Result<S, String>,
    ) -> Result<S, String> {
        cdr::decode(payload)
            .map_err(|error| error.to_string())
            .and_then(|message| convert(&message))
    }

    fn text<T: std::fmt::Debug>(result: &Result<T, String>) -> String {
        // Debug text makes NaN equal to NaN.
        format!("{result:?}")
    }

    fn imu_both_ways(payload: &[u8]) -> (String, String) {
        let long = through_message(payload, |m: &Imu| {
            ImuSample::from_message(m).map_err(|e| e.to_string())
        });
        (text(&imu(payload)), text(&long))
    }

    fn joints_both_ways(payload: &[u8]) -> (String, String) {
        let long = through_message(payload, |m: &JointState| {
            JointSample::from_message(m).map_err(|e| e.to_string())
        });
        (text(&joints(payload)), text(&long))
    }

    fn numbered_imu(frame: &str) -> Imu {
        let mut imu = Imu::default();
        imu.header.frame_id = frame.to_owned();
        imu.header.stamp = Time {
            sec: -7,
            nanosec: 999_999_999,
        };
        imu.angular_velocity = nalgebra::Vector3::new(1.0, 2.0, f64::NAN).into();
        imu.linear_acceleration = nalgebra::Vector3::new(4.0, f64::INFINITY, 6.0).into();
        for i in 0..9 {
            imu.angular_velocity_covariance[i] = 10.0 + i as f64;
            imu.linear_acceleration_covariance[i] = 20.0 + i as f64;
        }
        imu
    }

    /// Frames of every length shift the numbers; the sample stays the same.
    #[test]
    fn imu_in_place_is_the_message() {
        for length in 0..20 {
            let payload = payload(&numbered_imu(&"f".repeat(length)));
            let (short, long) = imu_both_ways(&payload);
            assert_eq!(short, long);
            assert!(imu_in_place(&payload).is_some());
        }
    }

    /// Joints by name with extra ones, and without velocities.
    #[test]
    fn joints_in_place_are_the_message() {
        let mut state = JointState {
            name: vec!["mast".into(), "inner_joint".into(), "outer_joint".into()],
            position: vec![1.0, 2.0, 3.0],
            velocity: vec![4.0, 5.0, 6.0],
            ..JointState::default()
        };
        for velocity in [vec![4.0, 5.0, 6.0], Vec::new()] {
            state.velocity = velocity;
            let payload = payload(&state);
            let (short, long) = joints_both_ways(&payload);
            assert_eq!(short, long);
            assert!(joints_in_place(&payload).is_some());
        }
    }

    /// A payload with the big end first goes the long way, and gives the same values.
    #[test]
    fn the_big_end_may_come_first() {
        fn big<M: RosMessage>(message: &M) -> Vec<u8> {
            let mut payload = vec![0, 0, 0, 0];
            cdr_encoding::to_writer::<_, byteorder::BigEndian, _>(&mut payload, message).unwrap();
            payload
        }
        let message = numbered_imu("imu_link");
        let sample = imu(&big(&message));
        assert_eq!(text(&sample), text(&imu(&payload(&message))));
        assert_eq!(sample.unwrap().angular_rate.y, 2.0);
        let message = JointState {
            name: vec!["inner_joint".into(), "outer_joint".into()],
            position: vec![1.0, 2.0],
            velocity: vec![3.0, 4.0],
            ..JointState::default()
        };
        let sample = joints(&big(&message));
        assert_eq!(text(&sample), text(&joints(&payload(&message))));
        let sample = sample.unwrap();
        assert_eq!((sample.position, sample.velocity), ([2.0, 1.0], [4.0, 3.0]));
    }

    /// A message that lacks a joint is the error of the long way.
    #[test]
    fn a_missing_joint_is_named() {
        let state = JointState {
            name: vec!["outer_joint".into()],
            position: vec![0.0],
            ..JointState::default()
        };
        assert!(
            joints(&payload(&state))
                .unwrap_err()
                .contains("joint inner_joint is missing")
        );
    }

    proptest! {
        /// Damaged payloads give the same result on both ways, and no panic.
        #[test]
        fn damage_is_treated_alike(cut in 0usize..400, at in 0usize..400, flip in 1u8..) {
            let joint_state = ToMessage::<JointState>::to_message(&JointSample { stamp: Stamp::from_nanos(5), position: [1.0, 2.0], velocity: [3.0, 4.0] });
            for (payload, both) in [
                (payload(&numbered_imu("imu_link")), imu_both_ways as fn(&[u8]) -> (String, String)),
                (payload(&joint_state), joints_both_ways),
            ] {
                let mut payload = payload;
                payload.truncate(payload.len().saturating_sub(cut));
                if let Some(byte) = payload.get_mut(at) {
                    *byte ^= flip;
                }
                let (short, long) = both(&payload);
                prop_assert_eq!(short, long);
            }
        }
    }
}
