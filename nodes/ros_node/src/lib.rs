//! What every ROS 2 node has and ros2-client leaves out.
//!
//! ros2-client and RustDDS bring topics, services and actions; this crate makes a *node* of them: the command line of
//! ROS (`--ros-args`), parameters declared once with description, unit and range, the six parameter services,
//! `/parameter_events`, `/rosout`, `/diagnostics`, simulated time, name resolution and remapping, the environment
//! variables of discovery, signals, panics and exit status.
//!
//! ```no_run
//! use std::process::ExitCode;
//! use ros_node::{Node, NodeBuilder, Parameter, Qos};
//! use ros2_interfaces::sensor_msgs::Imu;
//!
//! fn main() -> ExitCode {
//!     let builder = NodeBuilder::new("imu_watch")
//!         .about("says how fast the IMU samples")
//!         .parameter(Parameter::new("report_every", 1000_i64).unit("samples").range(1.0, 1e6));
//!     ros_node::run(builder, watch)
//! }
//!
//! async fn watch(node: Node) -> ros_node::Result<()> {
//!     let every = node.parameter::<i64>("report_every")? as u64;
//!     let mut samples = node.subscription::<Imu>("imu/data_raw", Qos::sensor())?;
//!     let mut monitor = ros_node::StreamMonitor::default();
//!     node.set_ready();
//!     loop {
//!         tokio::select! {
//!             () = node.shutdown() => return Ok(()),
//!             sample = samples.recv() => {
//!                 monitor.ingest(sample.header.stamp.nanos());
//!                 if monitor.received() % every == 0 {
//!                     tracing::info!("{:?} Hz, {} gaps", monitor.rate(), monitor.gaps());
//!                 }
//!             }
//!         }
//!     }
//! }
//! ```
//!
//! # What a node does by itself
//! | part | behaviour |
//! | --- | --- |
//! | arguments | `-r`, `-p`, `--params-file`, `--log-level`, `--[enable,disable]-[rosout,stdout]-logs`, `--`; anything unknown is one line and exit status 2; later values win |
//! | parameters | [`ParameterSet`]: declared once, with the place in a struct that each stands for; unknown keys, wrong types and values out of range are errors; read-only unless [`Parameter::changeable`]; `--help` lists them, `--print-parameters` prints a file of them |
//! | environment | `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY`, `ROS_AUTOMATIC_DISCOVERY_RANGE` (`SUBNET`, `LOCALHOST`), `ROS_STATIC_PEERS` (IPv4) |
//! | time | [`Clock`]; with `use_sim_time`, which may be set while the node runs, that of `/clock` (rosgraph_msgs/Clock, best effort, depth 1) |
//! | topics | [`Publisher::publish`] never waits and says what became of the message ([`Published`]), [`Subscription`] hears reliable and best-effort publishers; what is dropped, lost or incompatible is counted and told |
//! | queues | bounded; what overflows is counted and told ([`Overflow`]) |
//! | actions | [`ActionServer`], [`ActionClient`]: results kept, status latched, cancels and refusals as rcl_action has them |
//! | quality of service | overridden by parameters `qos_overrides.<topic>.<publisher or subscription>.<policy>` |
//! | lifecycle | [`NodeBuilder::managed`]: all services, `~/transition_event`; comes up active unless [`LIFECYCLE_AUTOSTART`] is false |
//! | types | `~/get_type_description` |
//! | diagnostics | [`Diagnostics`] once a second; the task `topics` is built in |
//! | log | the macros of `tracing`; `[INFO] [sec.nsec] [node]: text` on standard error, and `/rosout` |
//! | middleware | a stop and a continuation (Ctrl-Z and `fg`, a debugger) are lived through; where RustDDS's threads end or lock up all the same: a FATAL line and status 1 within seconds; memory is bounded ([`NodeBuilder::memory_limit`], [`BoundedAllocator`]) |
//! | end | SIGINT, SIGTERM, [`Node::request_shutdown`]: first what is to be put in order ([`Endings`]), then 3 s for the main function ([`NodeBuilder::end_within`]), then its endpoints leave the graph. A main function that is dropped is a FATAL line and status 1 |
//!
//! The Spinner of ros2-client is not run: it subscribes `/clock` as another type. What it provides is done here
//! (matches and incompatibilities from the participant's events), and `ros_discovery_info`, by which tools know the
//! node's endpoints, is published by ros2-client without it; what others publish there names them ([`Subscription::publishers`]).
//!
//! How much goes through on two cores, and what limits it, is in `THROUGHPUT.md`.
//!
//! # Known limits
//! - After `cleanup` of a managed node, or where a program drops an endpoint, Fast DDS goes on listing it until the
//!   process ends: RustDDS 0.15 disposes of endpoints by serialized key, which Fast DDS does not read
//!   (`docs/upstream/rustdds-key-hash.md`). Of whole participants this crate takes leave itself.
//! - The hash of a type in discovery is invalid (`ros2 topic info -v`, `docs/upstream/rustdds-type-hash.md`);
//!   `~/get_type_description` has it right.
//! - A long-lived Fast DDS participant may miss endpoints that are made many at a time
//!   (`docs/upstream/rustdds-sedp-timestamp.md`).
//! - ros2-client keeps a writer of `/parameter_events` of its own, which never writes: tools count two.
//! - The discovery range `OFF` and DDS security are refused.

mod actions;
mod builder;
mod clock;
pub mod diagnostics;
mod discovery;
mod ending;
mod environment;
mod error;
mod graph;
mod input_watch;
mod lifecycle;
mod logging;
mod middleware;
mod names;
mod node;
mod node_names;
mod overflow;
mod parameter_file;
mod parameters;
mod publisher;
mod qos;
mod qos_overrides;
mod raw;
mod replies;
mod ros_args;
mod run;
mod service;
mod shutdown;
mod subscription;
mod supervisor;
mod type_description;
mod yaml;

pub use actions::{
    ActionClient, ActionPart, ActionServer, CancelReturn, GoalHandle, GoalId, GoalNews,
    GoalRequest, GoalStatus, RemoteGoal,
};
pub use builder::NodeBuilder;
pub use clock::Clock;
pub use diagnostics::{Diagnostics, Level, Report};
pub use ending::{Ending, Endings, Purpose};
pub use environment::Environment;
pub use error::{Error, Result};
pub use input_watch::InputWatch;
pub use lifecycle::LIFECYCLE_AUTOSTART;
pub use logging::fatal;
pub use middleware::BoundedAllocator;
pub use names::{NameKind, NodeIdentity, RemapRule, RemapTarget, short};
pub use node::Node;
pub use overflow::Overflow;
pub use parameters::{
    FromValue, Parameter, ParameterSet, ParameterType, Parameters, USE_SIM_TIME, Unit, Value,
};
pub use publisher::{Published, Publisher, PublisherStatistics};
pub use qos::{Qos, SENSOR_DEPTH};
pub use raw::{DiscoveredPublisher, Payload};
pub use ros_args::{LogLevelRule, RosArgs};
pub use ros2_client::Message;
pub use run::{run, run_with};
pub use service::{Client, RequestId, Service};
pub use shutdown::Shutdown;
pub use stream_monitor::StreamMonitor;
pub use subscription::{Subscription, SubscriptionStatistics};
