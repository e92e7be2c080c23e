//! The end of a node: asked for by a signal, by a panic or by the node itself.

use std::sync::Arc;

use tokio::sync::watch;

/// Tells everybody in the process that the node is to end. Clones share it.
#[derive(Clone, Debug)]
pub struct Shutdown {
    requested: Arc<watch::Sender<bool>>,
}

impl Default for Shutdown {
    fn default() -> Self {
        Self {
            requested: Arc::new(watch::Sender::new(false)),
        }
    }
}

impl Shutdown {
    /// Asks the node to end.
    pub fn request(&self) {
        self.requested.send_replace(true);
    }

    /// Whether the end was asked for.
    pub fn is_requested(&self) -> bool {
        *self.requested.borrow()
    }

    /// Completes when the end is asked for.
    pub async fn requested(&self) {
        // The sender lives in `self`, so that waiting can only end by the request.
        self.requested
            .subscribe()
            .wait_for(|requested| *requested)
            .await
            .ok();
    }
}
