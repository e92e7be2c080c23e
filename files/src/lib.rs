//! The one way in which files leave the suite, and in which small ones enter it.
//!
//! [`write()`] puts a whole file in its place or none: whoever reads meanwhile, and whoever loses power meanwhile, has the old one
//! or the new one. [`read`] takes no more than it was told, and never waits.

mod reading;
mod writing;

pub use reading::{read, read_text};
pub use writing::{check, create_new, is_same, write};
