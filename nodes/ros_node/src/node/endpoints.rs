//! Publishers and subscriptions of a node.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use ros2_client::{Message, MessageTypeName, Name};
use ros2_interfaces::{Registry, RosMessage};
use rustdds::Topic;

use super::Node;
use crate::error::{Error, Result};
use crate::lifecycle::Gate;
use crate::publisher::Publisher;
use crate::qos::{Profile, Qos};
use crate::qos_overrides::{End, Overrides, overridden};
use crate::subscription::Subscription;

/// Time between two endpoints that are made.
const SPREAD: Duration = Duration::from_millis(3);

/// Lets RustDDS tell the network of the endpoint before. Its discovery thread does so with a lock held, and waits for its event loop
/// meanwhile; one more endpoint that is made in that moment can lock up all three for good (`docs/upstream/rustdds-lock-up.md`).
pub(crate) fn spread() {
    std::thread::sleep(SPREAD);
}

impl Node {
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
        self.publisher_of(topic, M::TYPE_NAME, qos, self.gate(), Overrides::None)
    }

    /// A publisher of a topic that is a constant; parameters may override its quality of service where it is
    /// [`ros2_interfaces::Topic::overridable`].
    ///
    /// # Errors
    /// As [`Self::publisher`].
    pub fn publish_on<M: RosMessage + Message>(
        &self,
        topic: &ros2_interfaces::Topic<M>,
    ) -> Result<Publisher<M>> {
        self.register_type::<M>()?;
        let overrides = topic.overridable.into();
        self.publisher_of(topic.name, M::TYPE_NAME, topic.qos, self.gate(), overrides)
    }

    /// As [`Self::publisher`], also while the node is not active.
    pub(crate) fn ungated_publisher<M: RosMessage + Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Publisher<M>> {
        self.register_type::<M>()?;
        self.publisher_of(topic, M::TYPE_NAME, qos, &Gate::opened(), Overrides::None)
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
        self.subscription_of(topic, M::TYPE_NAME, qos, self.gate(), Overrides::None)
    }

    /// A subscription of a topic that is a constant; what it keeps can be another number of samples than what the publisher
    /// keeps ([`ros2_interfaces::Topic::with_depth`]).
    ///
    /// # Errors
    /// As [`Self::subscription`].
    pub fn subscribe_on<M: RosMessage + Message>(
        &self,
        topic: &ros2_interfaces::Topic<M>,
    ) -> Result<Subscription<M>> {
        self.register_type::<M>()?;
        let overrides = topic.overridable.into();
        self.subscription_of(topic.name, M::TYPE_NAME, topic.qos, self.gate(), overrides)
    }

    /// As [`Self::subscribe_on`], also while the node is not active.
    pub(crate) fn ungated_subscription<M: RosMessage + Message>(
        &self,
        topic: &ros2_interfaces::Topic<M>,
    ) -> Result<Subscription<M>> {
        self.register_type::<M>()?;
        let overrides = topic.overridable.into();
        self.subscription_of(
            topic.name,
            M::TYPE_NAME,
            topic.qos,
            &Gate::opened(),
            overrides,
        )
    }

    /// Declares the parameters of a subscription that may be made later, or never: whoever gives values for them is understood
    /// in either case.
    ///
    /// # Errors
    /// [`Error::Name`], or [`Error::ParameterValue`] for a policy that makes no sense.
    pub(crate) fn announce_subscription<M>(&self, topic: &ros2_interfaces::Topic<M>) -> Result<()> {
        let name = self.resolve_topic(topic.name)?;
        overridden(self.parameters(), &name, End::Subscription, topic.qos).map(|_| ())
    }

    pub(crate) fn publisher_of<M: Message + Send + Sync + 'static>(
        &self,
        topic: &str,
        type_name: &str,
        qos: Qos,
        gate: &Gate,
        overrides: Overrides,
    ) -> Result<Publisher<M>> {
        let end = (End::Publisher, overrides);
        let (topic, qos, dds_topic) = self.topic(topic, type_name, qos, end)?;
        spread();
        let writer = self
            .ros()
            .create_publisher(&dds_topic, Some(qos.profile()))
            .map_err(|error| Error::Create {
                what: format!("a publisher of {topic}"),
                reason: error.to_string(),
            })?;
        let graph = Arc::clone(&self.shared.graph);
        let publisher = Publisher::new(writer, &topic, graph, gate.clone(), qos);
        if let Some(delivery) = publisher.deliver_present() {
            self.spawn(delivery);
        }
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
        overrides: Overrides,
    ) -> Result<Subscription<M>> {
        let end = (End::Subscription, overrides);
        let (topic, qos, dds_topic) = self.topic(topic, type_name, qos, end)?;
        spread();
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
        (end, overrides): (End, Overrides),
    ) -> Result<(String, Qos, Topic)> {
        let topic = self.resolve_topic(topic)?;
        let qos = match overrides {
            Overrides::Allowed => overridden(self.parameters(), &topic, end, qos)?,
            Overrides::None => qos,
        };
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
