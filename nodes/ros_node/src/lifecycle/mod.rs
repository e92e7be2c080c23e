//! Managed nodes: states, transitions, and the gate that an inactive node's topics stand behind.
//!
//! A managed node ([`crate::NodeBuilder::managed`]) has the five services and the topic that `ros2 lifecycle` and
//! lifecycle managers use. It comes up **active** by itself; with the parameter `lifecycle_autostart` false it waits,
//! unconfigured, for a manager.
//!
//! | step | what happens |
//! | --- | --- |
//! | configure | the node's main function is started; it succeeds when that calls [`crate::Node::set_ready`], fails where that ends with an error or is not ready in time ([`crate::NodeBuilder::configure_within`]) |
//! | activate | the gate opens: subscriptions give out what comes from now on, publishers publish, actions take goals. What came while the node was inactive is passed over and counted, but of transient local topics, whose last messages are the present state |
//! | deactivate | the main function puts things in order first ([`crate::Endings`]); where it cannot, the node stays active. Then the gate closes: publishers are silent, goals are rejected, diagnostics say "inactive" |
//! | cleanup | the main function puts things in order, and is dropped, with its endpoints, tasks and diagnostics |
//! | shutdown | the same from any state; the node stays, finalized, until it is told to end |
//! | a signal | the same, and the process ends |
//! | an error of the main function at work | error processing: it is dropped as in cleanup, and the node is unconfigured. A node that came up by itself has nobody to configure it again: it ends with a FATAL line and status 1 |
//!
//! While a transition is under way every other request is answered at once, with "no".

mod graph;
mod services;

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use ros2_interfaces::lifecycle_msgs::{State, Transition, TransitionEvent};
use tokio::sync::{mpsc, oneshot, watch};

use crate::clock::system_nanos;
use crate::overflow::Overflow;

pub(crate) use services::serve;

/// Name of the parameter that lets a managed node come up active without a manager.
pub const LIFECYCLE_AUTOSTART: &str = "lifecycle_autostart";

/// Requests and announcements of transitions that wait for their turn.
const QUEUE: usize = 32;

/// Whether an inactive node's endpoints do anything.
#[derive(Clone, Debug)]
pub(crate) struct Gate {
    shared: Arc<GateState>,
}

#[derive(Debug)]
struct GateState {
    open: watch::Sender<bool>,
    /// When it was opened last, in system time; 0 where it has been open from the beginning.
    opened_nanos: AtomicI64,
    waiting: Mutex<Vec<Waker>>,
}

impl Gate {
    /// A gate that is open.
    pub(crate) fn opened() -> Self {
        Self {
            shared: Arc::new(GateState {
                open: watch::Sender::new(true),
                opened_nanos: AtomicI64::new(0),
                waiting: Mutex::default(),
            }),
        }
    }

    pub(crate) fn is_open(&self) -> bool {
        *self.shared.open.borrow()
    }

    /// When it was opened last, in system time \[ns\]; 0 where it has been open from the beginning.
    pub(crate) fn opened_nanos(&self) -> i64 {
        self.shared.opened_nanos.load(Ordering::Acquire)
    }

    /// Waits until it is open.
    pub(crate) async fn opens(&self) {
        // The sender lives in `self`, so that waiting can only end by the gate.
        let mut open = self.shared.open.subscribe();
        open.wait_for(|open| *open).await.ok();
    }

