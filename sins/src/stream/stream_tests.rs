#![allow(clippy::unwrap_used)]
use nalgebra::Vector3;

use super::counts::Refusal;
use super::*;

fn sample(millis: i64, rate: f64) -> ImuSample {
    let mut sample = ImuSample::at_rest(Stamp::from_nanos(millis * 1_000_000), 9.8);
    sample.angular_rate.x = rate;
    sample
}

fn joints(millis: i64, outer: f64) -> JointSample {
    JointSample {
        stamp: Stamp::from_nanos(millis * 1_000_000),
        position: [outer, 0.0],
        velocity: [0.0; 2],
    }
}

fn drain(stream: &mut Stream) -> Vec<Item> {
    std::iter::from_fn(|| stream.next()).collect()
}

/// Ends of the intervals in milliseconds.
fn ends(items: &[Item]) -> Vec<i64> {
    let end = |item: &Item| match item {
        Item::Interval(interval, _) => Some(interval.stamp.nanos() / 1_000_000),
        _ => None,
    };
    items.iter().filter_map(end).collect()
}

/// In the regular case every sample comes out as it goes in.
#[test]
fn regular_samples_never_wait() {
    let mut stream = Stream::new(StreamSettings::default()).unwrap();
    for k in 0..100 {
        stream.push_sample(&sample(10 * k, 0.0));
        let items = drain(&mut stream);
        assert!(k < 8 || items.len() == 1, "{k}: {items:?}");
    }
    assert_eq!(stream.waiting(), 0);
}

/// A hole is bridged by the mean of its ends, and the encoders say what was turned in it, however late they come.
#[test]
fn the_encoders_tell_what_was_turned_in_a_hole() {
    let mut stream = Stream::new(StreamSettings::default()).unwrap();
    stream.push_joints(joints(0, 0.0)).unwrap();
    for k in 0..20 {
        stream.push_sample(&sample(10 * k, 0.1));
    }
    stream.push_joints(joints(190, 0.01)).unwrap();
    drain(&mut stream);
    for k in [520, 521, 522] {
        stream.push_sample(&sample(10 * k, 0.2));
    }
    assert!(drain(&mut stream).is_empty(), "waits for the joints");
    stream.push_joints(joints(5200, 0.26)).unwrap();
    let items = drain(&mut stream);
    assert_eq!(ends(&items), [5200, 5210, 5220]);
    let Item::Interval(interval, _) = &items[0] else {
        panic!("{items:?}")
    };
    assert!((interval.increment.angle.x - 0.15 * 5.01).abs() < 1e-12);
    let hole = interval.hole.as_ref().unwrap();
    assert_eq!(hole.lost, 500);
    let turned = hole.turned.unwrap();
    assert_eq!((turned.from, turned.to), ([0.01, 0.0], [0.26, 0.0]));
}

/// Without encoders a hole longer than the bridge begins an epoch.
#[test]
fn a_long_hole_begins_an_epoch() {
    let mut stream = Stream::new(StreamSettings::default()).unwrap();
    for k in (0..20).chain(620..640) {
        stream.push_sample(&sample(10 * k, 0.0));
    }
    let causes: Vec<_> = drain(&mut stream)
        .into_iter()
        .filter_map(|item| match item {
            Item::Epoch { cause, .. } => Some(cause),
            _ => None,
        })
        .collect();
    assert_eq!(causes[0], EpochCause::First);
    assert!(matches!(causes[1], EpochCause::Hole { seconds } if (seconds - 6.01).abs() < 1e-9));
    assert_eq!((stream.counts().restarts, stream.counts().samples), (1, 40));
}

/// Samples wait for the velocity of their time and no longer than their patience, before and after the source begins anew.
#[test]
fn velocities_meet_their_samples_also_after_a_rewind() {
    let mut stream = Stream::new(StreamSettings {
        velocity_patience_s: Some(0.5),
        ..StreamSettings::default()
    })
    .unwrap();
    let velocity = |east| VelocityMeasurement {
        east_north: [east, 0.0],
        sigma: [0.1; 2],
    };
    for round in 0..3 {
        let mut met = Vec::new();
        for k in 0..200 {
            stream.push_sample(&sample(10 * k, 0.0));
            if k % 10 == 5 {
                let stamp = Stamp::from_nanos(10_000_000 * (k - 5));
                stream.push_velocity(stamp, velocity(k as f64)).unwrap();
            }
            for item in drain(&mut stream) {
                if let Item::Interval(interval, _) = item {
                    met.extend(interval.velocity.map(|v| (interval.stamp, v.east_north[0])));
                }
            }
        }
        // Around the rewind itself a few may be of the time before.
        assert!(met.len() >= 16, "round {round}: {met:?}");
        for (stamp, east) in met.iter().filter(|(stamp, _)| stamp.nanos() > 200_000_000) {
            assert_eq!((stamp.nanos() / 10_000_000 + 5) as f64, *east, "{round}");
        }
    }
    assert_eq!(stream.counts().restarts, 2);
}

