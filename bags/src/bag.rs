//! A bag: one MCAP file, or a rosbag2 directory of them.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    path::{Path, PathBuf},
};

use memmap2::Mmap;
use ros2_interfaces::Qos;
use rotary_sins_msgs::known_type;

use crate::{
    error::{Error, Warning},
    index::FileIndex,
    messages::{Messages, Selection},
    metadata::{self, MetadataRead},
};

/// How messages that can be read are packed.
pub const ENCODING: &str = "cdr";

/// More in a `metadata.yaml` is none \[bytes\].
const LONGEST_METADATA: u64 = 64 << 20;

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Full name, e.g. `/imu/data_raw`.
    pub name: String,
    /// Full type, e.g. `sensor_msgs/msg/Imu`.
    pub type_name: String,
    /// How the messages are packed: `cdr`.
    pub encoding: String,
    /// `ros2msg` text, empty where the bag has none.
    pub schema: String,
    /// REP-2011 hash of the type, where the bag or this suite knows it.
    pub type_hash: Option<String>,
    /// What its publishers offered.
    pub qos: Vec<Qos>,
    /// Messages in the bag, damaged parts left out.
    pub count: u64,
}

pub(crate) struct BagFile {
    pub path: PathBuf,
    pub map: Mapped,
    pub index: FileIndex,
    /// Topic number by channel number.
    pub topic_of: BTreeMap<u16, usize>,
}

/// The bytes of a file.
pub(crate) enum Mapped {
    /// Zero bytes cannot be mapped.
    Empty,
    Map(Mmap),
}

impl std::ops::Deref for Mapped {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Empty => &[],
            Self::Map(map) => map,
        }
    }
}

/// An open bag. Its files are mapped into memory; nothing is unpacked before it is asked for.
pub struct Bag {
    path: PathBuf,
    pub(crate) files: Vec<BagFile>,
    topics: Vec<Topic>,
    warnings: Vec<Warning>,
}