    /// Ready where it is open; otherwise the task is woken when it opens.
    pub(crate) fn poll_open(&self, context: &Context<'_>) -> Poll<()> {
        if self.is_open() {
            return Poll::Ready(());
        }
        let mut waiting = self.waiting();
        if !waiting.iter().any(|waker| waker.will_wake(context.waker())) {
            waiting.push(context.waker().clone());
        }
        drop(waiting);
        // It may have opened between the look and the entry in the list.
        if self.is_open() {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    }

    pub(crate) fn set(&self, open: bool) {
        if open && !self.is_open() {
            let now = system_nanos();
            self.shared.opened_nanos.store(now, Ordering::Release);
        }
        self.shared.open.send_replace(open);
        if open {
            let waiting = std::mem::take(&mut *self.waiting());
            waiting.into_iter().for_each(Waker::wake);
        }
    }

    // Pushing and taking are single steps, so a panic elsewhere leaves the list whole.
    fn waiting(&self) -> MutexGuard<'_, Vec<Waker>> {
        self.shared
            .waiting
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// A transition that somebody asks for, and where the answer goes.
#[derive(Debug)]
pub(crate) struct Request {
    pub(crate) transition: Transition,
    pub(crate) answer: oneshot::Sender<bool>,
}

/// The state of a managed node.
#[derive(Debug)]
pub(crate) struct Lifecycle {
    state: watch::Sender<u8>,
    gate: Gate,
    requests: mpsc::Sender<Request>,
    inbox: Mutex<Option<mpsc::Receiver<Request>>>,
    events: mpsc::Sender<TransitionEvent>,
    outbox: Mutex<Option<mpsc::Receiver<TransitionEvent>>>,
    overflow: Overflow,
}

impl Lifecycle {
    /// Unconfigured, with an open gate.
    pub(crate) fn new() -> Self {
        let (requests, inbox) = mpsc::channel(QUEUE);
        let (events, outbox) = mpsc::channel(QUEUE);
        Self {
            state: watch::Sender::new(State::UNCONFIGURED),
            gate: Gate::opened(),
            requests,
            inbox: Mutex::new(Some(inbox)),
            events,
            outbox: Mutex::new(Some(outbox)),
            overflow: Overflow::new("transition events"),
        }
    }

    /// Counts the transitions that could not be announced.
    pub(crate) fn overflow(&self) -> &Overflow {
        &self.overflow
    }

    pub(crate) fn gate(&self) -> &Gate {
        &self.gate
    }

    /// Number of the state in `lifecycle_msgs/msg/State`.
    pub(crate) fn state(&self) -> u8 {
        *self.state.borrow()
    }

    /// Name of the state.
    pub(crate) fn label(&self) -> String {
        graph::state(self.state()).label
    }

    /// Where requests come out; once.
    pub(crate) fn take_requests(&self) -> Option<mpsc::Receiver<Request>> {
        self.inbox
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }

    fn outbox(&self) -> MutexGuard<'_, Option<mpsc::Receiver<TransitionEvent>>> {
        self.outbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take_events(&self) -> Option<mpsc::Receiver<TransitionEvent>> {
        self.outbox().take()
    }

    /// The transition that a request means here and now.
    pub(crate) fn requested(&self, wanted: &Transition) -> Option<u8> {
        graph::requested(self.state(), wanted).map(|t| t.transition.id)
    }

    /// Goes over a transition and announces it. One that does not begin here changes nothing.
    pub(crate) fn pass(&self, transition: u8) {
        let Some(taken) = graph::transition(self.state(), transition) else {
            tracing::error!(
                "lifecycle: no transition {transition} from {}",
                self.label()
            );
            return;
        };
        self.state.send_replace(taken.goal_state.id);
        tracing::debug!(
            "lifecycle: {} to {}",
            taken.start_state.label,
            taken.goal_state.label
        );
        let event = TransitionEvent {
            timestamp: u64::try_from(system_nanos()).unwrap_or(0),
            transition: taken.transition,
            start_state: taken.start_state,
            goal_state: taken.goal_state,
        };
        // A node that is not managed announces nothing, and at the very end nobody listens any more.
        if let Err(mpsc::error::TrySendError::Full(_)) = self.events.try_send(event)
            && self.outbox().is_none()
        {
            self.overflow.count(1);
        }
    }

    /// Opens or closes the gate.
    pub(crate) fn open(&self, open: bool) {
        self.gate.set(open);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gate wakes what waits before it, and a transition from elsewhere changes nothing.
    #[tokio::test]
    async fn gate_and_states() {
        let lifecycle = Lifecycle::new();
        lifecycle.open(false);
        let gate = lifecycle.gate().clone();
        let passed = tokio::spawn(async move {
            std::future::poll_fn(|context| gate.poll_open(context)).await;
        });
        tokio::task::yield_now().await;
        assert!(!passed.is_finished());
        lifecycle.open(true);
        assert!(passed.await.is_ok());

        lifecycle.pass(Transition::ACTIVATE);
        assert_eq!(lifecycle.label(), "unconfigured");
        lifecycle.pass(Transition::CONFIGURE);
        lifecycle.pass(Transition::ON_CONFIGURE_SUCCESS);
        assert_eq!(lifecycle.label(), "inactive");
    }
}
