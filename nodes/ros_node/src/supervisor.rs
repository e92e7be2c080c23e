//! Starts, ends and drops the main function of a node as its states, a manager and signals ask for it.

use std::fmt::Display;
use std::future::Future;
use std::pin::{Pin, pin};
use std::time::Duration;

use ros2_interfaces::lifecycle_msgs::{State, Transition};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::{mpsc, oneshot};
use tokio::time::Instant;

use crate::ending::{Purpose, settled};
use crate::error::{Error, Result};
use crate::lifecycle::Request;
use crate::logging;
use crate::node::Node;
use crate::shutdown::Shutdown;

/// How a node failed.
pub(crate) enum Failure {
    /// The node could not be made.
    Start(Error),
    /// `main` failed before it was ready.
    Input(String),
    /// It failed later, which is in the log.
    Work,
}

impl Failure {
    /// The main function ended with this error; at work it is told here.
    fn of_main(ready: bool, error: &str) -> Self {
        if ready {
            logging::fatal(error);
            Self::Work
        } else {
            Self::Input(error.to_owned())
        }
    }
}

/// SIGINT, SIGTERM, and the node's own wish to end.
pub(crate) struct Signals {
    interrupt: Signal,
    terminate: Signal,
    shutdown: Shutdown,
    received: u32,
}

impl Signals {
    /// From now on signals end a node, and no longer the process: to be called before anything is started.
    pub(crate) fn listen() -> Result<Self, Failure> {
        let listen = |kind: SignalKind| {
            signal(kind).map_err(|source| {
                let what = "listening to signals";
                Failure::Start(Error::Io { what, source })
            })
        };
        Ok(Self {
            interrupt: listen(SignalKind::interrupt())?,
            terminate: listen(SignalKind::terminate())?,
            shutdown: Shutdown::default(),
            received: 0,
        })
    }

    /// The node that they end, and that may end by itself.
    pub(crate) fn of(mut self, shutdown: Shutdown) -> Self {
        self.shutdown = shutdown;
        self
    }

    /// Completes once the node is to end. Cancelling the future loses nothing.
    async fn ended(&mut self) {
        if self.received > 0 {
            return;
        }
        let shutdown = self.shutdown.clone();
        tokio::select! {
            () = self.signal() => {}
            () = shutdown.requested() => {}
        }
    }

    /// The next signal.
    async fn signal(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
        self.received += 1;
    }

    /// Completes where somebody who has interrupted the node already does it once more.
    async fn insisted(&mut self) {
        while self.received < 2 {
            self.signal().await;
        }
    }
}

/// How long things may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// The main function, from the request to end to its end; `None`: as long as it takes.
    pub(crate) ending: Option<Duration>,
    /// `configure`, where a manager waits for it.
    pub(crate) configuring: Duration,
    /// For the process's own memory \[bytes\].
    pub(crate) memory: u64,
}

/// The main function of a node and who asks for what.
pub(crate) struct Supervisor<F, Fut> {
    node: Node,
    main: F,
    running: Option<Pin<Box<Fut>>>,
    signals: Signals,
    limits: Limits,
    requests: Option<mpsc::Receiver<Request>>,
    /// Nobody manages the node: it comes up active, and ends with its main function.
    autostart: bool,
    /// Who asked for the `configure` that is under way, and until when.
    configuring: Option<(oneshot::Sender<bool>, Instant)>,
    /// Something could not be put in order, which is in the log.
    unsettled: bool,
}

/// What a supervisor waits for.
enum Event<E> {
    Ready,
    Ended(Result<(), E>),
    Asked(Request),
    TooLate,
    Signal,
}

/// What became of the preparations for an end.
enum Left<E> {
    Settled,
    Failed(String),
    /// The main function has ended meanwhile.
    Ended(Result<(), E>),
}