/// Joint states that came before the samples of a rewound source are kept, those of the time before are not.
#[test]
fn joints_of_the_time_before_are_forgotten() {
    let mut stream = Stream::new(StreamSettings::default()).unwrap();
    for round in 0..2 {
        for k in 0..100 {
            stream
                .push_joints(joints(10 * k, f64::from(round)))
                .unwrap();
            stream.push_sample(&sample(10 * k, 0.0));
            drain(&mut stream);
        }
    }
    for k in 3..20 {
        let angles = stream.joints().angles_at(Stamp::from_nanos(10_000_000 * k));
        assert_eq!(angles, [1.0, 0.0]);
    }
    assert!(stream.push_joints(joints(2000, f64::NAN)).is_err());
    let velocity = [0.0, f64::NAN];
    assert!(
        stream
            .push_joints(JointSample {
                velocity,
                ..joints(2000, 0.0)
            })
            .is_err()
    );
}

/// Samples wait for the joint state after them where they are told to, and no longer than that.
#[test]
fn samples_wait_for_joints() {
    let mut stream = Stream::new(StreamSettings {
        joint_patience_s: 0.03,
        ..StreamSettings::default()
    })
    .unwrap();
    stream.push_joints(joints(100, 0.0)).unwrap();
    for k in 0..13 {
        stream.push_sample(&sample(10 * k, 0.0));
    }
    assert_eq!(ends(&drain(&mut stream)).last(), Some(&100));
    stream.push_sample(&sample(140, 0.0));
    assert_eq!(ends(&drain(&mut stream)).last(), None, "140 looks odd");
    stream.push_sample(&sample(130, 0.0));
    // 110 has waited long enough, and nothing behind it waits for what is silent.
    assert_eq!(ends(&drain(&mut stream)), [110, 120, 130, 140]);
}

/// A topic that dies costs its patience once: no sample waits for it again until it speaks, and then they do.
#[test]
fn a_topic_that_dies_costs_its_patience_once() {
    let mut stream = Stream::new(StreamSettings {
        joint_patience_s: 0.2,
        ..StreamSettings::default()
    })
    .unwrap();
    stream.push_joints(joints(100, 0.0)).unwrap();
    for k in 0..30 {
        stream.push_sample(&sample(10 * k, 0.0));
    }
    assert_eq!(ends(&drain(&mut stream)).last(), Some(&100));
    for k in 30..34 {
        stream.push_sample(&sample(10 * k, 0.0));
    }
    // 110 has waited for 0.2 s, and those behind it wait no more.
    assert_eq!(ends(&drain(&mut stream)).last(), Some(&330));
    stream.push_joints(joints(335, 0.0)).unwrap();
    stream.push_sample(&sample(340, 0.0));
    assert!(drain(&mut stream).is_empty());
    stream.push_joints(joints(345, 0.0)).unwrap();
    assert_eq!(ends(&drain(&mut stream)), [340]);
}

/// A restart that is asked for begins an epoch; counts go on, and the next sample is used at once.
#[test]
fn a_restart_begins_an_epoch() {
    let mut stream = Stream::new(StreamSettings::default()).unwrap();
    for k in 0..20 {
        stream.push_sample(&sample(10 * k, 0.0));
    }
    drain(&mut stream);
    stream.restart();
    stream.push_sample(&sample(200, 0.0));
    let items = drain(&mut stream);
    assert!(
        matches!(
            items[..],
            [Item::Epoch {
                cause: EpochCause::Asked,
                ..
            }]
        ),
        "{items:?}"
    );
    assert_eq!(stream.counts().samples, 21);
}

/// What no sensor gave never comes out, and each kind is counted.
#[test]
fn implausible_samples_are_refused_and_counted() {
    let mut stream = Stream::new(StreamSettings::default()).unwrap();
    for k in 0..100 {
        let mut s = sample(10 * k, 0.01);
        match k {
            20 => s.angular_rate.y = f64::NAN,
            40 => s.angular_rate.y = 1e30,
            60 => s.angular_rate.y = 1.0,
            80 => s.specific_force = Vector3::repeat(600.0),
            _ => {}
        }
        stream.push_sample(&s);
    }
    let refused: Vec<_> = drain(&mut stream)
        .into_iter()
        .filter_map(|item| match item {
            Item::Refused(refused) => Some(refused.why.name()),
            Item::Interval(_, sample) => {
                assert!(sample.angular_rate.amax() < 0.1);
                None
            }
            Item::Epoch { .. } => None,
        })
        .collect();
    assert_eq!(
        refused,
        ["not finite", "beyond range", "spike", "beyond range"]
    );
    let counts = stream.counts();
    assert_eq!((counts.samples, counts.gaps, counts.lost), (96, 4, 4));
    assert_eq!(Refusal::Repeated.name(), "repeated");
}
