//! How nodes end, are managed, and answer whoever asks, over real DDS in a network namespace of their own.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::Duration;

use common::{LONG, isolated, minimal, run_inner, start};
use ros_node::{ActionClient, ActionServer, Client, GoalNews, GoalStatus, Node, Published, Qos};
use ros2_interfaces::control_msgs::{
    FOLLOW_JOINT_TRAJECTORY, FollowJointTrajectoryFeedback as Feedback,
    FollowJointTrajectoryGoal as Goal, FollowJointTrajectoryResult as Outcome,
};
use ros2_interfaces::diagnostic_msgs::KeyValue;
use ros2_interfaces::lifecycle_msgs::{ChangeStateRequest, ChangeStateResponse, Transition};

/// The example under way, line by line.
struct Running {
    child: Child,
    lines: BufReader<ChildStderr>,
    log: String,
}

impl Running {
    fn start(mut command: Command) -> Self {
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap());
        let log = String::new();
        Self { child, lines, log }
    }

    /// Reads on to a line with these words, or to the end.
    fn read_to(&mut self, words: &str) -> String {
        let mut line = String::new();
        while self.lines.read_line(&mut line).unwrap() > 0 && !line.contains(words) {
            self.log.push_str(&line);
            line.clear();
        }
        self.log.push_str(&line);
        line
    }

    fn interrupt(&self) {
        let id = self.child.id().to_string();
        let status = Command::new("kill").args(["-INT", &id]).status();
        assert!(status.unwrap().success());
    }
}

/// Whatever the main function does at the end is told, and the status says so: one that hangs is dropped with a FATAL line.
#[test]
fn every_ending_has_its_status() {
    for (way, status, words) in [
        ("done", 0, "[INFO]"),
        ("failed", 1, "the node ends: asked to fail"),
        ("hangs", 1, "not everything was put in order within 1.0 s"),
        ("deaf", 1, "dropped where it stands, 1.0 s after"),
    ] {
        let parameter = format!("at_the_end:={way}");
        let mut running = Running::start(isolated(&minimal(), &["--ros-args", "-p", &parameter]));
        assert!(!running.read_to("publishing on").is_empty(), "{way}");
        running.interrupt();
        running.read_to("nothing more, to the end");
        assert_eq!(
            running.child.wait().unwrap().code(),
            Some(status),
            "{}",
            running.log
        );
        assert!(running.log.contains(words), "{way}: {}", running.log);
        assert_eq!(
            running.log.contains("[FATAL]"),
            way == "deaf",
            "{}",
            running.log
        );
    }
}

/// Asks a managed node for transitions.
struct Manager(Client<ChangeStateRequest, ChangeStateResponse>);

impl Manager {
    fn of(node: &Node) -> Self {
        let kind = "lifecycle_msgs/srv/ChangeState";
        Self(node.client("/minimal/change_state", kind).unwrap())
    }

    async fn step(&self, id: u8, label: &str) -> bool {
        let label = label.to_owned();
        let request = ChangeStateRequest {
            transition: Transition { id, label },
        };
        self.0.call(request, LONG).await.unwrap().success
    }
}

#[test]
fn a_manager_is_never_left_without_an_answer() {
    run_inner("inner_manager");
}

/// `configure` of a node that never gets ready fails in time; who asks for something else meanwhile has an answer first. Labels
/// are read before numbers.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_manager() {
    let mut command = Command::new(minimal());
    command.args([
        "--ros-args",
        "-p",
        "lifecycle_autostart:=false",
        "-p",
        "configures:=false",
    ]);
    let mut running = Running::start(command);
    let node = start("manager", &[]);
    let manager = Manager::of(&node);
    assert!(!manager.step(Transition::CONFIGURE, "dance").await);
    let configure = async {
        let success = manager.step(0, "configure").await;
        (success, std::time::Instant::now())
    };
    let other = async {
        let success = manager.step(Transition::ACTIVATE, "").await;
        (success, std::time::Instant::now())
    };
    let ((configured, late), (activated, early)) = tokio::join!(configure, other);
    assert!(!configured && !activated);
    assert!(early < late);
    assert!(
        running.read_to("not ready within").contains("2.0 s"),
        "{}",
        running.log
    );
    running.child.kill().unwrap();
    running.child.wait().unwrap();
}

#[test]
fn last_words_come_before_the_gate_closes() {
    run_inner("inner_last_words");
}