impl<F, Fut, E> Supervisor<F, Fut>
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    pub(crate) fn new(
        node: Node,
        main: F,
        signals: Signals,
        limits: Limits,
        autostart: bool,
    ) -> Self {
        Self {
            requests: node.lifecycle().take_requests(),
            node,
            main,
            running: None,
            signals,
            limits,
            autostart,
            configuring: None,
            unsettled: false,
        }
    }

    /// Until the node is to end, or its main function ends, where that is the end of the node.
    pub(crate) async fn work(&mut self) -> Result<(), Failure> {
        if self.autostart {
            self.configure();
        } else {
            self.node.lifecycle().open(false);
            tracing::info!("unconfigured: waiting for ~/change_state");
        }
        loop {
            let node = self.node.clone();
            let configuring = node.lifecycle().state() == State::CONFIGURING;
            let deadline = self.configuring.as_ref().map(|(_, deadline)| *deadline);
            let event = tokio::select! {
                biased;
                () = self.signals.ended() => Event::Signal,
                () = node.ready(), if configuring => Event::Ready,
                outcome = running(&mut self.running) => Event::Ended(outcome),
                () = until(deadline) => Event::TooLate,
                Some(request) = next(&mut self.requests) => Event::Asked(request),
            };
            match event {
                Event::Signal => return self.end().await,
                Event::Ready => {
                    self.node.lifecycle().pass(Transition::ON_CONFIGURE_SUCCESS);
                    self.answer(true);
                    if self.autostart {
                        self.node.lifecycle().pass(Transition::ACTIVATE);
                        self.node.lifecycle().pass(Transition::ON_ACTIVATE_SUCCESS);
                    }
                }
                Event::TooLate => self.too_late().await,
                Event::Ended(outcome) => {
                    if self.ended(outcome).await? {
                        return self.verdict();
                    }
                }
                Event::Asked(request) => {
                    if let Some(outcome) = self.change(request).await
                        && self.ended(outcome).await?
                    {
                        return self.verdict();
                    }
                }
            }
        }
    }

    /// The end of the node as a transition, from wherever it stands.
    pub(crate) fn shut_down(&mut self) {
        self.running = None;
        let lifecycle = self.node.lifecycle();
        lifecycle.open(false);
        let transition = match lifecycle.state() {
            State::UNCONFIGURED => Transition::UNCONFIGURED_SHUTDOWN,
            State::INACTIVE => Transition::INACTIVE_SHUTDOWN,
            State::ACTIVE => Transition::ACTIVE_SHUTDOWN,
            _ => return,
        };
        lifecycle.pass(transition);
        lifecycle.pass(Transition::ON_SHUTDOWN_SUCCESS);
    }

    /// First what is to be put in order, while everything still works; then the main function gets its time to end.
    async fn end(&mut self) -> Result<(), Failure> {
        let ready = self.node.is_ready();
        let mut outcome = None;
        // Where the middleware has broken down there is nobody to be told.
        let is_broken = self.signals.shutdown.is_broken();
        if self.running.is_some() && !is_broken {
            match self.leave(Purpose::ShutDown).await {
                Left::Settled => {}
                Left::Failed(reason) => self.complain(&reason),
                Left::Ended(ended) => outcome = Some(ended),
            }
        }
        self.node.shutdown_handle().request();
        if outcome.is_none() && self.running.is_some() {
            let deadline = self.limits.ending.map(|limit| Instant::now() + limit);
            let dropped = tokio::select! {
                biased;
                ended = running(&mut self.running) => {
                    outcome = Some(ended);
                    None
                }
                () = self.signals.insisted() => Some("at the second signal".to_owned()),
                () = until(deadline) => Some(format!(
                    "{:.1} s after it was asked to end",
                    self.limits.ending.unwrap_or_default().as_secs_f64()
                )),
            };
            if let Some(when) = dropped {
                logging::fatal(&format!(
                    "the main function is dropped where it stands, {when}"
                ));
                self.running = None;
                return Err(Failure::Work);
            }
        }
        self.answer(false);
        match outcome {
            Some(Err(error)) => Err(Failure::of_main(ready, &format!("{error:#}"))),
            _ => self.verdict(),
        }
    }

    fn verdict(&self) -> Result<(), Failure> {
        if self.unsettled || self.signals.shutdown.is_broken() {
            Err(Failure::Work)
        } else {
            Ok(())
        }
    }

    fn complain(&mut self, reason: &str) {
        tracing::error!("{reason}");
        self.unsettled = true;
    }

    fn configure(&mut self) {
        self.node.lifecycle().pass(Transition::CONFIGURE);
        self.running = Some(Box::pin((self.main)(self.node.clone())));
    }

    /// Lets everybody put things in order. Whoever asks for a transition meanwhile is told no.
    async fn leave(&mut self, purpose: Purpose) -> Left<E> {
        let mut settled = pin!(settled(self.node.parties().tell(purpose)));
        let shutdown = self.signals.shutdown.clone();
        let mut broken = pin!(shutdown.broken());
        loop {
            tokio::select! {
                biased;
                outcome = &mut settled => return match outcome {
                    Ok(()) => Left::Settled,
                    Err(reason) => Left::Failed(format!("the node {}: {reason}", purpose.verb())),
                },
                outcome = running(&mut self.running) => return Left::Ended(outcome),
                () = &mut broken => {
                    return Left::Failed("what was to be put in order is left: the middleware has broken down".to_owned());
                }
                Some(request) = next(&mut self.requests) => {
                    request.answer.send(false).ok();
                }
                () = self.signals.insisted() => {
                    return Left::Failed("what was to be put in order is left at the second signal".to_owned());
                }
            }
        }
    }

    async fn clean_up(&mut self) {
        self.running = None;
        self.node.clean_up().await;
    }

    fn answer(&mut self, success: bool) {
        if let Some((answer, _)) = self.configuring.take() {
            // Who asked may have gone.
            answer.send(success).ok();
        }
    }

    /// A manager does not wait for ever.
    async fn too_late(&mut self) {
        tracing::error!(
            "configure: the node was not ready within {:.1} s",
            self.limits.configuring.as_secs_f64()
        );
        self.clean_up().await;
        self.node.lifecycle().pass(Transition::ON_CONFIGURE_FAILURE);
        self.answer(false);
    }

    /// The main function has ended; `true` where that is the end of the node.
    async fn ended(&mut self, outcome: Result<(), E>) -> Result<bool, Failure> {
        let Err(error) = outcome else {
            self.answer(false);
            return Ok(true);
        };
        let error = format!("{error:#}");
        let lifecycle = self.node.lifecycle();
        let ready = self.node.is_ready();
        let state = lifecycle.state();
        match state {
            State::ACTIVE => {
                lifecycle.pass(Transition::DEACTIVATE);
                lifecycle.pass(Transition::ON_DEACTIVATE_ERROR);
            }
            State::INACTIVE => {
                lifecycle.pass(Transition::CLEANUP);
                lifecycle.pass(Transition::ON_CLEANUP_ERROR);
            }
            State::DEACTIVATING => lifecycle.pass(Transition::ON_DEACTIVATE_ERROR),
            State::CLEANINGUP => lifecycle.pass(Transition::ON_CLEANUP_ERROR),
            State::SHUTTINGDOWN => lifecycle.pass(Transition::ON_SHUTDOWN_ERROR),
            _ if self.autostart => lifecycle.pass(Transition::ON_CONFIGURE_ERROR),
            _ => lifecycle.pass(Transition::ON_CONFIGURE_FAILURE),
        }
        if self.autostart {
            lifecycle.pass(Transition::ON_ERROR_FAILURE);
            return Err(Failure::of_main(ready, &error));
        }
        tracing::error!("{error}");
        lifecycle.open(false);
        self.clean_up().await;
        if state != State::CONFIGURING {
            self.node.lifecycle().pass(Transition::ON_ERROR_SUCCESS);
        }
        self.answer(false);
        Ok(false)
    }

    /// Does what was asked for and says how it went; `configure` is answered when it is over. Hands back how the main
    /// function ended, where it did so meanwhile.
    async fn change(&mut self, request: Request) -> Option<Result<(), E>> {
        let node = self.node.clone();
        let lifecycle = node.lifecycle();
        let Some(transition) = lifecycle.requested(&request.transition) else {
            let Transition { id, label } = &request.transition;
            tracing::warn!(
                "~/change_state: no transition {id} '{label}' from {}",
                lifecycle.label()
            );
            request.answer.send(false).ok();
            return None;
        };
        if transition == Transition::CONFIGURE {
            self.configuring = Some((request.answer, Instant::now() + self.limits.configuring));
            self.configure();
            return None;
        }
        lifecycle.pass(transition);
        let purpose = match transition {
            Transition::ACTIVATE => {
                lifecycle.open(true);
                lifecycle.pass(Transition::ON_ACTIVATE_SUCCESS);
                tracing::info!("{}", lifecycle.label());
                request.answer.send(true).ok();
                return None;
            }
            Transition::DEACTIVATE => Purpose::Deactivate,
            Transition::CLEANUP => Purpose::CleanUp,
            _ => Purpose::ShutDown,
        };
        let left = if self.running.is_some() {
            self.leave(purpose).await
        } else {
            Left::Settled
        };
        let failed = match left {
            Left::Settled => false,
            Left::Failed(reason) => {
                tracing::error!("{reason}");
                true
            }
            Left::Ended(outcome) => {
                request.answer.send(false).ok();
                return Some(outcome);
            }
        };
        match purpose {
            Purpose::Deactivate if failed => lifecycle.pass(Transition::ON_DEACTIVATE_FAILURE),
            Purpose::Deactivate => {
                lifecycle.open(false);
                lifecycle.pass(Transition::ON_DEACTIVATE_SUCCESS);
            }
            Purpose::CleanUp => {
                self.clean_up().await;
                if failed {
                    lifecycle.pass(Transition::ON_CLEANUP_ERROR);
                    lifecycle.pass(Transition::ON_ERROR_SUCCESS);
                } else {
                    lifecycle.pass(Transition::ON_CLEANUP_SUCCESS);
                }
            }
            Purpose::ShutDown => {
                lifecycle.open(false);
                self.clean_up().await;
                self.unsettled |= failed;
                lifecycle.pass(if failed {
                    Transition::ON_SHUTDOWN_FAILURE
                } else {
                    Transition::ON_SHUTDOWN_SUCCESS
                });
            }
        }
        tracing::info!("{}", lifecycle.label());
        request.answer.send(!failed).ok();
        None
    }
}

/// The outcome of the main function; never, without one.
async fn running<Fut: Future>(main: &mut Option<Pin<Box<Fut>>>) -> Fut::Output {
    match main {
        Some(future) => {
            let outcome = future.await;
            *main = None;
            outcome
        }
        None => std::future::pending().await,
    }
}

/// The next request; never, where none can come.
async fn next(requests: &mut Option<mpsc::Receiver<Request>>) -> Option<Request> {
    match requests {
        Some(requests) => requests.recv().await,
        None => std::future::pending().await,
    }
}

/// Waits for a time; for ever, without one.
async fn until(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => tokio::time::sleep_until(deadline).await,
        None => std::future::pending().await,
    }
}
