//! What the nodes said of themselves that was not well.

use std::collections::BTreeMap;

use ros2_interfaces::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use rotary_sins_msgs::convert::stamp_from_time;
use sins::time::Stamp;

/// Different diagnostics that are kept.
const KEPT: usize = 60;

/// A diagnostic above OK.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    /// Its part of a node.
    pub name: String,
    /// 1 warning, 2 error, 3 stale.
    pub level: u8,
    /// The first of its messages.
    pub message: String,
    /// The time of that.
    pub first: Stamp,
    /// How often it came.
    pub count: u64,
}

/// Diagnostics above OK, each kind once.
#[derive(Default)]
pub struct Diagnostics {
    kinds: BTreeMap<(String, u8, String), Diagnostic>,
    /// Messages of kinds that are not kept.
    pub more: u64,
}

impl Diagnostics {
    /// Takes what a node said.
    pub fn take(&mut self, array: &DiagnosticArray) {
        for status in &array.status {
            if status.level != DiagnosticStatus::OK {
                self.take_status(stamp_from_time(array.header.stamp), status);
            }
        }
    }

    fn take_status(&mut self, stamp: Stamp, status: &DiagnosticStatus) {
        // What differs in its numbers alone is the same message.
        let words = status
            .message
            .split(|c: char| c.is_ascii_digit())
            .filter(|part| !part.is_empty())
            .collect();
        let kind = (status.name.clone(), status.level, words);
        if let Some(known) = self.kinds.get_mut(&kind) {
            known.count += 1;
        } else if self.kinds.len() < KEPT {
            let diagnostic = Diagnostic {
                name: status.name.clone(),
                level: status.level,
                message: status.message.clone(),
                first: stamp,
                count: 1,
            };
            self.kinds.insert(kind, diagnostic);
        } else {
            self.more += 1;
        }
    }

    /// In the order of their first times.
    pub fn list(&self) -> Vec<&Diagnostic> {
        let mut list: Vec<_> = self.kinds.values().collect();
        list.sort_by_key(|diagnostic| diagnostic.first);
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(level: u8, message: &str) -> DiagnosticArray {
        DiagnosticArray {
            status: vec![DiagnosticStatus {
                level,
                message: message.to_owned(),
                ..DiagnosticStatus::default()
            }],
            ..DiagnosticArray::default()
        }
    }

    /// A count that goes up is one message; another level is another; OK is none.
    #[test]
    fn each_kind_is_listed_once() {
        let mut diagnostics = Diagnostics::default();
        for (level, message) in [(1, "9 gaps"), (0, "well"), (1, "10 gaps"), (2, "10 gaps")] {
            diagnostics.take(&status(level, message));
        }
        let list = diagnostics.list();
        let told: Vec<_> = list.iter().map(|d| (d.message.as_str(), d.count)).collect();
        assert_eq!(told, [("9 gaps", 2), ("10 gaps", 1)]);
    }

    /// Messages that are all different fill no memory.
    #[test]
    fn endless_kinds_are_counted() {
        let mut diagnostics = Diagnostics::default();
        for n in 0..100 {
            diagnostics.take(&status(1, &"x".repeat(n + 1)));
        }
        assert_eq!((diagnostics.list().len(), diagnostics.more), (KEPT, 40));
    }
}
