//! Processes that end with the test.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::executables::executable;
use crate::listener::GUARD;

/// Lines of a log that a failed test shows.
const TAIL: usize = 30;

/// A process to be started, with its arguments.
#[derive(Clone, Debug)]
pub struct Program {
    label: String,
    path: PathBuf,
    arguments: Vec<String>,
    ros_arguments: Vec<String>,
    environment: Vec<(String, String)>,
}

impl Program {
    /// One of the suite's executables.
    pub fn new(name: &str) -> Self {
        Self::at(name, executable(name))
    }

    /// The sequencer of a simulated table, which starts its scheme by itself.
    pub fn sequencer() -> Self {
        Self::new("scheme_sequencer").parameter("autostart", "true")
    }

    /// Any executable; `label` names its log.
    pub fn at(label: &str, path: PathBuf) -> Self {
        Self {
            label: label.to_owned(),
            path,
            arguments: Vec::new(),
            ros_arguments: Vec::new(),
            environment: Vec::new(),
        }
    }

    /// Another name for the log, where one executable runs several times.
    #[must_use]
    pub fn label(mut self, label: &str) -> Self {
        label.clone_into(&mut self.label);
        self
    }

    /// An argument.
    #[must_use]
    pub fn arg(mut self, argument: impl AsRef<Path>) -> Self {
        self.arguments
            .push(argument.as_ref().to_str().unwrap().to_owned());
        self
    }

    /// Arguments, split at spaces.
    #[must_use]
    pub fn args(mut self, arguments: &str) -> Self {
        self.arguments
            .extend(arguments.split_whitespace().map(str::to_owned));
        self
    }

    /// A parameter of the node.
    #[must_use]
    pub fn parameter(mut self, name: &str, value: &str) -> Self {
        self.ros_arguments
            .extend(["-p".to_owned(), format!("{name}:={value}")]);
        self
    }

    /// A file of parameters.
    #[must_use]
    pub fn parameters_of(mut self, file: &Path) -> Self {
        let file = file.to_str().unwrap().to_owned();
        self.ros_arguments
            .extend(["--params-file".to_owned(), file]);
        self
    }

    /// A topic by another name.
    #[must_use]
    pub fn remap(mut self, from: &str, to: &str) -> Self {
        self.ros_arguments
            .extend(["-r".to_owned(), format!("{from}:={to}")]);
        self
    }

    /// An environment variable.
    #[must_use]
    pub fn environment(mut self, name: &str, value: &str) -> Self {
        self.environment.push((name.to_owned(), value.to_owned()));
        self
    }

    /// What it is called in logs.
    pub fn name(&self) -> &str {
        &self.label
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The command, with `--ros-args` where there are any.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        command.args(&self.arguments);
        if !self.ros_arguments.is_empty() {
            command.arg("--ros-args").args(&self.ros_arguments);
        }
        command
            .envs(self.environment.iter().map(|(k, v)| (k, v)))
            .stdin(Stdio::null());
        command
    }

    /// Starts it. Its output goes to `LABEL.log` in `folder`, after what an earlier run left there.
    pub fn start(&self, folder: &Path) -> Running {
        fs::create_dir_all(folder).unwrap();
        let log = folder.join(format!("{}.log", self.label));
        let mut file = File::options()
            .create(true)
            .append(true)
            .open(&log)
            .unwrap();
        let command_line = [&self.arguments[..], &self.ros_arguments[..]]
            .concat()
            .join(" ");
        writeln!(file, "$ {} {command_line}", self.path.display()).unwrap();
        let log_from = usize::try_from(file.metadata().unwrap().len()).unwrap();
        let child = self
            .command()
            .stdout(file.try_clone().unwrap())
            .stderr(file)
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}", self.path.display()));
        Running {
            label: self.label.clone(),
            child,
            log,
            log_from,
        }
    }
}

/// A running process; killed when it is dropped.
#[derive(Debug)]
pub struct Running {
    label: String,
    child: Child,
    log: PathBuf,
    log_from: usize,
}

impl Running {
    /// What it has written so far.
    pub fn log(&self) -> String {
        let bytes = fs::read(&self.log).unwrap();
        String::from_utf8_lossy(&bytes[self.log_from..]).into_owned()
    }

    /// Waits until its log has a line with `text`; fails where it ends before.
    pub fn wait_for_line(&mut self, text: &str) {
        let end = Instant::now() + GUARD;
        while !self.log().contains(text) {
            if let Some(status) = self.child.try_wait().unwrap() {
                assert!(
                    self.log().contains(text),
                    "{} ended ({status}) without a line with '{text}'",
                    self.label
                );
                return;
            }
            assert!(
                Instant::now() < end,
                "{}: no line with '{text}' after {GUARD:?}",
                self.label
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Number of the process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Whether it still runs.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// Waits for its own end.
    pub fn wait(&mut self) -> ExitStatus {
        let end = Instant::now() + GUARD;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(
                Instant::now() < end,
                "{} still runs after {GUARD:?}",
                self.label
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// SIGINT, as Ctrl-C sends it; the process must then end by itself, with status 0, soon.
    pub fn interrupt(&mut self) {
        let status = self.end();
        assert!(status.success(), "{} after SIGINT: {status}", self.label);
    }

    /// SIGKILL: it has no chance to say goodbye.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// SIGINT, and the status it ends with.
    pub fn end(&mut self) -> ExitStatus {
        self.signal(Signal::INT);
        self.wait()
    }

    /// SIGSTOP, and SIGCONT after this time: Ctrl-Z and `fg`, a debugger, a container that was frozen.
    pub fn stop_for(&self, time: Duration) {
        self.signal(Signal::STOP);
        std::thread::sleep(time);
        self.signal(Signal::CONT);
    }

    fn signal(&self, signal: Signal) {
        let pid = Pid::from_raw(i32::try_from(self.child.id()).unwrap()).unwrap();
        kill_process(pid, signal).unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.is_running() {
            self.kill();
        }
        if std::thread::panicking() {
            let log = self.log();
            let skipped = log.lines().count().saturating_sub(TAIL);
            let mut text = format!("--- {} ({} lines before)\n", self.label, skipped);
            for line in log.lines().skip(skipped) {
                writeln!(text, "{line}").unwrap();
            }
            println!("{text}");
        }
    }
}

/// Waits for a condition.
pub fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let end = Instant::now() + GUARD;
    while !condition() {
        assert!(Instant::now() < end, "not after {GUARD:?}: {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
