//! The table as an action server: FollowJointTrajectory goals, as a ros2_control `joint_trajectory_controller` takes them.
//!
//! A goal is executed as a trajectory of the topic is. What speaks against it is said in the result of a goal that was
//! accepted and aborted at once, for a rejection carries no reason.

use ros_node::{ActionServer, GoalHandle, Node};
use ros2_interfaces::control_msgs::{
    FollowJointTrajectoryFeedback as Feedback, FollowJointTrajectoryGoal as Goal,
    FollowJointTrajectoryResult as Outcome, JointTolerance,
};
use ros2_interfaces::trajectory_msgs::JointTrajectoryPoint;
use rotary_sins_msgs::convert::{ConvertError, FromMessage, header, stamp_from_time};
use rotary_sins_msgs::interfaces::actions::FOLLOW_JOINT_TRAJECTORY;
use sins::simulation::Simulator;
use sins::table::{self, JOINT_NAMES, JointState, Trajectory, Waypoints, violation};
use sins::time::{Stamp, seconds_to_nanos};

/// Simulated time between two feedbacks \[s\].
const FEEDBACK_PERIOD_S: f64 = 0.1;
/// Tolerances where a goal has none: at the end \[rad\], and so long after it \[s\]. On the way there is none.
const GOAL_TOLERANCE_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;
const GOAL_TIME_TOLERANCE_S: f64 = 1.0;

type Tolerances = [table::JointTolerance; 2];

/// The goal under way.
struct Active {
    handle: GoalHandle<Goal, Outcome, Feedback>,
    start: Stamp,
    end: Stamp,
    deadline: Stamp,
    path: Tolerances,
    goal: Tolerances,
    next_feedback: Stamp,
}

/// A goal that can be executed.
#[derive(Debug)]
struct Wanted {
    start: Option<Stamp>,
    trajectory: Waypoints,
    patience_s: f64,
    path: Tolerances,
    goal: Tolerances,
}

/// The server and what it executes.
pub struct Follower {
    /// Name of the action after remapping, for log lines.
    action: String,
    server: ActionServer<Goal, Outcome, Feedback>,
    active: Option<Active>,
}

impl Follower {
    /// Creates the server.
    ///
    /// # Errors
    /// A name that is none, or a middleware that refuses.
    pub fn new(node: &Node) -> ros_node::Result<Self> {
        Ok(Self {
            action: node.resolve_service(FOLLOW_JOINT_TRAJECTORY.name)?,
            server: node.serve_action(
                &FOLLOW_JOINT_TRAJECTORY,
                outcome(
                    Outcome::INVALID_GOAL,
                    "given up: the table's node ends".to_owned(),
                ),
            )?,
            active: None,
        })
    }

    /// Takes new goals and cancels. Says how many motions began and how many goals were refused.
    pub fn take_requests(&mut self, simulator: &mut Simulator) -> (u64, u64) {
        let (mut started, mut refused) = (0, 0);
        while let Some(request) = self.server.try_recv() {
            let (goal, handle) = request.accept();
            match begin(&goal, simulator) {
                Ok((wanted, start)) => {
                    started += 1;
                    self.replaced_by("a newer goal");
                    let end = start.plus_nanos(wanted.trajectory.duration_nanos());
                    self.active = Some(Active {
                        handle,
                        start,
                        end,
                        deadline: end.plus_seconds(wanted.patience_s),
                        path: wanted.path,
                        goal: wanted.goal,
                        next_feedback: simulator.plant().now(),
                    });
                }
                Err(outcome) => {
                    refused += 1;
                    tracing::warn!("{}: refused: {}", self.action, outcome.error_string);
                    handle.abort(&outcome);
                }
            }
        }
        if let Some(active) = self.active.take_if(|a| a.handle.is_cancel_requested()) {
            stop(simulator, &self.action);
            tracing::info!("{}: cancelled", self.action);
            let why = "cancelled: the table stops".to_owned();
            active.handle.canceled(&outcome(Outcome::SUCCESSFUL, why));
        }
        (started, refused)
    }

