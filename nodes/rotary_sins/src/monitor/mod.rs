//! `rotary-sins monitor`: how the calibration goes, on one page of a terminal.

mod draw;
mod picture;
mod state;

use std::{
    io::IsTerminal,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use clap::Args;
use ratatui::{
    Terminal,
    backend::TestBackend,
    crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers},
};
use ros_node::{Node, NodeBuilder};
use ros2_interfaces::{RosMessage, Topic, diagnostic_msgs::DiagnosticArray};
use rotary_sins_msgs::interfaces::topics::{DIAGNOSTICS, ESTIMATE, OUTLOOK, SCHEME_STATUS};

use self::{
    draw::{Look, page},
    state::MonitorState,
};

/// Name of the node, before its process id.
const NAME: &str = "rotary_sins_monitor";
/// Between two drawings.
const REFRESH: Duration = Duration::from_millis(500);

/// Options of `monitor`.
#[derive(Args, Clone)]
pub struct Options {
    /// Wait for an estimate, print one page as text, and end
    #[arg(long)]
    once: bool,
    /// How long --once waits
    #[arg(long, default_value_t = 20.0, value_name = "SECONDS")]
    timeout: f64,
    /// Write the page as a picture (SVG) when the monitor ends
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Runs until q, Ctrl-C or a signal. `ros_arguments` are those behind `--ros-args`, with it.
pub fn run(options: &Options, mut ros_arguments: Vec<String>) -> ExitCode {
    if ros_arguments.is_empty() {
        ros_arguments.push("--ros-args".to_owned());
    }
    // Its own log lines would run through the page.
    ros_arguments.extend(["--log-level", "error", "--disable-rosout-logs"].map(str::to_owned));
    let name = format!("{NAME}_{}", std::process::id());
    let builder = NodeBuilder::new(&name).about("shows how the calibration goes");
    ros_node::run_with(ros_arguments, builder, |node| {
        monitor(node, options.clone())
    })
}

async fn monitor(node: Node, options: Options) -> anyhow::Result<()> {
    let timeout = Duration::try_from_secs_f64(options.timeout).context("--timeout")?;
    let state = Arc::new(Mutex::new(MonitorState::default()));
    listen(
        &node,
        &state,
        &SCHEME_STATUS.with_depth(10),
        MonitorState::scheme,
    )?;
    listen(&node, &state, &ESTIMATE, MonitorState::estimate)?;
    listen(&node, &state, &OUTLOOK, MonitorState::outlook)?;
    listen(
        &node,
        &state,
        &DIAGNOSTICS.with_depth(100),
        |state, array: DiagnosticArray, at| {
            // What monitors say of themselves is no sign of life of the others.
            let others = array
                .status
                .into_iter()
                .filter(|s| !s.name.starts_with(NAME));
            for status in others {
                state.diagnostic(status, at);
            }
        },
    )?;
    node.set_ready();
    let shown = show_pages(&node, &state, options.once.then_some(timeout)).await;
    if let Some(file) = &options.picture {
        draw_picture(&locked(&state), file)?;
    }
    shown
}

/// Until the end: once, a page a second, or on the terminal.
async fn show_pages(
    node: &Node,
    state: &Arc<Mutex<MonitorState>>,
    once_within: Option<Duration>,
) -> anyhow::Result<()> {
    if let Some(timeout) = once_within {
        return once(node, state, timeout).await;
    }
    if !std::io::stdout().is_terminal() {
        return lines(node, state).await;
    }
    // Reading keys blocks; the node listens meanwhile on its own threads.
    let (own, state) = (node.clone(), Arc::clone(state));
    let shown = tokio::task::spawn_blocking(move || {
        let mut terminal = ratatui::try_init().context("the terminal")?;
        let result = show(&mut terminal, &own, &state);
        ratatui::restore();
        result
    });
    let result = shown.await.context("the page")?;
    node.request_shutdown();
    result
}

fn show(
    terminal: &mut ratatui::DefaultTerminal,
    node: &Node,
    state: &Mutex<MonitorState>,
) -> anyhow::Result<()> {
    let look = Look {
        colour: std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
    };
    while !node.is_shutdown_requested() {
        let seen = locked(state).clone();
        terminal.draw(|frame| page(frame, &seen, Instant::now(), look))?;
        if event::poll(REFRESH)?
            && let Event::Key(key) = event::read()?
            && key.kind == KeyEventKind::Press
        {
            let is_interrupt =
                key.modifiers.contains(KeyModifiers::CONTROL) && key.code == KeyCode::Char('c');
            if is_interrupt || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) {
                break;
            }
        }
    }
    Ok(())
}

