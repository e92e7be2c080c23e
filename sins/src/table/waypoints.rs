//! A motion as others command it: points with rates, or without.
//!
//! A `joint_trajectory_controller` goes from point to point on a cubic where both have rates, and on a straight line where one
//! has none. A straight line begins and ends with a jump of the rate, which no drive does: here the corners are rounded by a
//! parabola of the angle (constant acceleration) over [`BLEND_S`] on each side, or over a quarter of the way where it is short.

use super::trajectory::{JointState, Trajectory, TrajectoryPoint};
use crate::error::Error;
use crate::time::seconds_to_nanos;

/// Half of the time in which a corner is rounded \[s\].
const BLEND_S: f64 = 0.1;

/// One point of a commanded motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// From the start of the motion \[ns\].
    pub time_from_start_nanos: i64,
    /// Angles (outer, inner) \[rad\].
    pub position: [f64; 2],
    /// Rates (outer, inner), where the command has them \[rad/s\].
    pub velocity: Option<[f64; 2]>,
}

/// A commanded motion; without points: stop.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Waypoints {
    /// In order of time.
    pub points: Vec<Waypoint>,
}

impl From<Trajectory> for Waypoints {
    fn from(trajectory: Trajectory) -> Self {
        let points = trajectory.points.into_iter();
        Self {
            points: points
                .map(|point| Waypoint {
                    time_from_start_nanos: point.time_from_start_nanos,
                    position: point.position,
                    velocity: Some(point.velocity),
                })
                .collect(),
        }
    }
}

/// A side of a corner: the rates just before or just after it, and how long its piece is \[ns\].
#[derive(Clone, Copy)]
struct Side {
    rates: [f64; 2],
    nanos: i64,
}

impl Waypoints {
    /// Duration: time of the last point \[ns\].
    pub fn duration_nanos(&self) -> i64 {
        self.points.last().map_or(0, |p| p.time_from_start_nanos)
    }

    /// The motion of joints that are at `from` when it starts. Where every point has rates it is the points themselves.
    ///
    /// # Errors
    /// As [`Trajectory::validate`], of the points as they were given.
    pub fn trajectory(&self, from: JointState) -> Result<Trajectory, Error> {
        let given = Trajectory {
            points: self
                .points
                .iter()
                .map(|point| TrajectoryPoint {
                    time_from_start_nanos: point.time_from_start_nanos,
                    position: point.position,
                    velocity: point.velocity.unwrap_or_default(),
                })
                .collect(),
        };
        given.validate(f64::INFINITY)?;
        if self.points.iter().all(|point| point.velocity.is_some()) {
            return Ok(given);
        }
        let mut points = self.points.clone();
        if points[0].time_from_start_nanos > 0 {
            points.insert(
                0,
                Waypoint {
                    time_from_start_nanos: 0,
                    position: from.position,
                    velocity: Some(from.velocity),
                },
            );
        } else {
            points[0].velocity = points[0].velocity.or(Some(from.velocity));
        }
        let sides = sides(&points);
        let mut smooth = Vec::new();
        for (index, point) in points.iter().enumerate() {
            let before = index.checked_sub(1).map(|piece| sides[piece].1);
            let after = sides.get(index).map(|piece| piece.0);
            corner(point, before, after, &mut smooth);
        }
        Ok(Trajectory { points: smooth })
    }
}

/// Of each piece, the rates at its start and at its end.
fn sides(points: &[Waypoint]) -> Vec<(Side, Side)> {
    points
        .windows(2)
        .map(|pair| {
            let nanos = pair[1].time_from_start_nanos - pair[0].time_from_start_nanos;
            let seconds = nanos as f64 * 1e-9;
            let line = [0, 1].map(|j| (pair[1].position[j] - pair[0].position[j]) / seconds);
            let (first, last) = match (pair[0].velocity, pair[1].velocity) {
                (Some(first), Some(last)) => (first, last),
                _ => (line, line),
            };
            let side = |rates| Side { rates, nanos };
            (side(first), side(last))
        })
        .collect()
}

