//! The simulated table: follows joint trajectories as a `joint_trajectory_controller` would.

use crate::error::Error;
use crate::range;
use crate::table::{Cubic, JOINT_NAMES, JointState, Trajectory, TrajectoryPoint, Waypoints};
use crate::time::Stamp;
use serde::{Deserialize, Serialize};

/// What the drives can do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableSettings {
    /// A trajectory that asks for more is refused \[rad/s\].
    pub max_rate_rad_s: f64,
    /// With this the table stops when it is told to stop \[rad/s²\].
    pub stop_deceleration_rad_s2: f64,
    /// A trajectory whose first point lies further from where the joint stands is refused \[rad\].
    pub start_tolerance_rad: f64,
    /// Where the joints (outer, inner) stand at first \[rad\].
    pub start: [f64; 2],
    /// Joints (outer, inner) whose drive is blocked: a command is taken, and the joint stays where it is.
    pub stuck: [bool; 2],
}

impl Default for TableSettings {
    fn default() -> Self {
        Self {
            max_rate_rad_s: 60f64.to_radians(),
            stop_deceleration_rad_s2: 2.5f64.to_radians(),
            start_tolerance_rad: 0.1f64.to_radians(),
            start: [0.0; 2],
            stuck: [false; 2],
        }
    }
}

#[derive(Clone, Debug)]
struct Motion {
    start: Stamp,
    /// What the joints do.
    trajectory: Trajectory,
    /// What they were told to do: the same, unless a joint is stuck.
    planned: Trajectory,
}

impl Motion {
    fn cubic(&self, at: Stamp) -> Option<Cubic> {
        self.trajectory.cubic(at.nanos() - self.start.nanos())
    }

    fn end(&self) -> Stamp {
        self.start.plus_nanos(self.trajectory.duration_nanos())
    }
}

/// The joints of the table and the motion they are in. Angles and rates never jump.
#[derive(Clone, Debug)]
pub struct Table {
    settings: TableSettings,
    /// What was under way before the active motion: sensors that are late still feel it.
    previous: Option<Motion>,
    active: Motion,
    pending: Option<Motion>,
}

impl Table {
    /// A table at rest.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting means nothing.
    pub fn new(settings: TableSettings, now: Stamp) -> Result<Self, Error> {
        for (name, value) in [
            ("max rate of the table [rad/s]", settings.max_rate_rad_s),
            (
                "stop deceleration [rad/s²]",
                settings.stop_deceleration_rad_s2,
            ),
            ("start tolerance [rad]", settings.start_tolerance_rad),
        ] {
            range::positive(name, value)?;
        }
        let rest = Trajectory {
            points: vec![TrajectoryPoint {
                time_from_start_nanos: 0,
                position: settings.start,
                velocity: [0.0; 2],
            }],
        };
        rest.validate(settings.max_rate_rad_s)?;
        Ok(Self {
            settings,
            previous: None,
            active: Motion {
                start: now,
                planned: rest.clone(),
                trajectory: rest,
            },
            pending: None,
        })
    }

    /// Takes a trajectory that starts at `start` (`None`, or a moment that is over: now) and replaces what is under way
    /// or waiting from then on. One without points stops both joints now. Hands back when it starts.
    ///
    /// # Errors
    /// [`Error::Setting`] where the table cannot follow: times out of order, not finite, too fast, or a first point away from
    /// where the joint stands then. What was under way goes on.
    pub fn command(
        &mut self,
        now: Stamp,
        start: Option<Stamp>,
        trajectory: &Trajectory,
    ) -> Result<Stamp, Error> {
        if trajectory.points.is_empty() {
            let stop = Trajectory::stop(self.state(now), self.settings.stop_deceleration_rad_s2)?;
            self.begin(Motion {
                start: now,
                planned: stop.clone(),
                trajectory: stop,
            });
            self.pending = None;
            return Ok(now);
        }
        trajectory.validate(self.settings.max_rate_rad_s)?;
        let start = start.unwrap_or(now).max(now);
        // What starts later replaces what waited, so only the active motion leads up to it.
        let from = state_of(&self.active, start);
        let here = TrajectoryPoint {
            time_from_start_nanos: 0,
            position: from.position,
            velocity: from.velocity,
        };
        let mut trajectory = trajectory.clone();
        if trajectory.points[0].time_from_start_nanos > 0 {
            trajectory.points.insert(0, here);
        } else {
            for (joint, name) in JOINT_NAMES.iter().enumerate() {
                let (wanted, actual) = (trajectory.points[0].position[joint], from.position[joint]);
                if (wanted - actual).abs() > self.settings.start_tolerance_rad {
                    return Err(Error::setting(
                        format!("first point of {name} [deg]"),
                        format!("{:.4}", wanted.to_degrees()),
                        format!("{:.4}, where the joint stands", actual.to_degrees()),
                    ));
                }
            }
            trajectory.points[0] = here;
        }
        trajectory.validate(self.settings.max_rate_rad_s)?;
        let planned = trajectory.clone();
        for point in &mut trajectory.points {
            for joint in (0..2).filter(|joint| self.settings.stuck[*joint]) {
                point.position[joint] = from.position[joint];
                point.velocity[joint] = 0.0;
            }
        }
        let motion = Motion {
            start,
            trajectory,
            planned,
        };
        if start <= now {
            self.begin(motion);
            self.pending = None;
        } else {
            self.pending = Some(motion);
        }
        Ok(start)
    }

