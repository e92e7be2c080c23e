//! `rotary-sins play`: the topics of a bag, of any type, with simulated time.

use std::{
    path::PathBuf,
    process::ExitCode,
    str::FromStr,
    time::{Duration, Instant},
};

use anyhow::{Context, ensure};
use bags::{Bag, Selection};
use clap::Args;
use ros_node::{Node, NodeBuilder, Payload, Publisher, PublisherStatistics, Qos, SENSOR_DEPTH};
use ros2_interfaces::{builtin_interfaces::Time, rosgraph_msgs::Clock};
use rotary_sins_msgs::interfaces::topics::CLOCK;

use crate::{output, progress::SecondsBar};

/// A message waits for room this long before it is given up.
const PATIENCE: Duration = Duration::from_secs(60);
/// Without `--wait-for`: subscribers are waited for until none has come for so long.
const QUIET: Duration = Duration::from_millis(1500);
/// Without `--wait-for` and without any subscriber: begin after so long.
const LONELY: Duration = Duration::from_secs(5);
/// A player that was held up for longer goes on from where it is: what it sent faster to catch up, subscribers would lose.
const MOST_LATE: Duration = Duration::from_millis(100);
/// `/clock` comes at most so often, in simulated time \[ns\] ...
const CLOCK_STEP: u64 = 10_000_000;
/// ... and in real time, ...
const CLOCK_PAUSE: Duration = Duration::from_millis(5);
/// ... but at least so often in simulated time \[ns\].
const CLOCK_STRIDE: u64 = 500_000_000;

/// How fast.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rate {
    /// This multiple of real time.
    Times(f64),
    /// As fast as the subscribers take it.
    Most,
}

impl FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            _ if text == "max" => Ok(Self::Most),
            Ok(0.0) => Ok(Self::Most),
            Ok(rate) if rate > 0.0 && rate.is_finite() => Ok(Self::Times(rate)),
            _ => Err("expected a positive number, 0 or max".to_owned()),
        }
    }
}

/// How many subscribers a topic must have first.
#[derive(Clone, Debug, PartialEq, Eq)]
struct WaitFor {
    topic: Option<String>,
    count: usize,
}

impl FromStr for WaitFor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (topic, count) = match text.rsplit_once(':') {
            Some((topic, count)) => (Some(topic.to_owned()), count),
            None => (None, text),
        };
        let count = count
            .parse()
            .map_err(|_| "expected N or TOPIC:N".to_owned())?;
        Ok(Self { topic, count })
    }
}

/// Options of `play`.
#[derive(Args)]
pub struct Options {
    /// MCAP file or rosbag2 directory
    bag: PathBuf,
    /// Only these topics
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    topics: Vec<String>,
    /// With --topics: these too, where the bag has them
    #[arg(long, value_name = "TOPIC", num_args = 1.., requires = "topics")]
    optional_topics: Vec<String>,
    /// Multiple of real time; 0 or max: as fast as the subscribers take it
    #[arg(long, short, default_value = "1", value_name = "TIMES")]
    rate: Rate,
    /// Begin so many seconds after the start of the bag; of transient local topics the last message before comes first
    #[arg(long, value_name = "SECONDS")]
    start_offset: Option<f64>,
    /// Play so many seconds of the bag
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Wait until a topic has so many subscribers (without TOPIC: the one with the most messages)
    #[arg(long, value_name = "[TOPIC:]N")]
    wait_for: Vec<WaitFor>,
    /// Give up waiting for subscribers after this
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    wait_timeout: f64,
    /// Do not publish /clock (a /clock of the bag is played instead)
    #[arg(long)]
    no_clock: bool,
    /// Begin again at the end (only with --no-clock)
    #[arg(long = "loop")]
    repeat: bool,
}

