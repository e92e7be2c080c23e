//! Every message, service and action, both ways between the suite and rclpy, with no field at its default; and the hashes
//! of the types as rosidl gives them.

use std::any::Any;
use std::path::Path;
use std::pin::Pin;
use std::time::Duration;

use ros_node::{ActionPart, GoalNews, Message, Node, NodeBuilder, Qos};
use ros2_interfaces::control_msgs::{self, FOLLOW_JOINT_TRAJECTORY};
use ros2_interfaces::std_srvs::{SetBoolRequest, SetBoolResponse, TriggerRequest, TriggerResponse};
use ros2_interfaces::{RosMessage, std_msgs};
use rotary_sins_msgs::{
    KNOWN_TYPES, SelfCalibrateFeedback, SelfCalibrateGoal, SelfCalibrateResult, registry,
    with_known_types,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use suite_tests::{GUARD, Peer, assert_filled, each_distribution, filled};

/// There are no wheels of their packages; they are held against rosbags by the tests of the messages.
const MISSING: [&str; 2] = ["compass_interfaces/msg/Azimuth", "tf2_msgs/msg/TFMessage"];

fn plain(message: impl Serialize) -> Value {
    serde_json::to_value(message).unwrap()
}

/// Both ends of the topics of one type.
struct Topics {
    name: &'static str,
    sent: Value,
    received: Pin<Box<dyn Future<Output = Value>>>,
    /// Keeps the latched message.
    _publisher: Box<dyn Any>,
}

fn topics<M: RosMessage + Message + Sync>(node: &Node) -> Topics {
    let qos = Qos::latched(1);
    let publisher = node
        .publisher::<M>(&format!("/to_python/{}", M::TYPE_NAME), qos)
        .unwrap();
    let mut subscription = node
        .subscription::<M>(&format!("/to_rust/{}", M::TYPE_NAME), qos)
        .unwrap();
    let message: M = filled();
    let sent = plain(&message);
    assert!(publisher.publish(message).is_on_its_way());
    Topics {
        name: M::TYPE_NAME,
        sent,
        received: Box::pin(async move { plain(subscription.recv().await) }),
        _publisher: Box::new(publisher),
    }
}

/// Both ends of the topics of these types.
macro_rules! topics {
    ($node:expr, $($type:ty),* $(,)?) => { vec![$(topics::<$type>(&$node)),*] };
}

/// What was sent and received here, by the names that the peer uses.
#[derive(Default)]
struct Book {
    sent: Map<String, Value>,
    received: Map<String, Value>,
}

impl Book {
    fn send<M: Serialize + DeserializeOwned>(&mut self, part: &str) -> M {
        let message: M = filled();
        self.sent.insert(part.to_owned(), plain(&message));
        message
    }

    fn receive(&mut self, part: &str, message: impl Serialize) {
        self.received.insert(part.to_owned(), plain(message));
    }

    fn add(&mut self, other: Self) {
        self.sent.extend(other.sent);
        self.received.extend(other.received);
    }
}

/// Serves an action once, and asks for one.
async fn both_ends_of_action<G, R, F>(node: &Node, name: &str, kind: &str) -> Book
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    let mut book = Book::default();
    let mut server = node
        .action_server::<G, R, F>(&format!("/rust/{name}"), kind, R::default())
        .unwrap();
    let client = node
        .action_client::<G, R, F>(&format!("/python/{name}"), kind)
        .unwrap();
    let (goal, handle) = server.recv().await.accept();
    book.receive(&format!("{name} goal"), goal);
    // Volatile as it is, it is lost to a peer whose reader has not been met yet: rclpy looks for the server's end alone.
    let mut again = tokio::time::interval(Duration::from_millis(100));
    for _ in 0..50 {
        again.tick().await;
        handle.feedback(book.send(&format!("{name} feedback")));
    }
    handle.succeed(&book.send(&format!("{name} result")));

    let goal: G = book.send(&format!("{name} goal"));
    let mut goal = client
        .send_goal(goal, GUARD)
        .await
        .unwrap()
        .expect("accepted");
    loop {
        match goal.next().await {
            GoalNews::Feedback(feedback) => book.receive(&format!("{name} feedback"), feedback),
            GoalNews::Ended(_, result) => {
                book.receive(&format!("{name} result"), result);
                return book;
            }
        }
    }
}

