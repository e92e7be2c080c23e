//! `rotary-sins record`: topics of any type into a bag, until Ctrl-C.

use std::{
    collections::{BTreeMap, BTreeSet},
    future::Future,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use bags::{BagSummary, BagWriter, NewTopic, TopicId, WriteOptions, cdr::ENCAPSULATION};
use clap::Args;
use ros_node::{DiscoveredPublisher, Node, NodeBuilder, Payload, Qos, SENSOR_DEPTH, Subscription};
use ros2_interfaces::KnownType;
use rotary_sins_msgs::interfaces::topics::CLOCK;
use rotary_sins_msgs::known_type;
use sins::time::Stamp;
use tokio::{sync::mpsc, task::JoinSet};

use crate::{
    ament_types::{self, Definition},
    output,
    simulate::Packing,
};

/// Between two lines while the end of the bag is being written.
const SLOW: Duration = Duration::from_secs(2);
/// How often new topics are looked for.
const LOOK: Duration = Duration::from_millis(50);
/// Messages taken at once.
const BATCH: usize = 256;
/// Batches on the way to the file. When it is full the readers fill up, and what they lose is counted.
const QUEUE: usize = 256;

/// What the recorder may take: batches wait in memory where the disk is slow \[bytes\].
const MEMORY: u64 = 4 << 30;
/// How often what has been written is handed to the disk, and the disk is looked at.
const LOOK_AT_DISK: Duration = Duration::from_secs(1);
/// What a bag needs for its end: its last chunk and its index \[bytes\].
const ROOM: u64 = 16 << 20;
/// A chunk is open no longer than this: it is what a kill costs.
const CHUNK: Duration = Duration::from_secs(10);

/// Exit status where the bag is whole, but messages did not reach it.
const LOST: u8 = 3;

/// A stamp that is further than this from the simulated time is of another clock \[ns\].
const SAME_CLOCK: i64 = 600_000_000_000;

/// Options of `record`.
#[derive(Args, Clone)]
#[command(
    after_help = "Exit status: 0 done, 1 it broke down (a full disk: the bag is whole up to then), 2 unusable arguments, 3 the bag is whole but messages were lost \
                        on the way to it (a line names each topic)"
)]
pub struct Options {
    /// Topics; none means all
    topics: Vec<String>,
    /// Bag to write: FILE.mcap, or the directory of a rosbag2
    #[arg(long, short, value_name = "BAG")]
    output: PathBuf,
    /// Replace FILE.mcap where it is there already
    #[arg(long)]
    force: bool,
    /// Record so many seconds, then end
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Topics to leave out
    #[arg(long, value_name = "TOPIC")]
    exclude: Vec<String>,
    /// Log times are simulated time: the stamp of a message that has one in front, else that of /clock
    #[arg(long)]
    use_sim_time: bool,
    /// Messages of a topic that the middleware keeps until they are taken; more where time runs fast
    #[arg(long, value_name = "N", default_value_t = SENSOR_DEPTH)]
    depth: usize,
    /// Packing of the bag
    #[arg(long, value_enum, default_value = "zstd")]
    compression: Packing,
}

/// Messages of one topic with their log times \[ns\].
struct Batch {
    topic: TopicId,
    messages: Vec<(u64, Payload)>,
}

/// What goes to the thread that writes.
enum Order {
    Topic(
        NewTopic,
        tokio::sync::oneshot::Sender<Result<TopicId, bags::Error>>,
    ),
    Write(Batch),
    /// Hand what there is to the disk, and look at it.
    Look,
}

/// What the thread that writes leaves behind.
struct Written {
    summary: BagSummary,
    /// Why it ended by itself: the disk is full.
    full: Option<String>,
}

/// Where a task's log times come from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LogTime {
    /// The clock of the node: the system's, or `/clock`.
    Clock,
    /// The stamp that the message begins with, where it is of the same clock.
    Stamp,
}

/// Records until it is told to end. `ros_arguments` are those behind `--ros-args`, with it. Exit status: that of a node, and 3
/// where messages were lost on the way.
pub fn run(options: &Options, ros_arguments: Vec<String>) -> ExitCode {
    let mut arguments = ros_arguments;
    if options.use_sim_time {
        arguments.extend(["--ros-args", "-p", "use_sim_time:=true"].map(str::to_owned));
    }
    // A task for each topic, and at a hundred times real time one thread would not do.
    let builder = NodeBuilder::new("rotary_sins_recorder")
        .about("records topics into a bag")
        .worker_threads(2)
        .memory_limit(MEMORY)
        // A bag without its end is half a bag: it is written however long the disk takes.
        .end_within(None);
    let lost = Arc::new(AtomicBool::new(false));
    let status = ros_node::run_with(arguments, builder, |node| {
        let (options, found) = (options.clone(), Arc::clone(&lost));
        async move {
            let any = record(node, options).await?;
            found.store(any, Ordering::SeqCst);
            anyhow::Ok(())
        }
    });
    if lost.load(Ordering::SeqCst) {
        ExitCode::from(LOST)
    } else {
        status
    }
}

