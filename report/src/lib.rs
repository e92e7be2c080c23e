//! Pictures for people: line charts as SVG, their data as CSV, and one HTML page that needs nothing else.
//!
//! A [`Figure`] is a column of [`Panel`]s over one x axis; [`Figure::to_svg`] draws it, [`Figure::to_csv`] writes what is drawn.
//! A [`Page`] gathers text, [`Table`]s and figures; [`Page::to_html`] is one file without scripts, fonts or network that prints on
//! A4 and reads on a phone. The crate knows nothing of ROS and nothing of navigation.
//!
//! ```
//! use report::{Axis, Band, Figure, Page, Panel, Series};
//!
//! # fn main() -> Result<(), report::Error> {
//! let figure = Figure::new("azimuth", "Azimuth misalignment", Axis::new("time", "h")).panel(
//!     Panel::new("", Axis::new("azimuth", "arcmin"))
//!         .band(Band::new("±3σ", vec![(0.0, -9.0, 9.0), (1.0, -3.0, 3.0)]))
//!         .series(Series::new("estimate", vec![(0.0, 4.0), (1.0, 0.5)]))
//!         .vertical(0.7, "below threshold"),
//! );
//! let mut page = Page::new("Alignment");
//! page.meta("seed", "7").section(2, "Result").paragraph("The azimuth settles.");
//! page.figure(&figure)?;
//! assert!(page.to_html().contains("<svg"));
//! # Ok(())
//! # }
//! ```
//!
//! Pictures are written as markup, as pages are (`docs/decisions/0001-figures-by-markup.md`): 1000 units wide, scaled by their
//! `viewBox`, to a tenth of a unit. Sizes of text are estimated; nothing of the system is asked, so that the same figure always
//! gives the same bytes.

mod csv;
mod curve;
mod error;
mod figure;
mod frame;
mod legend;
mod marks;
mod page;
pub mod palette;
mod plan;
mod svg;
mod table;
mod text;
mod ticks;

pub use error::Error;
pub use figure::{Axis, Band, Figure, Line, Mark, Panel, Scale, Series};
pub use page::{Page, Verdict};
pub use table::{Cell, Table};
