//! Studies over the mathematics of `sins`, and the report on one recorded run.
//!
//! - [`compare`]: the paper's simulations, reproduced, and its claims judged.
//! - [`allan`]: the noise of the sensors from a bag at rest.
//! - [`assurance`]: how often the judge is wrong, over drawn worlds.
//! - [`design`]: rotation schemes by search, held against those that are known.
//! - [`experiment`]: the paper's experiment on simulated IMUs.
//! - [`observability`]: what a rotation scheme can show, before anything is measured.
//! - [`passes`]: how often a record is gone over, and its smoothed epochs.
//! - [`run_report`]: one page about one recorded run.
//!
//! Each gives values, a text, JSON and a page. Nothing here prints, reads arguments or speaks to a network: who wants to
//! know how far the work is gives a [`Listener`].

mod alignment;
pub mod allan;
pub mod assurance;
pub mod compare;
pub mod design;
mod error;
pub mod experiment;
mod free_navigation;
mod listener;
mod notes;
pub mod observability;
pub mod passes;
pub mod run_report;
mod sensor_source;
mod simulated_bag;
mod words;

pub use alignment::Aligner;
pub use error::Error;
pub use free_navigation::{Distance, FreeNavigation, Navigated, NavigationFigures};
pub use listener::Listener;
pub use notes::Notes;
pub use sensor_source::SensorSource;
pub use simulated_bag::{SimulatedBag, write_simulated_bag};
pub use words::{decimals, significant};
