//! The node: everything that an executable needs of ROS, by one handle.

mod built_in;
mod endpoints;
mod services;

use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use ros2_client::{Context, NodeName, NodeOptions};
use ros2_interfaces::Registry;
use rustdds::DomainParticipant;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::builder::Startup;
use crate::clock::Clock;
use crate::diagnostics::Diagnostics;
use crate::ending::{Endings, Parties};
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::lifecycle::{Gate, Lifecycle};
use crate::names::{NameKind, NodeIdentity, RemapRule, resolve};
use crate::overflow::Overflow;
use crate::parameters::{FromValue, Parameters, USE_SIM_TIME};
use crate::publisher::PublisherStatistics;
use crate::shutdown::Shutdown;
use crate::subscription::SubscriptionStatistics;

/// Time in which whatever was missed is asked for and repeated. RustDDS would say when all is acknowledged, but ros2-client has no way to
/// ask it (`docs/upstream/ros2-client-acknowledgements.md`). Its writers ask their readers once a second, and ten times a second while
/// they know that one is behind, so this is the second and twenty rounds, of which each brings what a socket holds.
const REPEATS: Duration = Duration::from_secs(3);

/// A node. Clones are handles of the same node.
#[derive(Clone, Debug)]
pub struct Node {
    shared: Arc<Shared>,
}

struct Shared {
    identity: NodeIdentity,
    original_name: String,
    remaps: Vec<RemapRule>,
    types: Arc<Mutex<Registry>>,
    arguments: Vec<String>,
    parameters: Parameters,
    ros: Arc<Mutex<ros2_client::Node>>,
    graph: Arc<Graph>,
    clock: Clock,
    diagnostics: Diagnostics,
    shutdown: Shutdown,
    lifecycle: Lifecycle,
    ready: watch::Sender<bool>,
    endpoints: Mutex<Endpoints>,
    overflows: Mutex<Vec<Overflow>>,
    parties: Parties,
    tasks: Mutex<Tasks>,
    // Dropped last: endpoints that outlive their participant complain.
    participant: DomainParticipant,
}

/// Tasks that end with the node.
#[derive(Default)]
struct Tasks {
    /// Those of the node itself.
    built_in: Vec<JoinHandle<()>>,
    /// Those of its main function.
    main: Vec<JoinHandle<()>>,
    /// The main function has the word.
    started: bool,
}

/// What the diagnostics watch.
#[derive(Default)]
struct Endpoints {
    publishers: Vec<Weak<PublisherStatistics>>,
    subscriptions: Vec<Weak<SubscriptionStatistics>>,
}

impl Shared {
    // Lists are changed in single steps, so a panic elsewhere leaves them whole.
    fn overflows(&self) -> MutexGuard<'_, Vec<Overflow>> {
        self.overflows
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Node")
            .field("identity", &self.identity)
            .finish_non_exhaustive()
    }
}

