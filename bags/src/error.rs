//! What can go wrong with a bag, with the file, the topic and the place in it.

use std::path::{Path, PathBuf};

/// Errors of the `bags` crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// File or directory.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The path is not a bag that can be read.
    #[error("{}: {reason}", path.display())]
    NotABag {
        /// File or directory.
        path: PathBuf,
        /// What it is, and what was expected.
        reason: String,
    },
    /// A topic that is needed is not in the bag.
    #[error("{}: no topic {wanted}; the bag has {}", path.display(), listed(has))]
    MissingTopic {
        /// The bag.
        path: PathBuf,
        /// What was looked for: name, type or both.
        wanted: String,
        /// `name (type)` of every topic of the bag.
        has: Vec<String>,
    },
    /// The messages of a topic are packed in a way that nobody here reads.
    #[error("{}: {topic}: message encoding {encoding:?}, expected \"cdr\"", path.display())]
    Encoding {
        /// The bag.
        path: PathBuf,
        /// Name of the topic.
        topic: String,
        /// How they are packed.
        encoding: String,
    },
    /// A message does not hold what its type says.
    #[error("{}: {topic}: message {index}: {reason}", path.display())]
    Message {
        /// The bag.
        path: PathBuf,
        /// Name of the topic.
        topic: String,
        /// Which message of this topic, counted from 0 in the order they were read.
        index: u64,
        /// What is wrong.
        reason: String,
    },
    /// The bag could not be written.
    #[error("{}: not written: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

impl Error {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn not_a_bag(path: &Path, reason: impl Into<String>) -> Self {
        Self::NotABag {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }

    /// With what stands behind the error: that of a full disk is told by the system.
    pub(crate) fn unwritten(path: &Path, error: &dyn std::error::Error) -> Self {
        let mut reason = error.to_string();
        let mut behind = error.source();
        while let Some(source) = behind {
            let told = source.to_string();
            if !reason.contains(&told) {
                reason = format!("{reason}: {told}");
            }
            behind = source.source();
        }
        Self::write(path, reason)
    }

    pub(crate) fn write(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Write {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

/// A part of a bag that could not be read. What was good around it has been.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub path: PathBuf,
    /// Where in the file \[bytes\].
    pub offset: u64,
    /// Log time of the newest good message before it \[ns\], where one is known.
    pub log_time: Option<u64>,
    /// What happened, and what was done about it.
    pub what: Damage,
}

/// Kinds of damage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The file ends before its end marker: the recorder was cut off, or the copy was.
    CutShort {
        /// Inside of what it ends.
        inside: &'static str,
    },
    /// A chunk was left out.
    ChunkSkipped {
        /// Why it is not good.
        reason: String,
    },
    /// Bytes that are no records were passed over.
    BytesSkipped {
        /// How many.
        length: u64,
    },
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let path = self.path.display();
        match &self.what {
            Damage::CutShort { inside } => {
                write!(f, "{path}: ends at byte {}, inside {inside}", self.offset)?;
            }
            Damage::ChunkSkipped { reason } => write!(
                f,
                "{path}: chunk at byte {} left out: {reason}",
                self.offset
            )?,
            Damage::BytesSkipped { length } => {
                write!(
                    f,
                    "{path}: {length} bytes at byte {} are no records and were passed over",
                    self.offset
                )?;
            }
        }
        match self.log_time {
            Some(t) => write!(
                f,
                " (last good message before it at {}.{:09} s)",
                t / 1_000_000_000,
                t % 1_000_000_000
            ),
            None => Ok(()),
        }
    }
}
