//! `main` of a node: arguments, logging, signals, panics, a clean end, the exit status.

use std::fmt::Display;
use std::future::Future;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ros2_interfaces::lifecycle_msgs::{State, Transition};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{mpsc, oneshot};

use crate::builder::{NodeBuilder, Startup};
use crate::discovery::{Identity, farewell};
use crate::error::{Error, Result};
use crate::lifecycle::{LIFECYCLE_AUTOSTART, Request};
use crate::logging;
use crate::node::Node;
use crate::ros_args::RosArgs;

/// Time a node has to end by itself after a signal.
const GRACE: Duration = Duration::from_millis(500);
/// Time in which reliable subscribers can ask again for what they missed, before the publishers go.
const LINGER: Duration = Duration::from_millis(200);
/// Time in which discovery tells others that the endpoints are gone.
const FAREWELL: Duration = Duration::from_millis(200);

/// Exit status for arguments, parameters or input that cannot be used.
const UNUSABLE: u8 = 2;
/// Exit status where the node failed at work.
const FAILED: u8 = 1;
/// Exit status after a panic.
const PANICKED: u8 = 101;

static PANIC: AtomicBool = AtomicBool::new(false);

/// Runs a node until `main` returns or a signal comes. A managed node may have its `main` called several times.
///
/// `main` should select on [`Node::shutdown`]; half a second after a signal it is dropped where it stands. Exit
/// status: 0 after a clean end, 2 where the node could not start or `main` failed before [`Node::set_ready`], 1 where
/// it failed later, 101 after a panic, which becomes a FATAL line.
pub fn run<F, Fut, E>(builder: NodeBuilder, main: F) -> ExitCode
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    run_with(std::env::args().skip(1), builder, main)
}

/// As [`run`], with these arguments instead of the command line's: for a program of which the node is one command.
pub fn run_with<F, Fut, E>(
    arguments: impl IntoIterator<Item = String>,
    builder: NodeBuilder,
    main: F,
) -> ExitCode
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    let name = builder.name().to_owned();
    let unusable = |error: &dyn Display| {
        eprintln!("{name}: {error:#}");
        ExitCode::from(UNUSABLE)
    };
    let ros_args = match RosArgs::parse(arguments) {
        Ok(ros_args) => ros_args,
        Err(error) => return unusable(&error),
    };
    if ros_args
        .others
        .iter()
        .any(|argument| argument == "--help" || argument == "-h")
    {
        println!("{}", builder.usage());
        return ExitCode::SUCCESS;
    }
    let is_asked = |option: &str| ros_args.others.iter().any(|argument| argument == option);
    if is_asked("--print-parameters") {
        if is_asked("--markdown") {
            print!("{}", builder.parameter_table());
        } else {
            print!("{}", builder.parameter_file());
        }
        return ExitCode::SUCCESS;
    }
    let workers = builder.workers();
    let startup = match builder.check(ros_args) {
        Ok(startup) => startup,
        Err(error) => return unusable(&error),
    };
    let level = startup.ros_args.log_level(&startup.identity.name);
    logging::install(&startup.identity.name, level, startup.ros_args.console);
    // What costs at a few hundred samples a second is waking threads up: one thread, unless the node asks for more.
    let mut runtime = match workers {
        0 => tokio::runtime::Builder::new_current_thread(),
        _ => tokio::runtime::Builder::new_multi_thread(),
    };
    if workers > 0 {
        runtime.worker_threads(workers);
    }
    let runtime = match runtime.enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return unusable(&error),
    };
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        runtime.block_on(supervise(startup, main))
    }));
    runtime.shutdown_timeout(Duration::from_millis(100));
    match outcome {
        _ if PANIC.load(Ordering::SeqCst) => ExitCode::from(PANICKED),
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(Failure::Start(error))) => unusable(&error),
        Ok(Err(Failure::Input(error))) => unusable(&error),
        Ok(Err(Failure::Work)) => ExitCode::from(FAILED),
        Err(_) => ExitCode::from(PANICKED),
    }
}