impl Node {
    /// Joins the domain and starts the node's own tasks: graph, clock, parameter services, diagnostics, `/rosout`.
    /// To be called within a tokio runtime.
    pub(crate) fn start(startup: Startup) -> Result<Self> {
        let Startup {
            identity,
            original_name,
            ros_args,
            parameters,
            environment,
            managed,
            limits: _,
            types,
            shutdown,
            ready,
        } = startup;
        let creating = |what: String| {
            move |error: &dyn std::fmt::Display| Error::Create {
                what,
                reason: error.to_string(),
            }
        };
        let participant = environment.participant()?;
        crate::discovery::meet(&participant);
        let name = NodeName::new(&identity.namespace, &identity.name)
            .map_err(|error| creating(identity.fully_qualified())(&error))?;
        let context = Context::from_domain_participant(participant.clone())
            .map_err(|error| creating("the ROS context".to_owned())(&error))?;
        let options = NodeOptions::new()
            .enable_rosout(false)
            .start_parameter_services(false);
        let ros = context
            .new_node(name, options)
            .map_err(|error| creating(identity.fully_qualified())(&error))?;
        let clock = Clock::new(parameters.get(USE_SIM_TIME)?);
        let node = Self {
            shared: Arc::new(Shared {
                identity,
                original_name,
                remaps: ros_args.remaps,
                types: Arc::new(Mutex::new(types)),
                arguments: ros_args.others,
                parameters,
                participant: participant.clone(),
                ros: Arc::new(Mutex::new(ros)),
                graph: Graph::new(),
                clock: clock.clone(),
                diagnostics: Diagnostics::default(),
                shutdown,
                lifecycle: Lifecycle::new(),
                ready,
                endpoints: Mutex::default(),
                overflows: Mutex::default(),
                parties: Parties::default(),
                tasks: Mutex::default(),
            }),
        };
        if !environment.static_peers.is_empty() {
            let peers = environment.static_peers.clone();
            node.spawn(crate::discovery::announce(participant.clone(), peers));
        }
        let departures =
            crate::discovery::departures::watch(participant.clone(), environment.clone());
        node.spawn(departures);
        crate::node_names::follow(&node, &participant)?;
        node.spawn(Arc::clone(&node.shared.graph).follow(participant));
        if ros_args.rosout {
            node.start_rosout()?;
        }
        crate::parameters::serve(&node)?;
        node.follow_clock()?;
        crate::type_description::serve(&node)?;
        if managed {
            crate::lifecycle::serve(&node)?;
        }
        node.start_diagnostics(managed)?;
        node.tasks().started = true;
        Ok(node)
    }

    /// Name without namespace, after remapping.
    pub fn name(&self) -> &str {
        &self.shared.identity.name
    }

    /// `/namespace/name`, after remapping.
    pub fn fully_qualified_name(&self) -> String {
        self.shared.identity.fully_qualified()
    }

    /// Arguments of the command line outside of `--ros-args`.
    pub fn arguments(&self) -> &[String] {
        &self.shared.arguments
    }

