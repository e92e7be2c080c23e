//! The one list of the suite's topics, services and actions: name, type, quality of service, who is at which end.
//!
//! Nodes publish, subscribe and serve by these constants, and tools and `docs/interfaces.md` come from their rows.
//! Names are those before remapping. A subscription keeps as many samples as its publisher unless it says otherwise
//! (`with_depth`), and hears best-effort publishers too.

pub mod actions;
pub mod services;
pub mod topics;

use ros2_interfaces::Interface;

/// All rows: topics, services, actions.
pub fn all() -> impl Iterator<Item = &'static Interface> {
    [topics::ALL, services::ALL, actions::ALL]
        .into_iter()
        .flatten()
}
