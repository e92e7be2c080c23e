//! The serving end of an action.

use std::future::Future;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Instant;

use byteorder::LittleEndian;
use futures::FutureExt;
use ros2_client::RmwRequestId;
use ros2_client::action::{
    FeedbackMessage, GetResultRequest, GetResultResponse, SendGoalRequest, SendGoalResponse,
};
use ros2_client::action_msgs::{CancelGoalRequest, CancelGoalResponse, GoalInfo};
use ros2_client::builtin_interfaces::Time;
use tokio::sync::{mpsc, watch};

use super::goals::Goals;
use super::{ActionPart, GoalId, GoalStatus};
use crate::clock::Clock;
use crate::lifecycle::Gate;
use crate::node::Node;
use crate::overflow::Overflow;

/// Goals that wait until they are taken; one more is rejected.
const GOALS_WAITING: usize = 16;

/// Serves one action, as rcl_action does: results are kept for a quarter of an hour, the status topic is latched and
/// told at every change, an id is used once, and what is not finished when its handle is dropped is aborted. Every cancel
/// of a goal that has not ended is granted.
///
/// Results and cancels are answered by a task of the node; new goals wait here until they are taken.
pub struct ActionServer<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
    requests: mpsc::Receiver<GoalRequest<G, R, F>>,
}

struct Shared<G: ActionPart, R: ActionPart, F: ActionPart> {
    name: String,
    clock: Clock,
    gate: Gate,
    /// The result of goals whose handle is dropped.
    abandoned: R,
    /// What had no room: goals, answers, feedback, statuses.
    overflow: Overflow,
    core: Mutex<Core<G, R, F>>,
}

struct Core<G: ActionPart, R: ActionPart, F: ActionPart> {
    ends: ros2_client::action::ActionServer<G, R, F>,
    goals: Goals<RmwRequestId, R>,
}

/// What comes in.
enum Arrival<G> {
    Goal(RmwRequestId, SendGoalRequest<G>),
    Cancel(RmwRequestId, CancelGoalRequest),
    Result(RmwRequestId, GetResultRequest),
    /// A request that is none, which has been logged.
    Nothing,
}

impl<G, R, F> std::fmt::Debug for ActionServer<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ActionServer")
            .field("name", &self.shared.name)
            .finish_non_exhaustive()
    }
}

impl<G, R, F> ActionServer<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    pub(super) fn start(
        node: &Node,
        ends: ros2_client::action::ActionServer<G, R, F>,
        name: String,
        abandoned: R,
    ) -> Self {
        let shared = Arc::new(Shared {
            overflow: Overflow::new(format!("action {name}")),
            name,
            clock: node.clock().clone(),
            gate: node.gate().clone(),
            abandoned,
            core: Mutex::new(Core {
                ends,
                goals: Goals::new(),
            }),
        });
        node.watch_overflow(&shared.overflow);
        let (sender, requests) = mpsc::channel(GOALS_WAITING);
        node.spawn(drive(Arc::clone(&shared), sender));
        Self { shared, requests }
    }

    /// The next goal that somebody wants. Cancelling the future loses nothing.
    pub async fn recv(&mut self) -> GoalRequest<G, R, F> {
        match self.requests.recv().await {
            Some(request) => request,
            // The node has ended, and its tasks with it.
            None => std::future::pending().await,
        }
    }

    /// A goal that is wanted already.
    pub fn try_recv(&mut self) -> Option<GoalRequest<G, R, F>> {
        self.requests.try_recv().ok()
    }

    /// Absolute name of the action.
    pub fn name(&self) -> &str {
        &self.shared.name
    }
}

/// A goal that somebody wants. Dropped without an answer it is rejected.
pub struct GoalRequest<G: ActionPart, R: ActionPart, F: ActionPart> {
    /// What is wanted.
    pub goal: G,
    answer: Answer<G, R, F>,
}

struct Answer<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
    request: RmwRequestId,
    id: GoalId,
    open: bool,
}

impl<G, R, F> GoalRequest<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    /// Takes the goal; it is executed from now on.
    pub fn accept(self) -> (G, GoalHandle<G, R, F>) {
        let Self { goal, mut answer } = self;
        answer.open = false;
        let (shared, id) = (Arc::clone(&answer.shared), answer.id);
        let now = shared.clock.now_nanos();
        let mut core = shared.core();
        core.goals.forget_old(Instant::now());
        let cancelled = core.goals.accept(id, now);
        shared.answer_goal(&mut core, answer.request, Some(now));
        shared.tell_status(&mut core);
        core.goals.execute(id);
        shared.tell_status(&mut core);
        drop(core);
        let handle = GoalHandle {
            shared,
            id,
            cancelled,
            open: true,
        };
        (goal, handle)
    }

    /// Refuses the goal.
    pub fn reject(self) {
        drop(self);
    }

    /// Id of the goal.
    pub fn id(&self) -> GoalId {
        self.answer.id
    }
}

