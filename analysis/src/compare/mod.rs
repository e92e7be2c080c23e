//! The paper's simulations, reproduced and judged.

mod campaign;
mod cases;
mod claims;
mod figures;
mod pages;
mod summary;
mod text;
mod voyages;

pub use campaign::{Campaign, Plan};
pub use claims::{Claim, PAPER_NMI, claims};
pub use pages::page;
pub use summary::{Results, results};
pub use text::text;

/// Confidence of the bounds on NEES.
pub const CONFIDENCE: f64 = 0.95;