    /// As [`Self::command`], for a motion whose points may have no rates: from where the joints are when it starts.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub fn follow(
        &mut self,
        now: Stamp,
        start: Option<Stamp>,
        motion: &Waypoints,
    ) -> Result<Stamp, Error> {
        if motion.points.is_empty() {
            return self.command(now, start, &Trajectory::default());
        }
        let from = state_of(&self.active, start.unwrap_or(now).max(now));
        self.command(now, start, &motion.trajectory(from)?)
    }

    /// Angles and rates at `at`, which is not before the start of the motion before the active one.
    pub fn state(&self, at: Stamp) -> JointState {
        state_of(self.motion(at), at)
    }

    /// Angles and rates that the joints should have at `at` by the motion they were told.
    pub fn planned(&self, at: Stamp) -> JointState {
        let motion = self.motion(at);
        let nanos = at.nanos() - motion.start.nanos();
        motion.planned.at(nanos).unwrap_or_default()
    }

    /// Whether no joint moves between `from` and `to`.
    pub fn rests(&self, from: Stamp, to: Stamp) -> bool {
        self.active.start <= from
            && self.active.end() <= from
            && self.pending.as_ref().is_none_or(|p| p.start >= to)
    }

    /// The smooth pieces between `from` and `to`: moments \[ns after `from`\] at which the acceleration changes, both ends
    /// included, in order.
    pub(super) fn breaks(&self, from: Stamp, to: Stamp, breaks: &mut Vec<i64>) {
        breaks.clear();
        breaks.push(0);
        let mut add = |motion: &Motion| {
            let begin = motion.start.nanos() - from.nanos();
            let times = motion
                .trajectory
                .points
                .iter()
                .map(|p| begin + p.time_from_start_nanos);
            breaks.extend(
                times
                    .chain([begin])
                    .filter(|t| *t > 0 && *t < to.nanos() - from.nanos()),
            );
        };
        if let Some(previous) = self.previous.as_ref().filter(|_| self.active.start > from) {
            add(previous);
        }
        add(&self.active);
        if let Some(pending) = &self.pending {
            add(pending);
        }
        breaks.push(to.nanos() - from.nanos());
        breaks.sort_unstable();
        breaks.dedup();
    }

    /// The smooth piece that holds just after `at`, and how far into it `at` lies \[s\].
    pub(super) fn piece(&self, at: Stamp) -> Option<(Cubic, f64)> {
        let motion = self.motion(at);
        let cubic = motion.cubic(at)?;
        Some((
            cubic,
            at.seconds_since(motion.start.plus_nanos(cubic.start_nanos)),
        ))
    }

    /// Lets a waiting motion take over when `now` has reached its start.
    pub fn advance(&mut self, now: Stamp) {
        if let Some(pending) = self.pending.take_if(|p| p.start <= now) {
            self.begin(pending);
        }
    }

    fn begin(&mut self, motion: Motion) {
        self.previous = Some(std::mem::replace(&mut self.active, motion));
    }

    fn motion(&self, at: Stamp) -> &Motion {
        if let Some(pending) = self.pending.as_ref().filter(|p| p.start <= at) {
            return pending;
        }
        let previous = self.previous.as_ref().filter(|_| at < self.active.start);
        previous.unwrap_or(&self.active)
    }
}

