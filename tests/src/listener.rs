//! A node of the test itself: what it hears, a test waits for, instead of for a time to pass.

use std::fmt::Debug;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ros_node::{Message, Node, NodeBuilder, Publisher, Qos};
use ros2_interfaces::RosMessage;
use ros2_interfaces::lifecycle_msgs::{ChangeStateRequest, ChangeStateResponse, Transition};
use ros2_interfaces::std_srvs::{TRIGGER, TriggerRequest, TriggerResponse};

/// Longest time that anything is waited for. It only ends what would never end: the slowest of these tests takes two minutes on
/// a quiet machine, and a busy one may take its time.
pub const GUARD: Duration = Duration::from_secs(600);
const LOOK: Duration = Duration::from_millis(20);

/// A node that listens.
#[derive(Debug)]
pub struct Listener {
    node: Node,
    runtime: tokio::runtime::Runtime,
}

impl Listener {
    /// On the network of this test: call it within [`crate::isolated`].
    pub fn new() -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let node = {
            let _context = runtime.enter();
            NodeBuilder::new("listener")
                .start(Vec::<String>::new())
                .unwrap()
        };
        Self { node, runtime }
    }

    /// A voice on a topic.
    pub fn speak<M>(&self, topic: &str, qos: Qos) -> Publisher<M>
    where
        M: RosMessage + Message + Clone + Send + 'static,
    {
        let _context = self.runtime.enter();
        self.node.publisher::<M>(topic, qos).unwrap()
    }

    /// Asks a service, and waits for its answer.
    pub fn call<Request, Response>(&self, service: &str, kind: &str, request: Request) -> Response
    where
        Request: Message + Clone + 'static,
        Response: Message + Clone + 'static,
    {
        let client = {
            let _context = self.runtime.enter();
            self.node
                .client::<Request, Response>(service, kind)
                .unwrap()
        };
        self.runtime
            .block_on(client.call(request, GUARD))
            .unwrap_or_else(|error| panic!("{service}: {error}"))
    }

    /// Asks a service so many times, one call behind the other.
    pub fn call_often<Request, Response>(
        &self,
        service: &str,
        kind: &str,
        request: &Request,
        times: usize,
    ) where
        Request: Message + Clone + 'static,
        Response: Message + Clone + 'static,
    {
        let client = {
            let _context = self.runtime.enter();
            self.node
                .client::<Request, Response>(service, kind)
                .unwrap()
        };
        self.runtime.block_on(async {
            for _ in 0..times {
                client.call(request.clone(), GUARD).await.unwrap();
            }
        });
    }

    /// Asks a service of `std_srvs/srv/Trigger`, and waits for its answer.
    pub fn trigger(&self, service: &str) -> TriggerResponse {
        self.call(service, TRIGGER, TriggerRequest::default())
    }

    /// Asks a node for a transition of its lifecycle, by its number; whether it went through.
    pub fn change_state(&self, node: &str, transition: u8) -> bool {
        let request = ChangeStateRequest {
            transition: Transition {
                id: transition,
                ..Transition::default()
            },
        };
        let service = format!("{node}/change_state");
        let answer: ChangeStateResponse =
            self.call(&service, "lifecycle_msgs/srv/ChangeState", request);
        answer.success
    }

    /// Keeps every message of a topic from now on; of a latched one, what was said before too.
    pub fn hear<M>(&self, topic: &str, qos: Qos) -> Heard<M>
    where
        M: RosMessage + Message + Clone + Send + 'static,
    {
        let _context = self.runtime.enter();
        let mut subscription = self.node.subscription::<M>(topic, qos).unwrap();
        let messages = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&messages);
        self.runtime.spawn(async move {
            loop {
                let batch = subscription.recv_batch(1000).await;
                kept.lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .extend(batch);
            }
        });
        Heard {
            topic: topic.to_owned(),
            messages,
        }
    }
}

impl Default for Listener {
    fn default() -> Self {
        Self::new()
    }
}

/// The messages of one topic so far.
#[derive(Debug)]
pub struct Heard<M> {
    topic: String,
    messages: Arc<Mutex<Vec<M>>>,
}

impl<M: Clone + Debug> Heard<M> {
    /// All of them.
    pub fn all(&self) -> Vec<M> {
        self.messages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// The newest.
    pub fn latest(&self) -> Option<M> {
        let messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
        messages.last().cloned()
    }

    /// Waits until one of them is as it is waited for, and gives the first that is.
    pub fn wait_for(&self, what: &str, is_it: impl Fn(&M) -> bool) -> M {
        let end = Instant::now() + GUARD;
        let mut looked_at = 0;
        loop {
            {
                let messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(found) = messages[looked_at..].iter().find(|message| is_it(message)) {
                    return found.clone();
                }
                looked_at = messages.len();
                assert!(
                    Instant::now() < end,
                    "{}: {what}: not in {GUARD:?}; the last of {looked_at}: {:.500}",
                    self.topic,
                    format!("{:?}", messages.last())
                );
            }
            std::thread::sleep(LOOK);
        }
    }
}
