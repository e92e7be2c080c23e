//! What holds for every table, every motion and every scheme.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::fmt::Write as _;

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::scheme::{About, CableLimits, Rotation, Scheme, SegmentKind};
use super::{Axis, Joint, JointState, Trajectory, Turntable};
use crate::earth::rotation::small_rotation;

fn axes() -> impl Strategy<Value = Turntable> {
    let axis = || prop::sample::select(vec![Axis::X, Axis::Y, Axis::Z]);
    (axis(), axis()).prop_filter_map("two axes", |(outer, inner)| {
        Turntable::new(outer, inner).ok()
    })
}

fn joints() -> impl Strategy<Value = Joint> {
    prop::sample::select(vec![Joint::Outer, Joint::Inner])
}

fn angles() -> impl Strategy<Value = [f64; 2]> {
    prop::array::uniform2(-2.0 * PI..2.0 * PI)
}

/// Rotations of a scheme that then goes all the way back, so that no cable is wound.
fn schemes() -> impl Strategy<Value = Scheme> {
    let rotation = (joints(), -3.0..3.0f64, 1.0..100.0f64);
    (prop::collection::vec(rotation, 1..6), 1u32..4).prop_map(|(rotations, cycles)| {
        let rotation = |joint, angle_rad, dwell_s| Rotation {
            dwell_s: Some(dwell_s),
            ..Rotation::new(About::Joint(joint), angle_rad)
        };
        let out = rotations
            .iter()
            .map(|(joint, angle, dwell)| rotation(*joint, angle + angle.signum() * 0.01, *dwell));
        let back = rotations
            .iter()
            .rev()
            .map(|(joint, angle, dwell)| rotation(*joint, -angle - angle.signum() * 0.01, *dwell));
        Scheme {
            cycles: Some(cycles),
            limits: CableLimits::NONE,
            ..Scheme::new("random", out.chain(back).collect())
        }
    })
}