    /// Before the node stops being active: the goal ends, and the table with it as soon as time goes on.
    pub fn give_up(&mut self, simulator: &mut Simulator, why: &str) {
        if let Some(active) = self.active.take() {
            stop(simulator, &self.action);
            tracing::info!("{}: given up: {why}", self.action);
            let why = format!("given up: {why}");
            active.handle.abort(&outcome(Outcome::INVALID_GOAL, why));
        }
    }

    /// Something else moves the table from now on.
    pub fn replaced_by(&mut self, what: &str) {
        if let Some(active) = self.active.take() {
            tracing::info!("{}: given up for {what}", self.action);
            let why = format!("given up: {what} took its place");
            active.handle.abort(&outcome(Outcome::INVALID_GOAL, why));
        }
    }

    /// Holds the table against the goal, after every step.
    pub fn check(&mut self, simulator: &mut Simulator) {
        let Some(active) = &mut self.active else {
            return;
        };
        let plant = simulator.plant();
        let (now, joints, desired) = (plant.now(), plant.joints(), plant.planned_joints());
        let actual = JointState {
            position: joints.position,
            velocity: joints.velocity,
        };
        if now >= active.next_feedback {
            active.next_feedback = now.plus_nanos(seconds_to_nanos(FEEDBACK_PERIOD_S));
            let from_start = now.nanos() - active.start.nanos();
            let feedback = feedback(now, from_start, &desired, &actual);
            active.handle.feedback(feedback);
        }
        let (over, tolerances) = if now < active.end {
            (false, &active.path)
        } else {
            (true, &active.goal)
        };
        let outcome = match violation(&desired, &actual, tolerances) {
            None if !over => return,
            None => outcome(Outcome::SUCCESSFUL, String::new()),
            Some(_) if over && now <= active.deadline => return,
            Some(what) if over => outcome(Outcome::GOAL_TOLERANCE_VIOLATED, what),
            Some(what) => outcome(Outcome::PATH_TOLERANCE_VIOLATED, what),
        };
        let Some(active) = self.active.take() else {
            return;
        };
        if outcome.error_code == Outcome::SUCCESSFUL {
            active.handle.succeed(&outcome);
        } else {
            tracing::warn!(
                "{}: {}: {}",
                self.action,
                outcome.error_name(),
                outcome.error_string
            );
            stop(simulator, &self.action);
            active.handle.abort(&outcome);
        }
    }
}

/// Hands the goal to the table.
fn begin(goal: &Goal, simulator: &mut Simulator) -> Result<(Wanted, Stamp), Outcome> {
    let wanted = wanted(goal, simulator.plant().now())?;
    let start = simulator
        .follow(wanted.start, &wanted.trajectory)
        .map_err(|error| outcome(Outcome::INVALID_GOAL, error.to_string()))?;
    Ok((wanted, start))
}

fn stop(simulator: &mut Simulator, action: &str) {
    // Stopping from any state is a trajectory that the table itself makes.
    if let Err(error) = simulator.command(None, &Trajectory::default()) {
        tracing::error!("{action}: the table cannot be stopped: {error}");
    }
}

fn outcome(error_code: i32, error_string: String) -> Outcome {
    Outcome {
        error_code,
        error_string,
    }
}

