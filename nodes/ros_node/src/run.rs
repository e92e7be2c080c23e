//! `main` of a node: arguments, logging, signals, panics, a clean end, the exit status.

use std::fmt::Display;
use std::future::Future;
use std::io::{ErrorKind, Write as _};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::builder::{NodeBuilder, Startup};
use crate::discovery::{Identity, farewell};
use crate::lifecycle::LIFECYCLE_AUTOSTART;
use crate::logging;
use crate::middleware::{Watchdog, is_of_middleware};
use crate::node::Node;
use crate::ros_args::RosArgs;
use crate::shutdown::Shutdown;
use crate::supervisor::{Failure, Signals, Supervisor};

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
/// A signal is told to [`crate::Endings`] first, while everything still works; then `main`, which should select on
/// [`Node::shutdown`], has its time to end ([`NodeBuilder::end_within`]). After that, or at a second signal, it is dropped
/// where it stands, which is a FATAL line. Exit status: 0 after a clean end, 2 where the node could not start or `main`
/// failed before [`Node::set_ready`], 1 where it failed later, was dropped or could not put everything in order, 101 after a
/// panic, which becomes a FATAL line.
pub fn run<F, Fut, E>(builder: NodeBuilder, main: F) -> ExitCode
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    let told: Result<Vec<String>, _> = std::env::args_os()
        .skip(1)
        .map(std::ffi::OsString::into_string)
        .collect();
    match told {
        Ok(arguments) => run_with(arguments, builder, main),
        Err(argument) => {
            let argument = argument.to_string_lossy();
            eprintln!("{}: argument {argument:?} is no UTF-8", builder.name());
            ExitCode::from(2)
        }
    }
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
        return print(&format!("{}\n", builder.usage()));
    }
    let is_asked = |option: &str| ros_args.others.iter().any(|argument| argument == option);
    if is_asked("--print-parameters") {
        return print(&if is_asked("--markdown") {
            builder.parameter_table()
        } else {
            builder.parameter_file()
        });
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

/// Prints a text for whoever asked for it. A reader that has seen enough (`| head`) is no fault.
fn print(text: &str) -> ExitCode {
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes());
    match written.and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("standard output: {error}");
            ExitCode::from(FAILED)
        }
        _ => ExitCode::SUCCESS,
    }
}

async fn supervise<F, Fut, E>(startup: Startup, main: F) -> Result<(), Failure>
where
    F: FnMut(Node) -> Fut,
    Fut: Future<Output = Result<(), E>>,
    E: Display,
{
    let managed = startup.managed;
    let environment = startup.environment.clone();
    let limits = startup.limits;
    let signals = Signals::listen()?;
    let shutdown = startup.shutdown.clone();
    end_on_panic(shutdown.clone());
    let watchdog = Watchdog::start(shutdown.clone(), startup.ready.subscribe(), limits, FAILED);
    let node = Node::start(startup).map_err(Failure::Start)?;
    let signals = signals.of(shutdown);
    let autostart = !managed || node.parameter(LIFECYCLE_AUTOSTART).unwrap_or(true);
    let mut supervisor = Supervisor::new(node.clone(), main, signals, limits, autostart);
    let outcome = supervisor.work().await;
    if node.shutdown_handle().is_broken() {
        // What RustDDS holds may be locked for good: it is left where it stands. The others are told by ourselves.
        farewell(Identity::of(&node.participant()), &environment);
        let panicked = PANIC.load(Ordering::SeqCst);
        std::process::exit(i32::from(if panicked { PANICKED } else { FAILED }));
    }
    drop(watchdog);
    // Here the main function goes, and its publishers and subscriptions with it, unless they were given to tasks.
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

/// A panic anywhere becomes a FATAL line and the end of the node, instead of one that goes on by half.
fn end_on_panic(shutdown: Shutdown) {
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
        if is_of_middleware() {
            shutdown.break_down();
        } else {
            shutdown.request();
        }
    }));
}
