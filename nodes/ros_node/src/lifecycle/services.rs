//! The services and the topic of a managed node.

use ros2_interfaces::lifecycle_msgs::{
    ChangeStateRequest, ChangeStateResponse, EmptyRequest, GetAvailableStatesResponse,
    GetAvailableTransitionsResponse, GetStateResponse, TransitionEvent,
};
use tokio::sync::oneshot;

use super::{Request, graph};
use crate::error::Result;
use crate::node::Node;
use crate::qos::Qos;

/// Starts them.
///
/// # Errors
/// [`crate::Error::Create`].
pub(crate) fn serve(node: &Node) -> Result<()> {
    let kind = |name: &str| format!("lifecycle_msgs/srv/{name}");
    let own = node.clone();
    node.serve("~/get_state", &kind("GetState"), move |_: EmptyRequest| {
        GetStateResponse {
            current_state: graph::state(own.lifecycle().state()),
        }
    })?;
    node.serve(
        "~/get_available_states",
        &kind("GetAvailableStates"),
        |_: EmptyRequest| GetAvailableStatesResponse {
            available_states: graph::STATES
                .iter()
                .map(|(id, _)| graph::state(*id))
                .collect(),
        },
    )?;
    let own = node.clone();
    node.serve(
        "~/get_available_transitions",
        &kind("GetAvailableTransitions"),
        move |_: EmptyRequest| {
            let here = own.lifecycle().state();
            transitions(|start| start == here)
        },
    )?;
    node.serve(
        "~/get_transition_graph",
        &kind("GetAvailableTransitions"),
        |_: EmptyRequest| transitions(|_| true),
    )?;
    serve_changes(node, &kind("ChangeState"))?;
    let Some(mut events) = node.lifecycle().take_events() else {
        return Ok(());
    };
    let publisher =
        node.ungated_publisher::<TransitionEvent>("~/transition_event", Qos::reliable(10))?;
    node.spawn(async move {
        while let Some(event) = events.recv().await {
            publisher.publish(event);
        }
    });
    Ok(())
}

fn transitions(of: impl Fn(u8) -> bool) -> GetAvailableTransitionsResponse {
    let wanted = graph::TRANSITIONS.iter().filter(|t| of(t.2));
    GetAvailableTransitionsResponse {
        available_transitions: wanted.map(graph::description).collect(),
    }
}

/// Requests are answered when their transition is over; one after the other, as they come.
fn serve_changes(node: &Node, kind: &str) -> Result<()> {
    let service =
        node.service::<ChangeStateRequest, ChangeStateResponse>("~/change_state", kind)?;
    let own = node.clone();
    node.spawn(async move {
        loop {
            let (id, request) = service.recv().await;
            let (answer, answered) = oneshot::channel();
            let transition = request.transition;
            own.lifecycle()
                .requests
                .send(Request { transition, answer })
                .await
                .ok();
            let success = answered.await.unwrap_or(false);
            service.respond(id, ChangeStateResponse { success }).await;
        }
    });
    Ok(())
}
