//! Topics, services and actions as typed constants: name, type, quality of service, who is at which end.
//!
//! A program keeps one list of them; nodes publish, subscribe and serve by its constants, and tools and documents read
//! its rows.

use std::marker::PhantomData;

use crate::{Qos, RosMessage};

/// A topic that carries messages of type `M`.
///
/// ```
/// use ros2_interfaces::{Qos, Topic, sensor_msgs::Imu};
///
/// const IMU: Topic<Imu> = Topic::new("imu/data", Qos::sensor(), "driver", "filter", "Samples");
/// assert_eq!(IMU.with_depth(10).qos, Qos::reliable(10));
/// assert_eq!(IMU.within("/ship"), "/ship/imu/data");
/// assert_eq!(IMU.row().type_name, "sensor_msgs/msg/Imu");
/// ```
#[derive(Debug)]
pub struct Topic<M> {
    /// As it is before remapping: relative names follow the namespace of the node.
    pub name: &'static str,
    /// What a publisher offers; subscriptions of another depth say so by [`Self::with_depth`].
    pub qos: Qos,
    /// Who publishes.
    pub from: &'static str,
    /// Who subscribes.
    pub to: &'static str,
    /// What it carries, in a line.
    pub about: &'static str,
    /// Whether parameters of a node may override its quality of service: streams, whose rate and place a system chooses. What
    /// commands, events and latched states offer is part of what they mean.
    pub overridable: bool,
    message: PhantomData<fn() -> M>,
}

// Not derived: a message need not be copied for its topic to be.
impl<M> Clone for Topic<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Topic<M> {}

impl<M> Topic<M> {
    /// A topic of this name.
    pub const fn new(
        name: &'static str,
        qos: Qos,
        from: &'static str,
        to: &'static str,
        about: &'static str,
    ) -> Self {
        Self {
            name,
            qos,
            from,
            to,
            about,
            overridable: false,
            message: PhantomData,
        }
    }

    /// The same, with a quality of service that parameters may override.
    #[must_use]
    pub const fn overridable(mut self) -> Self {
        self.overridable = true;
        self
    }

    /// The same for an end that keeps another number of samples.
    #[must_use]
    pub const fn with_depth(mut self, depth: usize) -> Self {
        self.qos = self.qos.with_depth(depth);
        self
    }

    /// The absolute name in a namespace; empty: the root.
    pub fn within(&self, namespace: &str) -> String {
        absolute(namespace, self.name)
    }
}

impl<M: RosMessage> Topic<M> {
    /// For lists that hold topics of every type.
    pub const fn row(&self) -> Interface {
        Interface {
            kind: InterfaceKind::Topic(self.qos),
            name: self.name,
            type_name: M::TYPE_NAME,
            from: self.from,
            to: self.to,
            about: self.about,
        }
    }
}

/// A service with requests `Q` and answers `A`.
#[derive(Debug)]
pub struct Service<Q, A> {
    /// As it is before remapping; `~` is the node that serves it.
    pub name: &'static str,
    /// Full name of the type, e.g. `std_srvs/srv/Trigger`.
    pub type_name: &'static str,
    /// Who serves it.
    pub server: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    parts: PhantomData<fn(Q) -> A>,
}

impl<Q, A> Clone for Service<Q, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Q, A> Copy for Service<Q, A> {}

impl<Q, A> Service<Q, A> {
    /// A service of this name.
    pub const fn new(
        name: &'static str,
        type_name: &'static str,
        server: &'static str,
        about: &'static str,
    ) -> Self {
        Self {
            name,
            type_name,
            server,
            about,
            parts: PhantomData,
        }
    }

    /// For lists that hold services of every type.
    pub const fn row(&self) -> Interface {
        Interface {
            kind: InterfaceKind::Service,
            name: self.name,
            type_name: self.type_name,
            from: "",
            to: self.server,
            about: self.about,
        }
    }
}

/// An action with goals `G`, results `R` and feedback `F`.
#[derive(Debug)]
pub struct Action<G, R, F> {
    /// As it is before remapping; `~` is the node that serves it.
    pub name: &'static str,
    /// Full name of the type, e.g. `control_msgs/action/FollowJointTrajectory`.
    pub type_name: &'static str,
    /// Who asks, where it is one of us.
    pub client: &'static str,
    /// Who serves it.
    pub server: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    #[allow(
        clippy::type_complexity,
        reason = "a mark that only carries the three types"
    )]
    parts: PhantomData<fn(G) -> (R, F)>,
}

impl<G, R, F> Clone for Action<G, R, F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<G, R, F> Copy for Action<G, R, F> {}

impl<G, R, F> Action<G, R, F> {
    /// An action of this name.
    pub const fn new(
        name: &'static str,
        type_name: &'static str,
        client: &'static str,
        server: &'static str,
        about: &'static str,
    ) -> Self {
        Self {
            name,
            type_name,
            client,
            server,
            about,
            parts: PhantomData,
        }
    }

    /// For lists that hold actions of every type.
    pub const fn row(&self) -> Interface {
        Interface {
            kind: InterfaceKind::Action,
            name: self.name,
            type_name: self.type_name,
            from: self.client,
            to: self.server,
            about: self.about,
        }
    }
}

/// What an interface is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InterfaceKind {
    /// With what its publishers offer.
    Topic(Qos),
    /// Of requests and answers.
    Service,
    /// Of goals.
    Action,
}

/// A topic, service or action without its Rust types, for tools and documents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// What it is.
    pub kind: InterfaceKind,
    /// As it is before remapping.
    pub name: &'static str,
    /// Full name of its type.
    pub type_name: &'static str,
    /// Who publishes or asks; empty: anybody.
    pub from: &'static str,
    /// Who subscribes or serves.
    pub to: &'static str,
    /// What it carries or does, in a line.
    pub about: &'static str,
}

impl Interface {
    /// The absolute name in a namespace; empty: the root.
    pub fn within(&self, namespace: &str) -> String {
        absolute(namespace, self.name)
    }
}

fn absolute(namespace: &str, name: &str) -> String {
    if name.starts_with('/') {
        name.to_owned()
    } else {
        format!("{namespace}/{name}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rosgraph_msgs::Clock;

    /// A relative name follows the namespace, an absolute one does not.
    #[test]
    fn names_in_a_namespace() {
        let topic = |name| Topic::<Clock>::new(name, Qos::best_effort(1), "", "", "");
        assert_eq!(topic("fix").within(""), "/fix");
        assert_eq!(topic("fix").within("/ship"), "/ship/fix");
        assert_eq!(topic("/clock").within("/ship"), "/clock");
        assert_eq!(topic("fix").row().within("/ship"), "/ship/fix");
    }
}
