//! Services: the answering and the asking end.

use std::sync::Arc;
use std::time::Duration;

use ros2_client::{Message, RmwRequestId, Server};
use rustdds::DomainParticipant;

use crate::error::{Error, Result};

/// Answers requests of one service.
pub struct Service<Request: Message, Response: Message> {
    server: Server<Request, Response>,
    name: String,
}

impl<Request: Message, Response: Message> std::fmt::Debug for Service<Request, Response> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Service")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

/// Identifies whom an answer is for.
#[derive(Clone, Copy, Debug)]
pub struct RequestId(RmwRequestId);

impl<Request, Response> Service<Request, Response>
where
    Request: Message + Clone + 'static,
    Response: Message + Clone + 'static,
{
    pub(crate) fn new(server: Server<Request, Response>, name: String) -> Self {
        Self { server, name }
    }

    /// The next request. One that cannot be read is logged and passed over.
    pub async fn recv(&self) -> (RequestId, Request) {
        loop {
            match self.server.async_receive_request().await {
                Ok((id, request)) => return (RequestId(id), request),
                Err(error) => tracing::error!("{}: a request cannot be read: {error}", self.name),
            }
        }
    }

    /// Answers a request; a failure is logged here.
    pub async fn respond(&self, request: RequestId, response: Response) {
        if let Err(error) = self.server.async_send_response(request.0, response).await {
            tracing::error!("{}: the answer cannot be sent: {error:?}", self.name);
        }
    }

    /// Absolute name of the service.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Asks one service.
pub struct Client<Request: Message, Response: Message> {
    client: Arc<ros2_client::Client<Request, Response>>,
    participant: DomainParticipant,
    name: String,
}

impl<Request: Message, Response: Message> std::fmt::Debug for Client<Request, Response> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Client")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

/// How often discovery is asked whether a server is there.
const DISCOVERY_POLL: Duration = Duration::from_millis(20);
/// Time for the server to find our reader of answers after we have found the server; a volatile answer sent earlier
/// would be lost.
const SETTLE: Duration = Duration::from_millis(200);

impl<Request, Response> Client<Request, Response>
where
    Request: Message + Clone + 'static,
    Response: Message + Clone + 'static,
{
    pub(crate) fn new(
        client: ros2_client::Client<Request, Response>,
        participant: DomainParticipant,
        name: String,
    ) -> Self {
        Self {
            client: Arc::new(client),
            participant,
            name,
        }
    }

    /// Waits until a server is there; `false` where the time ran out.
    pub async fn wait_for_service(&self, timeout: Duration) -> bool {
        let (requests, replies) = (
            format!("rq{}Request", self.name),
            format!("rr{}Reply", self.name),
        );
        let mut waited = false;
        let there = async {
            loop {
                let server_reads = self
                    .participant
                    .discovered_readers()
                    .iter()
                    .any(|r| *r.subscription_topic_data.topic_name() == requests);
                let server_writes = self
                    .participant
                    .discovered_writers()
                    .iter()
                    .any(|w| w.publication_topic_data.topic_name == replies);
                if server_reads && server_writes {
                    break;
                }
                waited = true;
                tokio::time::sleep(DISCOVERY_POLL).await;
            }
            if waited {
                tokio::time::sleep(SETTLE).await;
            }
        };
        tokio::time::timeout(timeout, there).await.is_ok()
    }

    /// Waits for the server, asks and waits for its answer. The very first call to a server may take some seconds.
    ///
    /// # Errors
    /// [`Error::Service`] where there is no server or no answer within `timeout`.
    pub async fn call(&self, request: Request, timeout: Duration) -> Result<Response> {
        let failed = |reason: String| Error::Service {
            service: self.name.clone(),
            reason,
        };
        let deadline = tokio::time::Instant::now() + timeout;
        if !self.wait_for_service(timeout).await {
            return Err(failed(format!(
                "no server within {:.1} s",
                timeout.as_secs_f64()
            )));
        }
        match tokio::time::timeout_at(deadline, self.client.async_call_service(request)).await {
            Ok(Ok(response)) => Ok(response),
            Ok(Err(error)) => Err(failed(error.to_string())),
            Err(_) => Err(failed(format!(
                "no answer within {:.1} s",
                timeout.as_secs_f64()
            ))),
        }
    }

    /// Absolute name of the service.
    pub fn name(&self) -> &str {
        &self.name
    }
}
