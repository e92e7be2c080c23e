//! The asking end of an action.

use std::collections::BTreeMap;
use std::future::Future;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;
use std::time::Duration;

use byteorder::LittleEndian;
use futures::StreamExt;
use ros2_client::RmwRequestId;
use ros2_client::action::{
    FeedbackMessage, GetResultRequest, GetResultResponse, SendGoalRequest, SendGoalResponse,
};
use ros2_client::action_msgs::{CancelGoalRequest, CancelGoalResponse, GoalInfo};
use ros2_client::builtin_interfaces::Time;
use rustdds::DomainParticipant;
use tokio::sync::{Notify, broadcast};
use tokio::time::Instant;

use super::{ActionPart, CancelReturn, GoalId, GoalStatus};
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::node::Node;
use crate::overflow::Overflow;
use crate::replies::{Replies, Reply};
use crate::service::{DISCOVERY_POLL, SETTLE};

/// How often it is looked for results while some are due: ros2-client has no way to wait for more than one.
const RESULT_POLL: Duration = Duration::from_millis(20);
/// Feedback of a goal that waits until it is taken; the oldest goes first.
const FEEDBACK_WAITING: usize = 128;
/// A goal that nobody waits for any more is cancelled where it is accepted all the same, up to this late.
const GIVEN_UP: Duration = Duration::from_secs(60);

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
    accepted: Replies<RmwRequestId, SendGoalResponse>,
    cancelled: Replies<RmwRequestId, CancelGoalResponse>,
    results: Replies<RmwRequestId, GetResultResponse<R>>,
    book: Mutex<Book<F>>,
    /// Results, or answers to goals that were given up, are due.
    due: Notify,
    overflow: Overflow,
}

struct Book<F> {
    feedback: BTreeMap<GoalId, broadcast::Sender<F>>,
    /// Goals whose acceptance nobody waits for any more.
    given_up: Vec<GivenUp>,
}

struct GivenUp {
    id: GoalId,
    reply: Reply<RmwRequestId, SendGoalResponse>,
    until: Instant,
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
            overflow: Overflow::new(format!("feedback of action {name}")),
            name,
            accepted: Replies::default(),
            cancelled: Replies::default(),
            results: Replies::default(),
            book: Mutex::new(Book {
                feedback: BTreeMap::new(),
                given_up: Vec::new(),
            }),
            due: Notify::new(),
        });
        node.watch_overflow(&shared.overflow);
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
    /// at once. A goal whose answer is not waited for any more, because this future was dropped or the time ran out, is
    /// cancelled at once, and once more where it is accepted later.
    ///
    /// # Errors
    /// [`Error::Service`] where there is no server or no answer within `timeout`.
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
        let (sender, feedback) = broadcast::channel(FEEDBACK_WAITING);
        shared.book().feedback.insert(id, sender);
        let mut remote = RemoteGoal {
            shared: Arc::clone(shared),
            id,
            feedback,
            result: None,
            end: None,
        };
        let request = SendGoalRequest { goal_id: id, goal };
        let client = shared.ends.goal_client();
        let reply = shared.accepted.ask(client, request);
        let mut asking = Asking {
            shared: Arc::clone(shared),
            id,
            reply: Some(reply.map_err(|reason| shared.failed(reason))?),
        };
        let answer = asking.answer();
        let answered = tokio::time::timeout_at(deadline, answer).await;
        if answered.is_ok() {
            asking.reply = None;
        }
        match answered {
            Ok(Ok(response)) if response.accepted => {
                remote.result = Some(shared.ask_for_result(id)?);
                Ok(Some(remote))
            }
            Ok(Ok(_)) => Ok(None),
            Ok(Err(reason)) => Err(shared.failed(reason)),
            Err(_) => Err(shared.failed(format!(
                "no answer to a goal within {:.1} s",
                timeout.as_secs_f64()
            ))),
        }
    }
}

/// A goal that a server has not answered yet. Dropped before, it is given up.
struct Asking<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
    id: GoalId,
    reply: Option<Reply<RmwRequestId, SendGoalResponse>>,
}

impl<G: ActionPart, R: ActionPart, F: ActionPart> Asking<G, R, F> {
    async fn answer(&mut self) -> Result<SendGoalResponse, String> {
        let (shared, reply) = (&self.shared, &mut self.reply);
        match reply {
            Some(reply) => {
                reply
                    .wait(|| shared.accepted.take(shared.ends.goal_client()))
                    .await
            }
            None => std::future::pending().await,
        }
    }
}

impl<G: ActionPart, R: ActionPart, F: ActionPart> Drop for Asking<G, R, F> {
    fn drop(&mut self) {
        if let Some(reply) = self.reply.take() {
            let (shared, id) = (&self.shared, self.id);
            // The server may have accepted it by now, or may do so at any time; its answer to this does not matter.
            drop(shared.ask_to_cancel(id));
            let until = Instant::now() + GIVEN_UP;
            shared.book().given_up.push(GivenUp { id, reply, until });
            shared.due.notify_one();
        }
    }
}