enum Failure {
    /// The node could not be made.
    Start(Error),
    /// `main` failed before it was ready.
    Input(String),
    /// `main` failed later, which is in the log.
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

async fn supervise<F, Fut, E>(startup: Startup, main: F) -> Result<(), Failure>
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    let managed = startup.managed;
    let environment = startup.environment.clone();
    let node = Node::start(startup).map_err(Failure::Start)?;
    end_on_panic(&node);
    let shutdown = node.shutdown_handle().clone();
    let ended = async {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            () = shutdown.requested() => {}
        }
    };
    let autostart = !managed || node.parameter(LIFECYCLE_AUTOSTART).unwrap_or(true);
    let mut supervisor = Supervisor {
        node: node.clone(),
        main,
        running: None,
        autostart,
        configuring: None,
    };
    let outcome = tokio::select! {
        outcome = supervisor.work() => outcome,
        () = ended => {
            shutdown.request();
            supervisor.end().await
        }
    };
    // Here the main function goes, and its publishers and subscriptions with it, unless they were given to tasks.
    supervisor.running = None;
    supervisor.shut_down();
    drop(supervisor);
    tokio::time::sleep(LINGER).await;
    node.stop_tasks().await;
    let participant = node.participant();
    drop(node);
    tokio::time::sleep(FAREWELL).await;
    let identity = Identity::of(&participant);
    drop(participant);
    farewell(identity, &environment);
    outcome
}

/// Starts and drops the main function as the states of the node ask for it.
struct Supervisor<F, Fut> {
    node: Node,
    main: F,
    running: Option<Pin<Box<Fut>>>,
    /// Nobody manages the node: it comes up active, and ends with its main function.
    autostart: bool,
    /// Who asked for the `configure` that is under way.
    configuring: Option<oneshot::Sender<bool>>,
}

/// What a supervisor waits for.
enum Event<E> {
    Ready,
    Ended(Result<(), E>),
    Asked(Request),
}