/// Plays until the end of the bag. `ros_arguments` are those behind `--ros-args`, with it.
pub fn run(options: &Options, ros_arguments: Vec<String>) -> anyhow::Result<ExitCode> {
    for (name, value) in [
        ("--start-offset", options.start_offset),
        ("--duration", options.duration),
    ] {
        ensure!(
            value.is_none_or(|value| value.is_finite() && value >= 0.0),
            "{name} is {}, expected a number of seconds that is not negative",
            value.unwrap_or_default()
        );
    }
    ensure!(
        !options.repeat || options.no_clock,
        "--loop is refused: /clock would run back at every turn, and nodes that integrate would see time run back \
         (with --no-clock only the stamps of the messages do)"
    );
    let bag = Bag::open(&options.bag)?;
    bag.warnings().iter().for_each(output::note);
    let builder = NodeBuilder::new("rotary_sins_player").about("plays a bag");
    Ok(ros_node::run_with(ros_arguments, builder, |node| {
        let bag = &bag;
        async move { play(&node, bag, options).await }
    }))
}

struct Player<'b> {
    bag: &'b Bag,
    /// By the number of the topic; none for topics that are not played.
    publishers: Vec<Option<Publisher<Payload>>>,
    clock: Option<Publisher<Clock>>,
    last_clock: Option<(u64, Instant)>,
    unplayable: u64,
}

async fn play(node: &Node, bag: &Bag, options: &Options) -> anyhow::Result<()> {
    let selection = selection(bag, options)?;
    let mut player = Player::new(node, bag, &selection, options)?;
    node.set_ready();
    // The end of the process may be asked for at any time; what was sent until then is told all the same.
    let is_whole = tokio::select! {
        result = async {
            player.play(&selection, options).await?;
            node.repeat_what_was_missed().await;
            anyhow::Ok(())
        } => result.map(|()| true)?,
        () = node.shutdown() => false,
    };
    player.sum_up()?;
    if !is_whole {
        output::note("ended before the end of the bag");
    }
    Ok(())
}

