//! The node: everything that an executable needs of ROS, by one handle.

use std::future::Future;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use ros2_client::{Context, Message, MessageTypeName, Name, NodeName, NodeOptions};
use rotary_sins_msgs::RosMessage;
use rustdds::{DomainParticipant, Topic};
use tokio::task::JoinHandle;

use crate::builder::Startup;
use crate::clock::Clock;
use crate::diagnostics::{Diagnostics, Level, Report};
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::names::{NameKind, NodeIdentity, RemapRule, resolve};
use crate::parameters::{FromValue, Parameters, USE_SIM_TIME};
use crate::publisher::{Publisher, PublisherStatistics};
use crate::qos::Qos;
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
    arguments: Vec<String>,
    parameters: Parameters,
    ros: Arc<Mutex<ros2_client::Node>>,
    graph: Arc<Graph>,
    clock: Clock,
    diagnostics: Diagnostics,
    shutdown: Shutdown,
    ready: AtomicBool,
    endpoints: Mutex<Endpoints>,
    tasks: Mutex<Vec<JoinHandle<()>>>,
    // Dropped last: endpoints that outlive their participant complain.
    participant: DomainParticipant,
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
                arguments: ros_args.others,
                parameters,
                participant: participant.clone(),
                ros: Arc::new(Mutex::new(ros)),
                graph: Graph::new(),
                clock: clock.clone(),
                diagnostics: Diagnostics::default(),
                shutdown: Shutdown::default(),
                ready: AtomicBool::new(false),
                endpoints: Mutex::default(),
                tasks: Mutex::default(),
            }),
        };
        node.spawn(Arc::clone(&node.shared.graph).follow(participant));
        if clock.is_simulated() {
            node.spawn(clock.follow(node.subscription("/clock", Qos::best_effort(1))?));
        }
        if ros_args.rosout {
            node.start_rosout()?;
        }
        crate::parameters::serve(&node)?;
        node.start_diagnostics()?;
        Ok(node)
    }

    fn start_rosout(&self) -> Result<()> {
        let Some(mut lines) = crate::logging::rosout_lines() else {
            return Ok(());
        };
        let qos = Qos {
            lifespan: Some(Duration::from_secs(10)),
            ..Qos::latched(1000)
        };
        let publisher = self.publisher("/rosout", qos)?;
        self.spawn(async move {
            while let Some(line) = lines.recv().await {
                publisher.publish(line);
            }
        });
        Ok(())
    }

    fn start_diagnostics(&self) -> Result<()> {
        let publisher = self.publisher("/diagnostics", Qos::reliable(10))?;
        // The task must not keep the node alive, so it holds a weak handle.
        let shared = Arc::downgrade(&self.shared);
        self.shared.diagnostics.add("topics", move || {
            shared.upgrade().map_or_else(
                || Report::stale("the node has ended"),
                |shared| shared.topics_report(),
            )
        });
        let diagnostics = self.shared.diagnostics.clone();
        self.spawn(diagnostics.run(
            self.shared.identity.name.clone(),
            self.shared.clock.clone(),
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

    /// A publisher of messages of type `M`.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn publisher<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Publisher<M>> {
        self.publisher_of(topic, M::TYPE_NAME, qos)
    }

    /// A subscription of messages of type `M`.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn subscription<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Subscription<M>> {
        self.subscription_of(topic, M::TYPE_NAME, qos)
    }

    pub(crate) fn publisher_of<M: Message>(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
    ) -> Result<Publisher<M>> {
        let (topic, dds_topic) = self.topic(topic, type_name, qos)?;
        let writer = self
            .ros()
            .create_publisher(&dds_topic, Some(qos.profile()))
            .map_err(|error| Error::Create {
                what: format!("a publisher of {topic}"),
                reason: error.to_string(),
            })?;
        let publisher = Publisher::new(writer, &topic, Arc::clone(&self.shared.graph));
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
    ) -> Result<Subscription<M>> {
        let (topic, dds_topic) = self.topic(topic, type_name, qos)?;
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
        );
        self.endpoints()
            .subscriptions
            .push(Arc::downgrade(&subscription.statistics()));
        Ok(subscription)
    }

    fn topic(&self, topic: &str, type_name: &str, qos: Qos) -> Result<(String, Topic)> {
        let topic = self.resolve_topic(topic)?;
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
        Ok((topic, dds_topic))
    }

    /// Runs a task until it is done or the node ends, which stops it at its next await.
    pub fn spawn(&self, task: impl Future<Output = ()> + Send + 'static) {
        let mut tasks = self
            .shared
            .tasks
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
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
    /// no longer unusable input (exit status 2).
    pub fn set_ready(&self) {
        self.shared.ready.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_ready(&self) -> bool {
        self.shared.ready.load(Ordering::Relaxed)
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
        let tasks = std::mem::take(
            &mut *self
                .shared
                .tasks
                .lock()
                .unwrap_or_else(PoisonError::into_inner),
        );
        tasks.iter().for_each(JoinHandle::abort);
        for task in tasks {
            // Cancelled is what was asked for; a panic has been told by the panic hook.
            task.await.ok();
        }
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