fn state_of(motion: &Motion, at: Stamp) -> JointState {
    // A motion always has points: it begins where the table stood.
    motion
        .trajectory
        .at(at.nanos() - motion.start.nanos())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::Joint;

    fn at(seconds: f64) -> Stamp {
        Stamp::default().plus_seconds(seconds)
    }

    fn turn(from: [f64; 2], degrees: f64) -> Trajectory {
        Trajectory::trapezoid(Joint::Outer, from, degrees.to_radians(), 0.1, 0.05).unwrap()
    }

    fn table() -> Table {
        Table::new(TableSettings::default(), at(0.0)).unwrap()
    }

    /// A trajectory with a later start waits for it; one without starts at once.
    #[test]
    fn starts_when_told() {
        let mut table = table();
        assert_eq!(
            table
                .command(at(1.0), Some(at(5.0)), &turn([0.0; 2], 30.0))
                .unwrap(),
            at(5.0)
        );
        assert!(table.rests(at(1.0), at(5.0)) && !table.rests(at(4.9), at(5.1)));
        assert_eq!(table.state(at(5.0)).position[0], 0.0);
        assert!(table.state(at(6.0)).position[0] > 0.0);
        table.advance(at(6.0));
        assert!((table.state(at(60.0)).position[0] - 30f64.to_radians()).abs() < 1e-12);
        assert!(table.rests(at(60.0), at(61.0)));
    }

    /// A start that is over when the command arrives means now, and nothing is left out.
    #[test]
    fn late_command_starts_now() {
        let mut table = table();
        assert_eq!(
            table
                .command(at(9.0), Some(at(5.0)), &turn([0.0; 2], 30.0))
                .unwrap(),
            at(9.0)
        );
    }

    /// Stop in the middle: no jump of angle or rate, and rest after the deceleration; what waited is forgotten.
    #[test]
    fn stops_smoothly() {
        let mut table = table();
        table.command(at(0.0), None, &turn([0.0; 2], 90.0)).unwrap();
        let before = table.state(at(7.0));
        table
            .command(
                at(7.0),
                Some(at(500.0)),
                &turn(table.state(at(500.0)).position, 5.0),
            )
            .unwrap();
        table
            .command(at(7.0), None, &Trajectory::default())
            .unwrap();
        let after = table.state(at(7.0));
        assert!(
            (before.position[0] - after.position[0]).abs() < 1e-15
                && before.velocity == after.velocity
        );
        assert_eq!(table.state(at(20.0)).velocity, [0.0; 2]);
        assert!(table.rests(at(20.0), at(1000.0)));
    }

    /// A trajectory that begins elsewhere is refused with both angles, and what was under way goes on.
    #[test]
    fn distant_first_point_is_refused() {
        let mut table = table();
        let message = table
            .command(at(0.0), None, &turn([0.5, 0.0], 10.0))
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("outer_joint") && message.contains("28.6479"),
            "{message}"
        );
        assert_eq!(table.state(at(5.0)), JointState::default());
    }

    /// Encoder errors in the first point are taken up by the motion: the table starts where it really stands.
    #[test]
    fn small_offset_of_the_first_point_is_no_jump() {
        let mut table = table();
        table
            .command(at(0.0), None, &turn([1e-4, 0.0], 10.0))
            .unwrap();
        assert_eq!(table.state(at(0.0)).position[0], 0.0);
        assert!((table.state(at(100.0)).position[0] - 1e-4 - 10f64.to_radians()).abs() < 1e-12);
    }

    /// A moment before the stop is that of the motion that was under way then, for sensors that are late.
    #[test]
    fn the_motion_before_is_remembered() {
        let mut table = table();
        table.command(at(0.0), None, &turn([0.0; 2], 90.0)).unwrap();
        let before = table.state(at(6.9));
        table
            .command(at(7.0), None, &Trajectory::default())
            .unwrap();
        assert_eq!(table.state(at(6.9)), before);
        let mut breaks = Vec::new();
        table.breaks(at(6.9), at(7.1), &mut breaks);
        assert_eq!(breaks, [0, 100_000_000, 200_000_000]);
        assert!(!table.rests(at(6.9), at(100.0)));
    }

    /// A stuck joint stays, the other goes, and the plan is what was commanded.
    #[test]
    fn a_stuck_joint_stays() {
        let settings = TableSettings {
            stuck: [true, false],
            ..TableSettings::default()
        };
        let mut table = Table::new(settings, at(0.0)).unwrap();
        let mut both = turn([0.0; 2], 30.0);
        for point in &mut both.points {
            point.position[1] = -point.position[0];
            point.velocity[1] = -point.velocity[0];
        }
        table.command(at(0.0), None, &both).unwrap();
        let (actual, planned) = (table.state(at(60.0)), table.planned(at(60.0)));
        assert_eq!(actual.position, [0.0, -30f64.to_radians()]);
        assert_eq!(planned.position, [30f64.to_radians(), -30f64.to_radians()]);
    }

    /// Faster than the drives is refused.
    #[test]
    fn over_rate_is_refused() {
        let settings = TableSettings {
            max_rate_rad_s: 0.05,
            ..TableSettings::default()
        };
        let mut table = Table::new(settings, at(0.0)).unwrap();
        let message = table
            .command(at(0.0), None, &turn([0.0; 2], 90.0))
            .unwrap_err()
            .to_string();
        assert!(message.contains("rate of outer_joint"), "{message}");
    }
}