impl<F, Fut, E> Supervisor<F, Fut>
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    /// Until the main function ends, where that is the end of the node.
    async fn work(&mut self) -> Result<(), Failure> {
        let mut requests = self.node.lifecycle().take_requests();
        if self.autostart {
            self.configure();
        } else {
            self.node.lifecycle().open(false);
            tracing::info!("unconfigured: waiting for ~/change_state");
        }
        loop {
            let node = self.node.clone();
            let configuring = node.lifecycle().state() == State::CONFIGURING;
            let event = tokio::select! {
                () = node.ready(), if configuring => Event::Ready,
                outcome = running(&mut self.running) => Event::Ended(outcome),
                Some(request) = next(&mut requests) => Event::Asked(request),
            };
            match event {
                Event::Ready => {
                    self.node.lifecycle().pass(Transition::ON_CONFIGURE_SUCCESS);
                    self.answer(true);
                    if self.autostart {
                        self.node.lifecycle().pass(Transition::ACTIVATE);
                        self.node.lifecycle().pass(Transition::ON_ACTIVATE_SUCCESS);
                    }
                }
                Event::Ended(Ok(())) => return Ok(()),
                Event::Ended(Err(error)) => self.failed(&format!("{error:#}")).await?,
                Event::Asked(request) => self.change(request).await,
            }
        }
    }

    /// The main function gets some time to end by itself.
    async fn end(&mut self) -> Result<(), Failure> {
        let ready = self.node.is_ready();
        let Some(main) = &mut self.running else {
            return Ok(());
        };
        match tokio::time::timeout(GRACE, main).await {
            Ok(Err(error)) => Err(Failure::of_main(ready, &format!("{error:#}"))),
            Ok(Ok(())) | Err(_) => Ok(()),
        }
    }

    fn configure(&mut self) {
        self.node.lifecycle().pass(Transition::CONFIGURE);
        self.running = Some(Box::pin((self.main)(self.node.clone())));
    }

    async fn clean_up(&mut self) {
        self.running = None;
        self.node.clean_up().await;
    }

    fn answer(&mut self, success: bool) {
        if let Some(answer) = self.configuring.take() {
            // Who asked may have gone.
            answer.send(success).ok();
        }
    }

    /// The main function has ended with an error.
    async fn failed(&mut self, error: &str) -> Result<(), Failure> {
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
            _ if self.autostart => lifecycle.pass(Transition::ON_CONFIGURE_ERROR),
            _ => lifecycle.pass(Transition::ON_CONFIGURE_FAILURE),
        }
        if self.autostart {
            lifecycle.pass(Transition::ON_ERROR_FAILURE);
            return Err(Failure::of_main(ready, error));
        }
        tracing::error!("{error}");
        lifecycle.open(false);
        self.clean_up().await;
        if state != State::CONFIGURING {
            self.node.lifecycle().pass(Transition::ON_ERROR_SUCCESS);
        }
        self.answer(false);
        Ok(())
    }

    /// Does what was asked for and says how it went; `configure` is answered when it is over.
    async fn change(&mut self, request: Request) {
        let node = self.node.clone();
        let lifecycle = node.lifecycle();
        let Some(transition) = lifecycle.requested(&request.transition) else {
            let Transition { id, label } = &request.transition;
            tracing::warn!(
                "~/change_state: no transition {id} '{label}' from {}",
                lifecycle.label()
            );
            request.answer.send(false).ok();
            return;
        };
        if transition == Transition::CONFIGURE {
            self.configuring = Some(request.answer);
            return self.configure();
        }
        let success = match transition {
            Transition::ACTIVATE => {
                lifecycle.pass(transition);
                lifecycle.open(true);
                Transition::ON_ACTIVATE_SUCCESS
            }
            Transition::DEACTIVATE => {
                lifecycle.pass(transition);
                lifecycle.open(false);
                Transition::ON_DEACTIVATE_SUCCESS
            }
            _ => {
                lifecycle.pass(transition);
                lifecycle.open(false);
                self.clean_up().await;
                if transition == Transition::CLEANUP {
                    Transition::ON_CLEANUP_SUCCESS
                } else {
                    Transition::ON_SHUTDOWN_SUCCESS
                }
            }
        };
        lifecycle.pass(success);
        tracing::info!("{}", lifecycle.label());
        request.answer.send(true).ok();
    }

    /// The end of the node as a transition, from wherever it stands.
    fn shut_down(&self) {
        let lifecycle = self.node.lifecycle();
        let transition = match lifecycle.state() {
            State::UNCONFIGURED => Transition::UNCONFIGURED_SHUTDOWN,
            State::INACTIVE => Transition::INACTIVE_SHUTDOWN,
            State::ACTIVE => Transition::ACTIVE_SHUTDOWN,
            _ => return,
        };
        lifecycle.pass(transition);
        lifecycle.pass(Transition::ON_SHUTDOWN_SUCCESS);
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

fn listen(kind: SignalKind) -> Result<tokio::signal::unix::Signal, Failure> {
    signal(kind).map_err(|source| {
        Failure::Start(Error::Io {
            what: "listening to signals",
            source,
        })
    })
}

/// A panic anywhere becomes a FATAL line and the end of the node, instead of one that goes on by half.
fn end_on_panic(node: &Node) {
    let shutdown = node.shutdown_handle().clone();
    std::panic::set_hook(Box::new(move |panic| {
        PANIC.store(true, Ordering::SeqCst);
        let payload = panic.payload();
        let text = payload.downcast_ref::<&str>().copied();
        let text = text
            .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
            .unwrap_or("unknown");
        let place = panic
            .location()
            .map_or_else(String::new, |at| format!(" at {}:{}", at.file(), at.line()));
        logging::fatal(&format!("panic{place}: {text}"));
        shutdown.request();
    }));
}