proptest! {
    /// The rate of the block is the derivative of its attitude, whichever axes the joints have.
    #[test]
    fn rate_is_the_derivative_of_attitude(table in axes(), angles in angles(), rates in prop::array::uniform2(-0.1..0.1f64)) {
        const STEP_S: f64 = 1e-3;
        let at = |seconds: f64| table.attitude([0, 1].map(|joint| angles[joint] + rates[joint] * seconds));
        let turned: UnitQuaternion<f64> = at(-STEP_S).inverse() * at(STEP_S);
        let rate: Vector3<f64> = turned.scaled_axis() / (2.0 * STEP_S);
        prop_assert!((rate - table.body_rate(angles, rates)).norm() < 1e-9);
        let small = small_rotation(&(table.body_rate(angles, rates) * STEP_S));
        prop_assert!((at(0.0) * small).angle_to(&at(STEP_S)) < 1e-8);
    }

    /// A trapezoid turns the one joint by the angle, from rest to rest, within rate and acceleration, and its rate is the derivative of
    /// its angle.
    #[test]
    fn trapezoids_keep_their_limits(
        joint in joints(), from in angles(), angle in prop_oneof![-7.0..-1e-3, 1e-3..7.0f64],
        rate in 0.01..1.0f64, acceleration in 0.01..2.0f64,
    ) {
        let motion = Trajectory::trapezoid(joint, from, angle, rate, acceleration).unwrap();
        motion.validate(rate * (1.0 + 1e-9)).unwrap();
        let end = motion.duration_nanos();
        let (first, last) = (motion.at(0).unwrap(), motion.at(end).unwrap());
        prop_assert_eq!(first, JointState { position: from, velocity: [0.0; 2] });
        prop_assert_eq!(last.velocity, [0.0; 2]);
        let (moving, resting) = (joint.index(), 1 - joint.index());
        prop_assert!((last.position[moving] - from[moving] - angle).abs() < 1e-12);
        prop_assert_eq!(last.position[resting], from[resting]);
        let step_nanos = end / 50;
        let step_s = step_nanos as f64 * 1e-9;
        for k in 0..50 {
            let [before, middle, after] = [0, 1, 2].map(|half| motion.at(step_nanos * k + step_nanos * half / 2).unwrap());
            prop_assert!(before.velocity[moving] * angle.signum() >= -1e-9);
            let change = (after.velocity[moving] - before.velocity[moving]).abs();
            prop_assert!(change <= acceleration * step_s * (1.0 + 1e-6) + 1e-9, "{change} in {step_s} s");
            // Simpson's rule is exact for a parabola, and off by less than the corners otherwise.
            let mean = (before.velocity[moving] + 4.0 * middle.velocity[moving] + after.velocity[moving]) / 6.0;
            let moved = after.position[moving] - before.position[moving];
            prop_assert!((moved - mean * step_s).abs() <= acceleration * step_s * step_s / 8.0 + 1e-8);
        }
    }

    /// A stop brings both joints to rest without turning back.
    #[test]
    fn stops_come_to_rest(position in angles(), velocity in prop::array::uniform2(-0.5..0.5f64), deceleration in 0.01..1.0f64) {
        let stop = Trajectory::stop(JointState { position, velocity }, deceleration).unwrap();
        let last = stop.at(stop.duration_nanos()).unwrap();
        prop_assert_eq!(last.velocity, [0.0; 2]);
        for joint in 0..2 {
            let turned = last.position[joint] - position[joint];
            let expected = velocity[joint] * velocity[joint].abs() / (2.0 * deceleration);
            prop_assert!((turned - expected).abs() < 1e-8, "{turned} {expected}");
        }
    }

    /// The time line of a scheme has no hole, each rotation begins where the one before ended, and it ends where and when the program
    /// says.
    #[test]
    fn schemes_follow_their_time_line(scheme in schemes(), table in axes()) {
        let program = scheme.program(table).unwrap();
        let (mut nanos, mut at, mut dwells) = (0, [0.0; 2], 0);
        for segment in program.segments() {
            prop_assert_eq!(segment.start_nanos, nanos);
            nanos = segment.end_nanos;
            match segment.kind {
                SegmentKind::Dwell => dwells += 1,
                SegmentKind::Rotation => {
                    let step = program.step(segment.step).unwrap();
                    at[step.joint.index()] += step.angle_rad;
                }
            }
            let target = program.target(segment.cycle, segment.step);
            prop_assert!((0..2).all(|joint| (at[joint] - target[joint]).abs() < 1e-9), "{at:?} {target:?}");
        }
        prop_assert_eq!(Some(nanos), program.total_nanos());
        prop_assert_eq!(dwells, 1 + scheme.rotations.len() * scheme.cycles.unwrap_or(0) as usize);
        prop_assert!(at.iter().all(|angle| angle.abs() < 1e-9));
    }

    /// A scheme file gives the scheme that its numbers say, whatever they are.
    #[test]
    fn scheme_files_are_read_as_they_are_written(scheme in schemes()) {
        let mut text = format!("dwell_s: {:?}\ncycles: {}\nrotations:\n", scheme.dwell_s, scheme.cycles.unwrap_or(1));
        for rotation in &scheme.rotations {
            let About::Joint(joint) = rotation.about else { unreachable!() };
            let name = if joint == Joint::Outer { "outer" } else { "inner" };
            let (angle, dwell) = (rotation.angle_rad.to_degrees(), rotation.dwell_s.unwrap_or(0.0));
            writeln!(text, "  - {{joint: {name}, angle_deg: {angle:?}, dwell_s: {dwell:?}}}").unwrap();
        }
        let read = Scheme::from_yaml("random", &text).unwrap();
        prop_assert_eq!(read.rotations.len(), scheme.rotations.len());
        for (read, written) in read.rotations.iter().zip(&scheme.rotations) {
            prop_assert_eq!((read.about, read.dwell_s), (written.about, written.dwell_s));
            prop_assert!((read.angle_rad - written.angle_rad).abs() < 1e-14);
        }
    }
}
