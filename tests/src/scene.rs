//! Nodes, a recorder and a player on one network.

use std::path::{Path, PathBuf};

use crate::bag_cache::scratch;
use crate::listener::GUARD;
use crate::process::{Program, Running};

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

    /// Starts a recorder of these topics (none: all); [`Self::end`] ends its bag.
    pub fn record(&mut self, name: &str, topics: &[&str]) -> PathBuf {
        let bag = self.folder.join(name);
        self.record_to(&bag, topics);
        bag
    }

    /// The same, into a bag that stands elsewhere.
    pub fn record_to(&mut self, bag: &Path, topics: &[&str]) {
        let program = topics.iter().fold(
            Program::new("rotary-sins")
                .label("record")
                .arg("record")
                .arg("--output")
                .arg(bag),
            Program::arg,
        );
        self.start(&program);
    }

    /// Plays a bag at this multiple of real time, once the samples of its IMU have so many subscribers.
    pub fn play(&self, bag: &Path, rate: f64, subscribers: usize) -> Running {
        self.play_to(bag, rate, &[("/imu/data_raw", subscribers)])
    }

    /// The same, when so many subscribers of each of these topics are there. A recorder subscribes one topic after the other.
    pub fn play_to(&self, bag: &Path, rate: f64, subscribers: &[(&str, usize)]) -> Running {
        let player = Program::new("rotary-sins")
            .label("play")
            .arg("play")
            .arg(bag)
            .arg("--rate")
            .arg(rate.to_string())
            .arg("--wait-timeout")
            .arg(GUARD.as_secs().to_string());
        let player = subscribers.iter().fold(player, |player, (topic, count)| {
            player.arg("--wait-for").arg(format!("{topic}:{count}"))
        });
        self.start_apart(&player)
    }

    /// Waits for the end of a replay. That what it sent is worked up then is another thing to wait for.
    pub fn finish(&self, mut player: Running) {
        let status = player.wait();
        assert!(status.success(), "play: {status}");
    }

    /// Ctrl-C for everything, the youngest last; each must end by itself with status 0. A recording is whole then.
    pub fn end(&mut self) {
        for mut running in self.running.drain(..) {
            running.interrupt();
        }
    }
}
