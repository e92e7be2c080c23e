//! Services of a node: making the answering and the asking end.

use std::fmt::Display;

use ros2_client::service::ServiceMapping;
use ros2_client::{Message, Name, QosProfile, ServiceTypeName};
use ros2_interfaces::std_srvs::{TRIGGER, TriggerRequest, TriggerResponse};

use super::endpoints::spread;
use super::{Node, type_parts};
use crate::error::{Error, Result};
use crate::qos::{Profile, SERVICE};
use crate::service::{Client, Service};

impl Node {
    /// The answering end of a service; `type_name` is e.g. `std_srvs/srv/Trigger`.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn service<Request, Response>(
        &self,
        name: &str,
        type_name: &str,
    ) -> Result<Service<Request, Response>>
    where
        Request: Message + Clone + 'static,
        Response: Message + Clone + 'static,
    {
        let (server, name) =
            self.service_end(name, type_name, |ros, mapping, name, kind, qos| {
                ros.create_server(mapping, name, kind, qos.clone(), qos)
            })?;
        let service = Service::new(server, name);
        self.watch_overflow(service.overflow());
        Ok(service)
    }

    /// Answers every request of a service by `handler`, until the node ends. The handler must not block for long;
    /// where answering takes time, use [`Self::service`].
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn serve<Request, Response>(
        &self,
        name: &str,
        type_name: &str,
        mut handler: impl FnMut(Request) -> Response + Send + 'static,
    ) -> Result<()>
    where
        Request: Message + Clone + Send + Sync + 'static,
        Response: Message + Clone + Send + Sync + 'static,
    {
        let service = self.service::<Request, Response>(name, type_name)?;
        self.spawn(async move {
            loop {
                let (id, request) = service.recv().await;
                let response = handler(request);
                service.respond(id, response);
            }
        });
        Ok(())
    }

    /// Answers a service of `std_srvs/srv/Trigger` that is a constant by `handler`, see [`Self::serve`].
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn serve_trigger(
        &self,
        service: &ros2_interfaces::Service<TriggerRequest, TriggerResponse>,
        mut handler: impl FnMut() -> TriggerResponse + Send + 'static,
    ) -> Result<()> {
        self.serve(service.name, TRIGGER, move |_: TriggerRequest| handler())
    }

    /// As [`Self::serve_trigger`]; a node that is not active refuses, for what the handler would publish could not leave it.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn serve_trigger_while_active(
        &self,
        service: &ros2_interfaces::Service<TriggerRequest, TriggerResponse>,
        mut handler: impl FnMut() -> TriggerResponse + Send + 'static,
    ) -> Result<()> {
        let gate = self.gate().clone();
        self.serve_trigger(service, move || {
            if gate.is_open() {
                handler()
            } else {
                TriggerResponse {
                    success: false,
                    message: "the node is not active".to_owned(),
                }
            }
        })
    }

    /// The asking end of a service; `type_name` is e.g. `std_srvs/srv/Trigger`.
    ///
    /// # Errors
    /// [`Error::Name`] or [`Error::Create`].
    pub fn client<Request, Response>(
        &self,
        name: &str,
        type_name: &str,
    ) -> Result<Client<Request, Response>>
    where
        Request: Message + Clone + 'static,
        Response: Message + Clone + 'static,
    {
        let (client, name) =
            self.service_end(name, type_name, |ros, mapping, name, kind, qos| {
                ros.create_client(mapping, name, kind, qos.clone(), qos)
            })?;
        Ok(Client::new(client, self.participant(), self.graph(), name))
    }

    /// One end of a service, made by `create`, and the absolute name of the service.
    fn service_end<End, E: Display>(
        &self,
        name: &str,
        type_name: &str,
        create: impl FnOnce(
            &mut ros2_client::Node,
            ServiceMapping,
            &Name,
            &ServiceTypeName,
            QosProfile,
        ) -> std::result::Result<End, E>,
    ) -> Result<(End, String)> {
        let name = self.resolve_service(name)?;
        let failed = |reason: String| Error::Create {
            what: format!("service {name}"),
            reason,
        };
        let dds_name = Name::parse(&name).map_err(|error| failed(error.to_string()))?;
        let (package, kind) = type_parts(type_name, "srv").map_err(failed)?;
        let kind = ServiceTypeName::new(package, kind);
        let qos = SERVICE.profile();
        spread();
        let end = create(
            &mut self.ros(),
            ServiceMapping::Enhanced,
            &dds_name,
            &kind,
            qos,
        )
        .map_err(|error| failed(error.to_string()))?;
        Ok((end, name))
    }
}
