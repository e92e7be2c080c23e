//! Joint trajectories: cubic Hermite curves through positions and rates, and the trapezoid of rate as such a curve.
//!
//! Between the points (t₀, p₀, v₀) and (t₁, p₁, v₁), with h = t₁ − t₀ and s = (t − t₀)/h:
//!
//! ```text
//! p(s) = p₀ + (p₁ − p₀)(3s² − 2s³) + h v₀ (s − 2s² + s³) + h v₁ (s³ − s²)
//! ```
//!
//! Where the rate grows linearly (constant acceleration) this is exactly the parabola, so a trapezoid of rate needs a
//! point only where the acceleration changes.

use super::{JOINT_NAMES, Joint};
use crate::error::Error;
use crate::range;
use crate::time::seconds_to_nanos;

/// Times of points are whole nanoseconds, which moves the peak rate of a short motion by as much.
const TIME_ROUNDING: f64 = 1e-6;

/// One point of a joint trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// From the start of the trajectory \[ns\].
    pub time_from_start_nanos: i64,
    /// Angles (outer, inner) \[rad\].
    pub position: [f64; 2],
    /// Rates (outer, inner) \[rad/s\].
    pub velocity: [f64; 2],
}

/// A motion of both joints, cubic Hermite between points (what a `ros2_control` `joint_trajectory_controller` does with
/// positions and velocities). A trapezoid of rate is four points, and the cubic through them is that trapezoid exactly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// The points in order of time; an empty trajectory means: stop where you are.
    pub points: Vec<TrajectoryPoint>,
}

/// Angles and rates of both joints at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointState {
    /// Angles (outer, inner), continuous \[rad\].
    pub position: [f64; 2],
    /// Rates (outer, inner) \[rad/s\].
    pub velocity: [f64; 2],
}

/// The piece of a trajectory between two neighbouring points (or the hold before the first and after the last).
#[derive(Clone, Copy, Debug)]
pub struct Cubic {
    /// Start of the piece, from the start of the trajectory \[ns\].
    pub start_nanos: i64,
    duration_s: f64,
    from: JointState,
    to: JointState,
}

impl Cubic {
    fn hold(at: [f64; 2], start_nanos: i64) -> Self {
        let state = JointState {
            position: at,
            velocity: [0.0; 2],
        };
        Self {
            start_nanos,
            duration_s: 1.0,
            from: state,
            to: state,
        }
    }

    /// Whether neither joint moves on this piece.
    pub fn is_still(&self) -> bool {
        self.from == self.to && self.from.velocity == [0.0; 2]
    }

    /// Angles and rates `seconds` after the start of the piece.
    pub fn at(&self, seconds: f64) -> JointState {
        let s = seconds / self.duration_s;
        let mut state = self.from;
        for joint in 0..2 {
            let step = self.to.position[joint] - self.from.position[joint];
            let (v0, v1) = (self.from.velocity[joint], self.to.velocity[joint]);
            let along = s * s * (3.0 - 2.0 * s);
            let bend = s * (1.0 + s * (s - 2.0)) * v0 + s * s * (s - 1.0) * v1;
            state.position[joint] += step * along + self.duration_s * bend;
            state.velocity[joint] = step / self.duration_s * 6.0 * s * (1.0 - s)
                + v0 * (1.0 + s * (3.0 * s - 4.0))
                + v1 * s * (3.0 * s - 2.0);
        }
        state
    }

    /// Angular accelerations (outer, inner) `seconds` after the start of the piece \[rad/s²\].
    pub fn acceleration(&self, seconds: f64) -> [f64; 2] {
        let s = seconds / self.duration_s;
        [0, 1].map(|joint| {
            let mean = (self.to.position[joint] - self.from.position[joint]) / self.duration_s;
            let (v0, v1) = (self.from.velocity[joint], self.to.velocity[joint]);
            (6.0 * mean * (1.0 - 2.0 * s) + v0 * (6.0 * s - 4.0) + v1 * (6.0 * s - 2.0))
                / self.duration_s
        })
    }

    /// Largest magnitude of a joint's rate on this piece \[rad/s\]: the rate is a parabola, so at an end or at its vertex.
    pub fn peak_rate(&self, joint: usize) -> f64 {
        let (v0, v1) = (self.from.velocity[joint], self.to.velocity[joint]);
        let mean = (self.to.position[joint] - self.from.position[joint]) / self.duration_s;
        let mut peak = v0.abs().max(v1.abs());
        // v(s) = v0 + s (6 mean − 4 v0 − 2 v1) + s² (3 v0 + 3 v1 − 6 mean)
        let (slope, curvature) = (
            6.0 * mean - 4.0 * v0 - 2.0 * v1,
            3.0 * (v0 + v1) - 6.0 * mean,
        );
        if curvature != 0.0 {
            let vertex = -slope / (2.0 * curvature);
            if (0.0..=1.0).contains(&vertex) {
                peak = peak.max((v0 + vertex * (slope + vertex * curvature)).abs());
            }
        }
        peak
    }
}

