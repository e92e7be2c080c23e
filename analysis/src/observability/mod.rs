//! What a scheme can show of the errors, before anything is measured.

mod page;
mod summary;
mod text;
mod words;

use sins::{
    studies::observability::{
        Setting,
        bound::{self, BoundPoint},
        degree::{self, Degrees},
        global::GlobalConditions,
        stripped::{self, RankAfterDwell},
    },
    table::scheme::Program,
};

pub use page::section;
pub use summary::{Report, report};
pub use text::text;

/// Everything that is known of a scheme on one table and one ship.
pub struct Analysis {
    /// Name of the scheme and its table.
    pub name: String,
    /// The paper's section 2.
    pub global: GlobalConditions,
    /// After every dwell of the first cycle.
    pub ranks: Vec<RankAfterDwell>,
    /// From the whole run.
    pub degrees: Degrees,
    /// Every minute.
    pub bound: Vec<BoundPoint>,
}

impl Analysis {
    /// Works all four parts.
    ///
    /// # Errors
    /// Where the setting is refused.
    pub fn of(program: &Program, setting: &Setting) -> Result<Self, sins::Error> {
        Ok(Self {
            name: format!(
                "{}, outer {} inner {}",
                program.name, program.table.outer, program.table.inner
            ),
            global: GlobalConditions::of(program, &setting.ship)?,
            ranks: stripped::ranks(program, &setting.ship, 1)?,
            degrees: degree::degrees(program, setting)?,
            bound: bound::bound(program, setting, 60)?,
        })
    }
}