impl Bag {
    /// Opens an MCAP file or a rosbag2 directory.
    ///
    /// # Errors
    /// Where the path cannot be read, is no bag, or lacks a file that its metadata names. Damage inside of a bag is no error: see [`Self::warnings`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let kind = fs::metadata(path).map_err(|e| Error::io(path, e))?;
        let mut warnings = Vec::new();
        let paths = if kind.is_dir() {
            files_of(path)?
        } else {
            vec![path.to_owned()]
        };
        let mut files = Vec::new();
        for path in paths {
            let map = map(&path)?;
            let mut index = FileIndex::scan(&path, &map)?;
            warnings.append(&mut index.warnings);
            files.push(BagFile {
                path,
                map,
                index,
                topic_of: BTreeMap::new(),
            });
        }
        let topics = link_topics(&mut files);
        Ok(Self {
            path: path.to_owned(),
            files,
            topics,
            warnings,
        })
    }

    /// The path it was opened with.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its topics, by name.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// What of it cannot be read, as far as that is known without unpacking.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Log time of the first and the last message \[ns\]; `None` where there are none.
    pub fn time_range(&self) -> Option<(u64, u64)> {
        let segments = || {
            self.files
                .iter()
                .flat_map(|file| &file.index.segments)
                .filter(|segment| {
                    // What nothing came out of has no time.
                    segment
                        .counts
                        .as_ref()
                        .is_none_or(|counts| !counts.is_empty())
                })
        };
        Some((
            segments().map(|s| s.first_time).min()?,
            segments().map(|s| s.last_time).max()?,
        ))
    }

    /// Its files.
    pub fn file_paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|file| file.path.as_path())
    }

    /// Length of its files together \[bytes\].
    pub fn size(&self) -> u64 {
        self.files.iter().map(|file| file.map.len() as u64).sum()
    }

    /// Packed and unpacked bytes of its chunks by compression (`zstd`, `lz4`, or empty for none).
    pub fn compression(&self) -> BTreeMap<String, (u64, u64)> {
        let mut all = BTreeMap::new();
        for (name, sizes) in self.files.iter().flat_map(|file| &file.index.compression) {
            let sum: &mut (u64, u64) = all.entry(name.clone()).or_default();
            *sum = (sum.0 + sizes.0, sum.1.saturating_add(sizes.1));
        }
        all
    }

    /// Profile and library of the first file's header.
    pub fn written_by(&self) -> (&str, &str) {
        self.files
            .first()
            .map_or(("", ""), |file| (&file.index.profile, &file.index.library))
    }

    /// Metadata records by name, in the order of the files.
    pub fn metadata(&self) -> impl Iterator<Item = &(String, BTreeMap<String, String>)> {
        self.files.iter().flat_map(|file| &file.index.metadata)
    }

    /// Number of the topic of this name (a missing leading slash is forgiven).
    pub fn topic(&self, name: &str) -> Option<usize> {
        let bare = name.strip_prefix('/').unwrap_or(name);
        self.topics
            .iter()
            .position(|topic| topic.name.strip_prefix('/').unwrap_or(&topic.name) == bare)
    }

    /// Number of the topic of a type: the one named `wanted` where that is given, else the one of the `usual` name,
    /// else the only one of this type.
    ///
    /// # Errors
    /// [`Error::MissingTopic`] with what the bag has, also where the choice is not clear. [`Error::Encoding`] where its messages are
    /// no CDR.
    pub fn find_topic(
        &self,
        type_name: &str,
        usual: &str,
        wanted: Option<&str>,
    ) -> Result<usize, Error> {
        let is_of_type = |&at: &usize| self.topics[at].type_name == type_name;
        let candidates: Vec<usize> = (0..self.topics.len()).filter(is_of_type).collect();
        let found = match wanted {
            Some(name) => self.topic(name).filter(is_of_type),
            None => match (self.topic(usual).filter(is_of_type), &candidates[..]) {
                (Some(at), _) => Some(at),
                (None, &[only]) => Some(only),
                (None, _) => None,
            },
        };
        if let Some(topic) = found.map(|at| &self.topics[at])
            && topic.encoding != ENCODING
        {
            return Err(Error::Encoding {
                path: self.path.clone(),
                topic: topic.name.clone(),
                encoding: topic.encoding.clone(),
            });
        }
        found.ok_or_else(|| Error::MissingTopic {
            path: self.path.clone(),
            wanted: format!("{} of type {type_name}", wanted.unwrap_or(usual)),
            has: self
                .topics
                .iter()
                .map(|topic| format!("{} ({})", topic.name, topic.type_name))
                .collect(),
        })
    }

    /// The messages of a selection in the order of their log time.
    pub fn messages(&self, selection: &Selection) -> Messages<'_> {
        Messages::new(self, selection)
    }

    /// An error about a message of this bag.
    pub fn message_error(&self, topic: usize, index: u64, reason: impl Into<String>) -> Error {
        Error::Message {
            path: self.path.clone(),
            topic: self
                .topics
                .get(topic)
                .map(|topic| topic.name.clone())
                .unwrap_or_default(),
            index,
            reason: reason.into(),
        }
    }
}

/// The MCAP files of a rosbag2 directory: those of `metadata.yaml`, or all where there is none (a recorder that was
/// killed leaves none).
fn files_of(directory: &Path) -> Result<Vec<PathBuf>, Error> {
    let yaml_path = directory.join(metadata::FILE_NAME);
    let mut files = match files::read_text(&yaml_path, LONGEST_METADATA) {
        Ok(yaml) => files_of_metadata(directory, &yaml_path, &yaml)?,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(e) => return Err(Error::io(&yaml_path, e)),
    };
    if files.is_empty() {
        for entry in fs::read_dir(directory).map_err(|e| Error::io(directory, e))? {
            let path = entry.map_err(|e| Error::io(directory, e))?.path();
            if path
                .extension()
                .is_some_and(|extension| extension == "mcap")
            {
                files.push(path);
            }
        }
        files.sort();
    }
    if files.is_empty() {
        return Err(Error::not_a_bag(
            directory,
            "the directory has no MCAP file",
        ));
    }
    Ok(files)
}