/// Whether messages were lost that are missed.
async fn record(node: Node, options: Options) -> anyhow::Result<bool> {
    if options
        .duration
        .is_some_and(|seconds| !(seconds > 0.0 && seconds < 1e9))
    {
        bail!(
            "--duration is {:?}, expected a positive number of seconds",
            options.duration.unwrap_or_default()
        );
    }
    let wanted = Wanted::new(&node, &options)?;
    let write_options = WriteOptions {
        compression: options.compression.into(),
        replaces: options.force,
        ..WriteOptions::default()
    };
    let bag = BagWriter::create(&options.output, write_options)?;
    node.set_ready();
    let (orders, queue) = mpsc::channel(QUEUE);
    let mut writer = tokio::task::spawn_blocking(move || write(bag, queue));
    let mut recorder = Recorder {
        node: node.clone(),
        orders,
        wanted,
        tasks: JoinSet::new(),
        seen: BTreeMap::new(),
        refused: BTreeSet::new(),
        depth: options.depth,
    };
    let ended = async {
        match options.duration {
            Some(seconds) => tokio::time::sleep(Duration::from_secs_f64(seconds)).await,
            None => std::future::pending().await,
        }
    };
    let mut early = None;
    let followed = tokio::select! {
        biased;
        // It ends before the recording does where the disk does not take any more.
        ended = &mut writer => {
            early = Some(ended);
            Ok(())
        }
        result = recorder.follow() => result,
        () = node.shutdown() => Ok(()),
        () = ended => Ok(()),
    };
    node.request_shutdown();
    let Recorder {
        orders,
        tasks,
        wanted,
        seen,
        ..
    } = recorder;
    drop(orders);
    let end = async {
        let losses: Vec<(String, u64)> = tasks.join_all().await;
        let ended = match early {
            Some(ended) => ended,
            None => writer.await,
        };
        (losses, ended)
    };
    let (losses, ended) = told_while_slow(end, &options.output).await;
    let written = ended.context("the writer of the bag broke down")?;
    let Written { summary, full } = written.context(
        "the disk takes no more; what the bag has up to its last whole chunk can be read",
    )?;
    report(&summary, &losses, &wanted, &seen);
    if let Some(full) = full {
        bail!("{full}; the bag is whole up to then");
    }
    followed?;
    // Every time on /clock stands for those before it, and its publishers offer best effort: a lost one is missed by nobody.
    let is_loss = |(topic, lost): &(String, u64)| *lost > 0 && topic != CLOCK.name;
    Ok(losses.iter().any(is_loss))
}

/// Waits as long as it takes, and says so now and then.
async fn told_while_slow<T>(end: impl Future<Output = T>, bag: &Path) -> T {
    let mut end = std::pin::pin!(end);
    let mut lines = tokio::time::interval(SLOW);
    lines.tick().await;
    loop {
        tokio::select! {
            biased;
            ended = &mut end => return ended,
            _ = lines.tick() => tracing::warn!(
                "{}: the end of the bag is being written, the disk is slow; a second signal leaves it without its end",
                bag.display()
            ),
        }
    }
}

/// Which topics are wanted.
struct Wanted {
    /// Empty: all.
    topics: BTreeSet<String>,
    excluded: BTreeSet<String>,
}

impl Wanted {
    fn new(node: &Node, options: &Options) -> anyhow::Result<Self> {
        let resolve = |names: &[String]| {
            names
                .iter()
                .map(|name| Ok(node.resolve_topic(name)?))
                .collect::<anyhow::Result<_>>()
        };
        Ok(Self {
            topics: resolve(&options.topics)?,
            excluded: resolve(&options.exclude)?,
        })
    }

    fn has(&self, topic: &str) -> bool {
        (self.topics.is_empty() || self.topics.contains(topic)) && !self.excluded.contains(topic)
    }
}

