//! How far the work is, for whoever shows it.

/// Is told how far a study or a report has come. Studies call it from several threads.
///
/// `()` listens to nothing.
pub trait Listener: Sync {
    /// What is worked on now.
    fn task(&self, _name: &str) {}

    /// So many more units of work are done.
    fn advance(&self, _units: u64) {}

    /// The record has been read so far \[s\].
    fn reached(&self, _seconds: f64) {}

    /// A line that a person should see at once.
    fn note(&self, _line: &str) {}
}

impl Listener for () {}
