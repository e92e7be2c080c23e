//! A scheme on a given table: joints, targets, names of positions, time line, cable limits.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{About, Scheme};
use crate::error::Error;
use crate::table::{Axis, Joint, Trajectory, Turntable};
use crate::time::seconds_to_nanos;

/// Angles closer than this are the same \[rad\].
const SAME_ANGLE_RAD: f64 = 1e-9;

/// One rotation of a program and the dwell after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The joint that turns.
    pub joint: Joint,
    /// The axis of the block, at zero joint angles, about which that joint turns.
    pub axis: Axis,
    /// Angle, counter-clockwise positive \[rad\].
    pub angle_rad: f64,
    /// Cruise rate \[rad/s\].
    pub rate_rad_s: f64,
    /// Acceleration and deceleration \[rad/s²\].
    pub acceleration_rad_s2: f64,
    /// How long the rotation takes \[ns\].
    pub rotation_nanos: i64,
    /// The dwell after it \[ns\].
    pub dwell_nanos: i64,
    /// Name of the position it leads to.
    pub position: String,
    /// Joint angles (outer, inner) after it, from those at the start of the cycle \[rad\].
    target: [f64; 2],
}

/// Whether the table rests or turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// At rest in a position.
    Dwell,
    /// On the way to the next one.
    Rotation,
}

/// A stretch of the time line: a dwell or a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Which cycle, from 0.
    pub cycle: u32,
    /// 0 is the first dwell; k is the k-th rotation of the cycle and the dwell after it.
    pub step: u32,
    /// Dwell or rotation.
    pub kind: SegmentKind,
    /// From the start of the first dwell \[ns\].
    pub start_nanos: i64,
    /// From the start of the first dwell \[ns\]; `i64::MAX` for a dwell that lasts until stopped.
    pub end_nanos: i64,
}

/// A scheme, checked and laid out for one table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Program {
    /// Name of the scheme.
    pub name: String,
    /// The table it runs on.
    pub table: Turntable,
    /// How many cycles; `None`: until stopped.
    pub cycles: Option<u32>,
    /// The scheme's own cruise rate, for drives that are no rotation of the program \[rad/s\].
    pub rate_rad_s: f64,
    /// The scheme's own acceleration, for the same \[rad/s²\].
    pub acceleration_rad_s2: f64,
    /// The dwell at A that comes first \[ns\].
    pub first_dwell_nanos: i64,
    /// The rotations of one cycle.
    pub steps: Vec<Step>,
    /// Name of the position at zero joint angles.
    pub start_position: String,
    /// How much further each joint stands after a cycle \[rad\].
    advance: [f64; 2],
}

impl Scheme {
    /// Lays this scheme out for `table` and checks it, cable limits over all cycles included, before anything moves.
    ///
    /// # Errors
    /// [`Error::Scheme`] where a value is out of range, no joint turns about an axis that a rotation asks for, or a joint
    /// would leave its cable limits (naming cycle, rotation, joint and limit).
    pub fn program(&self, table: Turntable) -> Result<Program, Error> {
        self.validate()?;
        let table = Turntable::new(table.outer, table.inner)?;
        let mut program = Program {
            name: self.name.clone(),
            table,
            cycles: self.cycles,
            rate_rad_s: self.rate_rad_s,
            acceleration_rad_s2: self.acceleration_rad_s2,
            first_dwell_nanos: seconds_to_nanos(self.first_dwell_s.unwrap_or(self.dwell_s)),
            steps: Vec::with_capacity(self.rotations.len()),
            start_position: letter(0),
            advance: [0.0; 2],
        };
        let mut at = [0.0; 2];
        for (index, rotation) in self.rotations.iter().enumerate() {
            let joint = match rotation.about {
                About::Joint(joint) => joint,
                About::Axis(axis) => table.joint_about(axis).ok_or_else(|| {
                    self.error(format!(
                        "rotations[{index}] turns about {axis}, but the outer joint turns about {} and the inner about {}",
                        table.outer, table.inner
                    ))
                })?,
            };
            let rate_rad_s = rotation.rate_rad_s.unwrap_or(self.rate_rad_s);
            let acceleration_rad_s2 = rotation
                .acceleration_rad_s2
                .unwrap_or(self.acceleration_rad_s2);
            let motion = Trajectory::trapezoid(
                joint,
                at,
                rotation.angle_rad,
                rate_rad_s,
                acceleration_rad_s2,
            )
            .map_err(|e| self.error(format!("rotations[{index}]: {e}")))?;
            at[joint.index()] = without_dust(at[joint.index()] + rotation.angle_rad);
            program.steps.push(Step {
                joint,
                axis: if joint == Joint::Outer {
                    table.outer
                } else {
                    table.inner
                },
                angle_rad: rotation.angle_rad,
                rate_rad_s,
                acceleration_rad_s2,
                rotation_nanos: motion.duration_nanos(),
                dwell_nanos: seconds_to_nanos(rotation.dwell_s.unwrap_or(self.dwell_s)),
                position: String::new(),
                target: at,
            });
        }
        program.advance = at;
        program.name_positions(self);
        self.check_limits(&program)?;
        Ok(program)
    }

