//! Writes bags that ROS 2 tools read.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use mcap::records::{MessageHeader, Metadata as MetadataRecord};
use ros2_interfaces::{Qos, RosMessage};
use rotary_sins_msgs::known_type;

use crate::{
    cdr,
    error::Error,
    metadata::{
        self, DISTRIBUTION, FileInformation, Information, Metadata, Nanoseconds, SinceEpoch,
        TopicMetadata, TopicWithCount,
    },
};

/// Packing of chunks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Fastest to read.
    None,
    /// Fast.
    Lz4,
    /// Small.
    #[default]
    Zstd,
}

/// How to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WriteOptions {
    /// Packing of chunks.
    pub compression: Compression,
    /// A chunk is closed when it is larger than this \[bytes\].
    pub chunk_bytes: u64,
    /// An MCAP file that is there already is replaced; else it is refused.
    pub replaces: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            compression: Compression::default(),
            chunk_bytes: 1 << 20,
            replaces: false,
        }
    }
}

/// A topic to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewTopic {
    /// Full name.
    pub name: String,
    /// Full type, e.g. `sensor_msgs/msg/Imu`.
    pub type_name: String,
    /// `ros2msg` text, where it is known.
    pub schema: Option<String>,
    /// REP-2011 hash, where it is known.
    pub type_hash: Option<String>,
    /// What its publishers offer.
    pub qos: Vec<Qos>,
}

impl NewTopic {
    /// A topic of a message of this suite.
    pub fn of<M: RosMessage>(name: impl Into<String>, qos: Qos) -> Self {
        Self {
            name: name.into(),
            type_name: M::TYPE_NAME.to_owned(),
            schema: Some(M::schema()),
            type_hash: Some(M::TYPE_HASH.to_owned()),
            qos: vec![qos],
        }
    }

    /// A topic that is a constant, in the root namespace.
    pub fn on<M: RosMessage>(topic: &ros2_interfaces::Topic<M>) -> Self {
        Self::of::<M>(topic.within(""), topic.qos)
    }

    /// A topic of any type; schema and hash where this suite knows them.
    pub fn named(name: impl Into<String>, type_name: impl Into<String>, qos: Vec<Qos>) -> Self {
        let type_name = type_name.into();
        let known = known_type(&type_name);
        Self {
            name: name.into(),
            schema: known.map(|known| (known.schema)()),
            type_hash: known.map(|known| known.hash.to_owned()),
            type_name,
            qos,
        }
    }
}

/// A topic of a [`BagWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicId(usize);

struct WrittenTopic {
    topic: NewTopic,
    channel: u16,
    count: u64,
}

/// What has been written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagSummary {
    /// The path that opens it: the file or the directory.
    pub path: PathBuf,
    /// Name and number of messages of every topic.
    pub counts: Vec<(String, u64)>,
    /// Log time of the first and the last message \[ns\].
    pub time_range: Option<(u64, u64)>,
}

/// The file, which the writer of MCAP fills and the bag hands over.
#[derive(Clone)]
struct Output(Arc<Mutex<BufWriter<File>>>);

impl Output {
    fn new(file: File) -> Self {
        Self(Arc::new(Mutex::new(BufWriter::with_capacity(
            1 << 18,
            file,
        ))))
    }

    // Both ends are of one thread, and a panic ends it.
    fn lock(&self) -> MutexGuard<'_, BufWriter<File>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.lock().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.lock().flush()
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.lock().seek(to)
    }
}

/// Writes one bag. [`Self::finish`] it: a bag without its end can still be read, but says that it was cut off.
pub struct BagWriter {
    path: PathBuf,
    file: PathBuf,
    writer: mcap::Writer<Output>,
    output: Output,
    topics: Vec<WrittenTopic>,
    time_range: Option<(u64, u64)>,
    payload: Vec<u8>,
}

