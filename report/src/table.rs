//! Tables of a page.

use maud::{Markup, html};
use serde::Serialize;

use crate::Verdict;

/// Rows of a table that a printed page does not break.
const UNBROKEN: usize = 16;
/// Characters of a text that keeps its words whole.
const LONG: usize = 16;

/// One cell of a table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number with the digits it should have; its column is aligned to the right.
    Number(String),
    /// What is as it should be.
    Good(String),
    /// What needs a look.
    Warn(String),
    /// What is not as it should be.
    Bad(String),
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number, as it is to be read.
    pub fn number(text: impl Into<String>) -> Self {
        Self::Number(text.into())
    }

    /// Words with a verdict on them.
    pub fn verdict(verdict: Verdict, text: impl Into<String>) -> Self {
        match verdict {
            Verdict::Good => Self::Good(text.into()),
            Verdict::Warn => Self::Warn(text.into()),
            Verdict::Bad => Self::Bad(text.into()),
        }
    }

    fn parts(&self) -> (&str, Option<Verdict>) {
        match self {
            Self::Text(text) | Self::Number(text) => (text, None),
            Self::Good(text) => (text, Some(Verdict::Good)),
            Self::Warn(text) => (text, Some(Verdict::Warn)),
            Self::Bad(text) => (text, Some(Verdict::Bad)),
        }
    }
}

/// A table; units belong into its header.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows; one that is too short is filled with empty cells.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows.
    pub fn new<S: Into<String>>(
        caption: impl Into<String>,
        header: impl IntoIterator<Item = S>,
    ) -> Self {
        Self {
            caption: caption.into(),
            header: header.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// With one more row.
    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    fn columns(&self) -> usize {
        self.rows
            .iter()
            .map(Vec::len)
            .chain([self.header.len()])
            .max()
            .unwrap_or(0)
    }

    /// Whether a column holds numbers.
    fn is_numeric(&self, column: usize) -> bool {
        self.rows
            .iter()
            .any(|row| matches!(row.get(column), Some(Cell::Number(_))))
    }

    /// The caption stands outside of what scrolls, so that a phone shows all of it.
    pub(crate) fn markup(&self, number: usize, id: &str) -> Markup {
        let classes: Vec<_> = (0..self.columns())
            .map(|c| self.is_numeric(c).then_some("number"))
            .collect();
        html! {
            div.short[self.rows.len() <= UNBROKEN] {
                p.caption id=(id) { b { "Table " (number) "." } " " (self.caption) }
                div.scroll tabindex="0" role="region" aria-label={ "Table " (number) } {
                    table aria-labelledby=(id) {
                        @if !self.header.is_empty() {
                            thead { tr {
                                @for (column, class) in classes.iter().enumerate() {
                                    th scope="col" class=[class] { (self.header.get(column).map_or("", String::as_str)) }
                                }
                            } }
                        }
                        tbody {
                            @for row in &self.rows {
                                tr {
                                    @for (column, class) in classes.iter().enumerate() {
                                        (row.get(column).map_or_else(|| html! { td {} }, |cell| cell_markup(cell, *class)))
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn cell_markup(cell: &Cell, class: Option<&str>) -> Markup {
    let (text, verdict) = cell.parts();
    html! {
        td class=[class] {
            @match verdict {
                Some(verdict) => span class=(verdict.class()) { (verdict.sign()) " " (text) },
                None => (breakable(text)),
            }
        }
    }
}

/// Long names of topics and types may be broken: behind slashes and underscores, and where a word begins with a capital.
fn breakable(text: &str) -> Markup {
    let whole = text.chars().count() <= LONG;
    let mut last = ' ';
    let breaks = text.char_indices().filter(|&(at, c)| {
        let before = std::mem::replace(&mut last, c);
        let word = before.is_lowercase() && c.is_uppercase();
        at > 0 && !whole && (word || matches!(before, '/' | '_'))
    });
    let starts: Vec<_> = breaks.map(|(at, _)| at).collect();
    let ends = starts.iter().copied().chain([text.len()]);
    let parts = std::iter::once(0).chain(starts.iter().copied()).zip(ends);
    html! {
        @for (from, to) in parts {
            @if from > 0 { wbr; }
            (text[from..to])
        }
    }
}
