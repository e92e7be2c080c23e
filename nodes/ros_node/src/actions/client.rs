//! The asking end of an action.

use std::collections::BTreeMap;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;
use std::time::Duration;

use futures::{FutureExt, StreamExt};
use ros2_client::RmwRequestId;
use ros2_client::action::{FeedbackMessage, GetResultRequest, GetResultResponse, SendGoalRequest};
use ros2_client::builtin_interfaces::Time;
use rustdds::DomainParticipant;
use tokio::sync::{Notify, mpsc, oneshot};
use tokio::time::Instant;

use super::{ActionPart, CancelReturn, GoalId, GoalStatus};
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::node::Node;
use crate::service::{DISCOVERY_POLL, SETTLE};

/// How often it is looked for results while some are due: ros2-client has no way to wait for more than one.
const RESULT_POLL: Duration = Duration::from_millis(20);

/// Asks for goals of one action. Clones share the same ends.
pub struct ActionClient<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
}

struct Shared<G: ActionPart, R: ActionPart, F: ActionPart> {
    ends: ros2_client::action::ActionClient<G, R, F>,
    participant: DomainParticipant,
    graph: Arc<Graph>,
    created: Instant,
    name: String,
    /// One request of a kind at a time: who waits for an answer throws away those of others.
    sending: tokio::sync::Mutex<()>,
    cancelling: tokio::sync::Mutex<()>,
    book: Mutex<Book<R, F>>,
    result_due: Notify,
}

/// Who waits for what.
struct Book<R, F> {
    results: BTreeMap<RmwRequestId, oneshot::Sender<(GoalStatus, R)>>,
    feedback: BTreeMap<GoalId, mpsc::UnboundedSender<F>>,
}

impl<G: ActionPart, R: ActionPart, F: ActionPart> Clone for ActionClient<G, R, F> {
    fn clone(&self) -> Self {
        Self {
            shared: Arc::clone(&self.shared),
        }
    }
}

impl<G, R, F> std::fmt::Debug for ActionClient<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ActionClient")
            .field("name", &self.shared.name)
            .finish_non_exhaustive()
    }
}

impl<G, R, F> ActionClient<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    pub(super) fn start(
        node: &Node,
        ends: ros2_client::action::ActionClient<G, R, F>,
        name: String,
    ) -> Self {
        let shared = Arc::new(Shared {
            ends,
            participant: node.participant(),
            graph: node.graph(),
            created: Instant::now(),
            name,
            sending: tokio::sync::Mutex::default(),
            cancelling: tokio::sync::Mutex::default(),
            book: Mutex::new(Book {
                results: BTreeMap::new(),
                feedback: BTreeMap::new(),
            }),
            result_due: Notify::new(),
        });
        node.spawn(pump(Arc::clone(&shared)));
        Self { shared }
    }

    /// Absolute name of the action.
    pub fn name(&self) -> &str {
        &self.shared.name
    }

    /// Whether all parts of a server are there and matched. One that was killed is there until its lease has ended.
    pub fn is_server_ready(&self) -> bool {
        self.shared.is_matched() && self.shared.created.elapsed() >= SETTLE
    }

    /// Waits until a server is there; `false` where the time ran out.
    pub async fn wait_for_server(&self, timeout: Duration) -> bool {
        let there = async {
            while !self.is_server_ready() {
                tokio::time::sleep(DISCOVERY_POLL).await;
            }
        };
        tokio::time::timeout(timeout, there).await.is_ok()
    }

    /// Waits for the server, asks for a goal and waits for its answer; `None` where it is rejected. The result is asked for
    /// at once.
    ///
    /// # Errors
    /// [`Error::Service`] where there is no server or no answer within `timeout`; a goal whose answer is not waited for any
    /// more is cancelled.
    pub async fn send_goal(
        &self,
        goal: G,
        timeout: Duration,
    ) -> Result<Option<RemoteGoal<G, R, F>>> {
        let shared = &self.shared;
        let deadline = Instant::now() + timeout;
        if !self.wait_for_server(timeout).await {
            return Err(shared.failed(format!("no server within {:.1} s", timeout.as_secs_f64())));
        }
        let id = GoalId::new_random();
        // From the beginning, so that no feedback is missed and nothing is left behind where the future is dropped.
        let (sender, feedback) = mpsc::unbounded_channel();
        shared.book().feedback.insert(id, sender);
        let mut remote = RemoteGoal {
            shared: Arc::clone(shared),
            id,
            feedback,
            result: None,
        };
        let request = SendGoalRequest { goal_id: id, goal };
        let asked = tokio::time::timeout_at(deadline, async {
            let _turn = shared.sending.lock().await;
            shared.ends.goal_client().async_call_service(request).await
        });
        match asked.await {
            Ok(Ok(response)) if response.accepted => {
                remote.result = Some(shared.ask_for_result(id)?);
                Ok(Some(remote))
            }
            Ok(Ok(_)) => Ok(None),
            Ok(Err(error)) => Err(shared.failed(error.to_string())),
            Err(_) => {
                // The first poll sends the request; the answer does not matter.
                shared.ends.async_cancel_goal(id, Time::ZERO).now_or_never();
                Err(shared.failed(format!(
                    "no answer to a goal within {:.1} s",
                    timeout.as_secs_f64()
                )))
            }
        }
    }
}

/// A goal that a server has accepted.
pub struct RemoteGoal<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
    id: GoalId,
    feedback: mpsc::UnboundedReceiver<F>,
    result: Option<(RmwRequestId, oneshot::Receiver<(GoalStatus, R)>)>,
}