impl Player<'_> {
    /// All of it, once subscribers are there.
    async fn play(&mut self, selection: &Selection, options: &Options) -> anyhow::Result<()> {
        self.wait(options).await?;
        loop {
            self.once(selection, options).await?;
            if !options.repeat {
                break;
            }
        }
        Ok(())
    }

    /// Says what was sent; what was dropped is an error.
    fn sum_up(&self) -> anyhow::Result<()> {
        let count = |of: fn(&PublisherStatistics) -> u64| -> u64 {
            let publishers = self.publishers.iter().flatten();
            publishers
                .map(|publisher| of(&publisher.statistics()))
                .sum()
        };
        let sent = count(PublisherStatistics::published);
        let dropped = count(PublisherStatistics::dropped);
        output::note(format!(
            "{}: {sent} messages sent",
            self.bag.path().display()
        ));
        if self.unplayable > 0 {
            output::note(format!(
                "{} messages are no little-endian CDR and were left out",
                self.unplayable
            ));
        }
        ensure!(
            dropped == 0,
            "{dropped} messages were dropped, because a subscriber did not take them"
        );
        Ok(())
    }
}
/// Which topics and times.
fn selection(bag: &Bag, options: &Options) -> anyhow::Result<Selection> {
    let has = || {
        bag.topics()
            .iter()
            .map(|topic| topic.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    let mut topics = Vec::new();
    for name in &options.topics {
        let found = bag.topic(name);
        topics.push(found.with_context(|| {
            format!(
                "{}: no topic {name}; the bag has {}",
                bag.path().display(),
                has()
            )
        })?);
    }
    topics.extend(
        options
            .optional_topics
            .iter()
            .filter_map(|name| bag.topic(name)),
    );
    if topics.is_empty() {
        topics = (0..bag.topics().len()).collect();
    }
    for &at in &topics {
        let topic = &bag.topics()[at];
        ensure!(
            topic.encoding == bags::ENCODING,
            "{}: {}: message encoding {:?}, expected \"{}\"",
            bag.path().display(),
            topic.name,
            topic.encoding,
            bags::ENCODING
        );
    }
    if !options.no_clock {
        topics.retain(|&at| bag.topics()[at].name != CLOCK.name);
    }
    ensure!(
        !topics.is_empty(),
        "{}: there is no topic to play",
        bag.path().display()
    );
    Ok(Selection::topics(topics).window(bag, options.start_offset, options.duration))
}

impl<'b> Player<'b> {
    fn new(
        node: &Node,
        bag: &'b Bag,
        selection: &Selection,
        options: &Options,
    ) -> anyhow::Result<Self> {
        let wanted = |at: usize| {
            selection
                .topics
                .as_ref()
                .is_none_or(|topics| topics.contains(&at))
        };
        let mut publishers = Vec::new();
        for (at, topic) in bag.topics().iter().enumerate() {
            if !wanted(at) {
                publishers.push(None);
                continue;
            }
            // Reliable serves best-effort subscribers too, and loses nothing at a high rate.
            let is_latched =
                !topic.qos.is_empty() && topic.qos.iter().all(|qos| qos.transient_local);
            let qos = if is_latched {
                let depth = topic.qos.iter().map(|qos| qos.depth).max().unwrap_or(1);
                Qos::latched(if depth == 0 { SENSOR_DEPTH } else { depth })
            } else {
                Qos::reliable(SENSOR_DEPTH)
            };
            publishers.push(Some(node.raw_publisher(
                &topic.name,
                &topic.type_name,
                qos,
            )?));
        }
        let clock = if options.no_clock {
            None
        } else {
            // Reliable: a player's time is not told again soon.
            Some(node.publisher(CLOCK.name, Qos::reliable(10))?)
        };
        Ok(Self {
            bag,
            publishers,
            clock,
            last_clock: None,
            unplayable: 0,
        })
    }

    /// Waits for subscribers, so that the first messages are not lost.
    async fn wait(&self, options: &Options) -> anyhow::Result<()> {
        let timeout =
            Duration::try_from_secs_f64(options.wait_timeout).context("--wait-timeout")?;
        for wait in &options.wait_for {
            let most = (0..self.bag.topics().len()).filter(|&at| self.publishers[at].is_some());
            let at = match &wait.topic {
                Some(name) => self.bag.topic(name),
                None => most.max_by_key(|&at| self.bag.topics()[at].count),
            };
            let publisher = at.and_then(|at| self.publishers[at].as_ref());
            let publisher = publisher.with_context(|| {
                format!(
                    "--wait-for: topic {} is not played",
                    wait.topic.as_deref().unwrap_or_default()
                )
            })?;
            ensure!(
                publisher.wait_for_subscribers(wait.count, timeout).await,
                "{}: {} of {} subscribers after {} s",
                publisher.topic(),
                publisher.subscriber_count(),
                wait.count,
                options.wait_timeout
            );
        }
        if options.wait_for.is_empty() {
            self.wait_for_quiet().await;
        }
        Ok(())
    }

    async fn wait_for_quiet(&self) {
        let subscribers = || {
            self.publishers
                .iter()
                .flatten()
                .map(Publisher::subscriber_count)
                .sum::<usize>()
        };
        let begin = Instant::now();
        let (mut count, mut since) = (0, begin);
        loop {
            let now = subscribers();
            if now != count {
                (count, since) = (now, Instant::now());
            }
            if count > 0 && since.elapsed() >= QUIET {
                return;
            }
            if count == 0 && begin.elapsed() >= LONELY {
                output::note("nobody has subscribed; playing all the same");
                return;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    /// Plays the selection from its beginning to its end.
    async fn once(&mut self, selection: &Selection, options: &Options) -> anyhow::Result<()> {
        let length = self
            .bag
            .time_range()
            .map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9);
        let length = (length - options.start_offset.unwrap_or(0.0))
            .min(options.duration.unwrap_or(f64::INFINITY));
        let progress = SecondsBar::new("playing", length);
        self.send_latched(selection).await;
        let mut messages = self.bag.messages(selection);
        let mut beginning: Option<(u64, Instant)> = None;
        while let Some(message) = messages.next() {
            let (first, begun) =
                beginning.get_or_insert_with(|| (message.log_time, Instant::now()));
            let elapsed = message.log_time.saturating_sub(*first);
            if let Rate::Times(rate) = options.rate {
                let due = *begun + Duration::from_secs_f64(elapsed as f64 * 1e-9 / rate);
                let late = Instant::now().saturating_duration_since(due);
                if late > MOST_LATE {
                    *begun += late;
                }
                tokio::time::sleep_until(due.into()).await;
            }
            self.tick(message.log_time);
            self.send(message.topic, message.data).await;
            progress.set(elapsed as f64 * 1e-9);
        }
        messages
            .warnings()
            .iter()
            .for_each(|warning| progress.note(warning));
        Ok(())
    }

    /// Of transient local topics, the last message before the selection: what a late subscriber would have got.
    async fn send_latched(&mut self, selection: &Selection) {
        let Some(start) = selection.start else { return };
        let is_latched = |&at: &usize| {
            self.publishers[at].is_some()
                && self.bag.topics()[at]
                    .qos
                    .iter()
                    .any(|qos| qos.transient_local)
        };
        for at in (0..self.publishers.len())
            .filter(is_latched)
            .collect::<Vec<_>>()
        {
            let mut messages = self.bag.messages(&Selection {
                end: Some(start),
                ..Selection::topics([at])
            });
            let mut last = None;
            while let Some(message) = messages.next() {
                last = Some(message.data.to_vec());
            }
            if let Some(data) = last {
                self.send(at, &data).await;
            }
        }
    }

    async fn send(&mut self, topic: usize, data: &[u8]) {
        let Some(publisher) = &self.publishers[topic] else {
            return;
        };
        match data {
            [0, 1, _, _, payload @ ..] => {
                // What has no room in the end is counted by the publisher, and is an error when all is played.
                publisher
                    .publish_within(Payload(payload.to_vec()), PATIENCE)
                    .await
                    .left_to_diagnostics();
            }
            _ => self.unplayable += 1,
        }
    }

    /// Lets simulated time pass.
    fn tick(&mut self, now: u64) {
        let Some(clock) = &self.clock else { return };
        let is_due = self.last_clock.is_none_or(|(last, at)| {
            let step = now.saturating_sub(last);
            step >= CLOCK_STRIDE || (step >= CLOCK_STEP && at.elapsed() >= CLOCK_PAUSE)
        });
        if is_due && let Ok(nanos) = i64::try_from(now) {
            // Every time stands for those before it.
            clock
                .publish(Clock {
                    clock: Time::from_nanos(nanos),
                })
                .left_to_diagnostics();
            self.last_clock = Some((now, Instant::now()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rates are positive, or as fast as can be.
    #[test]
    fn rates() {
        assert_eq!("2.5".parse(), Ok(Rate::Times(2.5)));
        assert_eq!("0".parse(), Ok(Rate::Most));
        assert_eq!("max".parse(), Ok(Rate::Most));
        assert!(
            "-1".parse::<Rate>().is_err()
                && "inf".parse::<Rate>().is_err()
                && "x".parse::<Rate>().is_err()
        );
    }

    /// A number alone is about the busiest topic.
    #[test]
    fn waits() {
        assert_eq!(
            "3".parse(),
            Ok(WaitFor {
                topic: None,
                count: 3
            })
        );
        assert_eq!(
            "/imu:2".parse(),
            Ok(WaitFor {
                topic: Some("/imu".into()),
                count: 2
            })
        );
        assert!("imu".parse::<WaitFor>().is_err());
    }
}
