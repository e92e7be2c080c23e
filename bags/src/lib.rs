//! rosbag2-style MCAP bags, in and out.
//!
//! [`Bag`] reads an MCAP file or a rosbag2 directory: mapped into memory, indexed or not, in chunks or not, packed with
//! zstd, lz4 or not at all. What was cut off or damaged is read as far as it is good, and a [`Warning`] says in one line
//! what is missing. [`BagWriter`] writes what rosbag2 expects.
//!
//! Payloads are CDR; [`cdr`] reads and writes them, [`samples`] turns those of the sensors into samples directly.

mod bag;
pub use ros2_interfaces::cdr;
mod chunk;
mod error;
mod index;
mod messages;
mod metadata;
mod record;
pub mod samples;
mod sensors;
mod writer;

pub use bag::{Bag, ENCODING, Topic};
pub use error::{Damage, Error, Warning};
pub use messages::{Messages, RawMessage, Selection};
pub use ros2_interfaces::Qos;
pub use sensors::{Fix, Sample, SensorOptions, SensorStream, SensorTopics, last_position_before};
pub use writer::{BagSummary, BagWriter, Compression, NewTopic, TopicId, WriteOptions};