/// What is heard of a goal.
#[derive(Clone, Debug, PartialEq)]
pub enum GoalNews<R, F> {
    /// It is under way.
    Feedback(F),
    /// It has ended, and so.
    Ended(GoalStatus, R),
}

impl<G, R, F> RemoteGoal<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    /// Id of the goal.
    pub fn id(&self) -> GoalId {
        self.id
    }

    /// What is heard next; nothing any more after its end. Cancelling the future loses nothing.
    pub async fn next(&mut self) -> GoalNews<R, F> {
        let Some((_, result)) = &mut self.result else {
            return std::future::pending().await;
        };
        tokio::select! {
            biased;
            Some(feedback) = self.feedback.recv() => GoalNews::Feedback(feedback),
            ended = result => {
                self.result = None;
                match ended {
                    Ok((status, result)) => GoalNews::Ended(status, result),
                    // The node has ended, and its tasks with it.
                    Err(_) => std::future::pending().await,
                }
            }
        }
    }

    /// Waits for its end.
    pub async fn result(&mut self) -> (GoalStatus, R) {
        loop {
            if let GoalNews::Ended(status, result) = self.next().await {
                return (status, result);
            }
        }
    }

    /// Asks to cancel it. Where that is granted, it ends soon, and not always as cancelled.
    ///
    /// # Errors
    /// [`Error::Service`] where there is no answer within `timeout`.
    pub async fn cancel(&self, timeout: Duration) -> Result<CancelReturn> {
        let shared = &self.shared;
        let asked = tokio::time::timeout(timeout, async {
            let _turn = shared.cancelling.lock().await;
            shared.ends.async_cancel_goal(self.id, Time::ZERO).await
        });
        match asked.await {
            Ok(Ok(response)) => Ok(response.return_code),
            Ok(Err(error)) => Err(shared.failed(error.to_string())),
            Err(_) => Err(shared.failed(format!(
                "no answer to a cancel within {:.1} s",
                timeout.as_secs_f64()
            ))),
        }
    }
}

impl<G: ActionPart, R: ActionPart, F: ActionPart> Drop for RemoteGoal<G, R, F> {
    fn drop(&mut self) {
        let mut book = self.shared.book();
        book.feedback.remove(&self.id);
        if let Some((request, _)) = &self.result {
            book.results.remove(request);
        }
    }
}

/// Hands on what comes.
async fn pump<G, R, F>(shared: Arc<Shared<G, R, F>>)
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    loop {
        tokio::select! {
            message = shared.next_feedback() => {
                if let Some(sender) = shared.book().feedback.get(&message.goal_id) {
                    sender.send(message.feedback).ok();
                }
            }
            () = shared.time_to_look() => shared.take_results(),
        }
    }
}

impl<G, R, F> Shared<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    // Every change under the lock is a single insertion or removal, so a panic elsewhere leaves it whole.
    fn book(&self) -> MutexGuard<'_, Book<R, F>> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn failed(&self, reason: String) -> Error {
        Error::Service {
            service: self.name.clone(),
            reason,
        }
    }

    /// Sends the request under the lock, so that no answer comes before its waiter is noted.
    fn ask_for_result(
        &self,
        goal_id: GoalId,
    ) -> Result<(RmwRequestId, oneshot::Receiver<(GoalStatus, R)>)> {
        let mut book = self.book();
        let sent = self
            .ends
            .result_client()
            .async_send_request(GetResultRequest { goal_id });
        let request = match sent.now_or_never() {
            Some(Ok(request)) => request,
            Some(Err(error)) => return Err(self.failed(error.to_string())),
            None => return Err(self.failed("the server does not acknowledge".to_owned())),
        };
        let (sender, receiver) = oneshot::channel();
        book.results.insert(request, sender);
        self.result_due.notify_one();
        Ok((request, receiver))
    }

    async fn time_to_look(&self) {
        if self.book().results.is_empty() {
            self.result_due.notified().await;
        }
        tokio::time::sleep(RESULT_POLL).await;
    }

    fn take_results(&self) {
        let mut book = self.book();
        loop {
            match self.ends.result_client().receive_response() {
                Ok(Some((request, GetResultResponse { status, result }))) => {
                    if let Some(waiter) = book.results.remove(&request) {
                        waiter.send((status, result)).ok();
                    }
                }
                Ok(None) => return,
                Err(error) => {
                    tracing::error!("{}: a result cannot be read: {error}", self.name);
                    return;
                }
            }
        }
    }

    async fn next_feedback(&self) -> FeedbackMessage<F> {
        std::future::poll_fn(|context| {
            loop {
                // A view of the reader without a state of its own.
                let mut stream = pin!(self.ends.feedback_subscription().async_stream());
                match stream.poll_next_unpin(context) {
                    Poll::Ready(Some(Ok((message, _)))) => return Poll::Ready(message),
                    Poll::Ready(Some(Err(error))) => {
                        tracing::error!("{}: a feedback cannot be read: {error}", self.name);
                    }
                    Poll::Ready(None) | Poll::Pending => return Poll::Pending,
                }
            }
        })
        .await
    }

    /// Whether every part of a server is matched with ours.
    fn is_matched(&self) -> bool {
        let matched = self.graph.matched_topics(&self.participant);
        let part = |part: &str| format!("{}/_action/{part}", self.name);
        ["send_goal", "cancel_goal", "get_result"]
            .iter()
            .all(|service| matched.has_server(&part(service)))
            && ["feedback", "status"]
                .iter()
                .all(|topic| matched.has_publisher(&part(topic)))
    }
}
