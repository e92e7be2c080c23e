//! The node: everything that an executable needs of ROS, by one handle.

use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use ros2_client::{Context, Message, MessageTypeName, Name, NodeName, NodeOptions};
use ros2_interfaces::{Registry, RosMessage};
use rustdds::{DomainParticipant, Topic};
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::builder::Startup;
use crate::clock::Clock;
use crate::diagnostics::{Diagnostics, Level, Report};
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::lifecycle::{Gate, Lifecycle};
use crate::names::{NameKind, NodeIdentity, RemapRule, resolve};
use crate::parameters::{FromValue, HARDWARE_ID, Parameters, USE_SIM_TIME};
use crate::publisher::{Publisher, PublisherStatistics};
use crate::qos::Qos;
use crate::qos_overrides::{End, overridden};
use crate::shutdown::Shutdown;
use crate::subscription::{Subscription, SubscriptionStatistics};

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
            types,
        } = startup;
        let creating = |what: String| {
            move |error: &dyn std::fmt::Display| Error::Create {
                what,
                reason: error.to_string(),
            }
        };
        let participant = environment.participant()?;
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
                shutdown: Shutdown::default(),
                lifecycle: Lifecycle::new(),
                ready: watch::Sender::new(false),
                endpoints: Mutex::default(),
                tasks: Mutex::default(),
            }),
        };
        if !environment.static_peers.is_empty() {
            let peers = environment.static_peers.clone();
            node.spawn(crate::discovery::announce(participant.clone(), peers));
        }
        node.spawn(Arc::clone(&node.shared.graph).follow(participant));
        if ros_args.rosout {
            node.start_rosout()?;
        }
        crate::parameters::serve(&node)?;
        node.follow_clock();
        crate::type_description::serve(&node)?;
        if managed {
            crate::lifecycle::serve(&node)?;
        }
        node.start_diagnostics(managed)?;
        node.tasks().started = true;
        Ok(node)
    }

    fn follow_clock(&self) {
        let weak = |shared: &Arc<Shared>| {
            let shared = Arc::downgrade(shared);
            // The task must not keep the node alive.
            move || {
                Some(Self {
                    shared: shared.upgrade()?,
                })
            }
        };
        let (of_parameter, of_topic) = (weak(&self.shared), weak(&self.shared));
        let use_sim_time = move || {
            of_parameter().is_some_and(|node| node.parameter(USE_SIM_TIME).unwrap_or(false))
        };
        let subscribe = move || {
            let subscription = of_topic()?.ungated_subscription("/clock", Qos::best_effort(1));
            subscription
                .inspect_err(|error| tracing::error!("{error}"))
                .ok()
        };
        let changes = self.parameters().changes();
        self.spawn(
            self.clock()
                .clone()
                .follow(use_sim_time, changes, subscribe),
        );
    }

    fn start_rosout(&self) -> Result<()> {
        let Some(mut lines) = crate::logging::rosout_lines() else {
            return Ok(());
        };
        let qos = Qos {
            lifespan: Some(Duration::from_secs(10)),
            ..Qos::latched(1000)
        };
        let publisher = self.ungated_publisher("/rosout", qos)?;
        self.spawn(async move {
            while let Some(line) = lines.recv().await {
                publisher.publish(line);
            }
        });
        Ok(())
    }

    fn start_diagnostics(&self, managed: bool) -> Result<()> {
        let publisher = self.ungated_publisher("/diagnostics", Qos::reliable(10))?;
        if let Ok(hardware_id) = self.parameter::<String>(HARDWARE_ID) {
            self.diagnostics().set_hardware_id(&hardware_id);
        }
        // The tasks must not keep the node alive, so they hold weak handles.
        if managed {
            let shared = Arc::downgrade(&self.shared);
            self.shared.diagnostics.add_built_in("lifecycle", move || {
                shared.upgrade().map_or_else(
                    || Report::stale("the node has ended"),
                    |shared| {
                        let state = shared.lifecycle.label();
                        Report::ok(&state).with("state", state)
                    },
                )
            });
        }
        let shared = Arc::downgrade(&self.shared);
        self.shared.diagnostics.add_built_in("topics", move || {
            shared.upgrade().map_or_else(
                || Report::stale("the node has ended"),
                |shared| shared.topics_report(),
            )
        });
        let diagnostics = self.shared.diagnostics.clone();
        self.spawn(diagnostics.run(
            self.shared.identity.name.clone(),
            self.shared.clock.clone(),
            self.gate().clone(),
            publisher,
        ));
        Ok(())
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

    /// Makes a type known to `~/get_type_description`. Publishers and subscriptions do it for theirs; to be called for
    /// types that are known by name only ([`Self::raw_publisher`]).
    ///
    /// # Errors
    /// [`Error::Type`]: another type of this name is there, or its hash is not that of its definition.
    pub fn register_type<M: RosMessage>(&self) -> Result<()> {
        // A registration that panicked has added nothing.
        let mut types = self
            .shared
            .types
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        Ok(types.register::<M>()?)
    }

    /// The types that this node knows by name.
    pub(crate) fn types(&self) -> Arc<Mutex<Registry>> {
        Arc::clone(&self.shared.types)
    }

    /// A publisher of messages of type `M`.
    ///
    /// # Errors
    /// [`Error::Name`], [`Error::Type`] or [`Error::Create`].
    pub fn publisher<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Publisher<M>> {
        self.register_type::<M>()?;
        self.publisher_of(topic, M::TYPE_NAME, qos, self.gate())
    }

    /// As [`Self::publisher`], also while the node is not active.
    pub(crate) fn ungated_publisher<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Publisher<M>> {
        self.register_type::<M>()?;
        self.publisher_of(topic, M::TYPE_NAME, qos, &Gate::opened())
    }

    /// A subscription of messages of type `M`.
    ///
    /// # Errors
    /// [`Error::Name`], [`Error::Type`] or [`Error::Create`].
    pub fn subscription<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Subscription<M>> {
        self.register_type::<M>()?;
        self.subscription_of(topic, M::TYPE_NAME, qos, self.gate())
    }

    /// As [`Self::subscription`], also while the node is not active.
    pub(crate) fn ungated_subscription<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Subscription<M>> {
        self.register_type::<M>()?;
        self.subscription_of(topic, M::TYPE_NAME, qos, &Gate::opened())
    }

    pub(crate) fn publisher_of<M: Message>(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
        gate: &Gate,
    ) -> Result<Publisher<M>> {
        let (topic, qos, dds_topic) = self.topic(topic, type_name, qos, End::Publisher)?;
        let writer = self
            .ros()
            .create_publisher(&dds_topic, Some(qos.profile()))
            .map_err(|error| Error::Create {
                what: format!("a publisher of {topic}"),
                reason: error.to_string(),
            })?;
        let graph = Arc::clone(&self.shared.graph);
        let publisher = Publisher::new(writer, &topic, graph, gate.clone());
        self.endpoints()
            .publishers
            .push(Arc::downgrade(&publisher.statistics()));
        Ok(publisher)
    }

    pub(crate) fn subscription_of<M: Message + 'static>(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
        gate: &Gate,
    ) -> Result<Subscription<M>> {
        let (topic, qos, dds_topic) = self.topic(topic, type_name, qos, End::Subscription)?;
        let reader = self
            .ros()
            .create_subscription(&dds_topic, Some(qos.profile()))
            .map_err(|error| Error::Create {
                what: format!("a subscription of {topic}"),
                reason: error.to_string(),
            })?;
        let ros = Arc::clone(&self.shared.ros);
        let subscription = Subscription::new(
            reader,
            ros,
            dds_topic,
            &topic,
            qos,
            Arc::clone(&self.shared.graph),
            gate.clone(),
        );
        self.endpoints()
            .subscriptions
            .push(Arc::downgrade(&subscription.statistics()));
        Ok(subscription)
    }

    /// Absolute name, quality of service with its overrides, and the topic itself.
    fn topic(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
        end: End,
    ) -> Result<(String, Qos, Topic)> {
        let topic = self.resolve_topic(topic)?;
        let qos = overridden(self.parameters(), &topic, end, qos)?;
        let failed = |reason: String| Error::Create {
            what: format!("topic {topic}"),
            reason,
        };
        let name = Name::parse(&topic).map_err(|error| failed(error.to_string()))?;
        let (package, kind) = type_parts(type_name, "msg").map_err(failed)?;
        let dds_topic = self
            .ros()
            .create_topic(&name, MessageTypeName::new(package, kind), &qos.profile())
            .map_err(|error| failed(error.to_string()))?;
        Ok((topic, qos, dds_topic))
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
        self.diagnostics().clear();
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

impl Shared {
    /// The built-in diagnostics task: what got lost between us and others.
    fn topics_report(&self) -> Report {
        let endpoints = self
            .endpoints
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let mut report = Report::ok("nothing lost, everybody compatible");
        for publisher in endpoints.publishers.iter().filter_map(Weak::upgrade) {
            if publisher.dropped() > 0 {
                report = report
                    .worsened(
                        Level::Warn,
                        &format!(
                            "{}: {} messages dropped",
                            publisher.topic(),
                            publisher.dropped()
                        ),
                    )
                    .with(
                        &format!("{} dropped", publisher.topic()),
                        publisher.dropped(),
                    );
            }
        }
        for subscription in endpoints.subscriptions.iter().filter_map(Weak::upgrade) {
            let (topic, lost, bad) = (
                subscription.topic(),
                subscription.lost(),
                subscription.undecodable(),
            );
            // Of the clock only the newest sample counts, and best effort with depth 1 is its rule.
            if lost > 0 && topic != "/clock" {
                report = report
                    .worsened(Level::Warn, &format!("{topic}: {lost} messages lost"))
                    .with(&format!("{topic} lost"), lost);
            }
            if bad > 0 {
                report = report
                    .worsened(
                        Level::Error,
                        &format!("{topic}: {bad} messages of another form"),
                    )
                    .with(&format!("{topic} undecodable"), bad);
            }
        }
        for (topic, why) in self.graph.incompatible() {
            report = report
                .worsened(Level::Error, &format!("{topic}: {why}"))
                .with(&format!("{topic} incompatible"), why);
        }
        report
    }
}

/// Package and name of `package/msg/Name`.
pub(crate) fn type_parts<'a>(
    type_name: &'a str,
    middle: &str,
) -> Result<(&'a str, &'a str), String> {
    let mut parts = type_name.split('/');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(package), Some(found), Some(name), None) if found == middle => Ok((package, name)),
        _ => Err(format!(
            "'{type_name}' is no type name of the form package/{middle}/Name"
        )),
    }
}