/// What the goal asks for, or what is wrong with it by itself.
fn wanted(goal: &Goal, now: Stamp) -> Result<Wanted, Outcome> {
    let invalid = |what: String| outcome(Outcome::INVALID_GOAL, what);
    if !goal.multi_dof_trajectory.points.is_empty() {
        return Err(invalid(
            "the table has no joints of several degrees of freedom".to_owned(),
        ));
    }
    let trajectory = Waypoints::from_message(&goal.trajectory).map_err(|error| {
        let code = match error {
            ConvertError::UnknownJoint { .. } | ConvertError::MissingJoint { .. } => {
                Outcome::INVALID_JOINTS
            }
            _ => Outcome::INVALID_GOAL,
        };
        outcome(code, error.to_string())
    })?;
    if trajectory.points.is_empty() {
        return Err(invalid("the trajectory has no points".to_owned()));
    }
    trajectory
        .trajectory(JointState::default())
        .map_err(|error| invalid(error.to_string()))?;
    let stamp = stamp_from_time(goal.trajectory.header.stamp);
    let start = (stamp != Stamp::default()).then_some(stamp);
    let ends = start.map(|start| start.plus_nanos(trajectory.duration_nanos()));
    if let Some(late_s) = ends.map(|end| now.seconds_since(end)).filter(|s| *s > 0.0) {
        let why = format!("the trajectory was over {late_s:.3} s ago");
        return Err(outcome(Outcome::OLD_HEADER_TIMESTAMP, why));
    }
    let patience = goal.goal_time_tolerance.nanos();
    let at_end = table::JointTolerance {
        position_rad: GOAL_TOLERANCE_RAD,
        ..table::JointTolerance::NONE
    };
    Ok(Wanted {
        start,
        trajectory,
        patience_s: if patience > 0 {
            patience as f64 * 1e-9
        } else {
            GOAL_TIME_TOLERANCE_S
        },
        path: tolerances(&goal.path_tolerance, table::JointTolerance::NONE)?,
        goal: tolerances(&goal.goal_tolerance, at_end)?,
    })
}

/// By joint: 0 leaves the default, a negative value permits anything.
fn tolerances(
    wanted: &[JointTolerance],
    default: table::JointTolerance,
) -> Result<Tolerances, Outcome> {
    let mut all = [default; 2];
    for tolerance in wanted {
        let Some(joint) = JOINT_NAMES.iter().position(|name| *name == tolerance.name) else {
            let why = format!(
                "tolerance of joint {}: the table has {}",
                tolerance.name,
                JOINT_NAMES.join(", ")
            );
            return Err(outcome(Outcome::INVALID_JOINTS, why));
        };
        for (value, slot) in [
            (tolerance.position, &mut all[joint].position_rad),
            (tolerance.velocity, &mut all[joint].rate_rad_s),
        ] {
            if value.is_nan() {
                let why = format!("tolerance of joint {} is NaN", tolerance.name);
                return Err(outcome(Outcome::INVALID_GOAL, why));
            }
            if value < 0.0 {
                *slot = f64::INFINITY;
            } else if value > 0.0 {
                *slot = value;
            }
        }
    }
    Ok(all)
}