/// The point, or two points beside it with the rates of their sides where these differ. The motion rests at its end, and begins
/// with the rates that the joints have.
fn corner(
    point: &Waypoint,
    before: Option<Side>,
    after: Option<Side>,
    smooth: &mut Vec<TrajectoryPoint>,
) {
    let at = |nanos: i64, rates: [f64; 2]| {
        let seconds = nanos as f64 * 1e-9;
        TrajectoryPoint {
            time_from_start_nanos: point.time_from_start_nanos + nanos,
            position: [0, 1].map(|j| point.position[j] + rates[j] * seconds),
            velocity: rates,
        }
    };
    let blend = |side: Side| seconds_to_nanos(BLEND_S).min(side.nanos / 4).max(1);
    match (before, after) {
        (Some(before), Some(after)) if before.rates != after.rates => {
            let blend = blend(before).min(blend(after));
            smooth.extend([at(-blend, before.rates), at(blend, after.rates)]);
        }
        (Some(before), Some(_)) => smooth.push(at(0, before.rates)),
        (before, after) => {
            let held = point
                .velocity
                .filter(|_| before.is_none())
                .unwrap_or_default();
            let own = at(0, held);
            match before.or(after) {
                Some(side) if side.rates != held => {
                    let inner = if before.is_some() { -1 } else { 1 };
                    let beside = at(inner * 2 * blend(side), side.rates);
                    if before.is_some() {
                        smooth.extend([beside, own]);
                    } else {
                        smooth.extend([own, beside]);
                    }
                }
                _ => smooth.push(own),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::Joint;

    fn waypoint(seconds: f64, outer: f64) -> Waypoint {
        Waypoint {
            time_from_start_nanos: seconds_to_nanos(seconds),
            position: [outer, 0.0],
            velocity: None,
        }
    }

    /// Positions alone: straight between them, through rest at both ends, without a jump of angle or rate, and past every point
    /// by no more than a rounded corner.
    #[test]
    fn positions_alone_are_straight_lines() {
        let motion = Waypoints {
            points: vec![waypoint(2.0, 0.2), waypoint(5.0, 0.2), waypoint(7.0, -0.4)],
        };
        let trajectory = motion.trajectory(JointState::default()).unwrap();
        trajectory.validate(1.0).unwrap();
        let at = |seconds| trajectory.at(seconds_to_nanos(seconds)).unwrap();
        assert!((at(1.0).position[0] - 0.1).abs() < 1e-12);
        assert!((at(1.0).velocity[0] - 0.1).abs() < 1e-12);
        assert!(at(3.5).velocity[0].abs() < 1e-12);
        assert!((at(6.0).velocity[0] + 0.3).abs() < 1e-12);
        assert_eq!(at(7.0).position[0], -0.4);
        assert_eq!((at(0.0).velocity, at(7.0).velocity), ([0.0; 2], [0.0; 2]));
        for (seconds, angle) in [(2.0, 0.2), (5.0, 0.2)] {
            assert!((at(seconds).position[0] - angle).abs() < 0.3 * BLEND_S);
        }
        let mut before = at(0.0);
        for step in 1..=7000 {
            let now = at(f64::from(step) * 1e-3);
            assert!(
                (now.velocity[0] - before.velocity[0]).abs() < 0.02,
                "{step}"
            );
            before = now;
        }
    }

    /// A single point is reached from where the joints stand.
    #[test]
    fn a_single_position_is_a_way() {
        let motion = Waypoints {
            points: vec![waypoint(4.0, 1.0)],
        };
        let from = JointState {
            position: [0.5, 0.0],
            velocity: [0.0; 2],
        };
        let trajectory = motion.trajectory(from).unwrap();
        assert_eq!(trajectory.at(0).unwrap(), from);
        let middle = trajectory.at(seconds_to_nanos(2.0)).unwrap();
        assert!((middle.position[0] - 0.75).abs() < 1e-12);
    }

    /// Where every point has rates they are what they were; times that do not grow are refused as before.
    #[test]
    fn rates_are_taken_as_they_are() {
        let turn = Trajectory::trapezoid(Joint::Outer, [0.0; 2], 1.0, 0.1, 0.1).unwrap();
        let same = Waypoints::from(turn.clone()).trajectory(JointState::default());
        assert_eq!(same.unwrap(), turn);
        let twice = Waypoints {
            points: vec![waypoint(1.0, 0.1), waypoint(1.0, 0.2)],
        };
        let refused = twice.trajectory(JointState::default()).unwrap_err();
        assert!(refused.to_string().contains("times grow"), "{refused}");
    }
}