impl<G, R, F> Drop for Answer<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    fn drop(&mut self) {
        if self.open {
            let mut core = self.shared.core();
            core.goals.reject(self.id);
            self.shared.answer_goal(&mut core, self.request, None);
        }
    }
}

/// A goal under way. Dropped before it has ended it is aborted, with the result that the server has for that.
pub struct GoalHandle<G: ActionPart, R: ActionPart, F: ActionPart> {
    shared: Arc<Shared<G, R, F>>,
    id: GoalId,
    cancelled: watch::Receiver<bool>,
    open: bool,
}

impl<G, R, F> GoalHandle<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    /// Id of the goal.
    pub fn id(&self) -> GoalId {
        self.id
    }

    /// Tells how far it has come.
    pub fn feedback(&self, feedback: F) {
        let message = FeedbackMessage {
            goal_id: self.id,
            feedback,
        };
        let mut core = self.shared.core();
        let sent = core.ends.feedback_publisher().async_publish(message);
        if !matches!(sent.now_or_never(), Some(Ok(()))) {
            self.shared.overflow.count(1);
        }
    }

    /// Whether somebody asked to cancel it.
    pub fn is_cancel_requested(&self) -> bool {
        *self.cancelled.borrow()
    }

    /// Completes when somebody asks to cancel it.
    pub async fn cancel_requested(&mut self) {
        if self.cancelled.wait_for(|asked| *asked).await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// It is reached.
    pub fn succeed(mut self, result: &R) {
        self.end(GoalStatus::Succeeded, result);
    }

    /// It cannot be reached, or something newer took its place.
    pub fn abort(mut self, result: &R) {
        self.end(GoalStatus::Aborted, result);
    }

    /// It was given up because somebody asked for it; where nobody did, it counts as aborted.
    pub fn canceled(mut self, result: &R) {
        self.end(GoalStatus::Canceled, result);
    }

    fn end(&mut self, status: GoalStatus, result: &R) {
        self.open = false;
        let mut core = self.shared.core();
        let (status, askers) = core
            .goals
            .end(self.id, status, result.clone(), Instant::now());
        self.shared.tell_status(&mut core);
        for asker in askers {
            self.shared
                .answer_result(&mut core, asker, status, result.clone());
        }
    }
}

impl<G, R, F> Drop for GoalHandle<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    fn drop(&mut self) {
        if self.open {
            let abandoned = self.shared.abandoned.clone();
            self.end(GoalStatus::Aborted, &abandoned);
        }
    }
}

async fn drive<G, R, F>(shared: Arc<Shared<G, R, F>>, requests: mpsc::Sender<GoalRequest<G, R, F>>)
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    loop {
        match std::future::poll_fn(|context| shared.poll(context)).await {
            // It would be begun much later, on activation.
            Arrival::Goal(request, _) if !shared.gate.is_open() => {
                tracing::warn!(
                    "{}: a goal is rejected: the node is not active",
                    shared.name
                );
                shared.answer_goal(&mut shared.core(), request, None);
            }
            Arrival::Goal(request, wanted) => {
                if !shared.core().goals.offer(wanted.goal_id) {
                    tracing::warn!(
                        "{}: goal {:?} is rejected: there is one of this id",
                        shared.name,
                        wanted.goal_id
                    );
                    shared.answer_goal(&mut shared.core(), request, None);
                    continue;
                }
                let answer = Answer {
                    shared: Arc::clone(&shared),
                    request,
                    id: wanted.goal_id,
                    open: true,
                };
                // Where nobody takes goals any more, the request comes back, is dropped and so rejected.
                let goal = wanted.goal;
                let waits = requests.try_send(GoalRequest { goal, answer });
                if let Err(mpsc::error::TrySendError::Full(_)) = &waits {
                    shared.overflow.count(1);
                }
            }
            Arrival::Cancel(request, wanted) => shared.cancel(request, &wanted),
            Arrival::Result(request, wanted) => {
                let mut core = shared.core();
                core.goals.forget_old(Instant::now());
                if let Some((status, result)) = core.goals.ask(wanted.goal_id, request) {
                    shared.answer_result(&mut core, request, status, result);
                }
                let forgotten = core.goals.take_overflow();
                shared.overflow.count(forgotten);
            }
            Arrival::Nothing => {}
        }
    }
}