impl BagWriter {
    /// Begins a bag: a path that ends in `.mcap` becomes that file, any other a rosbag2 directory. Directories above it
    /// are made. An MCAP file of that name is refused unless the options say that it is to be replaced; a directory that holds
    /// one is always refused.
    ///
    /// # Errors
    /// Where the path cannot be written.
    pub fn create(path: impl AsRef<Path>, options: WriteOptions) -> Result<Self, Error> {
        let path = path.as_ref();
        let file = if path
            .extension()
            .is_some_and(|extension| extension == "mcap")
        {
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(|e| Error::io(parent, e))?;
            }
            path.to_owned()
        } else {
            new_directory(path)?
        };
        let compression = match options.compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        };
        let output = Output::new(create(&file, options.replaces)?);
        let writer = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("rotary-sins bags ", env!("CARGO_PKG_VERSION")))
            .compression(compression)
            // Level 1 of zstd; noise does not pack better at higher ones.
            .compression_level(u32::from(options.compression == Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(options.chunk_bytes.max(1)))
            .create(output.clone())
            .map_err(|e| Error::write(&file, e))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            writer,
            output,
            topics: Vec::new(),
            time_range: None,
            payload: Vec::new(),
        })
    }

    /// Adds a topic; one that is there already (same name and type) is given back.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn add_topic(&mut self, topic: NewTopic) -> Result<TopicId, Error> {
        let same =
            |w: &WrittenTopic| w.topic.name == topic.name && w.topic.type_name == topic.type_name;
        if let Some(at) = self.topics.iter().position(same) {
            return Ok(TopicId(at));
        }
        let (encoding, text) = topic
            .schema
            .as_deref()
            .map_or(("", ""), |text| ("ros2msg", text));
        let written = |e: mcap::McapError| Error::unwritten(&self.file, &e);
        let schema = self
            .writer
            .add_schema(&topic.type_name, encoding, text.as_bytes())
            .map_err(written)?;
        let profiles =
            metadata::write_profiles(&topic.qos).map_err(|e| Error::write(&self.file, e))?;
        let channel_metadata = BTreeMap::from([
            (
                "offered_qos_profiles".to_owned(),
                profiles.trim_end().to_owned(),
            ),
            (
                "topic_type_hash".to_owned(),
                topic.type_hash.clone().unwrap_or_default(),
            ),
        ]);
        let channel = self
            .writer
            .add_channel(schema, &topic.name, "cdr", &channel_metadata)
            .map_err(written)?;
        self.topics.push(WrittenTopic {
            topic,
            channel,
            count: 0,
        });
        Ok(TopicId(self.topics.len() - 1))
    }

    /// Writes a message.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write<M: RosMessage>(
        &mut self,
        topic: TopicId,
        log_time: u64,
        message: &M,
    ) -> Result<(), Error> {
        let mut payload = std::mem::take(&mut self.payload);
        let result = cdr::encode(message, &mut payload)
            .map_err(|e| Error::write(&self.file, e))
            .and_then(|()| self.write_payload(topic, log_time, log_time, &payload));
        self.payload = payload;
        result
    }

    /// Writes a payload as it is, encapsulation included.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_payload(
        &mut self,
        topic: TopicId,
        log_time: u64,
        publish_time: u64,
        payload: &[u8],
    ) -> Result<(), Error> {
        let written = &mut self.topics[topic.0];
        let sequence = u32::try_from(written.count % (1 << 32)).unwrap_or_default();
        let header = MessageHeader {
            channel_id: written.channel,
            sequence,
            log_time,
            publish_time,
        };
        self.writer
            .write_to_known_channel(&header, payload)
            .map_err(|e| Error::unwritten(&self.file, &e))?;
        written.count += 1;
        let (first, last) = self.time_range.unwrap_or((log_time, log_time));
        self.time_range = Some((first.min(log_time), last.max(log_time)));
        Ok(())
    }

    /// Closes the chunk that is being filled, so that a reader has everything up to here.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn flush(&mut self) -> Result<(), Error> {
        self.writer
            .flush()
            .map_err(|e| Error::unwritten(&self.file, &e))
    }

    /// Hands what has been packed to the system, so that a disk which does not take it says so now. The chunk stays open.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn hand_over(&mut self) -> Result<(), Error> {
        self.output.flush().map_err(|e| Error::write(&self.file, e))
    }

    /// The MCAP file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Messages written so far, by topic.
    pub fn counts(&self) -> impl Iterator<Item = (&str, u64)> {
        self.topics
            .iter()
            .map(|written| (written.topic.name.as_str(), written.count))
    }

    /// Ends the bag: index, metadata record, end marker, and `metadata.yaml` in its directory. For a single file the
    /// `metadata.yaml` is written only where the directory holds no other bag, for it describes a whole directory.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn finish(mut self) -> Result<BagSummary, Error> {
        let information = self.information();
        let serialized =
            serde_saphyr::to_string(&information).map_err(|e| Error::write(&self.file, e))?;
        let record = MetadataRecord {
            name: "rosbag2".to_owned(),
            metadata: BTreeMap::from([
                ("serialized_metadata".to_owned(), serialized),
                ("ROS_DISTRO".to_owned(), DISTRIBUTION.to_owned()),
            ]),
        };
        self.writer
            .write_metadata(&record)
            .map_err(|e| Error::unwritten(&self.file, &e))?;
        self.writer
            .finish()
            .map_err(|e| Error::unwritten(&self.file, &e))?;
        // What was written is there also after the power has gone.
        let synced = File::open(&self.file).and_then(|file| file.sync_all());
        synced.map_err(|e| Error::io(&self.file, e))?;
        let directory = self.file.parent().map(Path::to_owned).unwrap_or_default();
        if is_alone(&directory, &self.file) {
            let path = directory.join(metadata::FILE_NAME);
            let yaml = serde_saphyr::to_string(&Metadata {
                rosbag2_bagfile_information: information,
            })
            .map_err(|e| Error::write(&path, e))?;
            files::write(&path, yaml.as_bytes()).map_err(|e| Error::io(&path, e))?;
        }
        let counts = self
            .counts()
            .map(|(name, count)| (name.to_owned(), count))
            .collect();
        Ok(BagSummary {
            path: self.path,
            counts,
            time_range: self.time_range,
        })
    }

    fn information(&self) -> Information {
        let (first, last) = self.time_range.unwrap_or((0, 0));
        let starting_time = SinceEpoch {
            nanoseconds_since_epoch: first,
        };
        let duration = Nanoseconds {
            nanoseconds: last - first,
        };
        let message_count = self.topics.iter().map(|written| written.count).sum();
        let name = self
            .file
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default();
        let topics = self.topics.iter().map(|written| TopicWithCount {
            topic_metadata: TopicMetadata {
                name: written.topic.name.clone(),
                type_name: written.topic.type_name.clone(),
                serialization_format: "cdr",
                offered_qos_profiles: written.topic.qos.iter().map(|&qos| qos.into()).collect(),
                type_description_hash: written.topic.type_hash.clone().unwrap_or_default(),
            },
            message_count: written.count,
        });
        Information {
            version: 9,
            storage_identifier: "mcap",
            duration,
            starting_time,
            message_count,
            topics_with_message_count: topics.collect(),
            compression_format: "",
            compression_mode: "",
            relative_file_paths: vec![name.clone()],
            files: vec![FileInformation {
                path: name,
                starting_time,
                duration,
                message_count,
            }],
            custom_data: None,
            ros_distro: DISTRIBUTION,
        }
    }
}