impl Trajectory {
    /// Turns `joint` by `angle_rad` from rest to rest with a trapezoid of rate (a triangle, where `rate_rad_s` is never
    /// reached), starting where both joints stand at `from`.
    ///
    /// # Errors
    /// [`Error::Setting`] where the rate or the acceleration is not positive, or the angle is not finite.
    pub fn trapezoid(
        joint: Joint,
        from: [f64; 2],
        angle_rad: f64,
        rate_rad_s: f64,
        acceleration_rad_s2: f64,
    ) -> Result<Self, Error> {
        range::positive("rotation rate [rad/s]", rate_rad_s)?;
        range::positive("rotation acceleration [rad/s²]", acceleration_rad_s2)?;
        range::finite("rotation angle [rad]", angle_rad)?;
        let point = |time_s: f64, turned_rad: f64, rate_rad_s: f64| {
            let mut point = TrajectoryPoint {
                time_from_start_nanos: seconds_to_nanos(time_s),
                position: from,
                velocity: [0.0; 2],
            };
            point.position[joint.index()] += turned_rad;
            point.velocity[joint.index()] = rate_rad_s;
            point
        };
        if angle_rad == 0.0 {
            return Ok(Self {
                points: vec![point(0.0, 0.0, 0.0)],
            });
        }
        let sign = angle_rad.signum();
        let angle = angle_rad.abs();
        let ramp_angle = rate_rad_s * rate_rad_s / (2.0 * acceleration_rad_s2);
        let points = if angle > 2.0 * ramp_angle {
            let ramp_s = rate_rad_s / acceleration_rad_s2;
            let cruise_s = (angle - 2.0 * ramp_angle) / rate_rad_s;
            vec![
                point(0.0, 0.0, 0.0),
                point(ramp_s, sign * ramp_angle, sign * rate_rad_s),
                point(
                    ramp_s + cruise_s,
                    sign * (angle - ramp_angle),
                    sign * rate_rad_s,
                ),
                point(2.0 * ramp_s + cruise_s, angle_rad, 0.0),
            ]
        } else {
            let peak = (angle * acceleration_rad_s2).sqrt();
            let ramp_s = peak / acceleration_rad_s2;
            vec![
                point(0.0, 0.0, 0.0),
                point(ramp_s, angle_rad / 2.0, sign * peak),
                point(2.0 * ramp_s, angle_rad, 0.0),
            ]
        };
        // An angle below the resolution of the clock would give points that share a time.
        if points
            .windows(2)
            .any(|w| w[0].time_from_start_nanos >= w[1].time_from_start_nanos)
        {
            return Err(Error::setting(
                "rotation angle [rad]",
                angle_rad,
                "an angle that takes more than some nanoseconds to turn",
            ));
        }
        Ok(Self { points })
    }

    /// Brings both joints to rest from `state`, each at `deceleration_rad_s2`.
    ///
    /// # Errors
    /// [`Error::Setting`] where the deceleration is not positive.
    pub fn stop(state: JointState, deceleration_rad_s2: f64) -> Result<Self, Error> {
        range::positive("deceleration [rad/s²]", deceleration_rad_s2)?;
        let stop_nanos = state
            .velocity
            .map(|v| seconds_to_nanos(v.abs() / deceleration_rad_s2));
        let mut times = vec![0, stop_nanos[0], stop_nanos[1]];
        times.sort_unstable();
        times.dedup();
        let points = times
            .into_iter()
            .map(|nanos| {
                let mut point = TrajectoryPoint {
                    time_from_start_nanos: nanos,
                    position: state.position,
                    velocity: [0.0; 2],
                };
                for (joint, stop_nanos) in stop_nanos.iter().enumerate() {
                    let stop_s = *stop_nanos as f64 * 1e-9;
                    let left = if stop_s > 0.0 {
                        (1.0 - nanos as f64 * 1e-9 / stop_s).max(0.0)
                    } else {
                        0.0
                    };
                    point.velocity[joint] = state.velocity[joint] * left;
                    point.position[joint] +=
                        0.5 * state.velocity[joint] * stop_s * (1.0 - left * left);
                }
                point
            })
            .collect();
        Ok(Self { points })
    }

    /// Duration: time of the last point \[ns\].
    pub fn duration_nanos(&self) -> i64 {
        self.points.last().map_or(0, |p| p.time_from_start_nanos)
    }