async fn both_ends_of_service<Q, A>(node: &Node, name: &str, kind: &str) -> Book
where
    Q: Message + Clone + 'static,
    A: Message + Clone + 'static,
{
    let mut book = Book::default();
    let service = node
        .service::<Q, A>(&format!("/rust/{name}"), kind)
        .unwrap();
    let client = node
        .client::<Q, A>(&format!("/python/{name}"), kind)
        .unwrap();
    let (id, request) = service.recv().await;
    book.receive(&format!("{name} request"), request);
    service.respond(id, book.send(&format!("{name} response")));
    let request = book.send(&format!("{name} request"));
    let response = client.call(request, GUARD).await.unwrap();
    book.receive(&format!("{name} response"), response);
    book
}

async fn exchange(python: &Path) {
    let node = NodeBuilder::new("interfaces")
        .start(Vec::<String>::new())
        .unwrap();
    let mut topics: Vec<Topics> = with_known_types!(topics, node);
    let names: Vec<&str> = topics.iter().map(|topic| topic.name).collect();
    let known: Vec<&str> = KNOWN_TYPES.iter().map(|known| known.name).collect();
    let mut sorted = (names.clone(), known);
    sorted.0.sort_unstable();
    sorted.1.sort_unstable();
    assert_eq!(sorted.0, sorted.1, "types that are looked at");

    topics.retain(|topic| !MISSING.contains(&topic.name));

    let peer = names
        .iter()
        .fold(Peer::new(python, "interfaces.py"), Peer::arg);
    let peer = tokio::task::spawn_blocking(move || peer.ask());
    let done = node
        .publisher::<std_msgs::String>("/done", Qos::latched(1))
        .unwrap();
    let ends = async {
        let ends = tokio::join!(
            both_ends_of_action::<
                control_msgs::FollowJointTrajectoryGoal,
                control_msgs::FollowJointTrajectoryResult,
                control_msgs::FollowJointTrajectoryFeedback,
            >(&node, "follow", FOLLOW_JOINT_TRAJECTORY),
            both_ends_of_action::<SelfCalibrateGoal, SelfCalibrateResult, SelfCalibrateFeedback>(
                &node,
                "calibrate",
                SelfCalibrateGoal::ACTION
            ),
            both_ends_of_service::<SetBoolRequest, SetBoolResponse>(
                &node,
                "set_bool",
                "std_srvs/srv/SetBool"
            ),
            both_ends_of_service::<TriggerRequest, TriggerResponse>(
                &node,
                "trigger",
                "std_srvs/srv/Trigger"
            ),
        );
        let mut received = Vec::new();
        for topic in &mut topics {
            received.push(topic.received.as_mut().await);
        }
        // The peer serves until then.
        assert!(done.publish(std_msgs::String::default()).is_on_its_way());
        (ends, received)
    };
    // What the peer says comes first: without it nothing here ends well.
    let (answer, ends) = tokio::join!(peer, tokio::time::timeout(GUARD, ends));
    let answer = answer.unwrap();
    let ((follow, calibrate, set_bool, trigger), received) =
        ends.expect("both ends of actions and services");
    let mut book = Book::default();
    for part in [follow, calibrate, set_bool, trigger] {
        book.add(part);
    }
    assert_eq!(answer["missing"], json!(MISSING));
    for (topic, received) in topics.into_iter().zip(received) {
        book.sent.insert(topic.name.to_owned(), topic.sent);
        book.received.insert(topic.name.to_owned(), received);
    }
    compare(book, &answer);
    compare_hashes(&answer["hashes"]);
}

fn compare(mut book: Book, answer: &Value) {
    // A request without fields is one byte in CDR and no field in Python.
    for side in [&mut book.sent, &mut book.received] {
        side.insert("trigger request".to_owned(), json!({}));
    }
    let topics = KNOWN_TYPES.len() - MISSING.len();
    assert_eq!(book.sent.len(), topics + 2 * 3 + 2 * 2);
    for (what, sent) in &book.sent {
        assert_filled(what, sent);
        assert_eq!(&answer["received"][what], sent, "{what}, Rust to rclpy");
    }
    for (what, received) in &book.received {
        assert_filled(what, received);
        assert_eq!(received, &answer["sent"][what], "{what}, rclpy to Rust");
    }
    assert_eq!(book.received.len(), book.sent.len());
}

/// rosidl's own hashes, of everything that it has.
fn compare_hashes(hashes: &Value) {
    for known in registry().iter() {
        if !MISSING.contains(&known.name) {
            assert_eq!(hashes[known.name], known.hash, "{}", known.name);
        }
    }
}

/// Nothing is lost or changed on the way, whoever sends, and rosidl calls every type by the hash we have for it.
fn everything_goes_both_ways(python: &Path) {
    // The servers of a node live as long as its tasks.
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(exchange(python));
}

each_distribution!(everything_goes_both_ways);