/// A goal that a server has accepted.
pub struct RemoteGoal<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
    id: GoalId,
    feedback: broadcast::Receiver<F>,
    result: Option<Reply<RmwRequestId, GetResultResponse<R>>>,
    /// The result is there, and so many feedbacks came before it.
    end: Option<(GetResultResponse<R>, usize)>,
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

    /// What is heard next; nothing any more after its end. Cancelling the future loses nothing. The end comes after the
    /// feedback that was there before it, and no later, however fast feedback comes.
    pub async fn next(&mut self) -> GoalNews<R, F> {
        loop {
            if let Some((_, before)) = &mut self.end {
                if let Some(rest) = before.checked_sub(1) {
                    *before = rest;
                    if let Ok(feedback) = self.feedback.try_recv() {
                        return GoalNews::Feedback(feedback);
                    }
                    continue;
                }
                if let Some((GetResultResponse { status, result }, _)) = self.end.take() {
                    return GoalNews::Ended(status, result);
                }
            }
            let Some(result) = &mut self.result else {
                return std::future::pending().await;
            };
            tokio::select! {
                biased;
                ended = result.delivered() => {
                    self.result = None;
                    self.end = Some((ended, self.feedback.len()));
                }
                feedback = self.feedback.recv() => match feedback {
                    Ok(feedback) => return GoalNews::Feedback(feedback),
                    Err(broadcast::error::RecvError::Lagged(lost)) => self.shared.overflow.count(lost),
                    // The sender stays in the book as long as this goal.
                    Err(broadcast::error::RecvError::Closed) => std::future::pending().await,
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

    /// Asks to cancel it, at once; the future waits for the answer. Where that is granted, it ends soon, and not always as
    /// cancelled.
    ///
    /// # Errors
    /// [`Error::Service`] where there is no answer within `timeout`.
    pub fn cancel(
        &self,
        timeout: Duration,
    ) -> impl Future<Output = Result<CancelReturn>> + Send + use<G, R, F> {
        let shared = Arc::clone(&self.shared);
        let asked = shared.ask_to_cancel(self.id);
        async move {
            let mut reply = asked.map_err(|reason| shared.failed(reason))?;
            let answer = reply.wait(|| shared.cancelled.take(shared.ends.cancel_client()));
            match tokio::time::timeout(timeout, answer).await {
                Ok(Ok(response)) => Ok(response.return_code),
                Ok(Err(reason)) => Err(shared.failed(reason)),
                Err(_) => Err(shared.failed(format!(
                    "no answer to a cancel within {:.1} s",
                    timeout.as_secs_f64()
                ))),
            }
        }
    }
}

impl<G: ActionPart, R: ActionPart, F: ActionPart> Drop for RemoteGoal<G, R, F> {
    fn drop(&mut self) {
        self.shared.book().feedback.remove(&self.id);
    }
}

/// Hands on what comes. Looks for results go on at their pace however fast feedback comes.
async fn pump<G, R, F>(shared: Arc<Shared<G, R, F>>)
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    let mut looks = tokio::time::interval(RESULT_POLL);
    looks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        let is_due = shared.is_due();
        tokio::select! {
            message = shared.next_feedback() => {
                if let Some(sender) = shared.book().feedback.get(&message.goal_id) {
                    // The goal holds the receiver as long as it is in the book.
                    sender.send(message.feedback).ok();
                }
            }
            _ = looks.tick(), if is_due => shared.look(),
            () = shared.due.notified(), if !is_due => {}
        }
        // Where feedback is always there, nobody else on this thread would get a turn.
        tokio::task::consume_budget().await;
    }
}

impl<G, R, F> Shared<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    // Every change under the lock is a single insertion or removal, so a panic elsewhere leaves it whole.
    fn book(&self) -> MutexGuard<'_, Book<F>> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn failed(&self, reason: String) -> Error {
        Error::Service {
            service: self.name.clone(),
            reason,
        }
    }

    fn ask_for_result(&self, goal_id: GoalId) -> Result<Reply<RmwRequestId, GetResultResponse<R>>> {
        let request = GetResultRequest { goal_id };
        let reply = self.results.ask(self.ends.result_client(), request);
        let reply = reply.map_err(|reason| self.failed(reason))?;
        self.due.notify_one();
        Ok(reply)
    }

    fn ask_to_cancel(
        &self,
        goal_id: GoalId,
    ) -> Result<Reply<RmwRequestId, CancelGoalResponse>, String> {
        let request = cancel_request(goal_id)?;
        self.cancelled.ask(self.ends.cancel_client(), request)
    }

    fn is_due(&self) -> bool {
        !self.results.is_empty() || !self.book().given_up.is_empty()
    }

    /// Takes the results that have come, and cancels what was accepted after it was given up.
    fn look(&self) {
        if let Err(error) = self.results.take(self.ends.result_client()) {
            tracing::error!("{}: a result cannot be read: {error}", self.name);
        }
        let mut given_up = std::mem::take(&mut self.book().given_up);
        if given_up.is_empty() {
            return;
        }
        if let Err(error) = self.accepted.take(self.ends.goal_client()) {
            tracing::error!("{}: an answer cannot be read: {error}", self.name);
        }
        let now = Instant::now();
        given_up.retain_mut(|goal| match goal.reply.try_wait() {
            Some(answer) => {
                if answer.accepted
                    && let Err(reason) = self.ask_to_cancel(goal.id)
                {
                    tracing::error!(
                        "{}: a goal that was given up cannot be cancelled: {reason}",
                        self.name
                    );
                }
                false
            }
            None => now < goal.until,
        });
        self.book().given_up.append(&mut given_up);
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

/// A request to cancel one goal. ros2-client keeps its field to itself, but not what it is on the wire.
fn cancel_request(goal_id: GoalId) -> Result<CancelGoalRequest, String> {
    let stamp = Time::ZERO;
    let info = GoalInfo { goal_id, stamp };
    let bytes = cdr_encoding::to_vec::<_, LittleEndian>(&info).map_err(|e| e.to_string())?;
    let (request, _) = cdr_encoding::from_bytes::<CancelGoalRequest, LittleEndian>(&bytes)
        .map_err(|e| e.to_string())?;
    Ok(request)
}