fn feedback(now: Stamp, from_start: i64, desired: &JointState, actual: &JointState) -> Feedback {
    use ros2_interfaces::builtin_interfaces::Duration;
    let point = |position: [f64; 2], velocity: [f64; 2]| JointTrajectoryPoint {
        positions: position.to_vec(),
        velocities: velocity.to_vec(),
        time_from_start: Duration::from_nanos(from_start),
        ..JointTrajectoryPoint::default()
    };
    let difference = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    Feedback {
        header: header(now, ""),
        joint_names: JOINT_NAMES.map(str::to_owned).to_vec(),
        desired: point(desired.position, desired.velocity),
        actual: point(actual.position, actual.velocity),
        error: point(
            difference(desired.position, actual.position),
            difference(desired.velocity, actual.velocity),
        ),
        ..Feedback::default()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use ros2_interfaces::builtin_interfaces::Duration;
    use rotary_sins_msgs::convert::ToMessage;
    use sins::table::Joint;

    const NOW: Stamp = Stamp::from_nanos(1_000_000_000_000);

    fn goal() -> Goal {
        let turn = Trajectory::trapezoid(Joint::Outer, [0.0; 2], 1.0, 0.1, 0.1).unwrap();
        Goal {
            trajectory: turn.to_message(),
            ..Goal::default()
        }
    }

    fn refusal(change: impl FnOnce(&mut Goal)) -> (i32, String) {
        let mut goal = goal();
        change(&mut goal);
        let outcome = wanted(&goal, NOW).unwrap_err();
        (outcome.error_code, outcome.error_string)
    }

    /// Every way in which a goal can be wrong has its own code and says what is wrong.
    #[test]
    fn wrong_goals_are_told_apart() {
        for (change, code, text) in [
            (
                (|goal| goal.trajectory.joint_names[0] = "elbow".to_owned()) as fn(&mut Goal),
                Outcome::INVALID_JOINTS,
                "elbow",
            ),
            (
                |goal| {
                    goal.trajectory.joint_names.pop();
                },
                Outcome::INVALID_JOINTS,
                "inner_joint is missing",
            ),
            (
                |goal| goal.trajectory.points.clear(),
                Outcome::INVALID_GOAL,
                "no points",
            ),
            (
                |goal| goal.trajectory.points[1].positions[0] = f64::NAN,
                Outcome::INVALID_GOAL,
                "finite number",
            ),
            (
                |goal| {
                    goal.trajectory.points[1].velocities.clear();
                    goal.trajectory.points[1].positions.pop();
                },
                Outcome::INVALID_GOAL,
                "positions has no value for joint",
            ),
            (
                |goal| goal.trajectory.points[2].time_from_start = Duration::default(),
                Outcome::INVALID_GOAL,
                "times grow",
            ),
            (
                |goal| goal.trajectory.header.stamp = NOW.plus_seconds(-100.0).to_message(),
                Outcome::OLD_HEADER_TIMESTAMP,
                "over 89.000 s ago",
            ),
            (
                |goal| goal.path_tolerance = vec![JointTolerance::default()],
                Outcome::INVALID_JOINTS,
                "tolerance of joint",
            ),
        ] {
            let (found, message) = refusal(change);
            assert_eq!(found, code, "{message}");
            assert!(message.contains(text), "{message}");
        }
    }

    /// A goal of positions alone is taken, as a `joint_trajectory_controller` takes it, and lasts as long as it says.
    #[test]
    fn positions_alone_are_a_goal() {
        let mut goal = goal();
        for point in &mut goal.trajectory.points {
            point.velocities.clear();
        }
        let with_rates = Trajectory::trapezoid(Joint::Outer, [0.0; 2], 1.0, 0.1, 0.1).unwrap();
        let taken = wanted(&goal, NOW).unwrap().trajectory;
        assert_eq!(taken.duration_nanos(), with_rates.duration_nanos());
        assert!(taken.points.iter().all(|point| point.velocity.is_none()));
    }

    /// 0 is the table's own tolerance, negative is none, and a late start that is not over is good.
    #[test]
    fn tolerances_of_a_goal() {
        let mut goal = goal();
        let tolerance = |name: &str, position, velocity| JointTolerance {
            name: name.to_owned(),
            position,
            velocity,
            acceleration: 0.0,
        };
        goal.goal_tolerance = vec![tolerance("inner_joint", -1.0, 0.02)];
        goal.path_tolerance = vec![tolerance("outer_joint", 0.3, 0.0)];
        goal.trajectory.header.stamp = NOW.plus_seconds(-5.0).to_message();
        goal.goal_time_tolerance = Duration::from_nanos(2_500_000_000);
        let wanted = wanted(&goal, NOW).unwrap();
        assert_eq!(wanted.start, Some(NOW.plus_seconds(-5.0)));
        assert_eq!(wanted.patience_s, 2.5);
        assert_eq!(wanted.goal[0].position_rad, GOAL_TOLERANCE_RAD);
        assert_eq!(wanted.goal[1].position_rad, f64::INFINITY);
        assert_eq!(wanted.goal[1].rate_rad_s, 0.02);
        assert_eq!(wanted.path[0].position_rad, 0.3);
        assert_eq!(wanted.path[1], table::JointTolerance::NONE);
    }
}
