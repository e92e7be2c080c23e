//! A server that counts, and a client that asks it to.
//!
//! `cargo run -p ros_node --example action`, and beside it
//! `cargo run -p ros_node --example action -- --ros-args -p count_to:=5`
//!
//! There is no package of its own for it: the action is control_msgs/action/FollowJointTrajectory, whose goal
//! time tolerance is taken for the number of seconds to count.

use std::process::ExitCode;
use std::time::Duration;

use ros_node::{ActionClient, ActionServer, GoalHandle, GoalNews, Node, NodeBuilder, Parameter};
use ros2_interfaces::control_msgs::{
    FOLLOW_JOINT_TRAJECTORY, FollowJointTrajectoryFeedback as Feedback,
    FollowJointTrajectoryGoal as Goal, FollowJointTrajectoryResult as Outcome,
};

const ACTION: &str = "count";
const ANSWER: Duration = Duration::from_secs(10);

fn main() -> ExitCode {
    let builder = NodeBuilder::new("counter")
        .about("counts seconds when asked to, or asks for it")
        .parameter(
            Parameter::new("count_to", 0_i64)
                .unit("s")
                .range(0.0, 1000.0)
                .describe("what to ask for; 0: serve"),
        );
    ros_node::run(builder, count)
}

async fn count(node: Node) -> Result<(), ros_node::Error> {
    let seconds = node.parameter::<i64>("count_to")?;
    if seconds == 0 {
        let server = node.action_server(ACTION, FOLLOW_JOINT_TRAJECTORY)?;
        node.set_ready();
        serve(&node, server).await;
        return Ok(());
    }
    let client: ActionClient<Goal, Outcome, Feedback> =
        node.action_client(ACTION, FOLLOW_JOINT_TRAJECTORY)?;
    node.set_ready();
    let mut goal = Goal::default();
    goal.goal_time_tolerance.sec = i32::try_from(seconds).unwrap_or(i32::MAX);
    let Some(mut goal) = client.send_goal(goal, ANSWER).await? else {
        tracing::warn!("rejected: somebody else is served");
        return Ok(());
    };
    loop {
        tokio::select! {
            news = goal.next() => match news {
                GoalNews::Feedback(feedback) => tracing::info!("{}", feedback.header.stamp.sec),
                GoalNews::Ended(status, outcome) => {
                    tracing::info!("{status:?}: {}", outcome.error_string);
                    return Ok(());
                }
            },
            () = node.shutdown() => {
                let code = goal.cancel(ANSWER).await?;
                tracing::info!("asked to cancel: {code:?}");
                return Ok(());
            }
        }
    }
}

/// One goal after the other; a second one meanwhile is rejected.
async fn serve(node: &Node, mut server: ActionServer<Goal, Outcome, Feedback>) {
    loop {
        let (goal, handle) = tokio::select! {
            request = server.recv() => request.accept(),
            () = node.shutdown() => return,
        };
        tokio::select! {
            () = execute(goal.goal_time_tolerance.sec, handle) => {}
            () = async { loop { server.recv().await.reject() } } => {}
            () = node.shutdown() => return,
        }
    }
}

async fn execute(seconds: i32, mut handle: GoalHandle<Goal, Outcome, Feedback>) {
    let outcome = |text: &str| Outcome {
        error_string: text.to_owned(),
        ..Outcome::default()
    };
    for count in 1..=seconds {
        tokio::select! {
            () = tokio::time::sleep(Duration::from_secs(1)) => {}
            () = handle.cancel_requested() => return handle.canceled(&outcome("stopped counting")),
        }
        let mut feedback = Feedback::default();
        feedback.header.stamp.sec = count;
        handle.feedback(feedback);
    }
    handle.succeed(&outcome("counted"));
}