impl<G, R, F> Shared<G, R, F>
where
    G: ActionPart,
    R: ActionPart,
    F: ActionPart,
{
    // Every change under the lock is a whole one, so a panic elsewhere leaves it usable.
    fn core(&self) -> MutexGuard<'_, Core<G, R, F>> {
        self.core.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn poll(&self, context: &mut Context<'_>) -> Poll<Arrival<G>> {
        let mut core = self.core();
        let ends = &mut core.ends;
        // The futures are views of the readers without a state of their own; making them anew costs nothing.
        if let Poll::Ready(taken) = pin!(ends.goal_server().async_receive_request()).poll(context) {
            return Poll::Ready(self.arrival(taken, Arrival::Goal));
        }
        if let Poll::Ready(taken) = pin!(ends.cancel_server().async_receive_request()).poll(context)
        {
            return Poll::Ready(self.arrival(taken, Arrival::Cancel));
        }
        if let Poll::Ready(taken) = pin!(ends.result_server().async_receive_request()).poll(context)
        {
            return Poll::Ready(self.arrival(taken, Arrival::Result));
        }
        Poll::Pending
    }

    fn arrival<Request>(
        &self,
        taken: ros2_client::ReadResult<(RmwRequestId, Request)>,
        kind: fn(RmwRequestId, Request) -> Arrival<G>,
    ) -> Arrival<G> {
        match taken {
            Ok((id, request)) => kind(id, request),
            Err(error) => {
                tracing::error!("{}: a request cannot be read: {error}", self.name);
                Arrival::Nothing
            }
        }
    }

    fn cancel(&self, request: RmwRequestId, wanted: &CancelGoalRequest) {
        let Some(GoalInfo { goal_id, stamp }) = goal_info(wanted) else {
            tracing::error!("{}: a cancel request cannot be read", self.name);
            return;
        };
        let mut core = self.core();
        let (return_code, goals_canceling) = core.goals.cancel(goal_id, stamp.to_nanos());
        let changed = !goals_canceling.is_empty();
        let response = CancelGoalResponse {
            return_code,
            goals_canceling,
        };
        let sent = core
            .ends
            .cancel_server()
            .async_send_response(request, response)
            .now_or_never();
        self.check("a cancel", sent);
        if changed {
            self.tell_status(&mut core);
        }
    }

    /// Accepted at this time, or rejected.
    fn answer_goal(&self, core: &mut Core<G, R, F>, request: RmwRequestId, accepted: Option<i64>) {
        let response = SendGoalResponse {
            accepted: accepted.is_some(),
            stamp: Time::from_nanos(accepted.unwrap_or(0)),
        };
        let sent = core
            .ends
            .goal_server()
            .async_send_response(request, response)
            .now_or_never();
        self.check("a goal", sent);
    }

    fn answer_result(
        &self,
        core: &mut Core<G, R, F>,
        request: RmwRequestId,
        status: GoalStatus,
        result: R,
    ) {
        let sent = core
            .ends
            .result_server()
            .async_send_response(request, GetResultResponse { status, result })
            .now_or_never();
        self.check("a result", sent);
    }

    fn tell_status(&self, core: &mut Core<G, R, F>) {
        let statuses = core.goals.statuses();
        let sent = core.ends.my_status_publisher().async_publish(statuses);
        if !matches!(sent.now_or_never(), Some(Ok(()))) {
            self.overflow.count(1);
        }
    }

    /// An answer is either handed over at once or finds the window full of what a client does not acknowledge.
    fn check<E: std::fmt::Debug>(&self, what: &str, sent: Option<Result<(), E>>) {
        match sent {
            Some(Ok(())) => {}
            Some(Err(error)) => {
                tracing::error!(
                    "{}: the answer to {what} request cannot be sent: {error:?}",
                    self.name
                );
            }
            // A client does not acknowledge.
            None => self.overflow.count(1),
        }
    }
}

/// What a request asks to cancel. ros2-client keeps the field to itself, but not what it is on the wire.
fn goal_info(request: &CancelGoalRequest) -> Option<GoalInfo> {
    let bytes = cdr_encoding::to_vec::<_, LittleEndian>(request).ok()?;
    let (info, _) = cdr_encoding::from_bytes::<GoalInfo, LittleEndian>(&bytes).ok()?;
    Some(info)
}
