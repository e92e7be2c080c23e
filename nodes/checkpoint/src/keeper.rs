//! Writes checkpoints beside the node's own work.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;
use tokio::task::JoinHandle;

use crate::envelope::{self, Kind};
use crate::found::forget;

/// Writes the checkpoints of one node, one at a time and never on the node's own thread.
#[derive(Debug)]
pub struct Keeper {
    kind: Kind,
    path: PathBuf,
    period: Duration,
    /// When the last one was begun.
    begun: Option<Instant>,
    under_way: Option<JoinHandle<Result<(), String>>>,
    problem: Option<String>,
    written: u64,
}

impl Keeper {
    /// To this file, so often.
    pub fn new(kind: Kind, path: &Path, period: Duration) -> Self {
        Self {
            kind,
            path: path.to_owned(),
            period,
            begun: None,
            under_way: None,
            problem: None,
            written: 0,
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Why the last one could not be written.
    pub fn problem(&self) -> Option<&str> {
        self.problem.as_deref()
    }

    /// So many have been written.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Whether the next one is due, and none is under way. Who `hurries` waits for no period.
    pub async fn is_due(&mut self, hurries: bool) -> bool {
        if self
            .under_way
            .as_ref()
            .is_some_and(|task| !task.is_finished())
        {
            return false;
        }
        self.settle().await;
        hurries
            || self
                .begun
                .is_none_or(|begun| begun.elapsed() >= self.period)
    }

    /// Writes a state, beside everything else.
    pub fn keep<T: Serialize + Send + 'static>(&mut self, state: T) {
        self.begun = Some(Instant::now());
        let (kind, path) = (self.kind, self.path.clone());
        self.under_way = Some(tokio::task::spawn_blocking(move || {
            write(kind, &path, &state)
        }));
    }

    /// The last one, for which the node waits.
    pub async fn keep_last<T: Serialize + Send + 'static>(&mut self, state: T) {
        self.settle().await;
        self.keep(state);
        self.settle().await;
    }

    /// Takes the file away: what it holds is to be forgotten.
    pub async fn forget(&mut self) {
        self.settle().await;
        let path = self.path.clone();
        // A panic there is none, and a file that stays is told.
        let _done = tokio::task::spawn_blocking(move || forget(&path)).await;
    }

    /// Waits for what is under way, and says what became of it: once where it begins to fail, once where it works again.
    async fn settle(&mut self) {
        let Some(task) = self.under_way.take() else {
            return;
        };
        let outcome = task.await.unwrap_or_else(|error| Err(error.to_string()));
        let path = self.path.display();
        match outcome {
            Ok(()) => {
                self.written += 1;
                if self.problem.take().is_some() {
                    tracing::info!("checkpoint {path}: written again");
                }
            }
            Err(reason) => {
                if self.problem.as_ref() != Some(&reason) {
                    tracing::error!("checkpoint {path} is not written: {reason}");
                }
                self.problem = Some(reason);
            }
        }
    }
}

fn write<T: Serialize>(kind: Kind, path: &Path, state: &T) -> Result<(), String> {
    let bytes = envelope::encode(kind, state)?;
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|error| error.to_string())?;
    }
    files::write(path, &bytes).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const KIND: Kind = Kind {
        name: "a_node",
        version: 1,
    };

    /// What is kept can be read; a disk that refuses is a problem that ends when it takes again.
    #[tokio::test]
    async fn what_is_kept_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep").join("a.kept");
        let mut keeper = Keeper::new(KIND, &path, Duration::from_secs(3600));
        assert!(keeper.is_due(false).await);
        keeper.keep_last(vec![1.5, 2.5]).await;
        assert_eq!(keeper.problem(), None);
        assert_eq!(envelope::read(KIND, &path), Ok(Some(vec![1.5, 2.5])));
        assert!(!keeper.is_due(false).await && keeper.is_due(true).await);
        keeper.forget().await;
        assert!(!path.exists());
        keeper.keep_last(vec![1.5, 2.5]).await;

        let mut blocked = Keeper::new(KIND, &path.join("below"), Duration::ZERO);
        blocked.keep_last(1_u8).await;
        assert!(blocked.problem().is_some() && blocked.written() == 0);
        std::fs::remove_file(&path).unwrap();
        blocked.keep_last(1_u8).await;
        assert_eq!((blocked.problem(), blocked.written()), (None, 1));
    }
}
