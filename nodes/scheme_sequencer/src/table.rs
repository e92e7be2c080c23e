//! How the table is moved: by the topic of a `joint_trajectory_controller`, or by its action.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use ros_node::{
    ActionClient, CancelReturn, GoalNews, GoalStatus, Node, Published, Publisher, RemoteGoal,
};
use ros2_interfaces::control_msgs::{
    FollowJointTrajectoryGoal as Goal, FollowJointTrajectoryProgress as Progress,
    FollowJointTrajectoryResult as Outcome, JointTolerance,
};
use ros2_interfaces::trajectory_msgs::JointTrajectory;
use rotary_sins_msgs::convert::ToMessage;
use rotary_sins_msgs::interfaces::actions::FOLLOW_JOINT_TRAJECTORY;
use rotary_sins_msgs::interfaces::topics::JOINT_TRAJECTORY;
use sins::table::JOINT_NAMES;
use sins::table::scheme::sequencer::{Command, SequencerSettings};
use tokio::sync::watch;

/// Wall time that the action's server has for an answer, and to be there when a motion is due.
const ANSWER: Duration = Duration::from_secs(10);
/// How often it is looked whether the server of a motion under way is still there.
const SERVER_CHECK: Duration = Duration::from_millis(500);

type Client = ActionClient<Goal, Outcome, Progress>;

/// The way commands take.
#[derive(Clone)]
pub enum Table {
    /// Nobody answers; what the table does is seen by the joint states alone.
    Topic(Publisher<JointTrajectory>),
    /// Every motion is a goal, worked off by [`Driver::run`].
    Action {
        /// Asks for goals.
        client: Client,
        /// To the driver. There is only the newest: every command takes the place of the one before.
        motions: Arc<watch::Sender<Option<Motion>>>,
    },
}

/// A command with its number.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Counts commands.
    pub number: u64,
    /// What is to be done.
    pub command: Command,
}

/// What the driver tells of a motion.
#[derive(Debug)]
pub enum News {
    /// Largest difference of a joint from where it should be \[rad\].
    TrackingError(f64),
    /// The table says that it has arrived.
    Arrived,
    /// Why the table cannot go on, with the name of the action.
    Failed(String),
}

impl Table {
    /// By goals of the action or by the topic, and the driver to be run, where it takes one.
    ///
    /// # Errors
    /// A middleware that refuses.
    pub fn new(
        node: &Node,
        settings: &SequencerSettings,
        uses_action: bool,
    ) -> ros_node::Result<(Self, Option<Driver>)> {
        if !uses_action {
            return Ok((Self::Topic(node.publish_on(&JOINT_TRAJECTORY)?), None));
        }
        // Not all of the feedback is the same in every version of control_msgs; its head is.
        let client: Client = node.action_client(
            FOLLOW_JOINT_TRAJECTORY.name,
            FOLLOW_JOINT_TRAJECTORY.type_name,
        )?;
        let (motions, newest) = watch::channel(None);
        let motions = Arc::new(motions);
        let driver = Driver {
            client: client.clone(),
            motions: newest,
            settings: *settings,
        };
        Ok((Self::Action { client, motions }, Some(driver)))
    }

    /// Hands a command over.
    ///
    /// # Errors
    /// Why the table will not hear of it.
    pub fn send(&self, motion: Motion) -> Result<(), String> {
        match self {
            Self::Topic(publisher) => match publisher.publish(motion.command.to_message()) {
                Published::Sent => Ok(()),
                outcome => Err(format!("{}: {outcome}", publisher.topic())),
            },
            // The driver works as long as the node does, and tells what became of it.
            Self::Action { motions, .. } => {
                motions.send_replace(Some(motion));
                Ok(())
            }
        }
    }

    /// Whether a table takes commands.
    pub fn listens(&self) -> bool {
        match self {
            Self::Topic(publisher) => publisher.subscriber_count() > 0,
            Self::Action { client, .. } => client.is_server_ready(),
        }
    }

    /// Name of the action, where motions are goals.
    pub fn action(&self) -> Option<&str> {
        match self {
            Self::Topic(_) => None,
            Self::Action { client, .. } => Some(client.name()),
        }
    }
}

/// Works motions off, one goal at a time.
pub struct Driver {
    client: Client,
    motions: watch::Receiver<Option<Motion>>,
    settings: SequencerSettings,
}

/// A goal that the table has accepted.
type Accepted = RemoteGoal<Goal, Outcome, Progress>;

/// The goal under way.
struct Under {
    number: u64,
    goal: Accepted,
}

/// What the table has been asked and has not answered yet. Dropped, the goal that was asked for is cancelled.
enum Asked {
    Motion(Option<Accepted>),
    Stop,
}

type Answer = Pin<Box<dyn Future<Output = Result<Asked, String>> + Send>>;