struct Recorder {
    node: Node,
    orders: mpsc::Sender<Order>,
    wanted: Wanted,
    /// One a topic; each says in the end how many messages of it were lost.
    tasks: JoinSet<(String, u64)>,
    /// Topics with their types, as they were first seen.
    seen: BTreeMap<String, String>,
    /// Topics with other types of theirs, which are not recorded.
    refused: BTreeSet<(String, String)>,
    /// Messages of a topic that the middleware keeps.
    depth: usize,
}

impl Recorder {
    /// Subscribes to what is wanted as it turns up; never ends by itself.
    ///
    /// All topics that are there are subscribed first: a reader keeps what comes from then on, so that no topic misses a message
    /// because the bag is told of another one. What was published before a reader was matched can only be had of transient local
    /// topics; that is a matter of DDS.
    async fn follow(&mut self) -> anyhow::Result<()> {
        let mut looked = Instant::now();
        loop {
            if looked.elapsed() >= LOOK_AT_DISK {
                looked = Instant::now();
                // Where the queue is full the disk is being written to at this moment, and says so itself.
                self.orders.try_send(Order::Look).ok();
            }
            let mut subscribed = Vec::new();
            for publisher in self.node.discovered_publishers() {
                if self.wanted.has(&publisher.topic) {
                    subscribed.extend(self.subscribe(publisher)?);
                }
            }
            for (publisher, subscription) in subscribed {
                self.begin(&publisher, subscription).await?;
            }
            tokio::time::sleep(LOOK).await;
        }
    }

    /// A subscription of what has not been seen before.
    fn subscribe(
        &mut self,
        publisher: DiscoveredPublisher,
    ) -> anyhow::Result<Option<(DiscoveredPublisher, Subscription<Payload>)>> {
        let DiscoveredPublisher {
            topic, type_name, ..
        } = &publisher;
        match self.seen.get(topic) {
            Some(first) if first == type_name => return Ok(None),
            Some(first) => {
                if self.refused.insert((topic.clone(), type_name.clone())) {
                    tracing::warn!(
                        "{topic}: published as {type_name} too; only {first} is recorded"
                    );
                }
                return Ok(None);
            }
            None => self.seen.insert(topic.clone(), type_name.clone()),
        };
        let qos = Qos {
            transient_local: publisher.transient_local,
            ..Qos::reliable(self.depth)
        };
        let subscription = self.node.raw_subscription(topic, type_name, qos)?;
        Ok(Some((publisher, subscription)))
    }

    /// Tells the bag of a topic, and starts the task that hands its messages over.
    async fn begin(
        &mut self,
        publisher: &DiscoveredPublisher,
        subscription: Subscription<Payload>,
    ) -> anyhow::Result<()> {
        let DiscoveredPublisher {
            topic,
            type_name,
            reliable,
            transient_local,
        } = publisher;
        let offered = Qos {
            depth: if *transient_local { 10 } else { 1000 },
            reliable: *reliable,
            transient_local: *transient_local,
            lifespan: None,
        };
        let mut new_topic = NewTopic::named(topic, type_name, vec![offered]);
        if new_topic.schema.is_none() {
            match ament_types::find(type_name) {
                Ok(Definition { schema, hash }) => {
                    new_topic.schema = Some(schema);
                    new_topic.type_hash = hash;
                }
                Err(why) => tracing::warn!(
                    "{topic}: recorded without the definition of {type_name}, so that only who has it can read the \
                     messages: {why}"
                ),
            }
        }
        let (reply, answer) = tokio::sync::oneshot::channel();
        if self
            .orders
            .send(Order::Topic(new_topic, reply))
            .await
            .is_err()
        {
            bail!("the bag cannot be written any more");
        }
        let id = answer
            .await
            .context("the bag cannot be written any more")??;
        let has_stamp = known_type(type_name).is_some_and(KnownType::begins_with_stamp);
        let log_time = if self.node.clock().is_simulated() && has_stamp {
            LogTime::Stamp
        } else {
            LogTime::Clock
        };
        tracing::info!("recording {topic} ({type_name})");
        self.tasks.spawn(receive(
            self.node.clone(),
            subscription,
            id,
            log_time,
            self.orders.clone(),
            self.depth,
        ));
        Ok(())
    }
}

/// The first eight bytes of a message as a stamp \[ns\].
fn stamp_in_front(payload: &Payload) -> Option<i64> {
    let [a, b, c, d, e, f, g, h] = *payload.0.first_chunk::<8>()?;
    let (sec, nanosec) = (
        i32::from_le_bytes([a, b, c, d]),
        u32::from_le_bytes([e, f, g, h]),
    );
    Some(Stamp::from_sec_nanosec(sec, nanosec).nanos())
}