    /// The first place, in order of time, where a joint would leave its limits.
    fn check_limits(&self, program: &Program) -> Result<(), Error> {
        let mut first: Option<(u32, usize, Joint)> = None;
        for (index, step) in program.steps.iter().enumerate() {
            for joint in [Joint::Outer, Joint::Inner] {
                let (min, max) = self.limits.of(joint);
                let (target, advance) =
                    (step.target[joint.index()], program.advance[joint.index()]);
                // Cycles, from 0, until target + cycle·advance leaves min..max.
                let cycle = if target < min - SAME_ANGLE_RAD || target > max + SAME_ANGLE_RAD {
                    0.0
                } else if advance > 0.0 {
                    ((max + SAME_ANGLE_RAD - target) / advance).floor() + 1.0
                } else if advance < 0.0 {
                    ((min - SAME_ANGLE_RAD - target) / advance).floor() + 1.0
                } else {
                    continue;
                };
                if cycle >= self.cycles.map_or(f64::from(u32::MAX), f64::from) {
                    continue;
                }
                let found = (cycle as u32, index, joint);
                if first.is_none_or(|earlier| (found.0, found.1) < (earlier.0, earlier.1)) {
                    first = Some(found);
                }
            }
        }
        let Some((cycle, index, joint)) = first else {
            return Ok(());
        };
        let (min, max) = self.limits.of(joint);
        let angle = program.target(cycle, index as u32 + 1)[joint.index()];
        let net = program.advance[joint.index()].to_degrees();
        let winds = if net == 0.0 {
            String::new()
        } else {
            format!("; every cycle winds it by {net:.3} deg")
        };
        Err(self.error(format!(
            "rotation {} of cycle {cycle} turns {} to {:.3} deg, its limits are {:.3} to {:.3} deg{winds}",
            index + 1,
            joint.name(),
            angle.to_degrees(),
            min.to_degrees(),
            max.to_degrees(),
        )))
    }
}

impl Program {
    fn name_positions(&mut self, scheme: &Scheme) {
        let mut known: Vec<([f64; 2], String)> = vec![([0.0; 2], self.start_position.clone())];
        for (step, rotation) in self.steps.iter_mut().zip(&scheme.rotations) {
            let visited = known
                .iter()
                .find(|(angles, _)| same_pose(*angles, step.target));
            step.position = match (&rotation.position, visited) {
                (Some(name), _) | (None, Some((_, name))) => name.clone(),
                (None, None) => letter(known.len()),
            };
            if visited.is_none() {
                known.push((step.target, step.position.clone()));
            }
        }
    }

    /// Joint angles (outer, inner) at the end of `step` of `cycle`; step 0 is where the cycle starts \[rad\].
    pub fn target(&self, cycle: u32, step: u32) -> [f64; 2] {
        let within = self.step(step).map_or([0.0; 2], |s| s.target);
        [0, 1].map(|joint| within[joint] + f64::from(cycle) * self.advance[joint])
    }

    /// Name of the position at the end of `step`.
    pub fn position(&self, step: u32) -> &str {
        self.step(step)
            .map_or(&self.start_position, |s| &s.position)
    }

    /// Step `number` counted as in [`Segment::step`]; `None` for 0, the first dwell.
    pub fn step(&self, number: u32) -> Option<&Step> {
        self.steps.get((number as usize).checked_sub(1)?)
    }

    /// The step that follows (`cycle`, `step`), as (cycle, step); `None` where the program ends.
    pub fn next(&self, cycle: u32, step: u32) -> Option<(u32, u32)> {
        if (step as usize) < self.steps.len() {
            return Some((cycle, step + 1));
        }
        let next = cycle.checked_add(1)?;
        let more = self.cycles.is_none_or(|cycles| next < cycles);
        (more && !self.steps.is_empty()).then_some((next, 1))
    }

    /// Duration of one cycle: its rotations and the dwell after each; one dwell where there are no rotations \[ns\].
    pub fn cycle_nanos(&self) -> i64 {
        if self.steps.is_empty() {
            return self.first_dwell_nanos;
        }
        self.steps
            .iter()
            .map(|s| s.rotation_nanos + s.dwell_nanos)
            .sum()
    }