/// On deactivation a node still speaks while it puts things in order; where it cannot, it stays active. What it was sent while
/// inactive is not replayed.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_last_words() {
    let mut running = Running::start(Command::new(minimal()));
    let node = start("manager", &[]);
    let mut status = node
        .subscription::<KeyValue>("status", Qos::reliable(1000))
        .unwrap();
    let to = node
        .publisher::<KeyValue>("in", Qos::reliable(100))
        .unwrap();
    assert!(status.wait_for_publishers(1, LONG).await && to.wait_for_subscribers(1, LONG).await);
    let manager = Manager::of(&node);
    assert!(manager.step(Transition::DEACTIVATE, "").await);
    let mut last = KeyValue::default();
    while last.key != "last words" {
        last = tokio::time::timeout(LONG, status.recv()).await.unwrap();
    }
    assert_eq!(last.value, "Deactivate");
    assert!(
        tokio::time::timeout(Duration::from_millis(500), status.recv())
            .await
            .is_err(),
        "an inactive node is silent"
    );
    let say = |value: &str| {
        let (key, value) = ("k".to_owned(), value.to_owned());
        assert_eq!(to.publish(KeyValue { key, value }), Published::Sent);
    };
    for _ in 0..5 {
        say("of before");
    }
    // Its answer comes after these, which its reader has long had.
    assert!(!manager.step(Transition::CONFIGURE, "").await);
    assert!(manager.step(Transition::ACTIVATE, "").await);
    say("of now");
    running.read_to("heard of now");
    assert!(!running.log.contains("of before"), "{}", running.log);
    assert!(
        running
            .log
            .contains("5 messages came while the node was not active"),
        "{}",
        running.log
    );
    running.child.kill().unwrap();
    running.child.wait().unwrap();
}

#[test]
fn concurrent_calls_each_get_their_answer() {
    run_inner("inner_concurrent");
}

/// Twenty calls of one client at a time, answered in reverse order.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_concurrent() {
    const CALLS: u8 = 20;
    let (server, asking) = (start("server", &[]), start("asking", &[]));
    let kind = "lifecycle_msgs/srv/ChangeState";
    let service = server
        .service::<ChangeStateRequest, ChangeStateResponse>("/ask", kind)
        .unwrap();
    let client = asking
        .client::<ChangeStateRequest, ChangeStateResponse>("/ask", kind)
        .unwrap();
    let answers = async {
        let mut requests = Vec::new();
        for _ in 0..CALLS {
            requests.push(service.recv().await);
        }
        for (id, request) in requests.into_iter().rev() {
            let success = request.transition.id % 3 == 0;
            service.respond(id, ChangeStateResponse { success });
        }
    };
    let calls = futures::future::join_all((0..CALLS).map(async |id| {
        let label = String::new();
        let request = ChangeStateRequest {
            transition: Transition { id, label },
        };
        client.call(request, LONG).await.unwrap().success
    }));
    let ((), told) = tokio::join!(answers, calls);
    let expected: Vec<bool> = (0..CALLS).map(|id| id % 3 == 0).collect();
    assert_eq!(told, expected);
}

#[test]
fn goals_end_as_they_should() {
    run_inner("inner_goals");
}

/// A result comes through however fast feedback of another goal comes; a goal that is given up is cancelled when it is accepted
/// after all; one that is dropped ends with the result for that.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_goals() {
    let (serving, asking) = (start("serving", &[]), start("asking", &[]));
    let abandoned = Outcome {
        error_code: Outcome::INVALID_GOAL,
        error_string: "abandoned".to_owned(),
    };
    let mut server: ActionServer<Goal, Outcome, Feedback> = serving
        .action_server("/move", FOLLOW_JOINT_TRAJECTORY, abandoned)
        .unwrap();
    let client: ActionClient<Goal, Outcome, Feedback> = asking
        .action_client("/move", FOLLOW_JOINT_TRAJECTORY)
        .unwrap();
    let goal = Goal::default;

    let (first, request) = tokio::join!(client.send_goal(goal(), LONG), async {
        server.recv().await.accept()
    });
    let mut flooded = first.unwrap().unwrap();
    let (_, flooding) = request;
    let flood = tokio::spawn(async move {
        loop {
            flooding.feedback(Feedback::default());
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    });
    let (second, request) = tokio::join!(client.send_goal(goal(), LONG), async {
        server.recv().await.accept()
    });
    let mut second = second.unwrap().unwrap();
    request.1.succeed(&Outcome::default());
    let (status, _) = tokio::time::timeout(LONG, second.result()).await.unwrap();
    assert_eq!(status, GoalStatus::Succeeded);

    // The handle goes with the task.
    flood.abort();
    let end = async {
        loop {
            if let GoalNews::Ended(status, result) = flooded.next().await {
                return (status, result);
            }
        }
    };
    let (status, result) = tokio::time::timeout(LONG, end).await.unwrap();
    assert_eq!(
        (status, result.error_string.as_str()),
        (GoalStatus::Aborted, "abandoned")
    );

    let request = tokio::select! {
        _ = client.send_goal(goal(), LONG) => panic!("nobody has answered"),
        request = server.recv() => request,
    };
    // The future is dropped by now.
    let (_, mut handle) = request.accept();
    tokio::time::timeout(LONG, handle.cancel_requested())
        .await
        .unwrap();
}