/// Hands messages over until the node ends, then those that have arrived already.
async fn receive(
    node: Node,
    mut subscription: Subscription<Payload>,
    topic: TopicId,
    log_time: LogTime,
    orders: mpsc::Sender<Order>,
    depth: usize,
) -> (String, u64) {
    // Without a time there is nothing to file a message under; the reader keeps it until then.
    tokio::select! {
        () = node.clock().wait_until_known() => {}
        () = node.shutdown() => {}
    }
    let time_of = |payload: &Payload| {
        let now = node.now_nanos();
        let stamp = stamp_in_front(payload).filter(|_| log_time == LogTime::Stamp);
        // A node that is not in simulated time stamps with another clock.
        let time = stamp.filter(|stamp| stamp.saturating_sub(now).saturating_abs() < SAME_CLOCK);
        u64::try_from(time.unwrap_or(now)).unwrap_or(0)
    };
    let batch_of = |payloads: Vec<Payload>| Batch {
        topic,
        messages: payloads
            .into_iter()
            .map(|payload| (time_of(&payload), payload))
            .collect(),
    };
    loop {
        let payloads = tokio::select! {
            biased;
            () = node.shutdown() => break,
            payloads = subscription.recv_batch(BATCH) => payloads,
        };
        // Where the writer has gone, `follow` or the end of the recording says why.
        if orders.send(Order::Write(batch_of(payloads))).await.is_err() {
            break;
        }
    }
    // What has arrived by now, which is no more than the reader keeps; what still comes is of after the end.
    let arrived: Vec<Payload> = std::iter::from_fn(|| subscription.try_recv())
        .take(depth)
        .collect();
    if !arrived.is_empty() {
        orders.send(Order::Write(batch_of(arrived))).await.ok();
    }
    (
        subscription.topic().to_owned(),
        subscription.statistics().lost(),
    )
}

/// The thread that packs and writes; ends the bag when nobody sends any more, or when the disk is so full that nothing but the end
/// of the bag has room.
fn write(mut bag: BagWriter, mut queue: mpsc::Receiver<Order>) -> Result<Written, bags::Error> {
    let mut payload = Vec::new();
    let mut chunk = Instant::now();
    while let Some(order) = queue.blocking_recv() {
        match order {
            Order::Topic(topic, reply) => {
                // Who asked has gone only when the recording ends.
                reply.send(bag.add_topic(topic)).ok();
            }
            Order::Write(batch) => {
                for (time, message) in &batch.messages {
                    payload.clear();
                    payload.extend(ENCAPSULATION);
                    payload.extend(&message.0);
                    bag.write_payload(batch.topic, *time, *time, &payload)?;
                }
            }
            Order::Look => {
                if let Some(full) = full(bag.file()) {
                    tracing::error!("{full}: the recording ends here");
                    let summary = bag.finish()?;
                    let full = Some(full);
                    return Ok(Written { summary, full });
                }
                if chunk.elapsed() >= CHUNK {
                    bag.flush()?;
                    chunk = Instant::now();
                } else {
                    bag.hand_over()?;
                }
            }
        }
    }
    let summary = bag.finish()?;
    Ok(Written {
        summary,
        full: None,
    })
}

/// That the disk has room for nothing but the end of the bag, where that is so.
fn full(bag: &Path) -> Option<String> {
    // What says nothing of its room says so when it is written to.
    let disk = rustix::fs::statvfs(bag).ok()?;
    let room = disk.f_bavail.saturating_mul(disk.f_frsize);
    (room < ROOM).then(|| {
        format!(
            "{}: the disk is full: {:.1} MiB are left, and a bag needs {} MiB for its end",
            bag.display(),
            room as f64 / f64::from(1 << 20),
            ROOM >> 20
        )
    })
}

fn report(
    summary: &BagSummary,
    losses: &[(String, u64)],
    wanted: &Wanted,
    seen: &BTreeMap<String, String>,
) {
    let total: u64 = summary.counts.iter().map(|(_, count)| count).sum();
    output::note(format!("{}: {total} messages", summary.path.display()));
    for (topic, count) in &summary.counts {
        output::note(format!("  {topic}: {count}"));
    }
    for (topic, lost) in losses.iter().filter(|(_, lost)| *lost > 0) {
        output::note(format!(
            "{topic}: {lost} messages were lost on the way to the recorder"
        ));
    }
    for topic in wanted
        .topics
        .iter()
        .filter(|topic| !seen.contains_key(*topic))
    {
        output::note(format!("{topic}: nobody published it"));
    }
}
