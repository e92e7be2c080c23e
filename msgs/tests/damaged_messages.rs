//! Messages of every known type that a wire or a stranger has damaged.
#![allow(clippy::unwrap_used, missing_docs)]

use proptest::prelude::*;
use proptest::sample::select;
use ros2_interfaces::RosMessage;
use ros2_interfaces::cdr::{decode, encode};
use ros2_interfaces::sensor_msgs::JointState;
use rotary_sins_msgs::{SelfCalibrationEstimate, with_known_types};

/// A type: its name, a good message, and how it is read.
#[derive(Clone, Debug)]
struct Known {
    name: &'static str,
    good: Vec<u8>,
    read: fn(&[u8]) -> Result<(), String>,
}

impl Known {
    fn of<M: RosMessage + Default>(message: &M) -> Self {
        let mut good = Vec::new();
        encode(message, &mut good).unwrap();
        Self {
            name: M::TYPE_NAME,
            good,
            read: |bytes| {
                decode::<M>(bytes)
                    .map(drop)
                    .map_err(|error| error.to_string())
            },
        }
    }
}

macro_rules! list {
    ($($type:ty),* $(,)?) => { vec![$(Known::of(&<$type>::default())),*] };
}

/// Every known type with its defaults, and two whose lists and texts are full.
fn known() -> Vec<Known> {
    let mut known: Vec<Known> = with_known_types!(list);
    known.push(Known::of(&JointState {
        name: vec!["outer_joint".to_owned(), "inner_joint".to_owned()],
        position: vec![1.0; 2],
        velocity: vec![0.1; 2],
        ..JointState::default()
    }));
    known.push(Known::of(&SelfCalibrationEstimate {
        state_names: (0..60).map(|k| format!("state_{k}")).collect(),
        state: vec![1e-9; 60],
        covariance: vec![1e-18; 3600],
        message: "converged".to_owned(),
        ..SelfCalibrationEstimate::default()
    }));
    known
}

/// Every type reads its own messages.
#[test]
fn good_messages_are_read() {
    let known = known();
    assert!(known.len() > 20);
    for known in known {
        assert_eq!((known.read)(&known.good), Ok(()), "{}", known.name);
    }
}

proptest! {
    #![proptest_config(damage::drawn(20_000))]

    /// A damaged message is read or refused by the name of its type, whatever length it claims, and takes no memory that it does not
    /// bring: lists of 2^32 numbers would end the test.
    #[test]
    fn damaged_messages_are_told(
        (known, bytes) in select(known()).prop_flat_map(|known| {
            let good = known.good.clone();
            (Just(known), damage::damaged(good))
        }),
    ) {
        if let Err(told) = (known.read)(&bytes) {
            let is_named = told.contains(known.name) || told.contains("bytes") || told.contains("representation");
            prop_assert!(is_named && told.len() < 500, "{told}");
        }
    }
}
