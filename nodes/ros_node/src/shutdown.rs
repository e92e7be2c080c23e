//! The end of a node: asked for by a signal, by a panic or by the node itself, or because the middleware has broken down.

use std::sync::Arc;

use tokio::sync::watch;

/// Tells everybody in the process that the node is to end. Clones share it.
#[derive(Clone, Debug)]
pub struct Shutdown {
    stage: Arc<watch::Sender<Stage>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Stage {
    Working,
    /// Everything is to end in order.
    Asked,
    /// Nothing is heard and nothing can be said any more: only what is in the process can be put in order.
    Broken,
}

impl Default for Shutdown {
    fn default() -> Self {
        Self {
            stage: Arc::new(watch::Sender::new(Stage::Working)),
        }
    }
}

impl Shutdown {
    /// Asks the node to end.
    pub fn request(&self) {
        self.raise(Stage::Asked);
    }

    /// The middleware has broken down: the node ends, and asks nobody outside of the process any more.
    pub(crate) fn break_down(&self) {
        self.raise(Stage::Broken);
    }

    fn raise(&self, to: Stage) {
        self.stage.send_modify(|stage| *stage = to.max(*stage));
    }

    /// Whether the end was asked for.
    pub fn is_requested(&self) -> bool {
        *self.stage.borrow() >= Stage::Asked
    }

    pub(crate) fn is_broken(&self) -> bool {
        *self.stage.borrow() == Stage::Broken
    }

    /// Completes when the end is asked for.
    pub async fn requested(&self) {
        self.reaches(Stage::Asked).await;
    }

    /// Completes when the middleware has broken down.
    pub(crate) async fn broken(&self) {
        self.reaches(Stage::Broken).await;
    }

    async fn reaches(&self, wanted: Stage) {
        // The sender lives in `self`, so that waiting can only end by the request.
        let mut stage = self.stage.subscribe();
        stage.wait_for(|stage| *stage >= wanted).await.ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What has broken down stays so, whatever is asked for afterwards.
    #[tokio::test]
    async fn the_worst_stays() {
        let shutdown = Shutdown::default();
        assert!(!shutdown.is_requested());
        shutdown.request();
        assert!(shutdown.is_requested() && !shutdown.is_broken());
        shutdown.break_down();
        shutdown.request();
        shutdown.broken().await;
        assert!(shutdown.is_requested() && shutdown.is_broken());
    }
}
