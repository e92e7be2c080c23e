//! Services: the answering and the asking end.

use std::sync::Arc;
use std::time::Duration;

use futures::FutureExt;
use ros2_client::{Message, RmwRequestId, Server};
use rustdds::DomainParticipant;

use tokio::time::Instant;

use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::overflow::Overflow;
use crate::replies::Replies;

/// Answers requests of one service.
pub struct Service<Request: Message, Response: Message> {
    server: Server<Request, Response>,
    name: String,
    overflow: Overflow,
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
        Self {
            overflow: Overflow::new(format!("answers of {name}")),
            server,
            name,
        }
    }

    /// Counts the answers that had no room.
    pub(crate) fn overflow(&self) -> &Overflow {
        &self.overflow
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

    /// Answers a request without waiting: a client that does not acknowledge holds up nobody else. A failure is counted and
    /// logged here.
    pub fn respond(&self, request: RequestId, response: Response) {
        let sent = self.server.async_send_response(request.0, response);
        match sent.now_or_never() {
            Some(Ok(())) => {}
            Some(Err(error)) => {
                tracing::error!("{}: the answer cannot be sent: {error:?}", self.name);
            }
            None => self.overflow.count(1),
        }
    }

    /// Absolute name of the service.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Asks one service. Several may ask by it at the same time; each gets the answer to its own request.
pub struct Client<Request: Message, Response: Message> {
    asking: ros2_client::Client<Request, Response>,
    replies: Replies<RmwRequestId, Response>,
    participant: DomainParticipant,
    graph: Arc<Graph>,
    created: Instant,
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
pub(crate) const DISCOVERY_POLL: Duration = Duration::from_millis(20);
/// Time that a server has to find the reader of answers of a new client. An answer sent before would be lost, and
/// nobody tells us when it is done.
pub(crate) const SETTLE: Duration = Duration::from_millis(500);

impl<Request, Response> Client<Request, Response>
where
    Request: Message + Clone + 'static,
    Response: Message + Clone + 'static,
{
    pub(crate) fn new(
        client: ros2_client::Client<Request, Response>,
        participant: DomainParticipant,
        graph: Arc<Graph>,
        name: String,
    ) -> Self {
        Self {
            asking: client,
            replies: Replies::default(),
            participant,
            graph,
            created: Instant::now(),
            name,
        }
    }

    /// Waits until a server is there; `false` where the time ran out.
    pub async fn wait_for_service(&self, timeout: Duration) -> bool {
        let there = async {
            while !self.is_matched() {
                tokio::time::sleep(DISCOVERY_POLL).await;
            }
            tokio::time::sleep_until(self.created + SETTLE).await;
        };
        tokio::time::timeout(timeout, there).await.is_ok()
    }

    /// Whether both of our ends have found those of a server.
    fn is_matched(&self) -> bool {
        self.graph
            .matched_topics(&self.participant)
            .has_server(&self.name)
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
        let deadline = Instant::now() + timeout;
        if !self.wait_for_service(timeout).await {
            return Err(failed(format!(
                "no server within {:.1} s",
                timeout.as_secs_f64()
            )));
        }
        let mut reply = self.replies.ask(&self.asking, request).map_err(failed)?;
        let answer = reply.wait(|| self.replies.take(&self.asking));
        match tokio::time::timeout_at(deadline, answer).await {
            Ok(Ok(response)) => Ok(response),
            Ok(Err(error)) => Err(failed(error)),
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
