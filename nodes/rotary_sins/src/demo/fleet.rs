//! The processes of the demo: started from beside this executable, watched, and ended without a trace.

use std::fs::File;
use std::future::Future;
use std::path::{Path, PathBuf};
use std::pin::{Pin, pin};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use rustix::process::{Pid, Signal, kill_process};
use tokio::process::{Child, Command};

/// Time a node has to end by itself after SIGINT: a table that turns is stopped first.
const GRACE: Duration = Duration::from_secs(15);
/// The process whose end is the end of the run.
const SIMULATOR: &str = "imu_simulator";

/// What is to be started.
#[derive(Clone, Debug)]
pub struct Program {
    /// What it is called in logs and reports.
    pub name: String,
    /// The file beside this executable.
    pub executable: String,
    /// Its arguments.
    pub arguments: Vec<String>,
}

/// How a process ended.
#[derive(Clone, Debug)]
pub struct Ended {
    /// What it was called.
    pub name: String,
    /// Whether it ended by itself, with exit status 0.
    pub cleanly: bool,
    /// Its exit status, or the signal that ended it.
    pub status: String,
    /// Processor time it took, user and system \[s\]; as of the last look.
    pub cpu_s: f64,
}

struct Running {
    name: String,
    child: Child,
    log: PathBuf,
    status: Option<ExitStatus>,
    killed: bool,
    cpu_s: f64,
}

/// All processes that were started.
pub struct Fleet {
    folder: PathBuf,
    running: Vec<Running>,
}

impl Fleet {
    /// None yet; logs go to `folder`.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            running: Vec::new(),
        }
    }

    /// Starts a process; what it writes goes to its log.
    ///
    /// # Errors
    /// Where the executable is missing or cannot be started.
    pub fn start(&mut self, program: &Program) -> Result<()> {
        let executable = beside(&program.executable)?;
        let log = self.folder.join(format!("{}.log", program.name));
        let file = File::create(&log).with_context(|| format!("writing {}", log.display()))?;
        let child = Command::new(&executable)
            .args(&program.arguments)
            .stdin(Stdio::null())
            .stdout(file.try_clone()?)
            .stderr(file)
            // Ctrl-C at the terminal is for this process, which ends the others in order.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()
            .with_context(|| format!("starting {}", executable.display()))?;
        self.running.push(Running {
            name: program.name.clone(),
            child,
            log,
            status: None,
            killed: false,
            cpu_s: 0.0,
        });
        Ok(())
    }

    /// Looks after the processes; `true` when the simulator has done its work.
    ///
    /// # Errors
    /// Where a process has ended before that, with the last line of its log.
    pub fn check(&mut self) -> Result<bool> {
        let mut done = false;
        for process in &mut self.running {
            process.look()?;
            let Some(status) = process.status else {
                continue;
            };
            if process.name == SIMULATOR && status.success() {
                done = true;
                continue;
            }
            bail!(
                "{} ended too early ({status}): {}",
                process.name,
                process.last_line()
            );
        }
        Ok(done)
    }

    /// Ends every process that still runs: SIGINT to the nodes, then to the recorder. A node that does not listen gets SIGKILL
    /// after a while; the recorder may take as long as its disk does, unless `insisted` completes.
    ///
    /// # Errors
    /// Where the system does not let a process be waited for.
    pub async fn end(&mut self, insisted: impl Future<Output = ()>) -> Result<Vec<Ended>> {
        let mut insisted = pin!(insisted);
        let (recorder, nodes): (Vec<_>, Vec<_>) = self
            .running
            .iter_mut()
            .partition(|process| process.name == "recorder");
        for (group, grace) in [(nodes, Some(GRACE)), (recorder, None)] {
            let mut group = group;
            for process in &mut group {
                process.look()?;
                process.interrupt();
            }
            let deadline = grace.map(|grace| tokio::time::Instant::now() + grace);
            for process in group {
                process.wait(deadline, insisted.as_mut()).await?;
            }
        }
        Ok(self
            .running
            .iter()
            .map(|process| Ended {
                name: process.name.clone(),
                cleanly: !process.killed && process.status.is_some_and(|status| status.success()),
                status: process
                    .status
                    .map_or_else(|| "unknown".to_owned(), |status| status.to_string()),
                cpu_s: process.cpu_s,
            })
            .collect())
    }
}

impl Running {
    fn look(&mut self) -> Result<()> {
        if self.status.is_none() {
            if let Some(cpu_s) = self.child.id().and_then(cpu_seconds) {
                self.cpu_s = cpu_s;
            }
            self.status = self
                .child
                .try_wait()
                .with_context(|| format!("waiting for {}", self.name))?;
        }
        Ok(())
    }

    fn interrupt(&self) {
        // A process that has ended in the meantime needs no signal: `id` is then none.
        if let (None, Some(pid)) = (self.status, self.child.id())
            && let Some(pid) = i32::try_from(pid).ok().and_then(Pid::from_raw)
        {
            kill_process(pid, Signal::INT).ok();
        }
    }

    async fn wait(
        &mut self,
        deadline: Option<tokio::time::Instant>,
        insisted: Pin<&mut impl Future<Output = ()>>,
    ) -> Result<()> {
        if self.status.is_some() {
            return Ok(());
        }
        let patience = async {
            match deadline {
                Some(deadline) => tokio::time::sleep_until(deadline).await,
                None => std::future::pending().await,
            }
        };
        let in_time = tokio::select! {
            biased;
            status = self.child.wait() => Some(status),
            () = patience => None,
            () = insisted => None,
        };
        let status = if let Some(status) = in_time {
            status
        } else {
            self.killed = true;
            self.child.start_kill()?;
            self.child.wait().await
        };
        self.status = Some(status.with_context(|| format!("waiting for {}", self.name))?);
        Ok(())
    }

    fn last_line(&self) -> String {
        let text = std::fs::read_to_string(&self.log).unwrap_or_default();
        text.lines()
            .rfind(|line| !line.trim().is_empty())
            .map_or_else(
                || format!("nothing in {}", self.log.display()),
                str::to_owned,
            )
    }
}

/// The executable of this name in the folder of this one.
fn beside(name: &str) -> Result<PathBuf> {
    let own = std::env::current_exe().context("finding this executable")?;
    let path = own.with_file_name(name);
    ensure!(
        path.is_file(),
        "{} is missing beside {}: build it with `cargo build --release -p {name}`",
        path.display(),
        own.display()
    );
    Ok(path)
}

/// Processor time of a process \[s\], where the system tells it (Linux: fields 14 and 15 of /proc/PID/stat, in ticks).
fn cpu_seconds(pid: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let after_name = text.rsplit_once(')')?.1;
    let mut fields = after_name.split_whitespace().skip(11);
    let ticks = fields.next()?.parse::<f64>().ok()? + fields.next()?.parse::<f64>().ok()?;
    Some(ticks / rustix::param::clock_ticks_per_second() as f64)
}
