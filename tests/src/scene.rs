//! Nodes, a recorder and a player on one network.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::bag_cache::scratch;
use crate::process::{Program, Running};

/// Longest time that one replay may take.
const REPLAY: Duration = Duration::from_secs(240);
/// Time for what is under way to arrive everywhere.
const SETTLE: Duration = Duration::from_secs(2);

/// The stage of one test: a folder for logs and recordings, and what runs.
#[derive(Debug)]
pub struct Scene {
    folder: PathBuf,
    running: Vec<Running>,
}

impl Scene {
    /// Nothing runs yet. `test` names the folder.
    pub fn new(test: &str) -> Self {
        Self {
            folder: scratch(test),
            running: Vec::new(),
        }
    }

    /// Folder of its files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Starts a program that the scene ends.
    pub fn start(&mut self, program: &Program) {
        let running = program.start(&self.folder);
        self.running.push(running);
    }

    /// Starts a program that the test handles itself.
    pub fn start_apart(&self, program: &Program) -> Running {
        program.start(&self.folder)
    }

    /// Starts a recorder of these topics; [`Self::end`] ends its bag.
    pub fn record(&mut self, name: &str, topics: &[&str]) -> PathBuf {
        let bag = self.folder.join(name);
        let program = topics.iter().fold(
            Program::new("rotary-sins")
                .label(name)
                .arg("record")
                .arg("--output")
                .arg(&bag),
            Program::arg,
        );
        self.start(&program);
        bag
    }

    /// Plays a bag at this multiple of real time.
    pub fn play(&self, bag: &Path, rate: f64) -> Running {
        self.start_apart(
            &Program::new("rotary-sins")
                .label("play")
                .arg("play")
                .arg(bag)
                .arg("--rate")
                .arg(rate.to_string()),
        )
    }

    /// Waits for the end of a replay, and until what it sent is worked up.
    pub fn finish(&self, mut player: Running) {
        let status = player.wait(REPLAY);
        assert!(status.success(), "play: {status}");
        std::thread::sleep(SETTLE);
    }

    /// Ctrl-C for everything, the youngest last; each must end by itself with status 0. A recording is whole then.
    pub fn end(&mut self) {
        for mut running in self.running.drain(..) {
            running.interrupt();
        }
    }
}