    /// The piece that holds at `nanos` from the start; the first and the last position are held outside. `None` where
    /// there are no points.
    pub fn cubic(&self, nanos: i64) -> Option<Cubic> {
        let (first, last) = (self.points.first()?, self.points.last()?);
        if nanos < first.time_from_start_nanos {
            return Some(Cubic::hold(first.position, nanos));
        }
        let next = self
            .points
            .partition_point(|p| p.time_from_start_nanos <= nanos);
        let Some(to) = self.points.get(next) else {
            return Some(Cubic::hold(last.position, last.time_from_start_nanos));
        };
        let from = &self.points[next - 1];
        Some(Cubic {
            start_nanos: from.time_from_start_nanos,
            duration_s: (to.time_from_start_nanos - from.time_from_start_nanos) as f64 * 1e-9,
            from: JointState {
                position: from.position,
                velocity: from.velocity,
            },
            to: JointState {
                position: to.position,
                velocity: to.velocity,
            },
        })
    }

    /// Angles and rates at `nanos` from the start. `None` where there are no points.
    pub fn at(&self, nanos: i64) -> Option<JointState> {
        self.cubic(nanos)
            .map(|cubic| cubic.at((nanos - cubic.start_nanos) as f64 * 1e-9))
    }

    /// Checks that a table can follow: finite numbers, times that grow from zero or later, at rest at the end, no joint
    /// faster than `max_rate_rad_s`.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the joint, the point and the value.
    pub fn validate(&self, max_rate_rad_s: f64) -> Result<(), Error> {
        for (index, point) in self.points.iter().enumerate() {
            for (joint, name) in JOINT_NAMES.iter().enumerate() {
                let (position, velocity) = (point.position[joint], point.velocity[joint]);
                range::finite(
                    &format!("position of {name} at point {index} [rad]"),
                    position,
                )?;
                range::finite(
                    &format!("velocity of {name} at point {index} [rad/s]"),
                    velocity,
                )?;
            }
            let earliest = if index == 0 {
                0
            } else {
                self.points[index - 1].time_from_start_nanos + 1
            };
            if point.time_from_start_nanos < earliest {
                return Err(Error::setting(
                    format!("time_from_start of point {index} [ns]"),
                    point.time_from_start_nanos,
                    format!("at least {earliest}: times grow from point to point"),
                ));
            }
        }
        if let Some(last) = self.points.last() {
            for (name, velocity) in JOINT_NAMES.iter().zip(last.velocity) {
                if velocity != 0.0 {
                    let what = format!("velocity of {name} at the last point [rad/s]");
                    return Err(Error::setting(
                        what,
                        velocity,
                        "0: the trajectory ends at rest",
                    ));
                }
            }
        }
        for point in &self.points {
            let Some(cubic) = self.cubic(point.time_from_start_nanos) else {
                continue;
            };
            for (joint, name) in JOINT_NAMES.iter().enumerate() {
                let peak = cubic.peak_rate(joint);
                if peak > max_rate_rad_s * (1.0 + TIME_ROUNDING) {
                    return Err(Error::setting(
                        format!(
                            "rate of {name} after {:.3} s [rad/s]",
                            cubic.start_nanos as f64 * 1e-9
                        ),
                        format!("{peak:.6}"),
                        format!("at most {max_rate_rad_s:.6}"),
                    ));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const RATE: f64 = 5.0 * std::f64::consts::PI / 180.0;
    const ACCELERATION: f64 = RATE / 2.0;

    /// Table 1 of the paper: 180 deg take 38 s and 90 deg take 20 s.
    #[test]
    fn trapezoid_takes_the_papers_times() {
        for (angle_deg, seconds) in [(180.0_f64, 38.0), (-90.0, 20.0)] {
            let t = Trajectory::trapezoid(
                Joint::Inner,
                [1.0, 2.0],
                angle_deg.to_radians(),
                RATE,
                ACCELERATION,
            )
            .unwrap();
            assert_eq!(t.points.len(), 4);
            assert_eq!(t.duration_nanos(), seconds_to_nanos(seconds));
            let end = t.at(t.duration_nanos()).unwrap();
            assert_eq!(end.position[0], 1.0);
            assert!((end.position[1] - 2.0 - angle_deg.to_radians()).abs() < 1e-15);
        }
    }

    /// The cubic between the points of a trapezoid is the parabola of constant acceleration, in angle and in rate.
    #[test]
    fn trapezoid_is_exact_between_its_points() {
        let t = Trajectory::trapezoid(
            Joint::Outer,
            [0.0; 2],
            -std::f64::consts::FRAC_PI_2,
            RATE,
            ACCELERATION,
        )
        .unwrap();
        let state = t.at(700_000_000).unwrap();
        assert!((state.position[0] + 0.5 * ACCELERATION * 0.49).abs() < 1e-14);
        assert!((state.velocity[0] + ACCELERATION * 0.7).abs() < 1e-14);
        let cruise = t.at(5_000_000_000).unwrap();
        assert!((cruise.velocity[0] + RATE).abs() < 1e-14);
        assert!((cruise.position[0] + 0.5 * RATE * 2.0 + RATE * 3.0).abs() < 1e-14);
        let acceleration = |nanos: i64| {
            let piece = t.cubic(nanos).unwrap();
            piece.acceleration((nanos - piece.start_nanos) as f64 * 1e-9)[0]
        };
        assert!((acceleration(700_000_000) + ACCELERATION).abs() < 1e-12);
        assert!(acceleration(5_000_000_000).abs() < 1e-12);
    }

    /// A short turn never reaches the cruise rate: a triangle that stays below it.
    #[test]
    fn short_turn_is_a_triangle() {
        let t = Trajectory::trapezoid(Joint::Outer, [0.0; 2], 0.01, RATE, ACCELERATION).unwrap();
        assert_eq!(t.points.len(), 3);
        assert!(t.points[1].velocity[0] < RATE);
        t.validate(RATE).unwrap();
    }

    /// Outside its points a trajectory holds, at rest.
    #[test]
    fn holds_before_and_after() {
        let mut t =
            Trajectory::trapezoid(Joint::Outer, [0.3, 0.4], 0.5, RATE, ACCELERATION).unwrap();
        for point in &mut t.points {
            point.time_from_start_nanos += 1000;
        }
        assert_eq!(
            t.at(0).unwrap(),
            JointState {
                position: [0.3, 0.4],
                velocity: [0.0; 2]
            }
        );
        assert_eq!(
            t.at(i64::MAX / 2).unwrap(),
            JointState {
                position: [0.8, 0.4],
                velocity: [0.0; 2]
            }
        );
        assert_eq!(Trajectory::default().at(0), None);
    }

    /// A stop from motion decelerates each joint evenly and never turns back.
    #[test]
    fn stop_decelerates_each_joint() {
        let moving = JointState {
            position: [1.0, -1.0],
            velocity: [0.1, -0.04],
        };
        let t = Trajectory::stop(moving, 0.05).unwrap();
        assert_eq!(t.duration_nanos(), 2_000_000_000);
        let mid = t.at(400_000_000).unwrap();
        assert!((mid.velocity[0] - 0.08).abs() < 1e-12 && (mid.velocity[1] + 0.02).abs() < 1e-12);
        let end = t.at(t.duration_nanos()).unwrap();
        assert!((end.position[0] - 1.1).abs() < 1e-12 && (end.position[1] + 1.016).abs() < 1e-12);
    }

    /// What a table cannot follow is refused, and the message names the joint and the point.
    #[test]
    fn unusable_trajectories_are_refused() {
        let good = Trajectory::trapezoid(Joint::Inner, [0.0; 2], 1.5, RATE, ACCELERATION).unwrap();
        good.validate(RATE).unwrap();
        assert!(
            good.validate(0.9 * RATE)
                .unwrap_err()
                .to_string()
                .contains("inner_joint")
        );
        let mut bad = good.clone();
        bad.points[2].position[0] = f64::NAN;
        assert!(
            bad.validate(RATE)
                .unwrap_err()
                .to_string()
                .contains("outer_joint at point 2")
        );
        let mut bad = good.clone();
        bad.points[2].time_from_start_nanos = bad.points[1].time_from_start_nanos;
        assert!(
            bad.validate(RATE)
                .unwrap_err()
                .to_string()
                .contains("point 2")
        );
        let mut bad = good;
        bad.points[3].velocity[1] = 0.01;
        assert!(
            bad.validate(RATE)
                .unwrap_err()
                .to_string()
                .contains("last point")
        );
    }

    /// A cubic between slow points can still swing fast in the middle; that peak is what is held against the limit.
    #[test]
    fn peak_rate_finds_the_middle() {
        let point = |nanos, position| TrajectoryPoint {
            time_from_start_nanos: nanos,
            position: [position, 0.0],
            velocity: [0.0; 2],
        };
        let t = Trajectory {
            points: vec![point(0, 0.0), point(1_000_000_000, 1.0)],
        };
        assert!((t.cubic(0).unwrap().peak_rate(0) - 1.5).abs() < 1e-12);
        assert!(t.validate(1.4).is_err());
    }
}