/// Makes the directory of a bag and names its file, `NAME/NAME_0.mcap`.
/// The file to be written. A record that is there is hours of somebody's work.
fn create(file: &Path, replaces: bool) -> Result<File, Error> {
    if replaces && fs::symlink_metadata(file).is_ok_and(|there| there.is_file()) {
        fs::remove_file(file).map_err(|e| Error::io(file, e))?;
    }
    files::create_new(file).map_err(|e| {
        if e.kind() == std::io::ErrorKind::AlreadyExists {
            Error::write(file, "it is there already")
        } else {
            Error::io(file, e)
        }
    })
}

fn new_directory(path: &Path) -> Result<PathBuf, Error> {
    fs::create_dir_all(path).map_err(|e| Error::io(path, e))?;
    let name = path.canonicalize().map_err(|e| Error::io(path, e))?;
    let name = name
        .file_name()
        .map_or_else(|| "bag".into(), |name| name.to_string_lossy().into_owned());
    if has_other_bags(path, None) {
        return Err(Error::write(path, "the directory already holds a bag"));
    }
    Ok(path.join(format!("{name}_0.mcap")))
}

/// Whether a directory holds an MCAP file besides `own`.
fn has_other_bags(directory: &Path, own: Option<&Path>) -> bool {
    let own = own.and_then(Path::file_name);
    fs::read_dir(listable(directory)).is_ok_and(|entries| {
        entries.flatten().any(|entry| {
            let path = entry.path();
            path.extension()
                .is_some_and(|extension| extension == "mcap")
                && path.file_name() != own
        })
    })
}

/// Whether a `metadata.yaml` may be written beside a file: no other bag is there, and none that is there is of another.
fn is_alone(directory: &Path, file: &Path) -> bool {
    let describes_other =
        fs::read_to_string(directory.join(metadata::FILE_NAME)).is_ok_and(|yaml| {
            let name = file
                .file_name()
                .map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default();
            !yaml.contains(&name)
        });
    !describes_other && !has_other_bags(directory, Some(file))
}

fn listable(directory: &Path) -> &Path {
    if directory.as_os_str().is_empty() {
        Path::new(".")
    } else {
        directory
    }
}
