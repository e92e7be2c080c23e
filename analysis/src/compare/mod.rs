//! The paper's simulations, reproduced and judged.

mod campaign;
mod claims;
mod figures;
mod pages;
mod summary;

pub use campaign::{Campaign, Plan};
pub use claims::{Claim, PAPER_NMI, claims};
pub use pages::page;
pub use summary::{Results, results, text};