    /// Duration of the whole program, from the start of the first dwell \[ns\]; `None`: until stopped.
    pub fn total_nanos(&self) -> Option<i64> {
        let cycles = i64::from(self.cycles?);
        if self.steps.is_empty() {
            return Some(cycles * self.first_dwell_nanos);
        }
        Some(self.first_dwell_nanos + cycles * self.cycle_nanos())
    }

    /// The dwell that ends `step`; `i64::MAX` where it lasts until stopped \[ns\].
    pub fn dwell_nanos(&self, step: u32) -> i64 {
        match self.step(step) {
            Some(s) => s.dwell_nanos,
            None if self.steps.is_empty() => self.total_nanos().unwrap_or(i64::MAX),
            None => self.first_dwell_nanos,
        }
    }

    /// What is planned after the end of the dwell of (`cycle`, `step`); `None`: until stopped \[ns\].
    pub fn nanos_after(&self, cycle: u32, step: u32) -> Option<i64> {
        let cycles = i64::from(self.cycles?);
        let done: i64 = self
            .steps
            .iter()
            .take(step as usize)
            .map(|s| s.rotation_nanos + s.dwell_nanos)
            .sum();
        Some(if self.steps.is_empty() {
            0
        } else {
            (cycles - i64::from(cycle)) * self.cycle_nanos() - done
        })
    }

    /// The time line from the start of the first dwell, as planned; endless where the program is.
    pub fn segments(&self) -> Segments<'_> {
        Segments {
            program: self,
            next: Some((0, 0, SegmentKind::Dwell)),
            at_nanos: 0,
        }
    }
}

/// Iterator over the time line of a [`Program`]; see [`Program::segments`].
#[derive(Clone, Debug)]
pub struct Segments<'a> {
    program: &'a Program,
    next: Option<(u32, u32, SegmentKind)>,
    at_nanos: i64,
}

impl Iterator for Segments<'_> {
    type Item = Segment;

    fn next(&mut self) -> Option<Segment> {
        let (cycle, step, kind) = self.next?;
        let duration = match (self.program.step(step), kind) {
            (Some(s), SegmentKind::Rotation) => s.rotation_nanos,
            _ => self.program.dwell_nanos(step),
        };
        let start_nanos = self.at_nanos;
        self.at_nanos = start_nanos.saturating_add(duration);
        self.next = match kind {
            SegmentKind::Rotation => Some((cycle, step, SegmentKind::Dwell)),
            SegmentKind::Dwell => self
                .program
                .next(cycle, step)
                .map(|(c, s)| (c, s, SegmentKind::Rotation)),
        };
        Some(Segment {
            cycle,
            step,
            kind,
            start_nanos,
            end_nanos: self.at_nanos,
        })
    }
}

/// Whether two pairs of joint angles put the block in the same attitude by whole turns.
fn same_pose(a: [f64; 2], b: [f64; 2]) -> bool {
    (0..2).all(|j| {
        let turned = (a[j] - b[j]).rem_euclid(TAU);
        turned.min(TAU - turned) < SAME_ANGLE_RAD
    })
}

/// Sums of quarter turns that return to zero do so only to the last bits; zero is what is meant.
fn without_dust(angle_rad: f64) -> f64 {
    if angle_rad.abs() < 1e-12 {
        0.0
    } else {
        angle_rad
    }
}

