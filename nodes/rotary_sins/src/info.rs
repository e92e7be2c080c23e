//! `rotary-sins info`: what is in a bag.

use std::path::PathBuf;

use bags::{Bag, Selection};
use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

use crate::{Outcome, output};

/// Options of `info`.
#[derive(Args)]
#[command(
    after_help = "Exit status: 0 the bag is whole, 2 it is none or unusable arguments, 3 it is damaged (a line names each place)"
)]
pub struct Options {
    /// MCAP file or rosbag2 directory
    bag: PathBuf,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Info {
    path: PathBuf,
    files: Vec<PathBuf>,
    size_bytes: u64,
    library: String,
    profile: String,
    compression: Vec<Packing>,
    start_ns: Option<u64>,
    end_ns: Option<u64>,
    duration_s: f64,
    messages: u64,
    topics: Vec<TopicInfo>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct Packing {
    name: String,
    packed_bytes: u64,
    unpacked_bytes: u64,
}

#[derive(Serialize)]
struct TopicInfo {
    name: String,
    #[serde(rename = "type")]
    type_name: String,
    messages: u64,
    rate_hz: Option<f64>,
    reliable: bool,
    transient_local: bool,
}

/// First and last time and number of the messages of a topic.
#[derive(Clone, Copy, Default)]
struct Span {
    first: u64,
    last: u64,
    count: u64,
}

impl Span {
    fn take(&mut self, time: u64) {
        if self.count == 0 {
            self.first = time;
        }
        self.last = time;
        self.count += 1;
    }

    fn rate_hz(&self) -> Option<f64> {
        (self.last > self.first)
            .then(|| (self.count - 1) as f64 / ((self.last - self.first) as f64 * 1e-9))
    }
}

/// Reads the whole bag, so that counts are those of what can be read.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let bag = Bag::open(&options.bag)?;
    let mut spans = vec![Span::default(); bag.topics().len()];
    let mut all = Span::default();
    let mut messages = bag.messages(&Selection::default());
    while let Some(message) = messages.next() {
        spans[message.topic].take(message.log_time);
        all.take(message.log_time);
    }
    let warnings = bag
        .warnings()
        .iter()
        .chain(messages.warnings())
        .map(ToString::to_string);
    let (profile, library) = bag.written_by();
    let info = Info {
        path: bag.path().to_owned(),
        files: bag.file_paths().map(ToOwned::to_owned).collect(),
        size_bytes: bag.size(),
        library: library.to_owned(),
        profile: profile.to_owned(),
        compression: bag
            .compression()
            .into_iter()
            .map(|(name, (packed_bytes, unpacked_bytes))| Packing {
                name: if name.is_empty() {
                    "none".to_owned()
                } else {
                    name
                },
                packed_bytes,
                unpacked_bytes,
            })
            .collect(),
        start_ns: (all.count > 0).then_some(all.first),
        end_ns: (all.count > 0).then_some(all.last),
        duration_s: (all.last - all.first) as f64 * 1e-9,
        messages: all.count,
        topics: bag
            .topics()
            .iter()
            .zip(&spans)
            .map(|(topic, span)| TopicInfo {
                name: topic.name.clone(),
                type_name: topic.type_name.clone(),
                messages: span.count,
                rate_hz: span.rate_hz(),
                reliable: topic.qos.iter().all(|qos| qos.reliable),
                transient_local: topic.qos.iter().any(|qos| qos.transient_local),
            })
            .collect(),
        warnings: warnings.collect(),
    };
    if options.json {
        output::json(&info)?;
    } else {
        output::text_line(&text(&info))?;
    }
    info.warnings.iter().for_each(output::note);
    Ok(if info.warnings.is_empty() {
        Outcome::Reached
    } else {
        Outcome::Damaged
    })
}

fn text(info: &Info) -> String {
    let mut lines = vec![format!(
        "{}  {:.1} MB, {} messages, {:.3} s",
        info.path.display(),
        info.size_bytes as f64 * 1e-6,
        info.messages,
        info.duration_s
    )];
    if let (Some(start), Some(end)) = (info.start_ns, info.end_ns) {
        lines.push(format!(
            "from {} to {}",
            output::seconds(start),
            output::seconds(end)
        ));
    }
    for packing in &info.compression {
        lines.push(format!(
            "chunks {}: {:.1} MB packed, {:.1} MB unpacked",
            packing.name,
            packing.packed_bytes as f64 * 1e-6,
            packing.unpacked_bytes as f64 * 1e-6
        ));
    }
    lines.push(format!(
        "written by {} (profile {})",
        info.library, info.profile
    ));
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(["topic", "type", "messages", "Hz", "offered"]);
    for topic in &info.topics {
        let reliability = if topic.reliable {
            "reliable"
        } else {
            "best effort"
        };
        let durability = if topic.transient_local {
            ", transient local"
        } else {
            ""
        };
        table.add_row([
            topic.name.clone(),
            topic.type_name.clone(),
            topic.messages.to_string(),
            topic
                .rate_hz
                .map_or_else(|| "-".to_owned(), |rate| format!("{rate:.3}")),
            format!("{reliability}{durability}"),
        ]);
    }
    for column in [2, 3] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    lines.push(table.to_string());
    lines.join("\n")
}
