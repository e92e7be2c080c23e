//! Making the ends of an action.

use std::fmt::Display;

use ros2_client::action::{ActionClientQosPolicies, ActionServerQosPolicies};
use ros2_client::service::ServiceMapping;
use ros2_client::{ActionTypeName, Name};

use super::ActionPart;
use super::client::ActionClient;
use super::server::ActionServer;
use crate::error::{Error, Result};
use crate::node::{Node, spread, type_parts};
use crate::qos::{Profile, Qos, SERVICE};

impl Node {
    /// The serving end of an action; `type_name` is e.g. `control_msgs/action/FollowJointTrajectory`. A remapping of the
    /// action's name moves all its parts. It serves until the node ends, and rejects goals while the node is not active.
    /// A goal whose handle is dropped is aborted with the result `abandoned`, for a default may say something else: often
    /// that it was reached.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn action_server<G, R, F>(
        &self,
        name: &str,
        type_name: &str,
        abandoned: R,
    ) -> Result<ActionServer<G, R, F>>
    where
        G: ActionPart,
        R: ActionPart,
        F: ActionPart,
    {
        let service = || SERVICE.profile();
        let qos = ActionServerQosPolicies {
            goal_service: service(),
            result_service: service(),
            cancel_service: service(),
            feedback_publisher: Qos::reliable(10).profile(),
            status_publisher: Qos::latched(1).profile(),
        };
        let (ends, name) = self.action_end(name, type_name, |ros, name, kind| {
            ros.create_action_server(ServiceMapping::Enhanced, name, kind, qos)
        })?;
        Ok(ActionServer::start(self, ends, name, abandoned))
    }

    /// The serving end of an action that is a constant, see [`Self::action_server`].
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn serve_action<G, R, F>(
        &self,
        action: &ros2_interfaces::Action<G, R, F>,
        abandoned: R,
    ) -> Result<ActionServer<G, R, F>>
    where
        G: ActionPart,
        R: ActionPart,
        F: ActionPart,
    {
        self.action_server(action.name, action.type_name, abandoned)
    }

    /// The asking end of an action; `type_name` is e.g. `control_msgs/action/FollowJointTrajectory`.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn action_client<G, R, F>(
        &self,
        name: &str,
        type_name: &str,
    ) -> Result<ActionClient<G, R, F>>
    where
        G: ActionPart,
        R: ActionPart,
        F: ActionPart,
    {
        let service = || SERVICE.profile();
        let qos = ActionClientQosPolicies {
            goal_service: service(),
            result_service: service(),
            cancel_service: service(),
            feedback_subscription: Qos::reliable(100).profile(),
            status_subscription: Qos::latched(1).profile(),
        };
        let (ends, name) = self.action_end(name, type_name, |ros, name, kind| {
            ros.create_action_client(ServiceMapping::Enhanced, name, kind, qos)
        })?;
        Ok(ActionClient::start(self, ends, name))
    }

    fn action_end<End, E: Display>(
        &self,
        name: &str,
        type_name: &str,
        create: impl FnOnce(
            &mut ros2_client::Node,
            &Name,
            &ActionTypeName,
        ) -> std::result::Result<End, E>,
    ) -> Result<(End, String)> {
        let name = self.resolve_service(name)?;
        let failed = |reason: String| Error::Create {
            what: format!("action {name}"),
            reason,
        };
        let dds_name = Name::parse(&name).map_err(|error| failed(error.to_string()))?;
        let (package, kind) = type_parts(type_name, "action").map_err(failed)?;
        let kind = ActionTypeName::new(package, kind);
        // Only in front of the first part: ros2-client makes all eight in one call, whose parts nobody else can put together.
        spread();
        let end =
            create(&mut self.ros(), &dds_name, &kind).map_err(|error| failed(error.to_string()))?;
        Ok((end, name))
    }
}