/// A, B, ... Z, then A2, B2, ...
fn letter(index: usize) -> String {
    let letter = char::from(b'A' + (index % 26) as u8);
    match index / 26 {
        0 => letter.to_string(),
        round => format!("{letter}{}", round + 1),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::scheme::{CableLimits, Rotation};

    fn eight() -> Program {
        Scheme::eight_position()
            .program(Turntable::default())
            .unwrap()
    }

    /// One cycle of the eight-position scheme is 10·500 + 4·38 + 6·20 = 5272 s.
    #[test]
    fn cycle_takes_5272_seconds() {
        assert_eq!(eight().cycle_nanos(), 5_272_000_000_000);
    }

    /// The positions are the paper's A to H, and each half returns to where it began.
    #[test]
    fn positions_are_a_to_h() {
        let names: String = eight().steps.iter().map(|s| s.position.as_str()).collect();
        assert_eq!(names, "BCDAEFGHEA");
    }

    /// Every rotation of the paper's scheme turns about a horizontal axis on the default table, and the six faces of the block
    /// all see gravity (up, in the axes of the block, passes through ±x, ±y, ±z).
    #[test]
    fn six_faces_and_horizontal_axes() {
        let program = eight();
        let mut faces: Vec<[i32; 3]> = Vec::new();
        for k in 0..=10u32 {
            let attitude = program.table.attitude(program.target(0, k));
            let up = attitude.inverse() * nalgebra::Vector3::z();
            let face = [
                up.x.round() as i32,
                up.y.round() as i32,
                up.z.round() as i32,
            ];
            if !faces.contains(&face) {
                faces.push(face);
            }
            if let Some(step) = program.step(k + 1) {
                let rates = if step.joint == Joint::Outer {
                    [1.0, 0.0]
                } else {
                    [0.0, 1.0]
                };
                let axis = attitude * program.table.body_rate(program.target(0, k), rates);
                assert!(axis.z.abs() < 1e-12, "rotation {}", k + 1);
            }
        }
        assert_eq!(faces.len(), 6);
    }

    /// The y-z scheme is the same program about (y, z), on its own default table.
    #[test]
    fn yz_scheme_maps_the_axes() {
        let scheme = Scheme::eight_position_yz();
        let table = scheme.default_table();
        assert_eq!((table.outer, table.inner), (Axis::Y, Axis::Z));
        let program = scheme.program(table).unwrap();
        let joints: Vec<_> = program
            .steps
            .iter()
            .map(|s| (s.joint, s.angle_rad))
            .collect();
        let reference: Vec<_> = eight()
            .steps
            .iter()
            .map(|s| (s.joint, s.angle_rad))
            .collect();
        assert_eq!(joints, reference);
        let message = scheme
            .program(Turntable::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains("about z"), "{message}");
    }

    /// With the gimbals the other way round, turns about x are turns of the inner joint.
    #[test]
    fn gimbal_order_maps_axes_to_joints() {
        let program = Scheme::eight_position()
            .program(Turntable::new(Axis::Y, Axis::X).unwrap())
            .unwrap();
        assert_eq!(program.steps[0].joint, Joint::Inner);
        assert_eq!(program.steps[4].joint, Joint::Outer);
    }

    /// Four hours hold 2.73 cycles: the time line says which step it is, and finite programs end after a last dwell.
    #[test]
    fn time_line_adds_up() {
        let program = eight();
        let end = program
            .segments()
            .find(|s| s.end_nanos > 14_400_000_000_000)
            .unwrap();
        assert_eq!((end.cycle, end.step, end.kind), (2, 7, SegmentKind::Dwell));
        let mut scheme = Scheme::eight_position();
        scheme.cycles = Some(2);
        let program = scheme.program(Turntable::default()).unwrap();
        let segments: Vec<_> = program.segments().collect();
        assert_eq!(segments.len(), 41);
        assert!(
            segments
                .windows(2)
                .all(|w| w[0].end_nanos == w[1].start_nanos)
        );
        assert_eq!(
            segments.last().unwrap().end_nanos,
            program.total_nanos().unwrap()
        );
        assert_eq!(
            program.total_nanos(),
            Some(500_000_000_000 + 2 * 5_272_000_000_000)
        );
    }

    /// The static scheme is one dwell that lasts until stopped.
    #[test]
    fn static_scheme_only_dwells() {
        let program = Scheme::stationary().program(Turntable::default()).unwrap();
        let segments: Vec<_> = program.segments().collect();
        assert_eq!(segments.len(), 1);
        assert_eq!(
            (segments[0].kind, segments[0].end_nanos),
            (SegmentKind::Dwell, i64::MAX)
        );
    }

    /// A rotation beyond the cable is refused by cycle, rotation, joint and limit.
    #[test]
    fn cable_limit_is_checked_before_motion() {
        let mut scheme = Scheme::eight_position();
        scheme.limits = CableLimits {
            outer: (-3.5, 3.5),
            ..CableLimits::default()
        };
        let message = scheme
            .program(Turntable::default())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("rotation 2 of cycle 0") && message.contains("outer_joint to 270.000"),
            "{message}"
        );
    }

    /// A scheme whose joint does not return winds the cable: found in whichever cycle it breaks, endless or not.
    #[test]
    fn winding_schemes_are_found() {
        let mut scheme = Scheme::new(
            "winding",
            vec![Rotation::new(About::Joint(Joint::Inner), -TAU / 4.0)],
        );
        let message = scheme
            .program(Turntable::default())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("rotation 1 of cycle 4") && message.contains("inner_joint"),
            "{message}"
        );
        assert!(message.contains("winds it by -90"), "{message}");
        scheme.cycles = Some(4);
        assert!(scheme.program(Turntable::default()).is_ok());
        scheme.cycles = None;
        scheme.limits = CableLimits::NONE;
        assert!(scheme.program(Turntable::default()).is_ok());
    }
}
