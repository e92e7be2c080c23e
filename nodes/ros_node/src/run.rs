//! `main` of a node: arguments, logging, signals, panics, a clean end, the exit status.

use std::fmt::Display;
use std::future::Future;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::signal::unix::{SignalKind, signal};

use crate::builder::{NodeBuilder, Startup};
use crate::error::{Error, Result};
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

/// Runs a node until `main` returns or a signal comes.
///
/// `main` should select on [`Node::shutdown`]; half a second after a signal it is dropped where it stands. Exit
/// status: 0 after a clean end, 2 where the node could not start or `main` failed before [`Node::set_ready`], 1 where
/// it failed later, 101 after a panic, which becomes a FATAL line.
pub fn run<F, Fut, E>(builder: NodeBuilder, main: F) -> ExitCode
where
    F: FnOnce(Node) -> Fut,
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
    F: FnOnce(Node) -> Fut,
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

async fn supervise<F, Fut, E>(startup: Startup, main: F) -> Result<(), Failure>
where
    F: FnOnce(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    let node = Node::start(startup).map_err(Failure::Start)?;
    end_on_panic(&node);
    let shutdown = node.shutdown_handle().clone();
    let outcome = {
        let mut main = std::pin::pin!(main(node.clone()));
        tokio::select! {
            outcome = &mut main => Some(outcome),
            () = async {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                    () = shutdown.requested() => {}
                }
                shutdown.request();
                tokio::time::sleep(GRACE).await;
            } => None,
        }
        // Here `main` is dropped, and its publishers and subscriptions with it, unless they were given to tasks.
    };
    let outcome = match outcome {
        Some(Err(error)) if node.is_ready() => {
            logging::fatal(&format!("{error:#}"));
            Err(Failure::Work)
        }
        Some(Err(error)) => Err(Failure::Input(format!("{error:#}"))),
        Some(Ok(())) | None => Ok(()),
    };
    tokio::time::sleep(LINGER).await;
    node.stop_tasks().await;
    let participant = node.participant();
    drop(node);
    tokio::time::sleep(FAREWELL).await;
    drop(participant);
    outcome
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