/// The page as text, once.
async fn once(node: &Node, state: &Mutex<MonitorState>, timeout: Duration) -> anyhow::Result<()> {
    let until = Instant::now() + timeout;
    loop {
        let seen = locked(state).clone();
        if seen.is_present(Instant::now()) {
            return crate::output::text_line(&text(&seen)?);
        }
        if Instant::now() > until {
            if seen.newest(Instant::now()).is_some() {
                let mut page = text(&seen)?;
                for topic in seen.silent() {
                    page.push_str("\nnobody publishes ");
                    page.push_str(&node.resolve_topic(topic)?);
                }
                return crate::output::text_line(&page);
            }
            bail!(
                "nothing heard in {:.0} s on {}, {}, {}: \
                 are the nodes running, in this ROS_DOMAIN_ID and namespace?",
                timeout.as_secs_f64(),
                SCHEME_STATUS.name,
                ESTIMATE.name,
                DIAGNOSTICS.name
            );
        }
        tokio::select! {
            () = node.shutdown() => return Ok(()),
            () = tokio::time::sleep(Duration::from_millis(200)) => {}
        }
    }
}

/// Where standard output is no terminal: a page every second, parted by an empty line.
async fn lines(node: &Node, state: &Mutex<MonitorState>) -> anyhow::Result<()> {
    let mut seconds = tokio::time::interval(Duration::from_secs(1));
    loop {
        tokio::select! {
            () = node.shutdown() => return Ok(()),
            _ = seconds.tick() => {
                let seen = locked(state).clone();
                crate::output::text_line(&format!("{}\n", text(&seen)?))?;
            }
        }
    }
}

/// The page on 80 × 24 as SVG.
fn draw_picture(state: &MonitorState, file: &Path) -> anyhow::Result<()> {
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).context("the page")?;
    terminal
        .draw(|frame| page(frame, state, Instant::now(), Look { colour: true }))
        .context("the page")?;
    let picture = picture::svg(terminal.backend().buffer());
    crate::output::file(file, &picture, None)
}

fn text(state: &MonitorState) -> anyhow::Result<String> {
    let mut terminal = Terminal::new(TestBackend::new(100, 40)).context("the page")?;
    terminal
        .draw(|frame| page(frame, state, Instant::now(), Look { colour: false }))
        .context("the page")?;
    let buffer = terminal.backend().buffer();
    let mut lines: Vec<String> = (0..40)
        .map(|y| {
            let line: String = (0..100).map(|x| buffer[(x, y)].symbol()).collect();
            line.trim_end().to_owned()
        })
        .collect();
    // The line of keys is for those who have some.
    lines.pop();
    Ok(lines.join("\n").trim_end().to_owned())
}

fn listen<M: RosMessage + ros2_client::Message + Send + 'static>(
    node: &Node,
    state: &Arc<Mutex<MonitorState>>,
    topic: &Topic<M>,
    take: fn(&mut MonitorState, M, Instant),
) -> anyhow::Result<()> {
    let mut subscription = node.subscribe_on(topic)?;
    let (state, name) = (Arc::clone(state), topic.name);
    let mut looks = tokio::time::interval(REFRESH);
    node.spawn(async move {
        loop {
            tokio::select! {
                message = subscription.recv() => take(&mut locked(&state), message, Instant::now()),
                _ = looks.tick() => {
                    let mut publishers = subscription.publishers();
                    publishers.retain(|node| !node.contains(NAME));
                    locked(&state).publishers.insert(name, publishers);
                }
            }
        }
    });
    Ok(())
}

// Every change under the lock is a whole message, so a panic elsewhere leaves it usable.
fn locked(state: &Mutex<MonitorState>) -> MutexGuard<'_, MonitorState> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}