impl Driver {
    /// Runs until the node ends. `tell` is told of a motion by its number. A command is acted on at once, whatever the table
    /// still owes an answer to: what was asked before is given up.
    pub async fn run(mut self, tell: impl Fn(u64, News)) {
        let mut under: Option<Under> = None;
        let mut asked: Option<(u64, Answer)> = None;
        let mut checks = tokio::time::interval(SERVER_CHECK);
        checks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                biased;
                changed = self.motions.changed() => {
                    if changed.is_err() {
                        return;
                    }
                    let Some(motion) = self.motions.borrow_and_update().clone() else { continue };
                    asked = self.ask(&motion.command, &mut under).map(|answer| (motion.number, answer));
                }
                (number, answer) = answered(&mut asked) => match answer {
                    Ok(Asked::Motion(Some(goal))) => under = Some(Under { number, goal }),
                    Ok(Asked::Motion(None)) => tell(number, self.failed("the table rejects the motion")),
                    // Whatever has ended already stands still.
                    Ok(Asked::Stop) => {}
                    Err(reason) => tell(number, self.failed(&reason)),
                },
                (number, news) = next(&mut under) => match news {
                    GoalNews::Feedback(progress) => {
                        let errors = progress.error.positions.iter().map(|error| error.abs());
                        tell(number, News::TrackingError(errors.fold(0.0, f64::max)));
                    }
                    GoalNews::Ended(GoalStatus::Succeeded, _) => {
                        under = None;
                        tell(number, News::Arrived);
                    }
                    GoalNews::Ended(status, outcome) => {
                        under = None;
                        tell(number, self.failed(&ending(status, &outcome)));
                    }
                },
                _ = checks.tick() => {
                    if let Some(gone) = under.take_if(|_| !self.client.is_server_ready()) {
                        tell(gone.number, self.failed("the server is gone"));
                    }
                }
            }
        }
    }

    fn failed(&self, reason: &str) -> News {
        News::Failed(format!("action {}: {reason}", self.client.name()))
    }

    /// Asks for a motion, which takes the place of the one under way, or cancels that one.
    fn ask(&self, command: &Command, under: &mut Option<Under>) -> Option<Answer> {
        if command.trajectory.points.is_empty() {
            let cancelled = under.take()?.goal.cancel(ANSWER);
            return Some(Box::pin(async move {
                match cancelled.await {
                    Ok(CancelReturn::Rejected) => Err("the table refuses to stop".to_owned()),
                    Ok(_) => Ok(Asked::Stop),
                    Err(error) => Err(error.to_string()),
                }
            }));
        }
        let (client, goal) = (self.client.clone(), goal(command, &self.settings));
        Some(Box::pin(async move {
            match client.send_goal(goal, ANSWER).await {
                Ok(accepted) => Ok(Asked::Motion(accepted)),
                Err(ros_node::Error::Service { reason, .. }) => Err(reason),
                Err(error) => Err(error.to_string()),
            }
        }))
    }
}

/// The answer of the table; never, where nothing was asked.
async fn answered(asked: &mut Option<(u64, Answer)>) -> (u64, Result<Asked, String>) {
    match asked {
        Some((number, answer)) => {
            let answered = (*number, answer.await);
            *asked = None;
            answered
        }
        None => std::future::pending().await,
    }
}

async fn next(under: &mut Option<Under>) -> (u64, GoalNews<Outcome, Progress>) {
    match under {
        Some(Under { number, goal }) => (*number, goal.next().await),
        None => std::future::pending().await,
    }
}

/// Why a goal that did not succeed has ended, for a person.
fn ending(status: GoalStatus, outcome: &Outcome) -> String {
    let what = match status {
        GoalStatus::Canceled => "the motion was cancelled by somebody else".to_owned(),
        GoalStatus::Aborted if outcome.error_code == Outcome::SUCCESSFUL => {
            "the motion was aborted".to_owned()
        }
        GoalStatus::Aborted => format!("the motion was aborted: {}", outcome.error_name()),
        _ => "the table does not know the motion any more".to_owned(),
    };
    if outcome.error_string.is_empty() {
        what
    } else {
        format!("{what}: {}", outcome.error_string)
    }
}

/// The table must arrive as the sequencer itself demands it, but has only half the time: what it says of its failure tells
/// more than that it did not arrive.
fn goal(command: &Command, settings: &SequencerSettings) -> Goal {
    let tolerance = |name: &str| JointTolerance {
        name: name.to_owned(),
        position: settings.position_tolerance_rad,
        ..JointTolerance::default()
    };
    Goal {
        trajectory: command.to_message(),
        goal_tolerance: JOINT_NAMES.map(tolerance).to_vec(),
        goal_time_tolerance: ros2_interfaces::builtin_interfaces::Duration::from_nanos(
            sins::time::seconds_to_nanos(0.5 * settings.arrival_timeout_s),
        ),
        ..Goal::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every way in which a goal can end badly is told in one line with what the table says of it.
    #[test]
    fn endings_are_told() {
        let outcome = |error_code, text: &str| Outcome {
            error_code,
            error_string: text.to_owned(),
        };
        for (status, outcome, expected) in [
            (
                GoalStatus::Aborted,
                outcome(Outcome::GOAL_TOLERANCE_VIOLATED, "outer_joint"),
                "the motion was aborted: goal tolerance violated: outer_joint",
            ),
            (
                GoalStatus::Aborted,
                outcome(0, ""),
                "the motion was aborted",
            ),
            (
                GoalStatus::Canceled,
                outcome(0, ""),
                "the motion was cancelled by somebody else",
            ),
            (
                GoalStatus::Unknown,
                outcome(0, ""),
                "the table does not know the motion any more",
            ),
        ] {
            assert_eq!(ending(status, &outcome), expected);
        }
    }
}
