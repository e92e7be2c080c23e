//! Queues have bounds; what overflows is counted, and told in the diagnostics.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts what a queue had no room for. Clones count together.
#[derive(Clone, Debug)]
pub struct Overflow {
    shared: Arc<Counter>,
}

#[derive(Debug)]
struct Counter {
    queue: String,
    count: AtomicU64,
}

impl Overflow {
    /// A counter of the queue of this name. [`crate::Node::watch_overflow`] lets the diagnostics tell it.
    pub fn new(queue: impl Into<String>) -> Self {
        Self {
            shared: Arc::new(Counter {
                queue: queue.into(),
                count: AtomicU64::new(0),
            }),
        }
    }

    /// Counts entries without room; the first ones are logged.
    pub fn count(&self, entries: u64) {
        if entries > 0 && self.shared.count.fetch_add(entries, Ordering::Relaxed) == 0 {
            tracing::warn!(
                "{}: the queue is full; what has no room is counted in the diagnostics",
                self.queue()
            );
        }
    }

    /// Name of the queue.
    pub fn queue(&self) -> &str {
        &self.shared.queue
    }

    /// Entries that had no room so far.
    pub fn total(&self) -> u64 {
        self.shared.count.load(Ordering::Relaxed)
    }

    /// Whether somebody else counts with it.
    pub(crate) fn is_shared(&self) -> bool {
        Arc::strong_count(&self.shared) > 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clones count together.
    #[test]
    fn clones_count_together() {
        let overflow = Overflow::new("feedback");
        overflow.clone().count(2);
        overflow.count(0);
        overflow.count(3);
        assert_eq!((overflow.total(), overflow.queue()), (5, "feedback"));
        assert!(!overflow.is_shared());
    }
}