fn files_of_metadata(
    directory: &Path,
    yaml_path: &Path,
    yaml: &str,
) -> Result<Vec<PathBuf>, Error> {
    let information = serde_saphyr::from_str::<MetadataRead>(yaml)
        .map_err(|error| Error::not_a_bag(yaml_path, first_line(&error.to_string())))?
        .rosbag2_bagfile_information;
    if !matches!(information.storage_identifier.as_str(), "" | "mcap") {
        let reason = format!(
            "storage is {}, expected mcap (convert it with: ros2 bag convert)",
            information.storage_identifier
        );
        return Err(Error::not_a_bag(directory, reason));
    }
    if information.compression_mode.eq_ignore_ascii_case("message") {
        return Err(Error::not_a_bag(
            directory,
            "its messages are packed one by one (compression_mode MESSAGE), expected NONE",
        ));
    }
    let mut files = Vec::new();
    for name in information.relative_file_paths {
        if name.chars().any(char::is_control) {
            let reason = format!("names a file {name:?}, expected no control characters");
            return Err(Error::not_a_bag(yaml_path, reason));
        }
        let path = directory.join(&name);
        // A part that is gone is hours of samples, not damage that one reads past.
        if !path.is_file() {
            let reason = format!("not there, but {} names it", yaml_path.display());
            return Err(Error::not_a_bag(&path, reason));
        }
        files.push(path);
    }
    Ok(files)
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or(text)
}

#[allow(unsafe_code, reason = "the one place where a file is mapped")]
fn map(path: &Path) -> Result<Mapped, Error> {
    // Opening a FIFO would wait for a writer, and a device has no length.
    let kind = fs::metadata(path).map_err(|e| Error::io(path, e))?;
    if !kind.is_file() {
        let reason = "a device or a pipe, expected a regular file";
        return Err(Error::not_a_bag(path, reason));
    }
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let length = file.metadata().map_err(|e| Error::io(path, e))?.len();
    if length == 0 {
        return Ok(Mapped::Empty);
    }
    // SAFETY: the map is only read. A bag that another process overwrites meanwhile gives bytes that the checks of
    // lengths and CRCs catch; one that is cut short meanwhile ends this process, as with every reader that maps.
    let map = unsafe { Mmap::map(&file) }.map_err(|e| Error::io(path, e))?;
    #[cfg(unix)]
    {
        // Only a hint; reading is right without it.
        let _ = map.advise(memmap2::Advice::Sequential);
    }
    Ok(Mapped::Map(map))
}

/// Gives every channel the number of its topic. Channels of the same name and type are one topic.
fn link_topics(files: &mut [BagFile]) -> Vec<Topic> {
    let mut topics: BTreeMap<(String, String), Topic> = BTreeMap::new();
    let key = |file: &BagFile, id: u16| {
        let channel = file.index.channels.get(&id)?;
        let schema = file.index.schemas.get(&channel.schema);
        Some((
            channel.topic.clone(),
            schema.map(|schema| schema.name.clone()).unwrap_or_default(),
        ))
    };
    for file in &*files {
        for (&id, channel) in &file.index.channels {
            let Some(key) = key(file, id) else { continue };
            let counts = file
                .index
                .segments
                .iter()
                .filter_map(|segment| segment.counts.as_ref()?.get(&id));
            let count: u64 = counts.sum();
            let topic = topics
                .entry(key)
                .or_insert_with_key(|(name, type_name)| Topic {
                    name: name.clone(),
                    type_name: type_name.clone(),
                    encoding: channel.encoding.clone(),
                    schema: file
                        .index
                        .schemas
                        .get(&channel.schema)
                        .map(|s| s.text.clone())
                        .unwrap_or_default(),
                    type_hash: (channel
                        .metadata
                        .get("topic_type_hash")
                        .filter(|hash| !hash.is_empty())
                        .cloned())
                    .or_else(|| known_type(type_name).map(|known| known.hash.to_owned())),
                    qos: channel
                        .metadata
                        .get("offered_qos_profiles")
                        .map(|y| metadata::parse_profiles(y))
                        .unwrap_or_default(),
                    count: 0,
                });
            topic.count += count;
        }
    }
    let numbers: BTreeMap<(String, String), usize> = topics.keys().cloned().zip(0..).collect();
    for file in files {
        let ids: Vec<u16> = file.index.channels.keys().copied().collect();
        file.topic_of = ids
            .into_iter()
            .filter_map(|id| Some((id, *numbers.get(&key(file, id)?)?)))
            .collect();
    }
    topics.into_values().collect()
}