    /// The parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.shared.parameters
    }

    /// Value of a declared parameter.
    ///
    /// # Errors
    /// [`Error::NotDeclared`].
    pub fn parameter<T: FromValue>(&self, name: &str) -> Result<T> {
        self.shared.parameters.get(name)
    }

    /// The clock: system time, or `/clock` with `use_sim_time`.
    pub fn clock(&self) -> &Clock {
        &self.shared.clock
    }

    /// Now, in nanoseconds, by [`Self::clock`].
    pub fn now_nanos(&self) -> i64 {
        self.shared.clock.now_nanos()
    }

    /// The diagnostics, for adding tasks.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.shared.diagnostics
    }

    /// Absolute name of a topic after remapping.
    ///
    /// # Errors
    /// [`Error::Name`].
    pub fn resolve_topic(&self, name: &str) -> Result<String> {
        self.resolve(NameKind::Topic, name)
    }

    /// Absolute name of a service after remapping.
    ///
    /// # Errors
    /// [`Error::Name`].
    pub fn resolve_service(&self, name: &str) -> Result<String> {
        self.resolve(NameKind::Service, name)
    }

    fn resolve(&self, kind: NameKind, name: &str) -> Result<String> {
        let shared = &self.shared;
        resolve(
            &shared.identity,
            &shared.original_name,
            &shared.remaps,
            kind,
            name,
        )
    }

    /// Runs a task until it is done or the node ends (a managed one: is cleaned up), which stops it at its next await.
    pub fn spawn(&self, task: impl Future<Output = ()> + Send + 'static) {
        let mut tasks = self.tasks();
        let tasks = if tasks.started {
            &mut tasks.main
        } else {
            &mut tasks.built_in
        };
        tasks.retain(|task| !task.is_finished());
        tasks.push(tokio::spawn(task));
    }

    /// Waits as long as reliable subscribers may need to ask again for what they missed of the last messages: who publishes and then
    /// ends waits here first, for an ended writer repeats nothing.
    pub async fn repeat_what_was_missed(&self) {
        tokio::time::sleep(REPEATS).await;
    }

    /// Completes when the node is to end: SIGINT, SIGTERM, or [`Self::request_shutdown`].
    pub async fn shutdown(&self) {
        self.shared.shutdown.requested().await;
    }

    /// Whether the node is to end.
    pub fn is_shutdown_requested(&self) -> bool {
        self.shared.shutdown.is_requested()
    }

    /// Asks the node to end.
    pub fn request_shutdown(&self) {
        self.shared.shutdown.request();
    }

    /// Says that the start is over: what fails from now on is a failure at work (exit status 1 of [`crate::run`]),
    /// no longer unusable input (exit status 2). Of a managed node this is the end of `configure`.
    pub fn set_ready(&self) {
        for error in self.parameters().undeclared() {
            tracing::error!("{error}");
        }
        self.shared.ready.send_replace(true);
    }

    pub(crate) fn is_ready(&self) -> bool {
        *self.shared.ready.borrow()
    }

    pub(crate) async fn ready(&self) {
        let mut ready = self.shared.ready.subscribe();
        // The sender lives in `self`, so that waiting can only end by its being ready.
        ready.wait_for(|ready| *ready).await.ok();
    }

    /// Waits until the node is active; at once in one that is not managed.
    pub async fn active(&self) {
        self.gate().opens().await;
    }

    /// Whether the node is active; always, in one that is not managed.
    pub fn is_active(&self) -> bool {
        self.gate().is_open()
    }

    pub(crate) fn lifecycle(&self) -> &Lifecycle {
        &self.shared.lifecycle
    }

    pub(crate) fn gate(&self) -> &Gate {
        self.shared.lifecycle.gate()
    }

    /// Drops what the main function has left behind: its tasks, with the endpoints they hold, and its diagnostics.
    pub(crate) async fn clean_up(&self) {
        self.shared.ready.send_replace(false);
        let tasks = std::mem::take(&mut self.tasks().main);
        end(tasks).await;
        self.shared.parties.forget();
        self.diagnostics().clear();
    }

    /// What is to be put in order before the node stops being active: the endings, each of which waits up to `limit` for this
    /// main function.
    pub fn endings(&self, limit: Duration) -> Endings {
        self.shared.parties.join(limit)
    }

    pub(crate) fn parties(&self) -> &Parties {
        &self.shared.parties
    }

    /// Lets the diagnostics tell what a queue had no room for, as long as somebody else holds the counter.
    pub fn watch_overflow(&self, overflow: &Overflow) {
        let mut overflows = self.shared.overflows();
        overflows.retain(Overflow::is_shared);
        overflows.push(overflow.clone());
    }

    pub(crate) fn graph(&self) -> Arc<Graph> {
        Arc::clone(&self.shared.graph)
    }

    pub(crate) fn participant(&self) -> DomainParticipant {
        self.shared.participant.clone()
    }

    pub(crate) fn shutdown_handle(&self) -> &Shutdown {
        &self.shared.shutdown
    }

    /// Stops the node's tasks, so that their endpoints leave the graph.
    pub(crate) async fn stop_tasks(&self) {
        let tasks = std::mem::take(&mut *self.tasks());
        end(tasks.main).await;
        end(tasks.built_in).await;
    }

    // Lists are changed in single steps, so a panic elsewhere leaves them whole.
    fn tasks(&self) -> MutexGuard<'_, Tasks> {
        self.shared
            .tasks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    // Creating an endpoint that panics leaves the node of ros2-client usable.
    pub(crate) fn ros(&self) -> MutexGuard<'_, ros2_client::Node> {
        self.shared
            .ros
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn endpoints(&self) -> MutexGuard<'_, Endpoints> {
        self.shared
            .endpoints
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Stops tasks and waits until they are gone.
async fn end(tasks: Vec<JoinHandle<()>>) {
    tasks.iter().for_each(JoinHandle::abort);
    for task in tasks {
        // Cancelled is what was asked for; a panic has been told by the panic hook.
        task.await.ok();
    }
}

pub(crate) use endpoints::{spread, type_parts};
